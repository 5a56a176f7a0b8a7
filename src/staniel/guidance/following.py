"""Following lines and orbits: courses over ground by rival laws of one signature, chosen by name.

A `Follower` is a law for lines and one for orbits. ``guidance.following`` names the one that the
autopilot flies, at the dynamics step (`staniel.kernels.following`); the functions here give the
same courses to whoever plans with them, draws them, or flies another autopilot.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.angles import wrap_array
from staniel.datatypes.checks import checked_floats, checked_places, checked_positive
from staniel.kernels.following import (
    carrot_line_courses,
    carrot_orbit_courses,
    field_line_courses,
    field_orbit_courses,
)

__all__ = [
    "Follower",
    "LineLaw",
    "OrbitLaw",
    "WindTriangle",
    "carrot_line",
    "carrot_loiter",
    "follower_named",
    "follower_names",
    "heading_for_course",
    "line_course",
    "orbit_course",
]

Floats = NDArray[np.float64]


class LineLaw(Protocol):
    """Courses that bring aircraft onto a line: see `line_course`."""

    def __call__(  # noqa: D102 - the class says it
        self, position: ArrayLike, start: ArrayLike, direction: ArrayLike, *, gain: float
    ) -> Floats: ...


class OrbitLaw(Protocol):
    """Courses that bring aircraft onto an orbit: see `orbit_course`."""

    def __call__(  # noqa: D102 - the class says it
        self, position: ArrayLike, center: ArrayLike, *, radius: float, turn: int, gain: float
    ) -> Floats: ...


class Follower(NamedTuple):
    """A way of following paths: its law for lines and its law for orbits."""

    line: LineLaw
    orbit: OrbitLaw


class WindTriangle(NamedTuple):
    """How to hold a course in wind, elementwise: see `heading_for_course`.

    Attributes
    ----------
    heading : float array [rad]
        In (-pi, pi].
    ground_speed : float array [m/s]
        Made good with that heading.
    held : bool array
        False where the wind permits no such course and the heading gives the nearest one.
    """

    heading: Floats
    ground_speed: Floats
    held: NDArray[np.bool_]


def line_course(
    position: ArrayLike,
    start: ArrayLike,
    direction: ArrayLike,
    *,
    gain: float,
    approach: float = math.radians(60.0),
) -> Floats:
    r"""Course of the vector field that brings each aircraft onto a line and keeps it there.

    Parameters
    ----------
    position : (n, 2) array_like [m]
        Aircraft positions, east and north.
    start : (2,) array_like [m]
        A point of the line.
    direction : (2,) array_like
        Which way it runs; of any length but 0.
    gain : float [1/m]
        How hard to converge, greater than 0: K_path.
    approach : float [rad]
        Angle to the line far away from it, in (0, pi/2].

    Returns
    -------
    course : (n,) float array [rad]
        Course over ground in (-pi, pi], counter-clockwise from east.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite or out of its range, no direction.

    Notes
    -----
    .. math:: \chi = \chi_q - \chi_\infty \frac{2}{\pi} \arctan(K e)

    with :math:`e` the cross-track error, positive left of the line (thesis eq. 5.17-5.20), and
    :math:`\chi_q` its course (eq. 5.2, corrected). With :math:`\chi_\infty = \pi/2` it is
    `carrot_line`. Whoever steers by the difference to the course flown wraps that difference, and
    always turns the shorter way; the thesis unwraps :math:`\chi_q` alone (eq. 5.21), after which
    the difference may still exceed half a circle.

    Examples
    --------
    Left of a line to the east and far away: back towards it at 60 degrees.

    >>> course = line_course([[0.0, 1e6], [0.0, 0.0]], [0.0, 0.0], [1.0, 0.0], gain=0.05)
    >>> np.rad2deg(course).round(2)
    array([-60.,   0.])
    """
    places, (x, y), (along_x, along_y) = _line(position, start, direction)
    gain, steepest = checked_positive(gain, "gain"), checked_positive(approach, "approach")
    if steepest > 0.5 * math.pi:
        raise ValueError(f"approach = {approach}: expected at most pi/2 rad")
    courses: Floats = field_line_courses(places, x, y, along_x, along_y, steepest, gain)
    return courses


def carrot_line(
    position: ArrayLike, start: ArrayLike, direction: ArrayLike, *, gain: float
) -> Floats:
    """Course towards a carrot that runs ahead on a line (thesis alg. 5.3, corrected).

    Parameters
    ----------
    position : (n, 2) array_like [m]
        Aircraft positions, east and north.
    start : (2,) array_like [m]
        A point of the line.
    direction : (2,) array_like
        Which way it runs; of any length but 0.
    gain : float [1/m]
        How hard to converge, greater than 0: the carrot is 1/gain ahead of the foot of the
        perpendicular.

    Returns
    -------
    course : (n,) float array [rad]
        Course over ground in (-pi, pi], counter-clockwise from east.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite, a gain that is not positive, no direction.

    Examples
    --------
    20 m left of a line to the east, the carrot 20 m ahead:

    >>> np.rad2deg(carrot_line([[0.0, 20.0]], [0.0, 0.0], [1.0, 0.0], gain=0.05))
    array([-45.])
    """
    places, (x, y), (along_x, along_y) = _line(position, start, direction)
    lookahead = 1.0 / checked_positive(gain, "gain")
    courses: Floats = carrot_line_courses(places, x, y, along_x, along_y, lookahead)
    return courses


def orbit_course(
    position: ArrayLike, center: ArrayLike, *, radius: float, turn: int, gain: float
) -> Floats:
    r"""Course that brings each aircraft onto a circular orbit and keeps it there.

    Parameters
    ----------
    position : (n, 2) array_like [m]
        Aircraft positions, east and north.
    center : (2,) array_like [m]
        Orbit center, east and north.
    radius : float [m]
        Greater than 0. Not compared with what the aircraft can turn.
    turn : {+1, -1}
        +1 counter-clockwise seen from above.
    gain : float [-]
        How hard to converge, greater than 0; 1 to 5 is usual.

    Returns
    -------
    course : (n,) float array [rad]
        Course over ground in (-pi, pi], counter-clockwise from east.

    Raises
    ------
    ValueError
        Wrong shape, a non-finite value, `radius` or `gain` not positive, `turn` not ±1.

    Notes
    -----
    .. math:: \chi = \varphi + \lambda [\pi/2 + \arctan(k (d - \rho)/\rho)]

    with :math:`d, \varphi` the distance and bearing from the center; thesis eq. 5.32 (corrected to
    east-north-up). At the center the bearing is undefined and taken as 0. A course, not a heading:
    wind does not enter.

    Examples
    --------
    East of the center, on the orbit, counter-clockwise: fly north.

    >>> np.rad2deg(orbit_course([[100.0, 0.0]], [0.0, 0.0], radius=100.0, turn=+1, gain=4.0))
    array([90.])
    """
    places, (x, y), radius, gain = _orbit(position, center, radius, turn, gain)
    courses: Floats = field_orbit_courses(places, x, y, radius, float(turn), gain)
    return courses


def carrot_loiter(
    position: ArrayLike, center: ArrayLike, *, radius: float, turn: int, gain: float
) -> Floats:
    r"""Course towards a carrot that runs ahead on a circle (thesis alg. 5.3, corrected).

    Parameters
    ----------
    position : (n, 2) array_like [m]
        Aircraft positions, east and north.
    center : (2,) array_like [m]
        Orbit center, east and north.
    radius : float [m]
        Greater than 0. Not compared with what the aircraft can turn.
    turn : {+1, -1}
        +1 counter-clockwise seen from above.
    gain : float [-]
        How hard to converge, greater than 0. The carrot's look-ahead angle is 2 arctan(1/(2 gain)),
        so that a place just inside the circle is left at the slope of `orbit_course`.

    Returns
    -------
    course : (n,) float array [rad]
        Course over ground in (-pi, pi], counter-clockwise from east.

    Raises
    ------
    ValueError
        Wrong shape, a non-finite value, `radius` or `gain` not positive, `turn` not ±1.

    Notes
    -----
    Seen from the circle, a carrot that is an angle :math:`\lambda` ahead lies :math:`\lambda/2`
    inside the tangent; who simply flies towards it ends up on the circle of radius
    :math:`r\cos\lambda`. So :math:`\lambda/2` is taken off again, fading with r/d outside.

    Examples
    --------
    >>> np.rad2deg(carrot_loiter([[100.0, 0.0]], [0.0, 0.0], radius=100.0, turn=-1, gain=4.0))
    array([-90.])
    """
    places, (x, y), radius, gain = _orbit(position, center, radius, turn, gain)
    half = math.atan(0.5 / gain)
    courses: Floats = carrot_orbit_courses(places, x, y, radius, float(turn), half)
    return courses


def heading_for_course(course: ArrayLike, airspeed: float, wind: ArrayLike) -> WindTriangle:
    """Heading that makes good a course over ground in wind.

    Parameters
    ----------
    course : float or (n,) array_like [rad]
        Wanted, over ground.
    airspeed : float [m/s]
        Greater than 0.
    wind : (2,) array_like [m/s]
        Velocity of the air, to east and north.

    Returns
    -------
    WindTriangle
        Where the wind is as fast as the aircraft or faster, some courses cannot be flown: there the
        heading is the one whose course over ground comes nearest, and `held` is False.

    Raises
    ------
    ValueError
        A value that is not finite, a wrong shape, an airspeed that is not positive.

    Examples
    --------
    To the north at 15 m/s, the wind blowing to the east at 7.5 m/s: crab 30 degrees into it.

    >>> triangle = heading_for_course([np.pi / 2.0], 15.0, [7.5, 0.0])
    >>> np.rad2deg(triangle.heading).round(1), triangle.ground_speed.round(1)
    (array([120.]), array([13.]))
    """
    wanted = np.asarray(course, dtype=np.float64)
    if wanted.ndim > 1 or not np.isfinite(wanted).all():
        raise ValueError(f"course = {wanted.tolist()}: expected finite numbers, one or (n,)")
    airspeed = checked_positive(airspeed, "airspeed")
    east, north = checked_floats(wind, (2,), "wind").tolist()
    speed, blows = math.hypot(east, north), math.atan2(north, east)
    held = np.ones(wanted.shape, dtype=np.bool_)
    if speed >= airspeed:
        # Ground velocities fill a disc that does not hold the origin: courses fill a sector.
        off, widest = wrap_array(wanted - blows), math.asin(airspeed / speed)
        held = np.abs(off) < widest
        wanted = np.where(held, wanted, blows + np.copysign(widest, off))
    across = north * np.cos(wanted) - east * np.sin(wanted)
    crab = np.arcsin(np.clip(-across / airspeed, -1.0, 1.0))
    along = east * np.cos(wanted) + north * np.sin(wanted)
    return WindTriangle(wrap_array(wanted + crab), along + airspeed * np.cos(crab), held)


_FOLLOWERS = {
    "carrot": Follower(carrot_line, carrot_loiter),
    "vector-field": Follower(line_course, orbit_course),
}


def follower_names() -> list[str]:
    """Names of all followers, sorted: what ``guidance.following`` may be."""
    return sorted(_FOLLOWERS)


def follower_named(name: str) -> Follower:
    """The follower that ``guidance.following`` calls `name`.

    Raises
    ------
    ValueError
        There is none of this name.

    Examples
    --------
    >>> follower_named("vector-field").orbit is orbit_course
    True
    """
    try:
        return _FOLLOWERS[name]
    except KeyError:
        raise ValueError(
            f"guidance.following = {name!r}: expected one of {', '.join(follower_names())}"
        ) from None


def _line(
    position: ArrayLike, start: ArrayLike, direction: ArrayLike
) -> tuple[Floats, list[float], tuple[float, float]]:
    """Checked places, a point of the line, and the unit vector along it."""
    places = checked_places(position, "position")
    point = checked_floats(start, (2,), "start").tolist()
    east, north = checked_floats(direction, (2,), "direction").tolist()
    length = math.hypot(east, north)
    if length == 0.0:
        raise ValueError("direction = [0.0, 0.0]: expected a vector with a direction")
    return places, point, (east / length, north / length)


def _orbit(
    position: ArrayLike, center: ArrayLike, radius: float, turn: int, gain: float
) -> tuple[Floats, list[float], float, float]:
    """Checked places, center, radius and gain."""
    places = checked_places(position, "position")
    middle = (checked_floats(center, (2,), "center") + 0.0).tolist()
    if turn not in (1, -1):
        raise ValueError(f"turn = {turn}: expected +1 or -1")
    return places, middle, checked_positive(radius, "radius"), checked_positive(gain, "gain")
