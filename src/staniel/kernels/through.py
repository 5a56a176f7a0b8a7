"""The cheapest chain of Dubins paths through some of a row of poses, and pieces of a path."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.cells import Cells, advanced, piece_cost, warm_cells
from staniel.kernels.shots import TURNS, shot, shot_cost

__all__ = ["chain", "path_cost", "pieces", "sampled", "warm"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NOTHING = 1e-9  # a piece so short is none [m]


@njit(cache=True, error_model="numpy")
def chain(
    cells: Cells, poses: Floats, layers: Ints, window: int, radius: float
) -> tuple[float, Ints]:
    """The cheapest way from the first pose to the last, by Dubins paths from layer to later layer.

    Parameters
    ----------
    cells : Cells
    poses : (m, 3) float array
        x, y [m], course [rad]; the last one's course may be free (not a number).
    layers : (m,) int array
        Not decreasing. From a pose one goes on to poses of later layers only.
    window : int
        At most so many layers later.
    radius : float [m]
        Of the tightest turn.

    Returns
    -------
    cost : float
        Infinite where no chain is free.
    indices : (k,) int array
        Of the poses on the way, first and last included; empty where there is none.
    """
    m = poses.shape[0]
    best = np.full(m, np.inf)
    came = np.full(m, -1, dtype=np.int64)
    best[0] = 0.0
    for j in range(1, m):
        for i in range(j - 1, -1, -1):
            if layers[i] == layers[j] or best[i] == math.inf:
                continue
            if layers[j] - layers[i] > window:
                break
            apart = math.hypot(poses[j, 0] - poses[i, 0], poses[j, 1] - poses[i, 1])
            if best[i] + apart >= best[j]:
                continue
            length, word, first, middle, last = shot(
                poses[i, 0], poses[i, 1], poses[i, 2], poses[j, 0], poses[j, 1], poses[j, 2], radius
            )
            if best[i] + length >= best[j]:
                continue
            cost = best[i] + shot_cost(
                cells, poses[i, 0], poses[i, 1], poses[i, 2], word, first, middle, last, radius
            )
            if cost < best[j]:
                best[j], came[j] = cost, i
    if best[m - 1] == math.inf:
        return math.inf, np.empty(0, dtype=np.int64)
    count, at = 1, m - 1
    while came[at] >= 0:
        at = came[at]
        count += 1
    indices = np.empty(count, dtype=np.int64)
    at = m - 1
    for k in range(count - 1, -1, -1):
        indices[k] = at
        at = came[at]
    return best[m - 1], indices


@njit(cache=True, error_model="numpy")
def pieces(poses: Floats, radius: float) -> Floats:
    """The pieces of the Dubins paths from each pose to the next.

    Parameters
    ----------
    poses : (m, 3) float array
        The last one's course may be free (not a number).
    radius : float [m]

    Returns
    -------
    (k, 2) float array
        Curvature [1/m], positive to the left, and length [m] of each; neighbours differ in
        curvature.
    """
    out = np.empty((3 * poses.shape[0], 2))
    count = 0
    for i in range(poses.shape[0] - 1):
        a, b = poses[i], poses[i + 1]
        _, word, first, middle, last = shot(a[0], a[1], a[2], b[0], b[1], b[2], radius)
        for k in range(3):
            length = radius * (first if k == 0 else middle if k == 1 else last)
            bend = TURNS[word, k] / radius
            if length <= _NOTHING:
                continue
            if count > 0 and out[count - 1, 0] == bend:
                out[count - 1, 1] += length
            else:
                out[count, 0], out[count, 1] = bend, length
                count += 1
    return out[:count].copy()


@njit(cache=True, error_model="numpy")
def path_cost(cells: Cells, start: Floats, path: Floats) -> float:
    """Cost of a path of pieces (k, 2) from a pose (3,); infinite where it is not free."""
    x, y, course = start[0], start[1], start[2]
    total = 0.0
    for k in range(path.shape[0]):
        total += piece_cost(cells, x, y, course, path[k, 0], path[k, 1])
        x, y, course = advanced(x, y, course, path[k, 0], path[k, 1])
    return total


@njit(cache=True, error_model="numpy")
def sampled(start: Floats, path: Floats, ways: Floats) -> Floats:
    """(n, 3) poses at ascending ways (n,) [m] along a path of pieces (k, 2) from a pose (3,)."""
    out = np.empty((ways.shape[0], 3))
    x, y, course = start[0], start[1], start[2]
    k, behind = 0, 0.0
    for i in range(ways.shape[0]):
        while k < path.shape[0] - 1 and ways[i] > behind + path[k, 1]:
            x, y, course = advanced(x, y, course, path[k, 0], path[k, 1])
            behind += path[k, 1]
            k += 1
        bend = path[k, 0] if path.shape[0] else 0.0
        out[i, 0], out[i, 1], out[i, 2] = advanced(x, y, course, bend, ways[i] - behind)
    return out


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    poses = np.array([[0.5, 0.5, 0.0], [2.5, 0.5, 0.0]])
    chain(warm_cells(), poses, np.arange(2), 1, 1.0)
    path = pieces(poses, 1.0)
    path_cost(warm_cells(), poses[0], path)
    sampled(poses[0], path, np.zeros(1))
