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
    few arrays make a cheap argument, as each costs a kernel two counts of its references.
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
    """(nx * ny + 1, 3) of each cell: its first row in `pieces`, the tallest roof with a wall in it
    [m], the building over its south-west corner + 1 or 0."""
    edges: Floats
    """(w, 7) the walls of each building in turn, as in `pieces`."""
    buildings: Floats
    """(n + 1, 2) of each building: its first row in `edges`, roof height [m]."""


@njit(cache=True, error_model="numpy")
def _left_of(x0: float, y0: float, x1: float, y1: float, x: float, y: float) -> bool:
    """Is the point left of the wall? On its line: is a point slightly east, then slightly north?"""
    cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
    if cross != 0.0:
        return cross > 0.0
    if y1 != y0:
        return y1 < y0
    return x1 > x0


@njit(cache=True, error_model="numpy")
def inside(walls: Walls, x: float, y: float) -> int:
    """Index of the building whose interior holds the point, -1 in the open or on a wall.

    Walks from the cell's south-west corner, where the answer is known, north along the cell's edge
    and then east to the point, and toggles the building of each wall that is crossed on the way.
    """
    if not (0.0 <= x <= walls.width and 0.0 <= y <= walls.height):
        return -1
    i = min(int(x / walls.cell), walls.nx - 1)
    j = min(int(y / walls.cell), walls.ny - 1)
    west, south = i * walls.cell, j * walls.cell
    c = j * walls.nx + i
    pieces, cells = walls.pieces, walls.cells
    here = int(cells[c, 2])
    for k in range(int(cells[c, 0]), int(cells[c + 1, 0])):
        x0, y0, x1, y1 = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        ex, ey, reach = x1 - x0, y1 - y0, pieces[k, 5]
        if abs(ex * (y - y0) - ey * (x - x0)) <= reach:
            along = ex * (x - x0) + ey * (y - y0)
            if -reach <= along <= ex * ex + ey * ey + reach:
                return -1
        over_point, over_edge = (y0 <= y) != (y1 <= y), (x0 <= west) != (x1 <= west)
        if over_point or over_edge:
            bend = _left_of(x0, y0, x1, y1, west, y)
            crossed = over_point and bend != _left_of(x0, y0, x1, y1, x, y)
            if over_edge and bend != _left_of(x0, y0, x1, y1, west, south):
                crossed = not crossed
            if crossed:
                here ^= int(pieces[k, 6]) + 1
    return here - 1


@njit(cache=True, error_model="numpy")
def _next_touch(
    walls: Walls, building: int, ax: float, ay: float, dx: float, dy: float, after: float
) -> float:
    """First parameter above `after` at which the ray a + t d meets a wall or corner, at most 1."""
    edges = walls.edges
    length = math.sqrt(dx * dx + dy * dy)
    reach = SKIN * length
    best = 1.0
    for k in range(int(walls.buildings[building, 0]), int(walls.buildings[building + 1, 0])):
        ux, uy = edges[k, 0] - ax, edges[k, 1] - ay
        vx, vy = edges[k, 2] - ax, edges[k, 3] - ay
        side_u = dx * uy - dy * ux
        side_v = dx * vy - dy * vx
        t = 2.0
        if abs(side_u) <= reach:  # a corner on the ray's line
            t = (ux * dx + uy * dy) / (length * length)
        elif abs(side_v) > reach and (side_u > 0.0) != (side_v > 0.0):
            share = side_u / (side_u - side_v)
            t = ((ux + share * (vx - ux)) * dx + (uy + share * (vy - uy)) * dy) / (length * length)
        if after < t < best:
            best = t
    return best


@njit(cache=True, error_model="numpy")
def _enters(
    walls: Walls, building: int, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Does the segment enter this building's prism? The slow way, for rays that touch corners.

    Between two neighbouring contacts with the outline the segment is wholly inside or outside: the
    middle of the interval decides, and z, being linear, is lowest at one of its ends.
    """
    dx, dy, dz = bx - ax, by - ay, bz - az
    roof = walls.buildings[building, 1] - SKIN
    step = SKIN / math.sqrt(dx * dx + dy * dy)
    start = 0.0
    while start < 1.0:
        end = _next_touch(walls, building, ax, ay, dx, dy, start + step)
        middle = 0.5 * (start + end)
        low = az + dz * (start if dz > 0.0 else end)
        if low < roof and inside(walls, ax + dx * middle, ay + dy * middle) == building:
            return True
        start = end
    return False


@njit(cache=True, error_model="numpy")
def _crosses(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Does the segment from a up to b (az <= bz, not vertical) pass through a wall?

    Walks the grid cells under the part of the segment that is inside the city's rectangle and below
    the tallest roof, from the low end, where a building in the way is most likely.
    """
    dx, dy, dz = bx - ax, by - ay, bz - az
    first, last = 0.0, 1.0
    if az + dz > walls.tallest:
        last = (walls.tallest - az) / dz
    if dx != 0.0:
        t0, t1 = -ax / dx, (walls.width - ax) / dx
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    elif ax < 0.0 or ax > walls.width:
        return False
    if dy != 0.0:
        t0, t1 = -ay / dy, (walls.height - ay) / dy
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    elif ay < 0.0 or ay > walls.height:
        return False
    if first > last:
        return False

    pieces, cells = walls.pieces, walls.cells
    cell, nx, ny = walls.cell, walls.nx, walls.ny
    i = min(max(int((ax + dx * first) / cell), 0), nx - 1)
    j = min(max(int((ay + dy * first) / cell), 0), ny - 1)
    step_i, step_j = 1 if dx > 0.0 else -1, 1 if dy > 0.0 else -1
    next_i = ((i + (dx > 0.0)) * cell - ax) / dx if dx != 0.0 else math.inf
    next_j = ((j + (dy > 0.0)) * cell - ay) / dy if dy != 0.0 else math.inf
    stride_i = cell / abs(dx) if dx != 0.0 else math.inf
    stride_j = cell / abs(dy) if dy != 0.0 else math.inf
    reach = SKIN * math.sqrt(dx * dx + dy * dy)
    t = first
    while t <= last and 0 <= i < nx and 0 <= j < ny:
        low = az + dz * t
        c = j * nx + i
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
                    if _enters(walls, int(pieces[k, 6]), ax, ay, az, bx, by, bz):
                        return True
                elif az + dz * (side_a / (side_a - side_b)) < pieces[k, 4] - SKIN:
                    return True
        if next_i < next_j:
            t = next_i
            i += step_i
            next_i += stride_i
        else:
            t = next_j
            j += step_j
            next_j += stride_j
    return False


@njit(cache=True, error_model="numpy")
def _under_roof(walls: Walls, x: float, y: float, z: float) -> bool:
    """Is the point inside a building?"""
    if z >= walls.tallest:
        return False
    building = inside(walls, x, y)
    return building >= 0 and z < walls.buildings[building, 1] - SKIN


@njit(cache=True, error_model="numpy")
def _unhidden(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Line of sight between two points of which neither is inside a building."""
    if az >= walls.tallest and bz >= walls.tallest:
        return True
    if abs(bx - ax) <= SKIN and abs(by - ay) <= SKIN:
        return True
    if az <= bz:
        return not _crosses(walls, ax, ay, az, bx, by, bz)
    return not _crosses(walls, bx, by, bz, ax, ay, az)


@njit(cache=True, error_model="numpy")
def line_of_sight(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Is b visible from a? Blocked where the open segment meets the inside of a building.

    Parameters
    ----------
    walls : Walls
    ax, ay, az, bx, by, bz : float [m]
        East, north and height of both ends, anywhere.

    Returns
    -------
    bool
        Symmetric in a and b. False when an end is inside a building.
    """
    if _under_roof(walls, ax, ay, az) or _under_roof(walls, bx, by, bz):
        return False
    return _unhidden(walls, ax, ay, az, bx, by, bz)


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
            visible[o, k] = not buried[k] and _unhidden(
                walls, ax, ay, az, points[k, 0], points[k, 1], points[k, 2]
            )
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
    """(n,) is each ground point (n, 2) [m] inside a building?"""
    n = points.shape[0]
    covered = np.zeros(n, dtype=np.bool_)
    for k in range(n):
        covered[k] = inside(walls, points[k, 0], points[k, 1]) >= 0
    return covered


@njit(cache=True, error_model="numpy")
def path_clear(walls: Walls, ax: float, ay: float, bx: float, by: float) -> bool:
    """Does the ground segment stay inside the city's rectangle and out of every building?"""
    if not (0.0 <= ax <= walls.width and 0.0 <= ay <= walls.height):
        return False
    if not (0.0 <= bx <= walls.width and 0.0 <= by <= walls.height):
        return False
    return line_of_sight(walls, ax, ay, 0.0, bx, by, 0.0)


@njit(cache=True, error_model="numpy")
def disc_clear(walls: Walls, x: float, y: float, radius: float) -> bool:
    """Does a disc on the ground fit: in the city's rectangle, and no wall nearer than its radius?"""
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
    edges = np.array([[1.0, 1.0, 2.0, 1.0, 1.0, SKIN, 0.0]])
    cells = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    buildings = np.array([[0.0, 1.0], [1.0, 0.0]])
    return Walls(3.0, 3.0, 1.0, 3.0, 1, 1, edges, cells, edges, buildings)


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
