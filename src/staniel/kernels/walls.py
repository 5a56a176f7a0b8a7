"""Line of sight and free space against extruded outlines, on a grid of wall pieces.

A building is the region inside its outline (holes are courtyards) below its roof. Touching it is
not entering it: a wall, an edge, a corner or a roof that is only touched neither hides nor hits.
The tests are exact to `SKIN`: what enters a building by less than a nanometre counts as touching.

Each cell's walls are tried in float32 first, whole `blocks` at once; what is too near to call is
decided in float64 on its `pieces`. One segment walks the grid in `rays`, many in `volley`.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.blocks import in_open
from staniel.kernels.pieces import LANES, ROW, SKIN, Walls, bare, over
from staniel.kernels.rays import sees
from staniel.kernels.volley import visible_matrix, visible_pairs

__all__ = [
    "SKIN",
    "Walls",
    "disc_clear",
    "inside",
    "inside_points",
    "line_of_sight",
    "path_clear",
    "visible_matrix",
    "visible_pairs",
    "warm",
    "warm_walls",
]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@bare
def inside(walls: Walls, x: float, y: float) -> int:
    """Index of the building whose interior holds the point, -1 in the open or on a wall."""
    return -1 if in_open(walls, x, y) else over(walls, x, y)[0]


@bare
def line_of_sight(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Whether b is visible from a: the open segment does not meet the inside of a building.

    Parameters
    ----------
    walls : Walls
    ax, ay, az, bx, by, bz : float [m]
        East, north and height of both ends, anywhere.

    Returns
    -------
    bool
        Symmetric in a and b. False when an end is inside a building.

    Notes
    -----
    Only the lower end is looked up. Where the upper end is inside a building, so is the lower one,
    or the segment comes in through a wall below the roof.
    """
    return sees(walls, ax, ay, az, bx, by, bz)


@njit(cache=True, error_model="numpy")
def inside_points(walls: Walls, points: Floats) -> Bools:
    """(n,) whether each ground point (n, 2) [m] is inside a building."""
    n = points.shape[0]
    covered = np.zeros(n, dtype=np.bool_)
    for k in range(n):
        covered[k] = inside(walls, points[k, 0], points[k, 1]) >= 0
    return covered


@bare
def path_clear(walls: Walls, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether the ground segment stays inside the city's rectangle and out of every building."""
    if not (0.0 <= ax <= walls.width and 0.0 <= ay <= walls.height):
        return False
    if not (0.0 <= bx <= walls.width and 0.0 <= by <= walls.height):
        return False
    return line_of_sight(walls, ax, ay, 0.0, bx, by, 0.0)


@bare
def disc_clear(walls: Walls, x: float, y: float, radius: float) -> bool:
    """Whether a disc on the ground fits: in the rectangle, no wall nearer than its radius."""
    if not (radius <= x <= walls.width - radius and radius <= y <= walls.height - radius):
        return False
    pieces, cells, cell = walls.pieces, walls.cells, walls.cell
    i0, i1 = max(int((x - radius) / cell), 0), min(int((x + radius) / cell), walls.nx - 1)
    j0, j1 = max(int((y - radius) / cell), 0), min(int((y + radius) / cell), walls.ny - 1)
    for j in range(j0, j1 + 1):
        row = j * walls.nx
        for k in range(int(cells[row + i0, 0]), int(cells[row + i1 + 1, 0])):
            ex, ey = pieces[k, 2] - pieces[k, 0], pieces[k, 3] - pieces[k, 1]
            ux, uy = x - pieces[k, 0], y - pieces[k, 1]
            share = min(max((ux * ex + uy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
            if (ux - share * ex) ** 2 + (uy - share * ey) ** 2 < radius * radius:
                return False
    return inside(walls, x, y) < 0


def warm_walls() -> Walls:
    """The smallest city with a wall, for a first call of any kernel that takes one."""
    pieces = np.array([[1.0, 1.0, 2.0, 1.0, 1.0, SKIN, 0.0]])
    cells = np.array([[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    blocks = np.zeros((1, ROW), dtype=np.float32)
    blocks[0, : 5 * LANES] = np.repeat(np.array([1.0, 1.0, 1.0, 0.0, 1.0]), LANES)
    return Walls(3.0, 3.0, 1.0, 3.0, 1, 1, 1.0, pieces, cells, blocks)


def warm() -> None:
    """Compile the kernels, or load them from the cache, on one wall."""
    walls = warm_walls()
    point = np.zeros((1, 3))
    visible_matrix(walls, point, point)
    visible_pairs(walls, point, point)
    line_of_sight(walls, 0.0, 0.0, 0.0, 3.0, 3.0, 0.0)
    path_clear(walls, 0.0, 0.0, 3.0, 3.0)
    disc_clear(walls, 0.5, 0.5, 0.1)
    inside(walls, 0.5, 0.5)
    inside_points(walls, np.zeros((1, 2)))
