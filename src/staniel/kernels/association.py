"""Sightings and tracks: how likely each pair is, and what each track then makes of its share."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.gating import gated
from staniel.kernels.lanes import exp32, total_of

__all__ = ["contested", "density_at", "marginals", "paired", "rescore", "settled", "warm"]

Array = NDArray[Any]

_LOG_2PI = 1.8378770664093453
_WIDE = 4.0  # a cloud of so many times the sighting's variance is no Gaussian


@njit(cache=True, error_model="numpy")
def contested(pairs: Array, looks: Array) -> Array:
    """Which pairs are not the only one of their sighting, or of their track in the look.

    Parameters
    ----------
    pairs : (p, 2) int64 array
        Track and sighting, in ascending order of the track.
    looks : (m,) int64 array
        Number of the look of each sighting.

    Returns
    -------
    (p,) bool array
    """
    claims = np.zeros(looks.size, np.int64)
    for p in range(len(pairs)):
        claims[pairs[p, 1]] += 1
    open_ = np.zeros(len(pairs), np.bool_)
    last = np.full(looks.max() + 1 if looks.size else 0, -1)
    for p in range(len(pairs)):
        k, j = pairs[p, 0], pairs[p, 1]
        look = looks[j]
        if claims[j] > 1:
            open_[p] = True
        # `last` is the last pair of this look; of the same track, both are contested.
        if last[look] >= 0 and pairs[last[look], 0] == k:
            open_[p] = open_[last[look]] = True
        last[look] = p
    return open_


@njit(cache=True, error_model="numpy")
def rescore(
    pairs: Array,
    scores: Array,
    chosen: Array,
    state: Array,
    weights: Array,
    origins: Array,
    covariances: Array,
    sightings: Array,
    now: float,
    width: float,
) -> None:
    """Replace Gaussian scores by the particles' summed likelihood, Σ wᵢ N(z; xᵢ, S), in place.

    S = Σ + width²·P, its trace at most twice Σ's: a particle stands for a little Gaussian. A late
    sighting meets each particle where it was at the sighting's time, had it gone straight.

    Parameters
    ----------
    pairs, scores : as `staniel.kernels.gating.gated` gives them
    chosen : (p,) bool array
        Which to replace.
    state, weights, origins : as in `staniel.kernels.motion.predict`
    covariances : (count, 4, 4) float64 array
    sightings : (m, 6) float64 array
    now : float [s]
    width : float
    """
    n = weights.shape[1]
    buffer = np.empty(n, np.float32)
    for p in range(len(pairs)):
        if not chosen[p]:
            continue
        k, z = pairs[p, 0], sightings[pairs[p, 1]]
        cov = covariances[k]
        own = min(width * width, (z[3] + z[5]) / (cov[0, 0] + cov[1, 1] + 1e-9))
        xx, xy, yy = z[3] + own * cov[0, 0], z[4] + own * cov[0, 1], z[5] + own * cov[1, 1]
        det = xx * yy - xy * xy
        ixx, ixy, iyy = (
            np.float32(-0.5 * yy / det),
            np.float32(xy / det),
            np.float32(-0.5 * xx / det),
        )
        zx, zy = np.float32(z[1] - origins[k, 0]), np.float32(z[2] - origins[k, 1])
        age = np.float32(now - z[0])
        x, y, vx, vy, w = state[k, 0], state[k, 1], state[k, 2], state[k, 3], weights[k]
        for i in range(n):
            dx = zx - (x[i] - age * vx[i])
            dy = zy - (y[i] - age * vy[i])
            buffer[i] = w[i] * exp32(dx * (ixx * dx + ixy * dy) + iyy * dy * dy)
        scores[p] = np.log(total_of(buffer) + 1e-30) - _LOG_2PI - 0.5 * np.log(det)


@njit(cache=True, error_model="numpy")
def paired(
    means: Array,
    covariances: Array,
    state: Array,
    weights: Array,
    origins: Array,
    sightings: Array,
    looks: Array,
    now: float,
    gate: float,
    near: float,
    width: float,
) -> tuple[Array, Array, Array]:
    """Pairs inside the gates, each with its score, and how near each sighting is to any track.

    A Gaussian stands for a narrow cloud without rivals; all others are asked particle by particle.

    Parameters
    ----------
    means, covariances, origins, sightings, now, gate, near : as `gated` takes them
    state, weights, width : as `rescore` takes them
    looks : (m,) int64 array

    Returns
    -------
    pairs : (p, 2) int64 array
    scores : (p,) float64 array
    nearest : (m,) float64 array [m]
    """
    pairs, scores, nearest = gated(means, covariances, origins, sightings, now, gate, near)
    asked = contested(pairs, looks)
    for p in range(len(pairs)):
        cov, z = covariances[pairs[p, 0]], sightings[pairs[p, 1]]
        asked[p] |= cov[0, 0] + cov[1, 1] > _WIDE * (z[3] + z[5])
    rescore(pairs, scores, asked, state, weights, origins, covariances, sightings, now, width)
    return pairs, scores, nearest


@njit(cache=True, error_model="numpy")
def settled(pairs: Array, scores: Array, looks: Array, least: float) -> tuple[Array, Array, Array]:
    """Whose each sighting is, as far as that is plain: the pairs of a knot have an end in common.

    A knot is what hangs together by pairs of one look that are worth more than `least`. Of pairs
    that share their track, or their sighting, the likeliest alone can be taken.

    Parameters
    ----------
    pairs : (p, 2) int64 array
        Track and sighting, in ascending order of the track.
    scores : (p,) float64 array
    looks : (m,) int64 array
        Number of the look of each sighting.
    least : float
        Pairs of no greater score are not taken.

    Returns
    -------
    owners : (m,) int64 array
        Track of each sighting; -1 without one.
    shares : (p,) float64 array
        1 for the pairs taken, else 0.
    tangled : (t,) int64 array
        Numbers of the pairs of the other knots: nothing is decided about them.
    """
    count, m = len(pairs), looks.size
    owners, shares, tangled = np.full(m, -1), np.zeros(count), np.empty(count, np.int64)
    knots = 0
    of_sighting, of_track = np.zeros(m, np.int64), np.zeros(count, np.int64)
    around, best = np.ones(m, np.bool_), np.full(m, -1)
    for p in range(count):
        of_sighting[pairs[p, 1]] += 1 if scores[p] > least else 0
    first = 0
    for p in range(count):
        if pairs[first, 0] != pairs[p, 0]:
            first = p
        if scores[p] <= least:
            continue
        q = first
        while q < count and pairs[q, 0] == pairs[p, 0]:
            rival = scores[q] > least and looks[pairs[q, 1]] == looks[pairs[p, 1]]
            of_track[p] += 1 if rival else 0
            q += 1
        j = pairs[p, 1]
        around[j] &= of_track[p] == 1
        if best[j] < 0 or scores[p] > scores[best[j]]:
            best[j] = p
    first = 0
    for p in range(count):
        if pairs[first, 0] != pairs[p, 0]:
            first = p
        j = pairs[p, 1]
        if scores[p] <= least:
            continue
        taken, plain = best[j] == p, True
        if not around[j]:
            q = first
            while q < count and pairs[q, 0] == pairs[p, 0]:
                if scores[q] > least and looks[pairs[q, 1]] == looks[j]:
                    plain &= of_sighting[pairs[q, 1]] == 1
                    taken &= scores[q] < scores[p] or (scores[q] == scores[p] and q >= p)
                q += 1
        if not plain:
            tangled[knots] = p
            knots += 1
        elif taken:
            owners[j], shares[p] = pairs[p, 0], 1.0
    return owners, shares, tangled[:knots]


@njit(cache=True, error_model="numpy")
def density_at(
    state: Array, weights: Array, x: float, y: float, xx: float, yy: float, share: float
) -> float:
    """Density of a cloud at a place, each particle a Gaussian, by axis [1/m²].

    Parameters
    ----------
    state : (4, n) float32 array
    weights : (n,) float32 array
        They sum to 1.
    x, y : float [m]
        From the cloud's origin.
    xx, yy : float [m²]
        Variance of a particle's Gaussian.
    share : float
        More of it: so much of the cloud's variance, weights apart.
    """
    n = weights.size
    east, north = state[0], state[1]
    mx, my, sx, sy = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        mx += east[i]
        my += north[i]
    mx, my = mx / n, my / n
    for i in range(n):
        sx += (east[i] - mx) ** 2
        sy += (north[i] - my) ** 2
    xx, yy = xx + share * sx / n, yy + share * sy / n
    ix, iy = np.float32(-0.5 / xx), np.float32(-0.5 / yy)
    zx, zy = np.float32(x), np.float32(y)
    buffer = np.empty(n, np.float32)
    for i in range(n):
        dx, dy = east[i] - zx, north[i] - zy
        buffer[i] = weights[i] * exp32(ix * dx * dx + iy * dy * dy)
    density: float = total_of(buffer) * np.exp(-_LOG_2PI) / np.sqrt(xx * yy)
    return density


@njit(cache=True, error_model="numpy")
def marginals(pairs: Array, gains: Array, looks: Array, rounds: int) -> Array:
    """Share of each pair in its track's mixture: loopy belief propagation (Williams, Lau 2014).

    A target causes at most one sighting of a look, and a sighting has at most one cause. The
    message ν of a sighting to a track says how free the others leave it; with it the probability
    of a pair is ν g / (1 + Σ ν g) over the track's sightings of the look. Exact where no loop is;
    the cost is that of the pairs, times the rounds.

    Parameters
    ----------
    pairs : (p, 2) int64 array
        Track and sighting, in ascending order of the track.
    gains : (p,) float64 array
        Likelihood that the track caused the sighting, over that it missed and the sighting is
        false.
    looks : (m,) int64 array
    rounds : int
        At most; it stops when no message moves by more than a millionth.

    Returns
    -------
    (p,) float64 array
        ν of each pair, in [0, 1].
    """
    count = len(pairs)
    nu, mu = np.ones(count), np.empty(count)
    sightings = looks.size
    sums = np.zeros(sightings)
    totals = np.zeros(looks.max() + 1 if sightings else 0)
    for _ in range(rounds):
        first = 0
        while first < count:
            last = first
            while last < count and pairs[last, 0] == pairs[first, 0]:
                totals[looks[pairs[last, 1]]] = 1.0
                last += 1
            for p in range(first, last):
                totals[looks[pairs[p, 1]]] += nu[p] * gains[p]
            for p in range(first, last):
                others = totals[looks[pairs[p, 1]]] - nu[p] * gains[p]
                mu[p] = gains[p] / max(others, 1.0)
            first = last
        sums[:] = 1.0
        for p in range(count):
            sums[pairs[p, 1]] += mu[p]
        moved = 0.0
        for p in range(count):
            new = 1.0 / max(sums[pairs[p, 1]] - mu[p], 1.0)
            moved = max(moved, abs(new - nu[p]))
            nu[p] = new
        if moved < 1e-6:
            break
    return nu


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    state, weights = np.zeros((1, 4, 32), np.float32), np.full((1, 32), 1.0 / 32.0, np.float32)
    pairs, looks, one = np.zeros((1, 2), np.int64), np.zeros(1, np.int64), np.ones(1)
    z = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0]])
    square = np.eye(4).reshape(1, 4, 4)
    paired(np.zeros((1, 4)), square, state, weights, np.zeros((1, 2)), z, looks, 0.0, 4.0, 1.0, 0.5)
    marginals(pairs, one, looks, 5)
    settled(pairs, one, looks, 0.0)
    density_at(state[0], weights[0], 0.0, 0.0, 1.0, 1.0, 0.1)
