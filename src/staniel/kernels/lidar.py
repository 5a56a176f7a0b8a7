"""Level beams against the walls that reach above the aircraft: where each beam first enters one.

As for line of sight, touching is not entering: a beam that grazes a corner or runs along a wall to
within `SKIN` goes on. A beam that starts inside a building is stopped at once.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, normals
from staniel.kernels.walls import SKIN, Walls, inside, warm_walls

__all__ = ["Facades", "sweep", "warm"]

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]

_NEAR = 1e-3  # so near to a wall its angular extent is not trusted: every beam is tested [m]
_MARGIN = 1e-3  # beams tested beyond a wall's angular extent, in steps: far above rounding


class Facades(NamedTuple):
    """The walls of a city as seen from outside, sorted into the cells of a square grid.

    The grid covers the city's rectangle from the origin, row by row from the south. A wall stands
    in every cell that its bounding box touches.
    """

    tallest: float
    """Height of the tallest roof [m], 0 without buildings."""
    cell: float
    """Side of a grid cell [m]."""
    nx: int
    """Cells east."""
    ny: int
    """Cells north."""
    edges: Floats
    """(m, 5) the walls of each cell in turn: x0, y0, x1, y1, roof height [m]; the building's
    inside is on the left."""
    first: Ints
    """(nx * ny + 1,) where each cell's walls start."""
    roofs: Floats
    """(n,) roof height of each building [m]."""


@njit(cache=True, error_model="numpy")
def _clipped(x: float, cell: float, n: int) -> int:
    """Number of the column (or row) of cells that holds a coordinate; the nearest one outside."""
    return int(min(max(x / cell, 0.0), n - 1.0))


@njit(cache=True, error_model="numpy")
def _within(facades: Facades, x: float, y: float, z: float, reach: float) -> Ints:
    """Rows of the walls that reach above z and come within `reach`.

    A wall in several cells is taken in the first of them that is looked at: the one of its box's
    (and the search's) south-west corner.
    """
    edges, first, cell = facades.edges, facades.first, facades.cell
    i0, i1 = _clipped(x - reach, cell, facades.nx), _clipped(x + reach, cell, facades.nx)
    j0, j1 = _clipped(y - reach, cell, facades.ny), _clipped(y + reach, cell, facades.ny)
    most, count = 0, 0
    for j in range(j0, j1 + 1):
        most += first[j * facades.nx + i1 + 1] - first[j * facades.nx + i0]
    rows = np.empty(most, dtype=np.int64)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            c = j * facades.nx + i
            for k in range(first[c], first[c + 1]):
                if edges[k, 4] <= z:
                    continue
                x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
                if max(_clipped(min(x0, x1), cell, facades.nx), i0) != i:
                    continue
                if max(_clipped(min(y0, y1), cell, facades.ny), j0) != j:
                    continue
                ex, ey, ux, uy = x1 - x0, y1 - y0, x - x0, y - y0
                share = min(max((ux * ex + uy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
                if (ux - share * ex) ** 2 + (uy - share * ey) ** 2 > reach * reach:
                    continue
                rows[count] = k
                count += 1
    return rows[:count]


@njit(cache=True, error_model="numpy")
def _meet(
    ux: float, uy: float, vx: float, vy: float, dx: float, dy: float
) -> tuple[bool, float, float]:
    """Where the beam's line along the unit vector d meets the wall from u to v.

    Returns whether it passes clearly through the wall, and the distance [m]. Where it does not, the
    distances of the wall's ends that it touches, infinite for an end that it does not touch.
    """
    side_u, side_v = dx * uy - dy * ux, dx * vy - dy * vx
    if min(side_u, side_v) > SKIN or max(side_u, side_v) < -SKIN:
        return False, math.inf, math.inf
    touch_u, touch_v = abs(side_u) <= SKIN, abs(side_v) <= SKIN
    if touch_u or touch_v:
        return (
            False,
            ux * dx + uy * dy if touch_u else math.inf,
            vx * dx + vy * dy if touch_v else math.inf,
        )
    share = side_u / (side_u - side_v)
    px, py = ux + share * (vx - ux), uy + share * (vy - uy)
    return True, px * dx + py * dy, math.inf


@njit(cache=True, error_model="numpy")
def _through_corners(
    facades: Facades,
    walls: Walls,
    rows: Ints,
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    start: float,
    hit: float,
) -> float:
    """Where a beam first enters a building, when it touches a corner at `start` before `hit` [m].

    The slow way: between two neighbouring contacts the beam is wholly inside or outside of each
    building, so the middle decides.
    """
    edges = facades.edges
    while start < hit:
        end = hit
        for n in range(rows.size):
            k = rows[n]
            _, a, b = _meet(
                edges[k, 0] - x, edges[k, 1] - y, edges[k, 2] - x, edges[k, 3] - y, dx, dy
            )
            if start + SKIN < a < end:
                end = a
            if start + SKIN < b < end:
                end = b
        middle = 0.5 * (start + end)
        building = inside(walls, x + dx * middle, y + dy * middle)
        if building >= 0 and facades.roofs[building] > z:
            return max(start, 0.0)
        start = end
    return hit


@njit(cache=True, error_model="numpy")
def _first_hits(
    facades: Facades,
    walls: Walls,
    rows: Ints,
    x: float,
    y: float,
    z: float,
    heading: float,
    fan: Floats,
    step: float,
    reach: float,
    hits: Floats,
    touches: Floats,
) -> None:
    """Distance of the first wall along each beam from outside of every building, into `hits`.

    Each wall is tested against the beams in its angular extent only; walls that show their back
    are behind a front.
    """
    edges, beams = facades.edges, hits.size
    ahead_x, ahead_y = math.cos(heading), math.sin(heading)
    middle = 0.5 * (beams - 1)
    for b in range(beams):
        hits[b] = touches[b] = math.inf
    for n in range(rows.size):
        k = rows[n]
        # Both ends of the wall, ahead and to the left of the aircraft.
        wx, wy = edges[k, 0] - x, edges[k, 1] - y
        ux, uy = wx * ahead_x + wy * ahead_y, wy * ahead_x - wx * ahead_y
        wx, wy = edges[k, 2] - x, edges[k, 3] - y
        vx, vy = wx * ahead_x + wy * ahead_y, wy * ahead_x - wx * ahead_y
        ex, ey = vx - ux, vy - uy
        length = math.sqrt(ex * ex + ey * ey)
        off = (ux * vy - uy * vx) / length  # of the wall's line, positive where its back shows
        if off > SKIN:
            continue
        share = min(max(-(ux * ex + uy * ey) / (length * length), 0.0), 1.0)
        if (ux + share * ex) ** 2 + (uy + share * ey) ** 2 < _NEAR * _NEAR:
            right, left = -math.pi, math.pi
        else:
            right, left = math.atan2(vy, vx), math.atan2(uy, ux)
            if left < right:
                left += 2.0 * math.pi
        for turns in range(-1, 2):
            turned = 2.0 * math.pi * turns
            low = math.ceil((right + turned) / step + middle - _MARGIN)
            high = math.floor((left + turned) / step + middle + _MARGIN)
            for b in range(max(low, 0), min(high, beams - 1) + 1):
                crossed, near, far = _meet(ux, uy, vx, vy, fan[b, 0], fan[b, 1])
                if crossed:
                    # From a wall, beams also leave it without entering the building.
                    entering = off < -SKIN or ex * fan[b, 1] - ey * fan[b, 0] > 0.0
                    if entering and near >= -SKIN:
                        hits[b] = min(hits[b], max(near, 0.0))
                else:
                    if near >= -SKIN:
                        touches[b] = min(touches[b], near)
                    if far >= -SKIN:
                        touches[b] = min(touches[b], far)
    for b in range(beams):
        if touches[b] < min(hits[b], reach):
            dx = fan[b, 0] * ahead_x - fan[b, 1] * ahead_y
            dy = fan[b, 0] * ahead_y + fan[b, 1] * ahead_x
            most = min(hits[b], reach)
            hit = _through_corners(facades, walls, rows, x, y, z, dx, dy, touches[b], most)
            if hit < most:
                hits[b] = hit


@njit(cache=True, error_model="numpy")
def sweep(
    facades: Facades,
    walls: Walls,
    path: Floats,
    fan: Floats,
    step: float,
    reach: float,
    sigma: float,
    key: np.uint64,
    tick: int,
) -> Floats:
    """Measured ranges of all beams, of all aircraft, at all instants of a path.

    Parameters
    ----------
    facades : Facades
    walls : Walls
        Of the same city.
    path : (s, n, k) float array, k >= 4
        Instants, aircraft; x, y, z [m], heading [rad], and more that is not read.
    fan : (b, 2) float array
        Unit vectors of the beams, ahead and left, `step` apart and even to both sides of ahead.
    step : float [rad]
    reach : float [m]
        Maximum range.
    sigma : float [m]
        Standard deviation of a range.
    key : uint64
        With aircraft, tick, instant and beam it names every draw.
    tick : int

    Returns
    -------
    (s, n, b) float array [m]
        Not below 0; infinite where nothing is within reach. Noise may take one a little beyond.
    """
    instants, n, beams = path.shape[0], path.shape[1], fan.shape[0]
    ranges = np.empty((instants, n, beams))
    hits, touches = np.empty(beams), np.empty(beams)
    noise = np.empty(beams + beams % 2, dtype=np.float32)
    for s in range(instants):
        for i in range(n):
            x, y, z, heading = path[s, i, 0], path[s, i, 1], path[s, i, 2], path[s, i, 3]
            for b in range(beams):
                ranges[s, i, b] = math.inf
            if z >= facades.tallest:
                continue
            building = inside(walls, x, y)
            if building >= 0 and facades.roofs[building] > z:
                for b in range(beams):
                    hits[b] = 0.0
            else:
                rows = _within(facades, x, y, z, reach)
                if rows.size == 0:
                    continue
                _first_hits(facades, walls, rows, x, y, z, heading, fan, step, reach, hits, touches)
            normals(fold(fold(key, i), tick * instants + s), 0, noise)
            for b in range(beams):
                if hits[b] <= reach:
                    ranges[s, i, b] = max(hits[b] + sigma * noise[b], 0.0)
    return ranges


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    edges = np.array([[1.0, 1.0, 2.0, 1.0, 1.0]])
    facades = Facades(1.0, 3.0, 1, 1, edges, np.array([0, 1]), np.array([1.0]))
    fan = np.array([[1.0, 0.0]])
    sweep(facades, warm_walls(), np.zeros((1, 1, 6)), fan, 1.0, 9.0, 0.1, np.uint64(0), 0)
