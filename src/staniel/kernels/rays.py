"""Line of sight of one segment: a walk through the grid of wall pieces."""

import math

from staniel.kernels.blocks import in_open, meets, ray_of
from staniel.kernels.pieces import SKIN, Walls, bare, hides, over, woven

__all__ = ["buried", "part", "sees"]


@woven
def part(
    walls: Walls,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
    per_dx: float,
    per_dy: float,
) -> tuple[float, float]:
    """Between which parameters the segment from a up to b can meet a wall; first > last for none.

    Where it is in the city's rectangle and below the tallest roof; 1 / dx and 1 / dy are given.
    """
    first, last = 0.0, min(1.0, (walls.tallest - az) / (bz - az)) if bz > az else 1.0
    if min(ax, bx) < 0.0 or max(ax, bx) > walls.width:
        t0, t1 = -ax * per_dx, (walls.width - ax) * per_dx
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    if min(ay, by) < 0.0 or max(ay, by) > walls.height:
        t0, t1 = -ay * per_dy, (walls.height - ay) * per_dy
        first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    return first, last


@woven
def _crosses(
    walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> bool:
    """Whether the segment from a up to b (az <= bz, not vertical) passes through a wall.

    From the low end, where a building in the way is most likely.
    """
    cell, nx, ny = walls.cell, walls.nx, walls.ny
    dx, dy, dz = bx - ax, by - ay, bz - az
    per_dx = 1.0 / dx if dx != 0.0 else math.inf
    per_dy = 1.0 / dy if dy != 0.0 else math.inf
    t, last = part(walls, ax, ay, az, bx, by, bz, per_dx, per_dy)
    if not t <= last:
        return False

    per_cell = 1.0 / cell
    i = min(max(int((ax + dx * t) * per_cell), 0), nx - 1)
    j = min(max(int((ay + dy * t) * per_cell), 0), ny - 1)
    c = j * nx + i
    # Per direction: cells left until the grid ends, the parameter of the next line, and of a cell.
    left_i = nx - i if dx > 0.0 else i + 1
    left_j = ny - j if dy > 0.0 else j + 1
    next_i = ((i + (dx > 0.0)) * cell - ax) * per_dx if dx != 0.0 else math.inf
    next_j = ((j + (dy > 0.0)) * cell - ay) * per_dy if dy != 0.0 else math.inf
    stride_i, stride_j = cell * abs(per_dx), cell * abs(per_dy)
    step_i, step_j = 1 if dx > 0.0 else -1, nx if dy > 0.0 else -nx
    move_x, move_y = cell if dx > 0.0 else -cell, cell if dy > 0.0 else -cell
    # The start seen from the cell.
    from_x, from_y = ax - i * cell, ay - j * cell
    test = ray_of(walls, dx, dy, dz, az)
    while True:
        hit, near = meets(walls, c, from_x, from_y, test)
        if hit:
            return True
        if near and hides(walls, c, t, min(next_i, next_j, last), ax, ay, az, dx, dy, dz):
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
def buried(walls: Walls, x: float, y: float, z: float) -> bool:
    """Whether the point is inside a building."""
    return not in_open(walls, x, y) and z < over(walls, x, y)[1] - SKIN


@woven
def sees(walls: Walls, ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> bool:
    """Line of sight; see `staniel.kernels.walls.line_of_sight`."""
    if az > bz:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
    if az >= walls.tallest:
        return True
    upright = abs(bx - ax) <= SKIN and abs(by - ay) <= SKIN
    if not upright and _crosses(walls, ax, ay, az, bx, by, bz):
        return False
    return not buried(walls, ax, ay, az)
