"""Which track a sighting belongs to, and what it says of the track's particles."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.particles import LANES, exp32, total_of

__all__ = ["associate", "warm"]

Array = NDArray[Any]

_F2 = np.float32(2.0)
# Odd series of log(1 + e) = 2 atanh(e/(2 + e)), e in [0, 1]: the rest is below 1e-7.
_LOG = tuple(np.float32(2.0 / n) for n in (1, 3, 5, 7, 9, 11))
_LOG_2PI = 1.8378770664093453


@njit(cache=True, error_model="numpy", inline="always")
def _log_sum(a: np.float32, b: np.float32) -> np.float32:
    """log(exp(a) + exp(b)) of two float32."""
    e = exp32(-abs(a - b))
    t = e / (_F2 + e)
    t2 = t * t
    tail = _LOG[2] + t2 * (_LOG[3] + t2 * (_LOG[4] + t2 * _LOG[5]))
    high: np.float32 = max(a, b)
    return high + t * (_LOG[0] + t2 * (_LOG[1] + t2 * tail))


@njit(cache=True, error_model="numpy")
def _squared(
    state: Array, z: Array, now: float, origin: Array, mean: Array, width: float, buffer: Array
) -> float:
    """Per particle -½ dᵀS⁻¹d of one sighting into `buffer`; returns log 1/(2π√|S|).

    S = Σ + width²·P: a particle stands for a little Gaussian, the one that roughening draws from.
    A late sighting meets each particle where it was at the sighting's time, had it gone straight.
    """
    zx, zy = np.float32(z[1] - origin[0]), np.float32(z[2] - origin[1])
    own = width * width
    xx, xy, yy = z[3] + own * mean[4], z[4] + own * mean[5], z[5] + own * mean[7]
    det = xx * yy - xy * xy
    ixx = np.float32(-0.5 * yy / det)
    ixy = np.float32(xy / det)
    iyy = np.float32(-0.5 * xx / det)
    age = np.float32(now - z[0])
    x, y, vx, vy = state[0], state[1], state[2], state[3]
    for i in range(buffer.size):
        dx = zx - (x[i] - age * vx[i])
        dy = zy - (y[i] - age * vy[i])
        buffer[i] = dx * (ixx * dx + ixy * dy) + iyy * dy * dy
    return float(-_LOG_2PI - 0.5 * np.log(det))


@njit(cache=True, error_model="numpy")
def _descending(scores: Array, count: int) -> Array:
    """Order of the first `count` scores, the greatest first, equal ones as they come: heap sort.

    NumPy's own sort would take longer to compile than everything else here.
    """
    order = np.arange(count)
    size, root = count, count // 2
    while size > 1:
        if root > 0:
            root -= 1
        else:
            size -= 1
            order[0], order[size] = order[size], order[0]
        parent = root
        while 2 * parent + 1 < size:
            child = 2 * parent + 1
            if child + 1 < size and _before(scores, order[child], order[child + 1]):
                child += 1
            if not _before(scores, order[parent], order[child]):
                break
            order[parent], order[child] = order[child], order[parent]
            parent = child
    return order


@njit(cache=True, error_model="numpy")
def _before(scores: Array, a: int, b: int) -> bool:
    """Whether `a` comes before `b`: a greater score, or the same and a smaller number."""
    return bool(scores[a] > scores[b] or (scores[a] == scores[b] and a < b))


@njit(cache=True, error_model="numpy")
def associate(
    state: Array,
    weights: Array,
    log_weights: Array,
    origins: Array,
    moments: Array,
    sightings: Array,
    looks: Array,
    now: float,
    limits: Array,
) -> tuple[Array, Array]:
    """Give each sighting to a track, and weigh its particles (thesis alg. 6.1, corrected).

    Every sighting inside a track's gate is scored by the summed likelihood of the track's
    particles, Σ wᵢ N(z; xᵢ, S). The greatest score is served first. A sighting goes to one track;
    a track takes one sighting of a look (one camera, one picture), and several of several looks.
    The weight of a particle is multiplied by N(z; xᵢ, S) + floor: a false alarm costs little.
    S is the sighting's covariance Σ, widened by that of the little Gaussian that a particle is.

    Parameters
    ----------
    state, weights : arrays
        As in `predict`.
    log_weights : (capacity, n) float32 array
        Changed in place; not normalised afterwards.
    origins : (capacity, 2) float64 array [m]
    moments : (count, 8) float64 array
        Of `predict`.
    sightings : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²].
    looks : (m,) int64 array
        Number of the look that each belongs to, from 0.
    now : float [s]
        Time that the particles were predicted to.
    limits : (5,) float64 array
        Gate [sigma], clutter density [1/m²] that a score must exceed, likelihood floor [1/m²],
        distance to a track below which a free sighting cannot start another [m], and a particle's
        own standard deviation in units of its cloud's.

    Returns
    -------
    owner : (m,) int64 array
        Track index; -1 free; -2 free but at a place where a track already is.
    scores : (m,) float64 array
        Log of the owner's summed likelihood [log 1/m²]; 0 without owner.
    """
    count, m = moments.shape[0], sightings.shape[0]
    n = weights.shape[1]
    owner, scores = np.full(m, -1), np.zeros(m)
    buffer, lanes = np.empty(n, np.float32), np.empty(LANES, np.float32)
    gate, least, near = limits[0] ** 2, np.log(limits[1]), limits[3] ** 2
    pair_score = np.empty(m * count)
    pair = np.empty((m * count, 2), np.int64)
    pairs: Any = np.int64(0)
    for j in range(m):
        z = sightings[j]
        for k in range(count):
            mean = moments[k]
            dx = z[1] - origins[k, 0] - (mean[0] - (now - z[0]) * mean[2])
            dy = z[2] - origins[k, 1] - (mean[1] - (now - z[0]) * mean[3])
            sxx, sxy, syy = mean[4] + z[3], mean[5] + z[4], mean[7] + z[5]
            square = dx * dx + dy * dy
            if square < near:
                owner[j] = -2
            if square > gate * (sxx + syy):
                continue
            if syy * dx * dx - 2.0 * sxy * dx * dy + sxx * dy * dy > gate * (sxx * syy - sxy * sxy):
                continue
            log_norm = _squared(state[k], z, now, origins[k], mean, limits[4], buffer)
            own = weights[k]
            for i in range(n):
                buffer[i] = own[i] * exp32(buffer[i])
            score = np.log(total_of(buffer, lanes)) + log_norm
            if score > least:
                pair_score[pairs] = score
                pair[pairs, 0] = j
                pair[pairs, 1] = k
                pairs += 1
    served = np.zeros((count, m), np.bool_)
    order = _descending(pair_score, pairs)
    for i in range(pairs):
        p = order[i]
        j, k = pair[p, 0], pair[p, 1]
        if owner[j] >= 0 or served[k, looks[j]]:
            continue
        served[k, looks[j]] = True
        owner[j] = k
        scores[j] = pair_score[p]
    for j in range(m):
        if owner[j] >= 0:
            k = owner[j]
            log_norm = _squared(
                state[k], sightings[j], now, origins[k], moments[k], limits[4], buffer
            )
            floor = np.float32(np.log(limits[2]) - log_norm)
            logs = log_weights[k]
            for i in range(n):
                logs[i] += _log_sum(buffer[i], floor)
    return owner, scores


def warm() -> None:
    """Compile (or load) every kernel here with the types used in flight."""
    state = np.zeros((1, 4, 32), np.float32)
    weights, logs = np.full((1, 32), 1.0 / 32.0, np.float32), np.zeros((1, 32), np.float32)
    moments = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]])
    sightings = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0]])
    limits = np.array([4.0, 1e-6, 1e-7, 5.0, 0.1])
    looks = np.zeros(1, np.int64)
    associate(state, weights, logs, np.zeros((1, 2)), moments, sightings, looks, 0.0, limits)
