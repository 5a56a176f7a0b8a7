"""What one aircraft knows of the air around it: a window of square cells that moves along with it.

A building is upright: where a beam met a wall at some height, the building is there at every lower
height, too; where a beam passed, no building reaches above its height. So each cell keeps two
heights, the highest of the walls met and the lowest of the beams that passed, and what the chart
has there. The window is a torus: cell (i, j) of the plane lives at (i mod n, j mod n), and a cell
that falls out on one side is forgotten and comes in on the other.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.walls import Walls, inside, warm_walls

__all__ = ["Tops", "Window", "forget", "mark", "tops", "warm"]

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]

_TOUCHING = np.float32(0.3)
"""Heights nearer than this are one: what the altitude hold leaves open [m]."""


_PARTLY = 1.5
"""What nobody has looked at is grown by so many cells more than what stands there: a wall that
comes into sight may do so in a cell of which beams had passed another part. So it closes nothing
that was open."""


class Window(NamedTuple):
    """The cells, n by n; rows are east."""

    passed: Singles
    """Lowest height at which a beam passed above all walls met [m], infinite where none did."""
    met: Singles
    """Greatest height at which a beam met a wall [m], minus infinity where none did."""
    roof: Singles
    """What the chart has: the roof [m], minus infinity in the open and without a chart."""


class Tops(NamedTuple):
    """Below which height each cell around an aircraft cannot be entered, (n, n) [m]."""

    solid: Singles
    """For what is known to stand there, grown by the clearance."""
    closed: Singles
    """For that and for what nobody has looked at."""
    west: float
    """Of the first row's west side [m]."""
    south: float
    """Of the first column's south side [m]."""
    cell: float
    """Side of a cell [m]."""


@njit(cache=True, error_model="numpy")
def forget(
    window: Window,
    before: Ints,
    now: Ints,
    cell: float,
    walls: Walls,
    roofs: Floats,
    margin: float,
) -> None:
    """Move the window: what comes in is as the chart has it, and nobody has looked there.

    Parameters
    ----------
    window : Window
        Changed.
    before, now : (2,) int array
        Cell of the plane at the window's south-west corner.
    cell : float [m]
    walls : Walls
        Of the chart; a blank one has no building.
    roofs : (b,) float array [m]
        Of its buildings.
    margin : float [m]
        Height kept above them.
    """
    n = window.passed.shape[0]
    charted = roofs.shape[0] > 0
    for i in range(now[0], now[0] + n):
        kept = before[0] <= i < before[0] + n
        for j in range(now[1], now[1] + n):
            if kept and before[1] <= j < before[1] + n:
                continue
            a, b = i % n, j % n
            window.passed[a, b] = np.inf
            window.met[a, b] = -np.inf
            top = -np.inf
            if charted:
                for k in range(9):  # corners, middles of sides, middle
                    building = inside(
                        walls, (i + 0.5 * (k % 3)) * cell, (j + 0.5 * (k // 3)) * cell
                    )
                    if building >= 0:
                        top = max(top, roofs[building] + margin)
            window.roof[a, b] = top


@njit(cache=True, error_model="numpy")
def mark(
    window: Window,
    corner: Ints,
    cell: float,
    height: float,
    origins: Floats,
    directions: Floats,
    ranges: Floats,
    reach: float,
    sigma: float,
) -> None:
    """Enter a scan: where its beams passed, then which walls they met.

    Parameters
    ----------
    window : Window
        Changed.
    corner : (2,) int array
        Cell of the plane at its south-west corner.
    cell : float [m]
    height : float [m]
        Of the scan.
    origins : (b, 2) float array [m]
        Where each beam left.
    directions : (b,) float array [rad]
        Counter-clockwise from east.
    ranges : (b,) float array [m]
        Infinite where nothing came back.
    reach : float [m]
        How far a beam without a return is taken to have passed.
    sigma : float [m]
        Standard deviation of a range: the last 3 of them before a wall are left out.
    """
    n = window.passed.shape[0]
    low = np.float32(height)
    for k in range(ranges.shape[0]):
        cos, sin = math.cos(directions[k]), math.sin(directions[k])
        way = min(ranges[k] - 3.0 * sigma, reach)
        steps = int(2.0 * way / cell) + 1 if way > 0.0 else 0
        for step in range(steps):
            along = min(0.5 * step * cell, way)
            i = math.floor((origins[k, 0] + along * cos) / cell)
            j = math.floor((origins[k, 1] + along * sin) / cell)
            if not (0 <= i - corner[0] < n and 0 <= j - corner[1] < n):
                break
            a, b = i % n, j % n
            if low > window.met[a, b] + _TOUCHING:
                window.passed[a, b] = min(window.passed[a, b], low)
    for k in range(ranges.shape[0]):
        if math.isfinite(ranges[k]):
            i = math.floor((origins[k, 0] + ranges[k] * math.cos(directions[k])) / cell)
            j = math.floor((origins[k, 1] + ranges[k] * math.sin(directions[k])) / cell)
            if 0 <= i - corner[0] < n and 0 <= j - corner[1] < n:
                a, b = i % n, j % n
                window.met[a, b] = max(window.met[a, b], low)
                if window.passed[a, b] <= window.met[a, b] + _TOUCHING:
                    window.passed[a, b] = np.inf  # it passed in another part of the cell


@njit(cache=True, error_model="numpy")
def _grow(source: Singles, target: Singles, radius: float) -> None:
    """Raise each cell of `target` to the greatest of `source` within `radius` cells of it."""
    n = source.shape[0]
    most = int(radius)
    for di in range(-most, most + 1):
        for dj in range(-most, most + 1):
            if di * di + dj * dj > radius * radius:
                continue
            j0, j1 = max(0, -dj), min(n, n - dj)
            for i in range(max(0, -di), min(n, n - di)):
                row, other = target[i, j0:j1], source[i + di, j0 + dj : j1 + dj]
                for j in range(row.size):
                    row[j] = row[j] if row[j] >= other[j] else other[j]


@njit(cache=True, error_model="numpy")
def tops(
    window: Window,
    corner: Ints,
    cell: float,
    clearance: float,
    ceiling: float,
    blind: bool,
) -> Tops:
    """Where not to fly, and below which height.

    Parameters
    ----------
    window : Window
    corner : (2,) int array
        Cell of the plane at its south-west corner.
    cell : float [m]
    clearance : float [m]
        Kept from walls.
    ceiling : float [m]
        No building is higher, as far as the aircraft was told; may be infinite.
    blind : bool
        What nobody has looked at is closed.

    Returns
    -------
    Tops
    """
    n = window.passed.shape[0]
    known, unseen = np.empty((n, n), dtype=np.float32), np.empty((n, n), dtype=np.float32)
    high = np.float32(ceiling)
    for i in range(n):
        for j in range(n):
            a, b = (i + corner[0]) % n, (j + corner[1]) % n
            passed, met, top = window.passed[a, b], window.met[a, b], window.roof[a, b]
            if met > -np.inf:
                top = max(top, min(passed - _TOUCHING, high))
            known[i, j] = top
            over = np.float32(-np.inf)
            if blind:
                over = passed - _TOUCHING if passed < np.inf else high
            unseen[i, j] = max(top, min(over, high))
    radius = clearance / cell + 0.7  # a return is within 0.7 cells of the middle of its own
    solid, closed = known.copy(), unseen.copy()
    _grow(known, solid, radius)
    _grow(unseen, closed, radius + _PARTLY)
    return Tops(solid, closed, corner[0] * cell, corner[1] * cell, cell)


def warm() -> None:
    """Compile, or load from the disk cache, what this module is called with."""
    cells = [np.zeros((4, 4), dtype=np.float32) for _ in range(3)]
    window, corner, one = Window(*cells), np.zeros(2, dtype=np.int64), np.zeros(1)
    forget(window, corner, corner + 9, 1.0, warm_walls(), one, 1.0)
    mark(window, corner, 1.0, 1.0, np.zeros((1, 2)), one, one, 1.0, 0.1)
    tops(window, corner, 1.0, 1.0, 1.0, True)
