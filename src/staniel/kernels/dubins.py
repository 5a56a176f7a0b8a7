"""Shortest paths of bounded curvature: the six Dubins words, in units of the turn radius.

Thesis eq. 5.45-5.64 with the corrections (all six words, east-north-up), in the normalised form of
Shkel and Lumelsky (2001): the start at the origin, the goal at distance d on the x axis, courses
a and b.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "LRL",
    "LSL",
    "LSR",
    "RLR",
    "RSL",
    "RSR",
    "lengths",
    "shortest",
    "shortest_length",
    "warm",
]

LSL, RSR, LSR, RSL, RLR, LRL = range(6)

_TWO_PI = 2.0 * math.pi
_TINY = 1e-12


@njit(cache=True, error_model="numpy", inline="always")
def _turn(angle: float) -> float:
    """Angle of a turn in [0, 2 pi); rounding just below a whole circle is no turn at all."""
    turn = angle - _TWO_PI * np.floor(angle / _TWO_PI)
    return 0.0 if turn > _TWO_PI - _TINY else turn


@njit(cache=True, error_model="numpy")
def shortest(
    x0: float, y0: float, course0: float, x1: float, y1: float, course1: float, radius: float
) -> tuple[float, int, float, float, float]:
    """Shortest path between two poses.

    Parameters
    ----------
    x0, y0, x1, y1 : float [m]
    course0, course1 : float [rad]
    radius : float [m]
        Of the tightest turn.

    Returns
    -------
    length : float [m]
    word : int
        One of the constants of this module.
    first, middle, last : float
        Turned angles [rad]; the middle of a word with a straight is its length over the radius.
    """
    dx, dy = x1 - x0, y1 - y0
    d = math.sqrt(dx * dx + dy * dy) / radius
    toward = math.atan2(dy, dx)
    a, b = course0 - toward, course1 - toward
    sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
    cab = math.cos(a - b)
    best, word, first, middle, last = np.inf, LSL, 0.0, 0.0, 0.0

    # Outer tangents: both turns the same way. Squares below zero are rounding of zero.
    heading = math.atan2(cb - ca, d + sa - sb)
    t, q = _turn(heading - a), _turn(b - heading)
    p = math.sqrt(max(0.0, 2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb)))
    if t + p + q < best:
        best, word, first, middle, last = t + p + q, LSL, t, p, q
    heading = math.atan2(ca - cb, d - sa + sb)
    t, q = _turn(a - heading), _turn(heading - b)
    p = math.sqrt(max(0.0, 2.0 + d * d - 2.0 * cab + 2.0 * d * (sb - sa)))
    if t + p + q < best:
        best, word, first, middle, last = t + p + q, RSR, t, p, q

    # Inner tangents exist when the circles do not overlap.
    square = d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb)
    if square >= 0.0:
        p = math.sqrt(square)
        heading = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
        t, q = _turn(heading - a), _turn(heading - b)
        if t + p + q < best:
            best, word, first, middle, last = t + p + q, LSR, t, p, q
    square = d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb)
    if square >= 0.0:
        p = math.sqrt(square)
        heading = math.atan2(ca + cb, d - sa - sb) - math.atan2(2.0, p)
        t, q = _turn(a - heading), _turn(b - heading)
        if t + p + q < best:
            best, word, first, middle, last = t + p + q, RSL, t, p, q

    # Three turns win only for close poses.
    cosine = (6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0
    if abs(cosine) <= 1.0:
        p = _TWO_PI - math.acos(cosine)
        t = _turn(a - math.atan2(ca - cb, d - sa + sb) + 0.5 * p)
        q = _turn(a - b - t + p)
        if t + p + q < best:
            best, word, first, middle, last = t + p + q, RLR, t, p, q
    cosine = (6.0 - d * d + 2.0 * cab - 2.0 * d * (sa - sb)) / 8.0
    if abs(cosine) <= 1.0:
        p = _TWO_PI - math.acos(cosine)
        t = _turn(-a + math.atan2(cb - ca, d + sa - sb) + 0.5 * p)
        q = _turn(b - a - t + p)
        if t + p + q < best:
            best, word, first, middle, last = t + p + q, LRL, t, p, q
    return best * radius, word, first, middle, last


@njit(cache=True, error_model="numpy")
def lengths(
    start: NDArray[np.float64], goals: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """Length of the shortest path from one pose to each of n goals.

    Parameters
    ----------
    start : (3,) float array
        x, y [m], course [rad].
    goals : (n, 3) float array
    radius : float [m]

    Returns
    -------
    (n,) float array [m]
    """
    out = np.empty(goals.shape[0])
    for i in range(goals.shape[0]):
        found = shortest(
            start[0], start[1], start[2], goals[i, 0], goals[i, 1], goals[i, 2], radius
        )
        out[i] = found[0]
    return out


@njit(cache=True, error_model="numpy")
def shortest_length(
    x0: float, y0: float, course0: float, x1: float, y1: float, course1: float, radius: float
) -> float:
    """Length of `shortest` alone [m]."""
    return shortest(x0, y0, course0, x1, y1, course1, radius)[0]


def warm() -> None:
    """Compile, or load from the cache, what a flight calls."""
    shortest_length(0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0)
    lengths(np.zeros(3), np.ones((1, 3)), 1.0)
