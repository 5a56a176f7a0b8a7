"""The city as the kernels see it, and the exact decisions on its walls in float64."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "BEGIN",
    "BUILT",
    "END",
    "LANES",
    "ROW",
    "SKIN",
    "Walls",
    "bare",
    "fused",
    "hides",
    "over",
    "woven",
]

Floats = NDArray[np.float64]

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
_BARE: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}


def bare(kernel: Kernel) -> Kernel:
    """Compile a kernel that makes no array, without counting references to those it reads.

    On a call that takes a hundred nanoseconds the counting would be a fifth.
    """
    compiled: Kernel = njit(**_BARE)(kernel)
    return compiled


def woven(kernel: Kernel) -> Kernel:
    """As `bare`, and copied by the compiler into whatever calls it."""
    compiled: Kernel = njit(**_BARE, forceinline=True)(kernel)
    return compiled


def fused(kernel: Kernel) -> Kernel:
    """As `woven`, for tests with bounds on their rounding: a product and a sum may round once."""
    compiled: Kernel = njit(**_BARE, forceinline=True, fastmath={"contract"})(kernel)
    return compiled


SKIN = 1e-9
"""What is nearer to a wall or a roof than this touches it [m]; far above the rounding of a cross
product of two kilometre-long vectors, divided by their length."""

LANES = 8
"""Walls of a block: a vector register of float32."""

ROW = 6 * LANES
"""Length of a block: five numbers of each wall, and what belongs to the cell; three cache lines."""

BEGIN, END, BUILT = 5 * LANES, 5 * LANES + 1, 5 * LANES + 2
"""Where a cell's own numbers are in its first block; see `Walls.blocks`."""


class Walls(NamedTuple):
    """A city as the kernels see it: every wall once, and once more in each grid cell it touches.

    The grid covers the city's rectangle from the origin, row by row from the south; cell ``(i, j)``
    has the number ``j * nx + i``. All arrays are C-contiguous, with whole numbers among the others:
    few arrays make a cheap argument.
    """

    width: float
    """East extent of the city [m]."""
    height: float
    """North extent of the city [m]."""
    tallest: float
    """Height of the tallest roof [m], 0 without buildings."""
    cell: float
    """Side of a grid cell [m]."""
    nx: int
    """Cells east."""
    ny: int
    """Cells north."""
    span: float
    """Greatest number in the first four of each wall in `blocks` [m]."""
    pieces: Floats
    """(m, 7) the walls of each cell in turn: x0, y0, x1, y1, roof height [m], `SKIN` x length
    [m^2], building."""
    cells: Floats
    """(nx * ny + 1, 4) of each cell: its first row in `pieces`, the tallest roof with a wall in it
    [m], the building over its south-west corner + 1 or 0, and that building's roof or 0 [m]."""
    blocks: NDArray[np.float32]
    """(b, ROW) float32 the same walls again, `LANES` in a block: all x0, y0 from the cell's
    south-west corner, all x1 - x0, y1 - y0, all roof heights [m]. Block ``c`` is the first of cell
    ``c``; it continues in the blocks from number ``[BEGIN]`` up to ``[END]``, and ``[BUILT]`` is
    1 where a building is over its corner, else 0. Lanes left over have a roof deep in the ground.
    """


@njit(cache=True, error_model="numpy")
def _left_of(x0: float, y0: float, x1: float, y1: float, x: float, y: float) -> bool:
    """Whether the point is left of the wall; on its line, a point slightly east, then north, is."""
    cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
    if cross != 0.0:
        return cross > 0.0
    if y1 != y0:
        return y1 < y0
    return x1 > x0


@bare
def over(walls: Walls, x: float, y: float) -> tuple[int, float]:
    """Which building's interior holds the point and its roof; -1 and 0 in the open or on a wall.

    Walks from the cell's south-west corner, where the answer is known, north along the cell's edge
    and then east to the point, and toggles the building of each wall that is crossed on the way.
    """
    if not (0.0 <= x <= walls.width and 0.0 <= y <= walls.height):
        return -1, 0.0
    pieces, cells = walls.pieces, walls.cells
    i = min(int(x / walls.cell), walls.nx - 1)
    j = min(int(y / walls.cell), walls.ny - 1)
    west, south = i * walls.cell, j * walls.cell
    c = j * walls.nx + i
    begin, end = int(cells[c, 0]), int(cells[c + 1, 0])
    here = int(cells[c, 2])
    for k in range(begin, end):
        x0, y0, x1, y1 = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        ex, ey, reach = x1 - x0, y1 - y0, pieces[k, 5]
        if abs(ex * (y - y0) - ey * (x - x0)) <= reach:
            along = ex * (x - x0) + ey * (y - y0)
            if -reach <= along <= ex * ex + ey * ey + reach:
                return -1, 0.0
        over_point, over_edge = (y0 <= y) != (y1 <= y), (x0 <= west) != (x1 <= west)
        if over_point or over_edge:
            bend = _left_of(x0, y0, x1, y1, west, y)
            crossed = over_point and bend != _left_of(x0, y0, x1, y1, x, y)
            if over_edge and bend != _left_of(x0, y0, x1, y1, west, south):
                crossed = not crossed
            if crossed:
                here ^= int(pieces[k, 6]) + 1
    if here == 0:
        return -1, 0.0
    for k in range(begin, end):
        if int(pieces[k, 6]) == here - 1:
            return here - 1, pieces[k, 4]
    return here - 1, cells[c, 3]


@bare
def _enters(
    walls: Walls,
    c: int,
    first: float,
    last: float,
    ax: float,
    ay: float,
    az: float,
    dx: float,
    dy: float,
    dz: float,
) -> bool:
    """Whether a + t d (dz >= 0) is inside a building for some t in (first, last), in cell `c`.

    The slow way, for rays that touch corners or run along walls. Between two neighbouring contacts
    with walls the ray is wholly inside or outside of each building: the middle decides, and the
    height, growing with t, is lowest at the start.
    """
    pieces = walls.pieces
    length = math.sqrt(dx * dx + dy * dy)
    reach = SKIN * length
    start = first
    while start < last:
        end = last
        for k in range(int(walls.cells[c, 0]), int(walls.cells[c + 1, 0])):
            ux, uy = pieces[k, 0] - ax, pieces[k, 1] - ay
            vx, vy = pieces[k, 2] - ax, pieces[k, 3] - ay
            side_u, side_v = dx * uy - dy * ux, dx * vy - dy * vx
            if abs(side_u) <= reach:  # a corner on the ray's line; the next wall has it, too
                contact = (ux * dx + uy * dy) / (length * length)
            elif abs(side_v) > reach and (side_u > 0.0) != (side_v > 0.0):
                share = side_u / (side_u - side_v)
                px, py = ux + share * (vx - ux), uy + share * (vy - uy)
                contact = (px * dx + py * dy) / (length * length)
            else:
                continue
            if start + SKIN / length < contact < end:
                end = contact
        middle = 0.5 * (start + end)
        roof = over(walls, ax + dx * middle, ay + dy * middle)[1]
        if az + dz * start < roof - SKIN:
            return True
        start = end
    return False


@bare
def hides(
    walls: Walls,
    c: int,
    first: float,
    last: float,
    ax: float,
    ay: float,
    az: float,
    dx: float,
    dy: float,
    dz: float,
) -> bool:
    """Whether a + t d (dz >= 0) passes through a wall of cell `c`, where it is in (first, last)."""
    pieces, cells = walls.pieces, walls.cells
    reach = SKIN * math.sqrt(dx * dx + dy * dy)
    low = az + dz * first
    if low >= cells[c, 1]:
        return False
    for k in range(int(cells[c, 0]), int(cells[c + 1, 0])):
        ux, uy = pieces[k, 0] - ax, pieces[k, 1] - ay
        vx, vy = pieces[k, 2] - ax, pieces[k, 3] - ay
        side_u, side_v = dx * uy - dy * ux, dx * vy - dy * vx
        # Both ends of the wall clearly on one side of the ray?
        if min(side_u, side_v) > reach or max(side_u, side_v) < -reach:
            continue
        ex, ey, wall_reach = vx - ux, vy - uy, pieces[k, 5]
        side_a, side_b = ey * ux - ex * uy, ex * (dy - uy) - ey * (dx - ux)
        # Both ends of the ray clearly on one side of the wall, or the roof below the ray?
        if (
            min(side_a, side_b) > wall_reach
            or max(side_a, side_b) < -wall_reach
            or pieces[k, 4] <= low
        ):
            continue
        if min(abs(side_u), abs(side_v)) <= reach or min(abs(side_a), abs(side_b)) <= wall_reach:
            return _enters(walls, c, first, last, ax, ay, az, dx, dy, dz)
        if az + dz * (side_a / (side_a - side_b)) < pieces[k, 4] - SKIN:
            return True
    return False
