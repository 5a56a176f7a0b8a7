"""The quick tests of the sight kernels: a cell's walls in float32, a block at a time, no branch.

Each test says yes, no, or too near to call, by bounds on its own rounding. What is too near is
decided in float64 on the cell's `pieces`.
"""

from typing import NamedTuple

import numpy as np

from staniel.kernels.pieces import BEGIN, BUILT, END, LANES, SKIN, Walls, bare, fused

__all__ = ["Ray", "in_open", "meets", "ray_of"]

_ZERO = np.float32(0.0)
_SINGLE = 2e-6
"""What float32 may round a cross product by, relative to its factors: 33 units of its last place,
where the sum of all roundings from the stored numbers on is 11 at most."""


class Ray(NamedTuple):
    """A segment from its low end up, in float32, and how far its tests may be off."""

    x: np.float32
    """East from the low end to the high one [m]."""
    y: np.float32
    """North [m]."""
    z: np.float32
    """Up [m]."""
    low: np.float32
    """Height of the low end [m]."""
    edge: np.float32
    """Bound of the error of twice the side on which a wall's end, or the ray's, is [m^2]."""
    twist: np.float32
    """Bound of the error of a height times a side [m^3], by that of the side."""
    slack: np.float32
    """The same by that of the height, for each unit of the side [m]."""


@fused
def ray_of(walls: Walls, dx: float, dy: float, dz: float, low: float) -> Ray:
    """The ray from a point at the height `low` along (dx, dy, dz), dz >= 0."""
    x, y, z, bottom = np.float32(dx), np.float32(dy), np.float32(dz), np.float32(low)
    span, single = np.float32(walls.span), np.float32(_SINGLE)
    length, climb = abs(x) + abs(y), np.float32(walls.tallest) + abs(bottom)
    size = single * (length + np.float32(walls.cell) + span) + np.float32(SKIN)
    far = np.float32(2.0) * span * size
    edge = np.float32(2.0) * (far + length * size)
    twist = climb * length * size + far * z
    slack = single * (climb + z) + np.float32(2.0 * SKIN)
    return Ray(x, y, z, bottom, edge, twist, slack)


@fused
def meets(walls: Walls, c: int, from_x: float, from_y: float, ray: Ray) -> tuple[bool, bool]:
    """Whether a ray certainly passes through a wall of cell `c`, and whether one is too near to it.

    The ray starts at (from_x, from_y) seen from the cell's south-west corner.
    """
    blocks = walls.blocks
    ox, oy = np.float32(from_x), np.float32(from_y)
    row = np.uintp(c)
    following, end = int(blocks[row, BEGIN]), int(blocks[row, END])
    hit, near = False, False
    while True:
        hit_here, near_here = False, False
        for lane in range(LANES):
            ux, uy = blocks[row, lane] - ox, blocks[row, LANES + lane] - oy
            ex, ey = blocks[row, 2 * LANES + lane], blocks[row, 3 * LANES + lane]
            # On the line, side_u = 0 and side_u + turn = 0 are the wall's ends, side_a = 0 and
            # side_a = turn the ray's: both must be between, where |2 side -+ turn| < |turn|.
            side_u, turn = ray.x * uy - ray.y * ux, ray.x * ey - ray.y * ex
            across, side_a = abs(turn), ey * ux - ex * uy
            room = blocks[row, 4 * LANES + lane] - ray.low
            above, doubt = side_a * ray.z - room * turn, ray.slack * across + ray.twist
            above = above if turn > _ZERO else -above
            off = max(abs(side_u + side_u + turn), abs(side_a + side_a - turn)) - across
            enters = (off < -ray.edge) & (above < -doubt)
            hit_here |= enters
            # Not a number is too near, too.
            near_here |= not (enters | (off > ray.edge) | (above > doubt))
        hit |= hit_here
        near |= near_here
        if following >= end:
            return hit, near
        row = np.uintp(following)
        following += 1


@bare
def in_open(walls: Walls, x: float, y: float) -> bool:
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
    row = np.uintp(j * walls.nx + i)
    following, end = int(blocks[row, BEGIN]), int(blocks[row, END])
    odd, unsure = blocks[row, BUILT] > _ZERO, False
    while True:
        odd_here, unsure_here = False, False
        for lane in range(LANES):
            x0, y0 = blocks[row, lane], blocks[row, LANES + lane]
            ex, ey = blocks[row, 2 * LANES + lane], blocks[row, 3 * LANES + lane]
            x1, y1, over = x0 + ex, y0 + ey, py - y0
            side_point, side_bend = ex * over - ey * (px - x0), ex * over + ey * x0
            side_corner = ey * x0 - ex * y0
            bend = side_bend > _ZERO
            odd_here ^= ((y0 <= py) ^ (y1 <= py)) & (bend ^ (side_point > _ZERO))
            odd_here ^= ((x0 <= _ZERO) ^ (x1 <= _ZERO)) & (bend ^ (side_corner > _ZERO))
            unsure_here |= min(abs(over), abs(y1 - py), abs(x0), abs(x1)) <= near
            unsure_here |= min(abs(side_point), abs(side_bend), abs(side_corner)) <= reach
        odd ^= odd_here
        unsure |= unsure_here
        if following >= end:
            return not (odd | unsure)
        row = np.uintp(following)
        following += 1
