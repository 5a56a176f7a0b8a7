"""Line of sight and free space against extruded outlines, on a grid of wall pieces.

A building is the region inside its outline (holes are courtyards) below its roof. Touching it is
not entering it: a wall, an edge, a corner or a roof that is only touched neither hides nor hits.
The tests are exact to `SKIN`: what enters a building by less than a nanometre counts as touching.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

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

SKIN = 1e-9
"""What is nearer to a wall or a roof than this touches it [m]; far above the rounding of a cross
product of two kilometre-long vectors, divided by their length."""


class Walls(NamedTuple):
    """A city as the kernels see it: every wall once, and once more in each grid cell it touches.

    The grid covers the city's rectangle from the origin, row by row from the south; cell ``(i, j)``
    has the number ``j * nx + i``. All arrays are C-contiguous float64, whole numbers among them:
    two arrays make a cheap argument, as a kernel counts references of each on every call.
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
    pieces: Floats
    """(m, 7) the walls of each cell in turn: x0, y0, x1, y1, roof height [m], `SKIN` x length
    [m^2], building."""
    cells: Floats
    """(nx * ny + 1, 4) of each cell: its first row in `pieces`, the tallest roof with a wall in it
    [m], the building over its south-west corner + 1 or 0, and that building's roof or 0 [m]."""


@njit(cache=True, error_model="numpy")
def _left_of(x0: float, y0: float, x1: float, y1: float, x: float, y: float) -> bool:
    """Whether the point is left of the wall; on its line, a point slightly east, then north, is."""
    cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
    if cross != 0.0:
        return cross > 0.0
    if y1 != y0:
        return y1 < y0
    return x1 > x0


@njit(cache=True, error_model="numpy")
def _over(walls: Walls, x: float, y: float) -> tuple[int, float]:
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


@njit(cache=True, error_model="numpy")
def inside(walls: Walls, x: float, y: float) -> int:
    """Index of the building whose interior holds the point, -1 in the open or on a wall."""
    return _over(walls, x, y)[0]


@njit(cache=True, error_model="numpy")
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
        roof = _over(walls, ax + dx * middle, ay + dy * middle)[1]
        if az + dz * start < roof - SKIN:
            return True
        start = end
    return False


@njit(cache=True, error_model="numpy")
def _crosses(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Whether the segment from a up to b (az <= bz, not vertical) passes through a wall.

    Walks the grid cells under the part of the segment that is inside the city's rectangle and below
    the tallest roof, from the low end, where a building in the way is most likely.
    """
    pieces, cells = walls.pieces, walls.cells
    cell, nx, ny = walls.cell, walls.nx, walls.ny
    dx, dy, dz = bx - ax, by - ay, bz - az
    per_dx = 1.0 / dx if dx != 0.0 else math.inf
    per_dy = 1.0 / dy if dy != 0.0 else math.inf
    first, last = 0.0, 1.0
    if bz > walls.tallest:
        last = (walls.tallest - az) / dz
    if min(ax, bx) < 0.0 or max(ax, bx) > walls.width:
        t0, t1 = -ax * per_dx, (walls.width - ax) * per_dx
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    if min(ay, by) < 0.0 or max(ay, by) > walls.height:
        t0, t1 = -ay * per_dy, (walls.height - ay) * per_dy
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))

    i = min(max(int((ax + dx * first) / cell), 0), nx - 1)
    j = min(max(int((ay + dy * first) / cell), 0), ny - 1)
    # Per direction: cells left until the grid ends, the parameter of the next line, and of a cell.
    left_i = nx - i if dx > 0.0 else i + 1
    left_j = ny - j if dy > 0.0 else j + 1
    next_i = ((i + (dx > 0.0)) * cell - ax) * per_dx if dx != 0.0 else math.inf
    next_j = ((j + (dy > 0.0)) * cell - ay) * per_dy if dy != 0.0 else math.inf
    stride_i, stride_j = cell * abs(per_dx), cell * abs(per_dy)
    step_i, step_j = 1 if dx > 0.0 else -1, nx if dy > 0.0 else -nx
    reach = SKIN * math.sqrt(dx * dx + dy * dy)
    c = j * nx + i
    t = first
    while t <= last:
        low = az + dz * t
        if low < cells[c, 1]:
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
                if (
                    min(abs(side_u), abs(side_v)) <= reach
                    or min(abs(side_a), abs(side_b)) <= wall_reach
                ):
                    leave = min(next_i, next_j, last)
                    if _enters(walls, c, t, leave, ax, ay, az, dx, dy, dz):
                        return True
                    break  # every wall of the cell has been looked at
                if az + dz * (side_a / (side_a - side_b)) < pieces[k, 4] - SKIN:
                    return True
        if next_i < next_j:
            t = next_i
            c += step_i
            next_i += stride_i
            left_i -= 1
        else:
            t = next_j
            c += step_j
            next_j += stride_j
            left_j -= 1
        if left_i == 0 or left_j == 0:
            break
    return False


@njit(cache=True, error_model="numpy", inline="always")
def _under_roof(walls: Walls, x: float, y: float, z: float) -> bool:
    """Whether the point is inside a building."""
    return z < walls.tallest and z < _over(walls, x, y)[1] - SKIN


@njit(cache=True, error_model="numpy", inline="always")
def _unhidden(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Line of sight from a up to b (az <= bz); a is not inside a building."""
    return (
        az >= walls.tallest
        or (abs(bx - ax) <= SKIN and abs(by - ay) <= SKIN)
        or not _crosses(walls, ax, ay, az, bx, by, bz)
    )


@njit(cache=True, error_model="numpy", inline="always")
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
    if az > bz:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
    return not _under_roof(walls, ax, ay, az) and _unhidden(walls, ax, ay, az, bx, by, bz)


@njit(cache=True, error_model="numpy")
def visible_matrix(walls: Walls, observers: Floats, points: Floats) -> Bools:
    """(n, m) line of sight from each of n observers (n, 3) to each of m points (m, 3) [m]."""
    n, m = observers.shape[0], points.shape[0]
    visible = np.zeros((n, m), dtype=np.bool_)
    buried = np.zeros(m, dtype=np.bool_)
    for k in range(m):
        buried[k] = _under_roof(walls, points[k, 0], points[k, 1], points[k, 2])
    for o in range(n):
        ax, ay, az = observers[o, 0], observers[o, 1], observers[o, 2]
        if _under_roof(walls, ax, ay, az):
            continue
        for k in range(m):
            bx, by, bz = points[k, 0], points[k, 1], points[k, 2]
            if buried[k]:
                continue
            if az <= bz:
                visible[o, k] = _unhidden(walls, ax, ay, az, bx, by, bz)
            else:
                visible[o, k] = _unhidden(walls, bx, by, bz, ax, ay, az)
    return visible


@njit(cache=True, error_model="numpy")
def visible_pairs(walls: Walls, a: Floats, b: Floats) -> Bools:
    """(n,) line of sight between a[k] and b[k], both (n, 3) [m]."""
    n = a.shape[0]
    visible = np.zeros(n, dtype=np.bool_)
    for k in range(n):
        visible[k] = line_of_sight(walls, a[k, 0], a[k, 1], a[k, 2], b[k, 0], b[k, 1], b[k, 2])
    return visible


@njit(cache=True, error_model="numpy")
def inside_points(walls: Walls, points: Floats) -> Bools:
    """(n,) whether each ground point (n, 2) [m] is inside a building."""
    n = points.shape[0]
    covered = np.zeros(n, dtype=np.bool_)
    for k in range(n):
        covered[k] = inside(walls, points[k, 0], points[k, 1]) >= 0
    return covered


@njit(cache=True, error_model="numpy")
def path_clear(walls: Walls, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether the ground segment stays inside the city's rectangle and out of every building."""
    if not (0.0 <= ax <= walls.width and 0.0 <= ay <= walls.height):
        return False
    if not (0.0 <= bx <= walls.width and 0.0 <= by <= walls.height):
        return False
    return line_of_sight(walls, ax, ay, 0.0, bx, by, 0.0)


@njit(cache=True, error_model="numpy")
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
    return Walls(3.0, 3.0, 1.0, 3.0, 1, 1, pieces, cells)


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
