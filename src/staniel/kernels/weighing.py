"""What sightings say of a track's particles: their weights, and where they move.

A particle stands for a little Gaussian, all of a track for the same: a share of the cloud's own
spread. Each is weighed by how well it foresaw the sighting and then moved to where a Kalman filter
would move its Gaussian; new particles are drawn from what is left of it. As the particles are first
drawn together by as much as the Gaussians widen the cloud, its mean and covariance stay as they
were (the shrinkage of Liu and West 2001). With a share of 0 this is the bootstrap filter, with
nearly 1 nearly a Kalman filter; nothing is assumed of the motion.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.lanes import exp32, log32
from staniel.kernels.lineage import SLOTS, places_at
from staniel.kernels.motion import SAMPLE, STRIDE

__all__ = ["correct", "warm"]

Array = NDArray[Any]

_SAME_TIME = 1e-6
_2PI = 2.0 * math.pi
_F0 = np.float32(0.0)


@njit(cache=True, error_model="numpy")
def _weigh(
    planes: Array, row: int, logs: Array, offsets: Array, covariance: Array, z: Array,
    origin: Array, share: float, floor: float, moving: bool,
) -> None:  # fmt: skip
    """Meet one sighting: weigh and take on all planes and the covariance of the little Gaussians.

    Not `moving`, its likelihoods are only added to the first row of `offsets`.
    """
    d, n = planes.shape
    xx, xy, yy = (
        covariance[row, row] + z[3],
        covariance[row, row + 1] + z[4],
        covariance[row + 1, row + 1] + z[5],
    )
    det = xx * yy - xy * xy
    ixx, ixy, iyy = np.float32(-0.5 * yy / det), np.float32(xy / det), np.float32(-0.5 * xx / det)
    zx, zy = np.float32(z[1] - origin[0]), np.float32(z[2] - origin[1])
    x, y = planes[row], planes[row + 1]
    norm = np.float32(share / (_2PI * math.sqrt(det)))
    least = np.float32(floor)
    if not moving:
        for i in range(n):
            dx, dy = zx - x[i], zy - y[i]
            offsets[0, i] += norm * exp32(dx * (ixx * dx + ixy * dy) + iyy * dy * dy)
        return
    east, north = offsets[0], offsets[1]
    for i in range(n):
        dx, dy = zx - x[i], zy - y[i]
        likely = norm * exp32(dx * (ixx * dx + ixy * dy) + iyy * dy * dy)
        logs[i] += log32(likely + least)
        # A particle for which the sighting is rather a false alarm stays where it is.
        east[i], north[i] = (dx if likely > least else _F0), (dy if likely > least else _F0)
    gain = np.empty((d, 2))
    for a in range(d):
        gain[a, 0] = (covariance[a, row] * yy - covariance[a, row + 1] * xy) / det
        gain[a, 1] = (covariance[a, row + 1] * xx - covariance[a, row] * xy) / det
        to_east, to_north = np.float32(gain[a, 0]), np.float32(gain[a, 1])
        plane = planes[a]
        for i in range(n):
            plane[i] += to_east * east[i] + to_north * north[i]
    for a in range(d):
        s0 = gain[a, 0] * xx + gain[a, 1] * xy
        s1 = gain[a, 0] * xy + gain[a, 1] * yy
        for b in range(d):
            covariance[a, b] -= s0 * gain[b, 0] + s1 * gain[b, 1]


@njit(cache=True, error_model="numpy")
def correct(
    state: Array,
    weights: Array,
    log_weights: Array,
    origins: Array,
    past: Array,
    ancestors: Array,
    copied: Array,
    times: Array,
    depth: Array,
    head: int,
    pairs: Array,
    shares: Array,
    looks: Array,
    sightings: Array,
    now: float,
    width: float,
    floor: float,
    means: Array,
    covariances: Array,
    rests: Array,
    hits: Array,
) -> None:
    """Let every track meet its sightings, in place.

    Parameters
    ----------
    state, weights, log_weights, origins : as in `staniel.kernels.motion.predict`
        The first and the third are changed; log weights are not normalised afterwards.
    past, ancestors, copied, times, depth, head : as in `staniel.kernels.lineage.places_at`
    pairs : (p, 2) int64 array
        Track and sighting, in ascending order of the track.
    shares : (p,) float64 array
        In [0, 1]: 1 for a sighting that is the track's, 0 for one that is not. Where several of
        one look have a share, the particles are weighed by the mixture and not moved.
    looks : (m,) int64 array
    sightings : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²].
    now : float [s]
        To which the particles were moved.
    width : float
        Share of the cloud's standard deviation that a particle's Gaussian has, in [0, 1); never
        wider than the sightings' own noise.
    floor : float [1/m²]
        Likelihood of a false alarm beside a missed target: λ (1 - P_D)/P_D.
    means : (count, 4) float64 array
    covariances : (count, 4, 4) float64 array
        Of the clouds, as `staniel.kernels.motion.predict` gives them.
    rests : (capacity, 4, 4) float64 array
        Covariance that all particles of a track have in common; changed in place to that of what
        is left of the little Gaussians.
    hits : (count,) int64 array
        Filled: in how many looks each track has a share.
    """
    n = weights.shape[1]
    offsets, index = np.empty((2, n), np.float32), np.empty(n, np.int32)
    hits[:] = 0
    first = 0
    while first < len(pairs):
        k = pairs[first, 0]
        last = first
        mine, late, noise = 0, 0, 0.0
        while last < len(pairs) and pairs[last, 0] == k:
            if shares[last] > 0.0:
                z = sightings[pairs[last, 1]]
                mine += 1
                noise += z[3] + z[5]
                late += 1 if now - z[0] > _SAME_TIME else 0
            last += 1
        if mine == 0:
            first = last
            continue
        cloud = covariances[k]
        narrow = noise / (mine * (cloud[0, 0] + cloud[1, 1] + 1e-9))
        square = min(width * width, narrow)
        if late == 0:
            planes, times_seen, cov = state[k], np.empty(0), square * cloud + rests[k]
            _draw_together(planes, means[k], square)
        else:
            times_seen, planes = _with_the_past(
                pairs[first:last, 1], shares[first:last], sightings, now, state, past, ancestors,
                copied, times, depth, k, head, index,
            )  # fmt: skip
            mean, cov = np.empty(len(planes)), np.empty((len(planes), len(planes)))
            _spread_of_all(planes, weights[k], mean, cov)
            cov *= square
            cov[:4, :4] += rests[k]
            _draw_together(planes, mean, square)
        hits[k] = _meet(
            planes, times_seen, log_weights[k], offsets, cov, pairs[first:last, 1],
            shares[first:last], looks, sightings, origins[k], floor,
        )  # fmt: skip
        if late > 0:
            for row in range(4):
                for i in range(n):
                    state[k, row, i] = planes[row, i]
        rests[k] = cov[:4, :4]
        first = last


@njit(cache=True, error_model="numpy")
def _meet(
    planes: Array, late: Array, logs: Array, offsets: Array, covariance: Array, mine: Array,
    shares: Array, looks: Array, sightings: Array, origin: Array, floor: float,
) -> int:  # fmt: skip
    """Let one track meet the sightings that it has a share in, look by look; returns the looks.

    `late` are the times of which the planes from the fourth on are the places.
    """
    done, met = np.zeros(mine.size, np.bool_), 0
    for p in range(mine.size):
        if done[p] or shares[p] == 0.0:
            continue
        met += 1
        rivals = 0
        for q in range(p, mine.size):
            if shares[q] > 0.0 and looks[mine[q]] == looks[mine[p]]:
                done[q] = True
                rivals += 1
        if rivals > 1:
            offsets[0, :] = np.float32(floor)
        for q in range(p, mine.size):
            if shares[q] == 0.0 or looks[mine[q]] != looks[mine[p]]:
                continue
            z, row = sightings[mine[q]], 0
            for t in range(late.size):
                if abs(late[t] - z[0]) <= _SAME_TIME:
                    row = 4 + 2 * t
            _weigh(planes, row, logs, offsets, covariance, z, origin, shares[q], floor, rivals == 1)
        if rivals > 1:
            mixture = offsets[0]
            for i in range(logs.size):
                logs[i] += log32(mixture[i])
    return met


@njit(cache=True, error_model="numpy")
def _draw_together(planes: Array, mean: Array, square: float) -> None:
    """Bring the planes nearer to their mean, so that a share `square` of their variance goes."""
    pull = np.float32(1.0 - math.sqrt(1.0 - square))
    for a in range(len(planes)):
        middle, plane = np.float32(mean[a]), planes[a]
        for i in range(plane.size):
            plane[i] += pull * (middle - plane[i])


@njit(cache=True, error_model="numpy")
def _with_the_past(
    mine: Array, shares: Array, sightings: Array, now: float, state: Array, past: Array,
    ancestors: Array, copied: Array, times: Array, depth: Array, k: int, head: int, index: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """The late times among a track's sightings, and its planes with the places at each of them."""
    n = index.size
    seen, known = np.empty(mine.size), 0
    for p in range(mine.size):
        time = sightings[mine[p], 0]
        fresh = shares[p] > 0.0 and now - time > _SAME_TIME
        for t in range(known):
            fresh = fresh and abs(seen[t] - time) > _SAME_TIME
        if fresh:
            seen[known] = time
            known += 1
    planes = np.empty((4 + 2 * known, n), np.float32)
    planes[:4] = state[k]
    for t in range(known):
        out = planes[4 + 2 * t : 6 + 2 * t]
        places_at(seen[t], now, state, past, ancestors, copied, times, depth, k, head, index, out)
    return seen[:known], planes


@njit(cache=True, error_model="numpy")
def _spread_of_all(planes: Array, weights: Array, mean: Array, cov: Array) -> None:
    """As `staniel.kernels.motion.spread`, of any number of planes."""
    d, n = planes.shape
    stride = max(min(n // SAMPLE, STRIDE), 1)
    mean[:], cov[:] = 0.0, 0.0
    total = 0.0
    for i in range(0, n, stride):
        total += weights[i]
    share = 1.0 / total if total > 0.0 else 0.0
    for a in range(d):
        for i in range(0, n, stride):
            mean[a] += share * weights[i] * planes[a, i]
    for a in range(d):
        for b in range(a, d):
            for i in range(0, n, stride):
                off = (planes[a, i] - mean[a]) * (planes[b, i] - mean[b])
                cov[a, b] += share * weights[i] * off
            cov[b, a] = cov[a, b]


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    n = 32
    state, weights = np.zeros((1, 4, n), np.float32), np.full((1, n), 1.0 / n, np.float32)
    past, ancestors = np.zeros((1, SLOTS, 2, n), np.float32), np.zeros((1, SLOTS, n), np.int32)
    copied, times, depth = np.zeros((1, SLOTS), np.bool_), np.zeros(SLOTS), np.ones(1, np.int64)
    pairs, looks = np.zeros((1, 2), np.int64), np.zeros(1, np.int64)
    z = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0]])
    correct(
        state, weights, np.zeros((1, n), np.float32), np.zeros((1, 2)), past, ancestors, copied,
        times, depth, 1, pairs, np.ones(1), looks, z, 1.0, 0.5, 1e-6, np.zeros((1, 4)),
        np.zeros((1, 4, 4)), np.zeros((1, 4, 4)), np.zeros(1, np.int64),
    )  # fmt: skip
