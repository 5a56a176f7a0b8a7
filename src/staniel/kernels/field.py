"""Cost of the cheapest way from each cell of a grid to one place: Dijkstra, eight neighbours."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.cells import Cells, warm_cells
from staniel.kernels.heap import pop, push

__all__ = ["cost_to", "step_cost", "warm"]

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def step_cost(cells: Cells, j: int, i: int, dj: int, di: int) -> float:
    """Cost of a step to a neighbour; infinite where either is blocked, or a corner is cut."""
    price = cells.price
    rows, columns = price.shape
    b, a = j + dj, i + di
    if not (0 <= b < rows and 0 <= a < columns):
        return math.inf
    side: float = 0.5 * cells.cell * (price[j, i] + price[b, a])
    if dj == 0 or di == 0:
        return side
    if price[j, a] == math.inf or price[b, i] == math.inf:
        return math.inf
    return side * math.sqrt(2.0)


@njit(cache=True, error_model="numpy")
def cost_to(cells: Cells, x: float, y: float) -> Floats:
    """Cost from the middle of each cell to the middle of the cell that holds a place.

    Parameters
    ----------
    cells : Cells
    x, y : float [m]
        On the grid.

    Returns
    -------
    (rows, columns) float array
        Along the eight directions, so up to 8.3 % more than as the crow flies; infinite where
        there is no way.
    """
    rows, columns = cells.price.shape
    cost = np.full((rows, columns), np.inf)
    done = np.zeros((rows, columns), dtype=np.bool_)
    keys = np.empty(8 * rows * columns + 1)
    items = np.empty(8 * rows * columns + 1, dtype=np.int32)
    i, j = int((x - cells.west) / cells.cell), int((y - cells.south) / cells.cell)
    if cells.price[j, i] == math.inf:
        return cost
    cost[j, i] = 0.0
    size = push(keys, items, 0, 0.0, j * columns + i)
    while size > 0:
        j, i = items[0] // columns, items[0] % columns
        size = pop(keys, items, size)
        if done[j, i]:
            continue
        done[j, i] = True
        for dj in range(-1, 2):
            for di in range(-1, 2):
                through = cost[j, i] + step_cost(cells, j, i, dj, di)
                if through < math.inf and through < cost[j + dj, i + di]:
                    cost[j + dj, i + di] = through
                    size = push(keys, items, size, through, (j + dj) * columns + i + di)
    return cost


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    cost_to(warm_cells(), 0.5, 0.5)
