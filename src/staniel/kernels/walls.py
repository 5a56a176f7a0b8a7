"""Line of sight and free space against extruded outlines, on a grid of wall pieces.

A building is the region inside its outline (holes are courtyards) below its roof. Touching it is
not entering it: a wall, an edge, a corner or a roof that is only touched neither hides nor hits.
The tests are exact to `SKIN`: what enters a building by less than a nanometre counts as touching.

Each cell's walls are kept twice. In float32, as whole blocks of `LANES` relative to the cell, they
are tried all at once without a branch, and each test says yes, no, or too near to call, by bounds
on its own rounding. What is too near is decided in float64 on the cell's `pieces`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.pieces import (
    BEGIN,
    BUILT,
    END,
    LANES,
    ROW,
    SKIN,
    Walls,
    bare,
    hides,
    over,
    woven,
)

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

_ZERO = np.float32(0.0)
_SINGLE = 2e-6
"""What float32 may round a cross product by, relative to its factors: 33 units of its last place,
where the sum of all roundings from the stored numbers on is 11 at most."""


@bare
def _in_open(walls: Walls, x: float, y: float) -> bool:
    """Whether the point is certainly in no building; False where it takes a closer look.

    The walk of `over` along a cell's blocks. A point is in one building at most, so the parity of
    all crossings is enough.
    """
    if not (0.0 <= x <= walls.width and 0.0 <= y <= walls.height):
        return True
    blocks, cell = walls.blocks, walls.cell
    i = min(int(x / cell), walls.nx - 1)
    j = min(int(y / cell), walls.ny - 1)
    px, py = np.float32(x - i * cell), np.float32(y - j * cell)
    near = np.float32(_SINGLE * (cell + walls.span))
    reach = np.float32(2.0 * _SINGLE * walls.span * (cell + walls.span))
    k = j * walls.nx + i
    following, end = int(blocks[k, BEGIN]), int(blocks[k, END])
    odd, unsure = blocks[k, BUILT] > _ZERO, False
    while True:
        for lane in range(LANES):
            x0, y0 = blocks[k, lane], blocks[k, LANES + lane]
            ex, ey = blocks[k, 2 * LANES + lane], blocks[k, 3 * LANES + lane]
            x1, y1, over = x0 + ex, y0 + ey, py - y0
            side_point, side_bend = ex * over - ey * (px - x0), ex * over + ey * x0
            side_corner = ey * x0 - ex * y0
            bend = side_bend > _ZERO
            odd ^= ((y0 <= py) ^ (y1 <= py)) & (bend ^ (side_point > _ZERO))
            odd ^= ((x0 <= _ZERO) ^ (x1 <= _ZERO)) & (bend ^ (side_corner > _ZERO))
            unsure |= min(abs(over), abs(y1 - py), abs(x0), abs(x1)) <= near
            unsure |= min(abs(side_point), abs(side_bend), abs(side_corner)) <= reach
        if following >= end:
            break
        k = following
        following += 1
    return not (odd | unsure)


@bare
def inside(walls: Walls, x: float, y: float) -> int:
    """Index of the building whose interior holds the point, -1 in the open or on a wall."""
    return -1 if _in_open(walls, x, y) else over(walls, x, y)[0]


@woven
def _crosses(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Whether the segment from a up to b (az <= bz, not vertical) passes through a wall.

    Walks the grid cells under the part of the segment that is inside the city's rectangle and below
    the tallest roof, from the low end, where a building in the way is most likely.
    """
    blocks, cell, nx, ny = walls.blocks, walls.cell, walls.nx, walls.ny
    dx, dy, dz = bx - ax, by - ay, bz - az
    per_dx = 1.0 / dx if dx != 0.0 else math.inf
    per_dy = 1.0 / dy if dy != 0.0 else math.inf
    first, last = 0.0, min(1.0, (walls.tallest - az) / dz) if dz > 0.0 else 1.0
    if min(ax, bx) < 0.0 or max(ax, bx) > walls.width:
        t0, t1 = -ax * per_dx, (walls.width - ax) * per_dx
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    if min(ay, by) < 0.0 or max(ay, by) > walls.height:
        t0, t1 = -ay * per_dy, (walls.height - ay) * per_dy
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    if not first <= last:
        return False

    per_cell = 1.0 / cell
    i = min(max(int((ax + dx * first) * per_cell), 0), nx - 1)
    j = min(max(int((ay + dy * first) * per_cell), 0), ny - 1)
    # Per direction: cells left until the grid ends, the parameter of the next line, and of a cell.
    left_i = nx - i if dx > 0.0 else i + 1
    left_j = ny - j if dy > 0.0 else j + 1
    next_i = ((i + (dx > 0.0)) * cell - ax) * per_dx if dx != 0.0 else math.inf
    next_j = ((j + (dy > 0.0)) * cell - ay) * per_dy if dy != 0.0 else math.inf
    stride_i, stride_j = cell * abs(per_dx), cell * abs(per_dy)
    step_i, step_j = 1 if dx > 0.0 else -1, nx if dy > 0.0 else -nx
    move_x, move_y = cell if dx > 0.0 else -cell, cell if dy > 0.0 else -cell
    # The start seen from the cell, and bounds of the roundings: of twice the side on which a corner
    # or an end is, of a height, and of a height times a side.
    from_x, from_y = ax - i * cell, ay - j * cell
    fx, fy, fz, low = np.float32(dx), np.float32(dy), np.float32(dz), np.float32(az)
    length, climb = abs(fx) + abs(fy), np.float32(walls.tallest) + abs(low)
    span = np.float32(walls.span)
    size = np.float32(_SINGLE) * (length + np.float32(cell) + span) + np.float32(SKIN)
    far = np.float32(2.0) * span * size
    edge, twist = np.float32(2.0) * (far + length * size), climb * length * size + far * fz
    slack = np.float32(_SINGLE) * (climb + fz) + np.float32(2.0 * SKIN)
    c = j * nx + i
    t = first
    while True:
        ox, oy = np.float32(from_x), np.float32(from_y)
        k, following, end = c, int(blocks[np.uintp(c), BEGIN]), int(blocks[np.uintp(c), END])
        hit, clear = False, True
        while True:
            row = np.uintp(k)
            for lane in range(LANES):
                ux, uy = blocks[row, lane] - ox, blocks[row, LANES + lane] - oy
                ex, ey = blocks[row, 2 * LANES + lane], blocks[row, 3 * LANES + lane]
                # On the line, side_u = 0 and side_u + turn = 0 are the wall's ends, side_a = 0 and
                # side_a = turn the ray's: both must be between, where |2 side -+ turn| < |turn|.
                side_u, turn = fx * uy - fy * ux, fx * ey - fy * ex
                across, side_a = abs(turn), ey * ux - ex * uy
                room = blocks[row, 4 * LANES + lane] - low
                above, doubt = side_a * fz - room * turn, slack * across + twist
                above = above if turn > _ZERO else -above
                off = max(abs(side_u + side_u + turn), abs(side_a + side_a - turn))
                hit |= (off < across - edge) & (above < -doubt)
                # Not a number is unsure, too.
                clear &= (off > across + edge) | (above > doubt)
            if following >= end:
                break
            k = following
            following += 1
        if hit:
            return True
        if not clear and hides(walls, c, t, min(next_i, next_j, last), ax, ay, az, dx, dy, dz):
            return True
        east = next_i < next_j
        t = next_i if east else next_j
        c += step_i if east else step_j
        from_x -= move_x if east else 0.0
        from_y -= 0.0 if east else move_y
        next_i += stride_i if east else 0.0
        next_j += 0.0 if east else stride_j
        left_i -= 1 if east else 0
        left_j -= 0 if east else 1
        if (t > last) | (left_i == 0) | (left_j == 0):
            return False


@bare
def _buried(walls: Walls, x: float, y: float, z: float) -> bool:
    """Whether the point is inside a building."""
    return not _in_open(walls, x, y) and z < over(walls, x, y)[1] - SKIN


@woven
def _sees(walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> bool:
    """Line of sight; see `line_of_sight`."""
    if az > bz:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
    if az >= walls.tallest:
        return True
    upright = abs(bx - ax) <= SKIN and abs(by - ay) <= SKIN
    if not upright and _crosses(walls, ax, ay, az, bx, by, bz):
        return False
    return not _buried(walls, ax, ay, az)


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
    return _sees(walls, ax, ay, az, bx, by, bz)


@bare
def _see(walls: Walls, a: Floats, step: int, b: Floats, visible: Bools) -> None:
    """Set ``visible[r, k]`` to the line of sight between ``a[r + step * k]`` and ``b[k]``."""
    for r in range(visible.shape[0]):
        for k in range(visible.shape[1]):
            o = r + step * k
            visible[r, k] = _sees(walls, a[o, 0], a[o, 1], a[o, 2], b[k, 0], b[k, 1], b[k, 2])


def visible_matrix(walls: Walls, observers: Floats, points: Floats) -> Bools:
    """(n, m) line of sight from each of n observers (n, 3) to each of m points (m, 3) [m]."""
    visible = np.empty((len(observers), len(points)), dtype=np.bool_)
    _see(walls, observers, 0, points, visible)
    return visible


def visible_pairs(walls: Walls, a: Floats, b: Floats) -> Bools:
    """(n,) line of sight between a[k] and b[k], both (n, 3) [m]."""
    visible = np.empty((1, len(b)), dtype=np.bool_)
    _see(walls, a, 1, b, visible)
    seen: Bools = visible[0]
    return seen


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
