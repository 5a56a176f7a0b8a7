"""Who is near whom among many vehicles, on a grid made anew from where they are."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["neighbours", "rebuild_every", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def neighbours(vehicles: Array, reach: float) -> tuple[Indices, Indices]:
    """Who is nearer than `reach` to whom: the neighbours of i are ``near[first[i]:first[i + 1]]``.

    Found in a grid of cells not smaller than `reach`, and not many more than there are vehicles.
    """
    n = vehicles.shape[0]
    first = np.zeros(n + 1, dtype=np.int64)
    if n == 0:
        return first, first[:0]
    # Loops, here and below: what arrays do at once costs seconds to compile.
    west = east = vehicles[0, 0]
    south = north = vehicles[0, 1]
    for i in range(n):
        west, east = min(west, vehicles[i, 0]), max(east, vehicles[i, 0])
        south, north = min(south, vehicles[i, 1]), max(north, vehicles[i, 1])
    east, north = east - west, north - south
    cell = max(reach, math.sqrt(east * north / n), (east + north) / (n + 1))
    nx, ny = int(east / cell) + 1, int(north / cell) + 1
    head = np.zeros((ny, nx), dtype=np.int64)  # number of the last vehicle, plus 1
    following = np.empty(n, dtype=np.int64)
    for i in range(n):
        a, b = int((vehicles[i, 0] - west) / cell), int((vehicles[i, 1] - south) / cell)
        following[i] = head[b, a] - 1
        head[b, a] = i + 1
    near = first[:0]
    for filling in range(2):
        found = 0
        for i in range(n):
            first[i] = found
            a, b = int((vehicles[i, 0] - west) / cell), int((vehicles[i, 1] - south) / cell)
            for row in range(max(b - 1, 0), min(b + 2, ny)):
                for column in range(max(a - 1, 0), min(a + 2, nx)):
                    j = head[row, column] - 1
                    while j >= 0:
                        dx = vehicles[j, 0] - vehicles[i, 0]
                        dy = vehicles[j, 1] - vehicles[i, 1]
                        if j != i and dx * dx + dy * dy < reach * reach:
                            if filling == 1:
                                near[found] = j
                            found += 1
                        j = following[j]
        first[n] = found
        if filling == 0:
            near = np.empty(found, dtype=np.int64)
    return first, near


@njit(cache=True, error_model="numpy")
def rebuild_every(reach: float, fastest: float, dt: float, substeps: int) -> int:
    """Steps after which neighbours are looked for anew: before two have closed in by 2 `reach`."""
    closing = 2.0 * fastest * dt
    if closing * substeps <= 2.0 * reach:
        return max(substeps, 1)
    return max(int(2.0 * reach / closing), 1)


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    neighbours(np.zeros((1, 4)), 1.0)
    rebuild_every(1.0, 1.0, 0.1, 1)
