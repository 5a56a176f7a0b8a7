"""Where vehicles that wander can start: the streets' largest connected part, and places on it."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform
from staniel.kernels.walls import Walls, disc_clear, path_clear, warm_walls

__all__ = ["place", "streets", "warm"]

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def streets(walls: Walls, radius: float, spacing: float) -> NDArray[np.bool_]:
    """Nodes of a square grid on the largest connected part of the ground where a disc can drive.

    Parameters
    ----------
    walls : Walls
    radius : float [m]
        Of the disc.
    spacing : float [m]
        Of the grid.

    Returns
    -------
    (rows, columns) bool array
        Of the node at ``((column + 1/2) spacing, (row + 1/2) spacing)``: is it in that part?
        Nowhere true in a city without free space.
    """
    rows, columns = int(walls.height / spacing) + 1, int(walls.width / spacing) + 1
    part = np.zeros((rows, columns), dtype=np.int64)  # 0 not visited, -1 blocked, else its number
    stack = np.empty(rows * columns, dtype=np.int64)
    parts, best, most = 0, 0, 0
    for start in range(rows * columns):
        if part[start // columns, start % columns] != 0:
            continue
        parts += 1
        count, top = 0, 0
        stack[0] = start
        part[start // columns, start % columns] = parts
        while top >= 0:
            node = stack[top]
            top -= 1
            row, column = node // columns, node % columns
            x, y = (column + 0.5) * spacing, (row + 0.5) * spacing
            if not disc_clear(walls, x, y, radius):
                part[row, column] = -1
                continue
            count += 1
            for side in range(4):
                a, b = row + (side == 0) - (side == 1), column + (side == 2) - (side == 3)
                if 0 <= a < rows and 0 <= b < columns and part[a, b] == 0:
                    xb, yb = (b + 0.5) * spacing, (a + 0.5) * spacing
                    if path_clear(walls, x, y, xb, yb):
                        part[a, b] = parts
                        top += 1
                        stack[top] = a * columns + b
        if count > most:
            best, most = parts, count
    largest = np.zeros((rows, columns), dtype=np.bool_)
    for row in range(rows):
        for column in range(columns):
            largest[row, column] = most > 0 and part[row, column] == best
    return largest


@njit(cache=True, error_model="numpy")
def place(
    walls: Walls,
    street: NDArray[np.bool_],
    spacing: float,
    count: int,
    clearance: float,
    tries: int,
    key: np.uint64,
) -> Array:
    """Random places on the streets, none nearer than `clearance` to a wall or to another place.

    Parameters
    ----------
    walls : Walls
    street, spacing
        From `streets`.
    count : int
    clearance : float [m]
    tries : int
        At most so many for each place.
    key : uint64
        With a place's index it names its draws: one more place does not move those before it.

    Returns
    -------
    (m, 3) float array
        x, y [m] and a heading [rad]; fewer than `count` rows when no place was found for the next.
    """
    rows, columns = street.shape
    places = np.empty((count, 3))
    for i in range(count):
        stream = fold(key, i)
        placed = False
        for k in range(tries):
            x = walls.width * uniform(stream, 3 * k)
            y = walls.height * uniform(stream, 3 * k + 1)
            row, column = min(int(y / spacing), rows - 1), min(int(x / spacing), columns - 1)
            if not street[row, column] or not disc_clear(walls, x, y, clearance):
                continue
            if not path_clear(walls, x, y, (column + 0.5) * spacing, (row + 0.5) * spacing):
                continue
            placed = True
            for j in range(i):
                if math.hypot(places[j, 0] - x, places[j, 1] - y) < clearance:
                    placed = False
                    break
            if placed:
                places[i, 0], places[i, 1] = x, y
                places[i, 2] = math.pi * (1.0 - 2.0 * uniform(stream, 3 * k + 2))
                break
        if not placed:
            return places[:i]
    return places


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    walls = warm_walls()
    place(walls, streets(walls, 0.1, 1.0), 1.0, 1, 0.1, 1, np.uint64(0))
