"""Which sightings a track may have caused: those inside its gate, found over a grid."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["gated", "warm"]

Array = NDArray[Any]

_CELLS = 4  # of the grid, for each sighting: no more, however far apart they lie
_FAR_BEYOND = 25.0  # times the harmonic mean of the variances
_LOG_2PI = 1.8378770664093453


@njit(cache=True, error_model="numpy")
def _binned(sightings: Array, cell: float) -> tuple[Array, Array, Array]:
    """A grid over the sightings: frame (x, y, cell, columns, rows), starts of cells, members."""
    m = sightings.shape[0]
    low_x, low_y = sightings[:, 1].min(), sightings[:, 2].min()
    wide, high = sightings[:, 1].max() - low_x, sightings[:, 2].max() - low_y
    most = float(_CELLS * m + 1)
    while (math.floor(wide / cell) + 1.0) * (math.floor(high / cell) + 1.0) > most:
        cell *= 2.0
    columns, rows = int(wide / cell) + 1, int(high / cell) + 1
    starts = np.zeros(columns * rows + 1, np.int64)
    where = np.empty(m, np.int64)
    for j in range(m):
        where[j] = int((sightings[j, 2] - low_y) / cell) * columns + int(
            (sightings[j, 1] - low_x) / cell
        )
        starts[where[j] + 1] += 1
    for c in range(columns * rows):
        starts[c + 1] += starts[c]
    members, filled = np.empty(m, np.int64), starts[:-1].copy()
    for j in range(m):
        members[filled[where[j]]] = j
        filled[where[j]] += 1
    return np.array([low_x, low_y, cell, float(columns), float(rows)]), starts, members


@njit(cache=True, error_model="numpy")
def _usual(sightings: Array) -> tuple[float, Array]:
    """The greatest variance that is not far beyond the usual [m²], and who has a greater one."""
    m = sightings.shape[0]
    inverse = 0.0
    for j in range(m):
        inverse += 1.0 / max(sightings[j, 3], sightings[j, 5])
    most = _FAR_BEYOND * m / inverse
    widest, count = 0.0, 0
    wide = np.empty(m, np.int64)
    for j in range(m):
        variance = max(sightings[j, 3], sightings[j, 5])
        if variance > most:
            wide[count] = j
            count += 1
        else:
            widest = max(widest, variance)
    return widest, wide[:count]


@njit(cache=True, error_model="numpy")
def gated(
    means: Array,
    covariances: Array,
    origins: Array,
    sightings: Array,
    now: float,
    gate: float,
    near: float,
) -> tuple[Array, Array, Array]:
    """Pairs of a track and a sighting inside its gate, and how near each sighting is to any.

    A late sighting meets the track straight back along its mean velocity. The cost grows with the
    tracks, the sightings and the pairs, not with tracks times sightings.

    Parameters
    ----------
    means : (count, 4) float64 array
        Predicted x, y [m, from the track's origin], vx, vy [m/s].
    covariances : (count, 4, 4) float64 array
    origins : (capacity, 2) float64 array [m]
    sightings : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²].
    now : float [s]
        Of the means.
    gate : float [sigma]
    near : float [m]
        Up to which `nearest` is asked for.

    Returns
    -------
    pairs : (p, 2) int64 array
        Track and sighting, in ascending order of the track.
    scores : (p,) float64 array
        Log of the Gaussian likelihood of the sighting [log 1/m²].
    nearest : (m,) float64 array [m]
        Distance of each sighting to the nearest track; may be inf beyond `near`.
    """
    count, m = means.shape[0], sightings.shape[0]
    pairs, scores = np.empty((4 * (count + m), 2), np.int64), np.empty(4 * (count + m))
    nearest = np.full(m, np.inf)
    found = 0
    if m == 0 or count == 0:
        return pairs[:0], scores[:0], nearest
    oldest = 0.0
    for j in range(m):
        oldest = max(oldest, now - sightings[j, 0])
    # The few that are far less exact than the rest would make every reach as wide as theirs: they
    # are held against every track instead.
    widest, wide = _usual(sightings)
    frame, starts, members = _binned(sightings, 2.0 * gate * math.sqrt(2.0 * widest))
    cell, columns, rows = frame[2], int(frame[3]), int(frame[4])
    near_by = np.empty(m, np.int64)
    for k in range(count):
        mean, cov = means[k], covariances[k]
        x, y = origins[k, 0] + mean[0], origins[k, 1] + mean[1]
        reach_x = max(gate * math.sqrt(cov[0, 0] + widest), near) + oldest * abs(mean[2])
        reach_y = max(gate * math.sqrt(cov[1, 1] + widest), near) + oldest * abs(mean[3])
        west = max((x - reach_x - frame[0]) / cell, 0.0)
        east = min((x + reach_x - frame[0]) / cell, columns - 0.5)
        south = max((y - reach_y - frame[1]) / cell, 0.0)
        north = min((y + reach_y - frame[1]) / cell, rows - 0.5)
        asked = wide.size
        near_by[:asked] = wide
        if west <= columns and east >= 0.0 and south <= rows and north >= 0.0:
            for row in range(int(south), int(north) + 1):
                first = row * columns
                for p in range(starts[first + int(west)], starts[first + int(east) + 1]):
                    j = members[p]
                    if max(sightings[j, 3], sightings[j, 5]) <= widest:
                        near_by[asked] = j
                        asked += 1
        for j in near_by[:asked]:
            z = sightings[j]
            late = now - z[0]
            dx, dy = z[1] - x + late * mean[2], z[2] - y + late * mean[3]
            nearest[j] = min(nearest[j], math.hypot(dx, dy))
            xx, xy, yy = cov[0, 0] + z[3], cov[0, 1] + z[4], cov[1, 1] + z[5]
            det = xx * yy - xy * xy
            square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det
            if square > gate * gate:
                continue
            if found == scores.size:
                pairs = np.concatenate((pairs, np.empty_like(pairs)))
                scores = np.concatenate((scores, np.empty_like(scores)))
            pairs[found, 0], pairs[found, 1] = k, j
            scores[found] = -_LOG_2PI - 0.5 * (math.log(det) + square)
            found += 1
    return pairs[:found], scores[:found], nearest


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    one = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0]])
    gated(np.zeros((1, 4)), np.eye(4).reshape(1, 4, 4), np.zeros((1, 2)), one, 0.0, 4.0, 1.0)
