"""What laser beams tell of the cells of a grid: which they passed, and near which they ended."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["block", "pass_through", "warm"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@njit(cache=True, error_model="numpy")
def pass_through(
    known: Bools, west: float, south: float, cell: float, origins: Floats, ends: Floats
) -> None:
    """Mark the cells (rows, columns) that lie on the straight ways from origins to ends (n, 2)."""
    rows, columns = known.shape
    for n in range(origins.shape[0]):
        u, v = (origins[n, 0] - west) / cell, (origins[n, 1] - south) / cell
        du, dv = (ends[n, 0] - west) / cell - u, (ends[n, 1] - south) / cell - v
        # Quarter cells: what a beam only grazes need not count as seen.
        steps = int(4.0 * math.hypot(du, dv)) + 1
        for k in range(steps + 1):
            i, j = math.floor(u + du * k / steps), math.floor(v + dv * k / steps)
            if 0 <= i < columns and 0 <= j < rows:
                known[j, i] = True


@njit(cache=True, error_model="numpy")
def block(
    blocked: Bools, west: float, south: float, cell: float, points: Floats, reach: float
) -> int:
    """Mark the cells any place of which is nearer than `reach` to one of the points (n, 2).

    Returns
    -------
    int
        How many were not marked before.
    """
    rows, columns = blocked.shape
    new = 0
    for n in range(points.shape[0]):
        u, v = (points[n, 0] - west) / cell, (points[n, 1] - south) / cell
        wide = reach / cell
        for j in range(max(math.floor(v - wide), 0), min(math.floor(v + wide), rows - 1) + 1):
            dv = max(j - v, v - j - 1.0, 0.0)
            for i in range(
                max(math.floor(u - wide), 0), min(math.floor(u + wide), columns - 1) + 1
            ):
                du = max(i - u, u - i - 1.0, 0.0)
                if du * du + dv * dv < wide * wide and not blocked[j, i]:
                    blocked[j, i] = True
                    new += 1
    return new


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    cells, points = np.zeros((2, 2), dtype=np.bool_), np.ones((1, 2))
    pass_through(cells, 0.0, 0.0, 1.0, points, points)
    block(cells, 0.0, 0.0, 1.0, points, 0.5)
