"""Line of sight of many segments at once: volleys of rays that walk the grid in step.

A ray that walks alone stops after a number of cells that no processor foresees, and each wrong
guess costs as much as the tests of a cell. In a volley all rays try their first cell, those that
are left their second, and so on, with no branch on what a ray meets. One that comes too near to a
wall to tell walks again, alone.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.blocks import Ray, meets, ray_of
from staniel.kernels.pieces import SKIN, Walls, bare
from staniel.kernels.rays import buried, part, sees

__all__ = ["visible_matrix", "visible_pairs"]

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Marks = NDArray[np.uint8]
Bools = NDArray[np.bool_]

_SIZE = 128
"""Rays of a volley: with all that a walk needs of them they fit the first cache."""

# What is kept of the rays, by where each row of `_SIZE` numbers begins. In float64, by axis: the
# low end, the high end, the parameter per metre, where the next line of the grid is from a cell's
# corner; the last parameter; and the cell, in whole numbers, which is all that a walk changes.
_AX, _AY, _AZ, _BX, _BY, _BZ, _PER_X, _PER_Y, _AHEAD_X, _AHEAD_Y, _LAST, _I, _J, _ROWS = (
    np.uintp(_SIZE * k) for k in range(14)
)
# In float32, the numbers of a `Ray`.
_X, _Y, _Z, _LOW, _EDGE, _TWIST, _SLACK, _TESTS = (np.uintp(_SIZE * k) for k in range(8))

_PASSED, _HIDDEN, _NEAR = 0, 1, 2
"""A ray's fate: it met no wall yet; it met one, or came too near to one to tell, or both."""


@bare
def _take(a: Floats, b: Floats, o: int, k: int, step: int, n: int, rays: Floats) -> None:
    """Rows of both ends of n segments: from a[o] to b[k], from a[o + step] to b[k + 1], ..."""
    for s in range(np.uintp(n)):
        if k == len(b):
            o, k = o + 1, 0
        rays[_AX + s], rays[_AY + s] = a[np.uintp(o), 0], a[np.uintp(o), 1]
        rays[_BX + s], rays[_BY + s] = b[np.uintp(k), 0], b[np.uintp(k), 1]
        rays[_AZ + s], rays[_BZ + s] = a[np.uintp(o), 2], b[np.uintp(k), 2]
        o, k = o + step, k + 1


@bare
def _set_out(walls: Walls, n: int, rays: Floats, tests: Singles, on_way: Marks) -> int:
    """Put each ray's low end first, and it into its first cell; how many walk, first `on_way`."""
    cell, per_cell = walls.cell, 1.0 / walls.cell
    for s in range(np.uintp(n)):
        ax, ay, az = rays[_AX + s], rays[_AY + s], rays[_AZ + s]
        bx, by, bz = rays[_BX + s], rays[_BY + s], rays[_BZ + s]
        up = az <= bz
        ax, bx = ax if up else bx, bx if up else ax
        ay, by = ay if up else by, by if up else ay
        az, bz = min(az, bz), max(az, bz)
        rays[_AX + s], rays[_AY + s], rays[_AZ + s] = ax, ay, az
        rays[_BX + s], rays[_BY + s], rays[_BZ + s] = bx, by, bz

        dx, dy = bx - ax, by - ay
        per_dx = 1.0 / dx if dx != 0.0 else math.inf
        per_dy = 1.0 / dy if dy != 0.0 else math.inf
        first, last = part(walls, ax, ay, az, bx, by, bz, per_dx, per_dy)
        walks = (first <= last) & (az < walls.tallest) & (max(abs(dx), abs(dy)) > SKIN)
        rays[_PER_X + s], rays[_PER_Y + s] = per_dx, per_dy
        rays[_AHEAD_X + s] = cell if dx > 0.0 else (0.0 if dx < 0.0 else math.inf)
        rays[_AHEAD_Y + s] = cell if dy > 0.0 else (0.0 if dy < 0.0 else math.inf)
        rays[_LAST + s] = last if walks else -1.0
        i, j = (ax + dx * first) * per_cell, (ay + dy * first) * per_cell
        rays[_I + s] = math.floor(min(max(i, 0.0), walls.nx - 1.0))
        rays[_J + s] = math.floor(min(max(j, 0.0), walls.ny - 1.0))
        test = ray_of(walls, dx, dy, bz - az, az)
        tests[_X + s], tests[_Y + s], tests[_Z + s], tests[_LOW + s] = test[:4]
        tests[_EDGE + s], tests[_TWIST + s], tests[_SLACK + s] = test[4:]
    left = 0
    for s in range(np.uintp(n)):
        on_way[np.uintp(left)] = s
        left += 1 if rays[_LAST + s] >= 0.0 else 0
    return left


@bare
def _advance(
    walls: Walls, n: int, on_way: Marks, rays: Floats, tests: Singles, fates: Marks
) -> int:
    """Try the cell of each of the first n rays `on_way`; how many go on, now its first ones."""
    cell, nx, ny = walls.cell, walls.nx, walls.ny
    left = 0
    for k in range(np.uintp(n)):
        s = np.uintp(on_way[k])
        i, j = rays[_I + s], rays[_J + s]
        from_x, from_y = rays[_AX + s] - i * cell, rays[_AY + s] - j * cell
        x, y, z, low = tests[_X + s], tests[_Y + s], tests[_Z + s], tests[_LOW + s]
        test = Ray(x, y, z, low, tests[_EDGE + s], tests[_TWIST + s], tests[_SLACK + s])
        hit, near = meets(walls, int(j * nx + i), from_x, from_y, test)
        fate = _HIDDEN * hit + _NEAR * near
        fates[s] = fate

        per_dx, per_dy = rays[_PER_X + s], rays[_PER_Y + s]
        next_i = (rays[_AHEAD_X + s] - from_x) * per_dx
        next_j = (rays[_AHEAD_Y + s] - from_y) * per_dy
        # A choice would become a branch that is guessed wrong; the sign of a 0 or 1 does not.
        east = 1.0 if next_i < next_j else 0.0
        i, j = i + math.copysign(east, per_dx), j + math.copysign(1.0 - east, per_dy)
        rays[_I + s], rays[_J + s] = i, j
        goes_on = (fate == _PASSED) & (min(next_i, next_j) <= rays[_LAST + s])
        goes_on &= (i >= 0.0) & (i < nx) & (j >= 0.0) & (j < ny)
        on_way[np.uintp(left)] = s
        left += 1 if goes_on else 0
    return left


@bare
def _settle(walls: Walls, n: int, on_way: Marks, rays: Floats, fates: Marks, seen: Bools) -> None:
    """Line of sight of n rays at the end of their ways."""
    left = 0
    for k in range(np.uintp(n)):
        seen[k] = fates[k] == _PASSED
        on_way[np.uintp(left)] = k
        left += 1 if fates[k] != _HIDDEN else 0
    for k in range(np.uintp(left)):
        s = np.uintp(on_way[k])
        ax, ay, az = rays[_AX + s], rays[_AY + s], rays[_AZ + s]
        if fates[s] == _PASSED:
            seen[s] = not buried(walls, ax, ay, az)
        else:
            seen[s] = sees(walls, ax, ay, az, rays[_BX + s], rays[_BY + s], rays[_BZ + s])


@njit(cache=True, error_model="numpy")
def _see(walls: Walls, a: Floats, step: int, b: Floats, n: int) -> Bools:
    """(n,) line of sight between ``a[r + step * k]`` and ``b[k]`` at ``r * len(b) + k``."""
    rays, tests = np.empty(_ROWS), np.empty(_TESTS, dtype=np.float32)
    on_way, fates = np.empty(_SIZE, dtype=np.uint8), np.empty(_SIZE, dtype=np.uint8)
    visible = np.empty(n, dtype=np.bool_)
    for start in range(0, n, _SIZE):
        size = min(_SIZE, n - start)
        r = start // len(b)
        k = start - r * len(b)
        _take(a, b, r + step * k, k, step, size, rays)
        fates[:] = _PASSED
        left = _set_out(walls, size, rays, tests, on_way)
        while left > 0:
            left = _advance(walls, left, on_way, rays, tests, fates)
        _settle(walls, size, on_way, rays, fates, visible[start : start + size])
    return visible


def visible_matrix(walls: Walls, observers: Floats, points: Floats) -> Bools:
    """(n, m) line of sight from each of n observers (n, 3) to each of m points (m, 3) [m]."""
    n, m = len(observers), len(points)
    visible: Bools = _see(walls, observers, 0, points, n * m).reshape(n, m)
    return visible


def visible_pairs(walls: Walls, a: Floats, b: Floats) -> Bools:
    """(n,) line of sight between a[k] and b[k], both (n, 3) [m]."""
    visible: Bools = _see(walls, a, 1, b, len(b))
    return visible
