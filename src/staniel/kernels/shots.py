"""Dubins paths to a pose or to a place, and what they cost among cells.

A path is three pieces, of which the outer ones turn and the middle one turns or goes straight: the
words of `staniel.kernels.dubins`. To a place the last piece is empty and the course there is free.
"""

import math

import numpy as np
from numba import njit

from staniel.kernels.cells import Cells, advanced, piece_cost, warm_cells
from staniel.kernels.dubins import LRL, LSL, RLR, RSR, shortest

__all__ = ["TURNS", "shot", "shot_cost", "to_place", "warm"]

_TWO_PI = 2.0 * math.pi
_TINY = 1e-12
_SAME = 1e-9  # poses nearer than that, in radii, are the same

TURNS = np.array(
    [[1, 0, 1], [-1, 0, -1], [1, 0, -1], [-1, 0, 1], [-1, 1, -1], [1, -1, 1]], dtype=np.int64
)
"""(6, 3) which way each piece of each word turns, +1 left; by the numbers of the words."""

Found = tuple[float, int, float, float, float]


@njit(cache=True, error_model="numpy")
def _turn(angle: float) -> float:
    """Angle of a turn in [0, 2 pi); rounding just below a whole circle is no turn at all."""
    turn = angle - _TWO_PI * math.floor(angle / _TWO_PI)
    return 0.0 if turn > _TWO_PI - _TINY else turn


@njit(cache=True, error_model="numpy")
def _turn_then_straight(u: float, v: float) -> tuple[float, float]:
    """Left turn and straight, in radii, to (u ahead, v left); infinite inside the left circle."""
    square = u * u + (v - 1.0) * (v - 1.0) - 1.0
    if square < -_TINY:
        return math.inf, math.inf
    straight = math.sqrt(max(square, 0.0))
    return _turn(math.atan2(v - 1.0, u) + math.atan2(1.0, straight)), straight


@njit(cache=True, error_model="numpy")
def _turn_then_back(u: float, v: float) -> tuple[float, float]:
    """Right turn and left turn, in radii, to (u ahead, v left); infinite if too near or too far."""
    du, dv = u, v + 1.0  # from the right circle's center
    d = math.sqrt(du * du + dv * dv)
    best, first, second = math.inf, math.inf, math.inf
    if d < 1.0 or d > 3.0:
        return first, second
    toward = math.atan2(dv, du)
    aside = math.acos(min(max((d * d + 3.0) / (4.0 * d), -1.0), 1.0))
    for side in (-1.0, 1.0):
        beta = toward + side * aside  # of the second circle's center
        right = _turn(0.5 * math.pi - beta)
        left = _turn(
            math.atan2(dv - 2.0 * math.sin(beta), du - 2.0 * math.cos(beta)) - beta - math.pi
        )
        if right + left < best:
            best, first, second = right + left, right, left
    return first, second


@njit(cache=True, error_model="numpy")
def to_place(
    x0: float, y0: float, course0: float, x1: float, y1: float, radius: float
) -> tuple[float, int, float, float, float]:
    """Shortest path from a pose to a place where the course is free.

    Parameters
    ----------
    x0, y0, x1, y1 : float [m]
    course0 : float [rad]
    radius : float [m]
        Of the tightest turn.

    Returns
    -------
    length, word, first, middle, last
        Length of the path [m], its word, and its pieces in radii, of which the last is 0.

    Notes
    -----
    A turn and a straight, or two turns, which win where the place is inside a turning circle
    (Bui, Boissonnat, Souères and Laumond 1994).
    """
    dx, dy = (x1 - x0) / radius, (y1 - y0) / radius
    sin, cos = math.sin(course0), math.cos(course0)
    u, v = dx * cos + dy * sin, dy * cos - dx * sin
    best, word, first, middle = math.inf, LSL, 0.0, 0.0
    t, p = _turn_then_straight(u, v)
    if t + p < best:
        best, word, first, middle = t + p, LSL, t, p
    t, p = _turn_then_straight(u, -v)
    if t + p < best:
        best, word, first, middle = t + p, RSR, t, p
    t, p = _turn_then_back(u, v)
    if t + p < best:
        best, word, first, middle = t + p, RLR, t, p
    t, p = _turn_then_back(u, -v)
    if t + p < best:
        best, word, first, middle = t + p, LRL, t, p
    return best * radius, word, first, middle, 0.0


@njit(cache=True, error_model="numpy")
def _on_circle(
    x0: float, y0: float, course0: float, x1: float, y1: float, course1: float, radius: float
) -> float:
    """Angle of the one turn that leads from pose to pose, left positive; 0 where none does."""
    turned = course1 - course0
    turned -= _TWO_PI * math.floor(turned / _TWO_PI + 0.5)
    dx, dy = (x1 - x0) / radius, (y1 - y0) / radius
    chord = 2.0 * abs(math.sin(0.5 * turned))
    if abs(dx * dx + dy * dy - chord * chord) > _SAME:
        return 0.0
    for side in (1.0, -1.0):
        ax = side * (math.sin(course1) - math.sin(course0))
        ay = side * (math.cos(course0) - math.cos(course1))
        if abs(ax - dx) + abs(ay - dy) < _SAME:
            return side * _turn(side * turned)
    return 0.0


@njit(cache=True, error_model="numpy")
def shot(
    x0: float, y0: float, course0: float, x1: float, y1: float, course1: float, radius: float
) -> tuple[float, int, float, float, float]:
    """The shortest path to a pose, or to a place where `course1` is not a number.

    Along one turning circle the words of two turns with nothing in between are degenerate: rounding
    may add a whole circle to them. That case is told apart.
    """
    if math.isnan(course1):
        return to_place(x0, y0, course0, x1, y1, radius)
    turned = _on_circle(x0, y0, course0, x1, y1, course1, radius)
    if turned != 0.0:
        return radius * abs(turned), LSL if turned > 0.0 else RSR, abs(turned), 0.0, 0.0
    start, goal = np.empty((1, 3)), np.empty((1, 3))
    start[0, 0], start[0, 1], start[0, 2] = x0, y0, course0
    goal[0, 0], goal[0, 1], goal[0, 2] = x1, y1, course1
    lengths, words, pieces = shortest(start, goal, radius)
    first, middle, last = pieces[0] / radius
    return lengths[0], words[0], first, middle, last


@njit(cache=True, error_model="numpy")
def shot_cost(
    cells: Cells,
    x: float,
    y: float,
    course: float,
    word: int,
    first: float,
    middle: float,
    last: float,
    radius: float,
) -> float:
    """Cost of a path that `shot` found; infinite where it touches what is blocked."""
    total = 0.0
    for k in range(3):
        bend = TURNS[word, k] / radius
        length = radius * (first if k == 0 else middle if k == 1 else last)
        if length > 0.0:
            total += piece_cost(cells, x, y, course, bend, length)
            if total == math.inf:
                return math.inf
            x, y, course = advanced(x, y, course, bend, length)
    return total


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    to_place(0.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    shot(0.0, 0.0, 0.0, 1.0, 0.0, math.nan, 1.0)
    shot_cost(warm_cells(), 0.5, 0.5, 0.0, 0, 0.0, 1.0, 0.0, 1.0)
