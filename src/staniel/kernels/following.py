"""Rival laws that follow lines and orbits: the course over ground that each asks for.

Courses are over ground, so wind does not enter; whoever flies them adds the wind triangle. An
autopilot turns them into a rate of the course, `line_rate` and `orbit_rate`, with its one gain k.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "CARROT",
    "FOLLOWERS",
    "VECTOR_FIELD",
    "carrot_line",
    "carrot_line_courses",
    "carrot_orbit",
    "carrot_orbit_courses",
    "field_line",
    "field_line_courses",
    "field_orbit",
    "field_orbit_courses",
    "line_rate",
    "orbit_rate",
    "warm",
    "wrapped",
]

Array = NDArray[np.float64]

CARROT, VECTOR_FIELD = 0, 1
FOLLOWERS = {"carrot": CARROT, "vector-field": VECTOR_FIELD}
"""Numbers of the laws, by the names that scenarios use."""

_TWO_PI = 2.0 * math.pi
_HALF_PI = 0.5 * math.pi


@njit(cache=True, error_model="numpy")
def wrapped(angle: float) -> float:
    """Angle in (-pi, pi]."""
    inside = angle - _TWO_PI * math.ceil((angle - math.pi) / _TWO_PI)
    # Rounding may leave the quotient a hair off a whole number.
    return math.pi if inside <= -math.pi else inside


# Where to: courses over ground, not wrapped.


@njit(cache=True, error_model="numpy")
def carrot_line(
    x: float,
    y: float,
    start_x: float,
    start_y: float,
    along_x: float,
    along_y: float,
    lookahead: float,
) -> float:
    """Towards the carrot, `lookahead` beyond the foot of the perpendicular (alg. 5.3, corrected).

    (along_x, along_y) is a unit vector, or none: then the carrot stays at the start.
    """
    if along_x == 0.0 and along_y == 0.0:
        ahead = 0.0
    else:
        ahead = (x - start_x) * along_x + (y - start_y) * along_y + lookahead
    carrot_x, carrot_y = start_x + ahead * along_x, start_y + ahead * along_y
    course: float = math.atan2(carrot_y - y, carrot_x - x)
    return course


@njit(cache=True, error_model="numpy")
def carrot_orbit(
    x: float, y: float, radius: float, turn: float, half: float
) -> tuple[float, float]:
    r"""Towards the carrot on the circle (alg. 5.3, corrected); also off the outward radius.

    (x, y) is the place seen from the center. The carrot runs a look-ahead angle
    :math:`\lambda = 2` `half` ahead. From a place on the circle it lies :math:`\lambda/2` inside
    the tangent, so that much is taken off the course again (fading with r/D outside, where it would
    spoil the approach): no standing error of the radius. The second angle is the course against the
    outward radius, for a counter-clockwise orbit.
    """
    distance = math.hypot(x, y)
    aside = math.atan2(radius * math.sin(2.0 * half), radius * math.cos(2.0 * half) - distance)
    aside -= half * radius / max(distance, radius)
    return math.atan2(y, x) + turn * aside, aside


@njit(cache=True, error_model="numpy")
def field_line(across: float, along: float, approach: float, gain: float) -> float:
    """Course of the vector field `across` to the left of a line of course `along` (eq. 5.20)."""
    course: float = along - approach / _HALF_PI * math.atan(gain * across)
    return course


@njit(cache=True, error_model="numpy")
def field_orbit(x: float, y: float, radius: float, turn: float, gain: float) -> float:
    """Course of the vector field at (x, y) from the center of an orbit (eq. 5.32, corrected)."""
    aside = _HALF_PI + math.atan(gain * (math.hypot(x, y) - radius) / radius)
    course: float = math.atan2(y, x) + turn * aside
    return course


# How to get there: the rate of the course that an autopilot asks for.


@njit(cache=True, error_model="numpy")
def line_rate(
    follower: int,
    state: Array,
    command: Array,
    gain: float,
    approach: float,
    course: float,
    speed: float,
) -> float:
    r"""Rate of the course that follows a line.

    State and command are rows as in `staniel.kernels.flight`; course and speed are over ground.

    The carrot runs ``delta = 4 V / gain`` ahead. With roll at once, the cross-track error d obeys
    d'' + gain d' + gain V / delta d = 0, critically damped for this delta. With first-order roll K
    the roots are those of s³ + K s² + K gain s + K gain²/4: a slow real one and a pair, damped by
    0.69 at K = 2 gain and better above.

    The field adds the rate of its own course along the way, so that
    :math:`\chi' = \chi'_c + k(\chi_c - \chi)`; with first-order roll K that is thesis eq. 5.6
    (corrected), :math:`b_{\chi'} = K` and :math:`b_\chi = K k`. So it can afford a steeper course
    at the line, 1 in ``2 V / gain``: the cross-track error fades at gain/2, the course's at gain.
    """
    x, y = state[0], state[1]
    start_x, start_y = command[3], command[4]
    along_x, along_y = command[5] - start_x, command[6] - start_y
    length = math.hypot(along_x, along_y)
    if length > 0.0:
        along_x, along_y = along_x / length, along_y / length
    if follower == CARROT or length == 0.0:
        lookahead = 4.0 * speed / gain
        wanted = carrot_line(x, y, start_x, start_y, along_x, along_y, lookahead)
        toward: float = gain * wrapped(wanted - course)
        return toward
    across = along_x * (y - start_y) - along_y * (x - start_x)
    along = math.atan2(along_y, along_x)
    lookahead = 2.0 * speed / gain
    steep = _HALF_PI / (approach * lookahead)
    wanted = field_line(across, along, approach, steep)
    reach = steep * across
    change = -speed * math.sin(course - along) / (lookahead * (1.0 + reach * reach))
    rate: float = gain * wrapped(wanted - course) + change
    return rate


@njit(cache=True, error_model="numpy")
def orbit_rate(
    follower: int, state: Array, command: Array, gain: float, course: float, speed: float
) -> float:
    r"""Rate of the course that joins and keeps an orbit.

    The carrot's look-ahead angle is that of the distance 2 r tan(lambda/2) = 4 V / gain, and the
    steady turn's own rate V/D is added: what is left is zero on the orbit. The field adds the rate
    of its own course, as on a line; inside the orbit, where the bearing changes ever faster towards
    the center, that is bounded by the orbit's own radius.
    """
    x, y = state[0] - command[3], state[1] - command[4]
    radius, turn = command[5], command[6]
    distance = math.hypot(x, y)
    outside = max(distance, radius)
    if follower == CARROT:
        half = math.atan(2.0 * speed / (gain * radius))
        wanted, aside = carrot_orbit(x, y, radius, turn, half)
        error = wrapped(wanted - course)
        joined: float = gain * error + turn * speed / outside * max(0.0, math.sin(aside))
        return joined
    lookahead = 2.0 * speed / gain
    wanted = field_orbit(x, y, radius, turn, radius / lookahead)
    reach = (distance - radius) / lookahead
    off = course - math.atan2(y, x)
    change = speed * math.sin(off) / outside
    change += turn * speed * math.cos(off) / (lookahead * (1.0 + reach * reach))
    rate: float = gain * wrapped(wanted - course) + change
    return rate


# The laws on many places, for whoever wants courses alone.


@njit(cache=True, error_model="numpy")
def carrot_line_courses(
    places: Array, start_x: float, start_y: float, along_x: float, along_y: float, lookahead: float
) -> Array:
    """`carrot_line` at each of (n, 2) places."""
    courses = np.empty(places.shape[0])
    for i in range(places.shape[0]):
        courses[i] = wrapped(
            carrot_line(places[i, 0], places[i, 1], start_x, start_y, along_x, along_y, lookahead)
        )
    return courses


@njit(cache=True, error_model="numpy")
def field_line_courses(
    places: Array,
    start_x: float,
    start_y: float,
    along_x: float,
    along_y: float,
    approach: float,
    gain: float,
) -> Array:
    """`field_line` at each of (n, 2) places; (along_x, along_y) is a unit vector."""
    along = math.atan2(along_y, along_x)
    courses = np.empty(places.shape[0])
    for i in range(places.shape[0]):
        across = along_x * (places[i, 1] - start_y) - along_y * (places[i, 0] - start_x)
        courses[i] = wrapped(field_line(across, along, approach, gain))
    return courses


@njit(cache=True, error_model="numpy")
def carrot_orbit_courses(
    places: Array, center_x: float, center_y: float, radius: float, turn: float, half: float
) -> Array:
    """`carrot_orbit` at each of (n, 2) places."""
    courses = np.empty(places.shape[0])
    for i in range(places.shape[0]):
        course, _ = carrot_orbit(
            places[i, 0] - center_x, places[i, 1] - center_y, radius, turn, half
        )
        courses[i] = wrapped(course)
    return courses


@njit(cache=True, error_model="numpy")
def field_orbit_courses(
    places: Array, center_x: float, center_y: float, radius: float, turn: float, gain: float
) -> Array:
    """`field_orbit` at each of (n, 2) places."""
    courses = np.empty(places.shape[0])
    for i in range(places.shape[0]):
        courses[i] = wrapped(
            field_orbit(places[i, 0] - center_x, places[i, 1] - center_y, radius, turn, gain)
        )
    return courses


def warm() -> None:
    """Compile, or load from the disk cache, what no mission calls; `flight` warms the rest."""
    places = np.zeros((1, 2))
    carrot_line_courses(places, 0.0, 0.0, 1.0, 0.0, 1.0)
    field_line_courses(places, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0)
    carrot_orbit_courses(places, 0.0, 0.0, 1.0, 1.0, 1.0)
    field_orbit_courses(places, 0.0, 0.0, 1.0, 1.0, 1.0)
