"""What a path costs on a grid of cells: straight pieces and arcs, walked cell by cell.

Each cell has a price, the cost of a metre in it, infinite where it is blocked; outside the grid
everything is blocked. A piece costs what it spends in each cell, to rounding, and nothing that it
touches is skipped: there is no sampling that a thin wall could slip through. An arc is walked along
chords that are nowhere farther than `SAGITTA` from it.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "SAGITTA",
    "Cells",
    "advanced",
    "line_cost",
    "lines_cost",
    "piece_cost",
    "warm",
    "warm_cells",
]

Floats = NDArray[np.float64]
Prices = NDArray[np.float32]

SAGITTA = 0.05
"""An arc and the chords it is tested on are no farther from each other than that [m]."""


class Cells(NamedTuple):
    """A grid of square cells in east-north metres."""

    west: float
    """Of the grid's west edge [m]."""
    south: float
    """Of its south edge [m]."""
    cell: float
    """Side of a cell [m]."""
    price: Prices
    """(rows, columns) cost of a metre, row 0 the south edge; at least 1, infinite: blocked."""


@njit(cache=True, error_model="numpy")
def line_cost(cells: Cells, ax: float, ay: float, bx: float, by: float) -> float:
    """Cost of the straight way from a to b; infinite where it touches what is blocked.

    Parameters
    ----------
    cells : Cells
    ax, ay, bx, by : float [m]

    Returns
    -------
    float
        Sum over the cells that it passes of price times length inside.
    """
    rows, columns = cells.price.shape
    u, v = (ax - cells.west) / cells.cell, (ay - cells.south) / cells.cell
    p, q = (bx - cells.west) / cells.cell, (by - cells.south) / cells.cell
    if not (min(u, p) >= 0.0 and max(u, p) < columns and min(v, q) >= 0.0 and max(v, q) < rows):
        return math.inf
    i, j = int(u), int(v)
    price = float(cells.price[j, i])
    if price == math.inf:
        return math.inf
    left = abs(int(p) - i) + abs(int(q) - j)
    du, dv = p - u, q - v
    length = math.sqrt(du * du + dv * dv) * cells.cell
    if left == 0:
        return length * price
    # Shares of the way at which the next column and the next row begin.
    east, north = du > 0.0, dv > 0.0
    per_u = abs(1.0 / du) if du != 0.0 else math.inf
    per_v = abs(1.0 / dv) if dv != 0.0 else math.inf
    next_u = (i + 1 - u if east else u - i) * per_u if du != 0.0 else math.inf
    next_v = (j + 1 - v if north else v - j) * per_v if dv != 0.0 else math.inf
    cost, share = 0.0, 0.0
    while left > 0:
        if next_u < next_v:
            at = min(next_u, 1.0)
            next_u += per_u
            i += 1 if east else -1
        else:
            at = min(next_v, 1.0)
            next_v += per_v
            j += 1 if north else -1
        cost += price * (at - share)
        share = at
        # Rounding may count one crossing too many at the last corner: stay on the grid.
        price = float(cells.price[min(max(j, 0), rows - 1), min(max(i, 0), columns - 1)])
        if price == math.inf:
            return math.inf
        left -= 1
    return (cost + price * (1.0 - share)) * length


@njit(cache=True, error_model="numpy")
def lines_cost(cells: Cells, a: Floats, b: Floats) -> Floats:
    """(n,) `line_cost` of the straight ways from places a (n, 2) to places b (n, 2)."""
    costs = np.empty(a.shape[0])
    for k in range(a.shape[0]):
        costs[k] = line_cost(cells, a[k, 0], a[k, 1], b[k, 0], b[k, 1])
    return costs


@njit(cache=True, error_model="numpy")
def advanced(
    x: float, y: float, course: float, bend: float, length: float
) -> tuple[float, float, float]:
    """Pose after a piece: x, y [m] and course [rad], which is not wrapped.

    Parameters
    ----------
    x, y, course : float [m, m, rad]
    bend : float [1/m]
        Curvature, positive to the left, 0 for a straight.
    length : float [m]
    """
    if bend == 0.0:
        return x + length * math.cos(course), y + length * math.sin(course), course
    after = course + bend * length
    return (
        x + (math.sin(after) - math.sin(course)) / bend,
        y - (math.cos(after) - math.cos(course)) / bend,
        after,
    )


@njit(cache=True, error_model="numpy")
def piece_cost(
    cells: Cells, x: float, y: float, course: float, bend: float, length: float
) -> float:
    """Cost of a piece of constant curvature; infinite where it touches what is blocked.

    Parameters
    ----------
    cells : Cells
    x, y, course, bend, length
        As in `advanced`.

    Returns
    -------
    float
    """
    if bend == 0.0:
        return line_cost(cells, x, y, x + length * math.cos(course), y + length * math.sin(course))
    angle = abs(bend) * length
    chords = math.ceil(angle / math.sqrt(8.0 * SAGITTA * abs(bend))) if angle > 0.0 else 1
    part = length / chords
    cost = 0.0
    sin, cos = math.sin(course), math.cos(course)
    for k in range(1, chords + 1):
        after = course + bend * part * k
        sin_after, cos_after = math.sin(after), math.cos(after)
        bx, by = x + (sin_after - sin) / bend, y - (cos_after - cos) / bend
        cost += line_cost(cells, x, y, bx, by)
        if cost == math.inf:
            return math.inf
        x, y, sin, cos = bx, by, sin_after, cos_after
    half = 0.5 * angle / chords
    return cost * (half / math.sin(half)) if half > 0.0 else cost


def warm_cells() -> Cells:
    """The smallest grid, for a first call of any kernel that takes one."""
    return Cells(0.0, 0.0, 1.0, np.ones((4, 4), dtype=np.float32))


def warm() -> None:
    """Compile, or load from the cache, what this module is called with."""
    line_cost(warm_cells(), 0.5, 0.5, 1.5, 1.5)
    lines_cost(warm_cells(), np.ones((1, 2)), np.ones((1, 2)))
    piece_cost(warm_cells(), 0.5, 0.5, 0.0, 1.0, 0.5)
    advanced(0.0, 0.0, 0.0, 0.0, 1.0)
