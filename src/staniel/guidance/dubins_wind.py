"""Dubins paths in a steady wind: the earliest arrival at a place with a heading."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.errors import StanielError
from staniel.guidance.dubins import Paths, Word, shortest

__all__ = ["WindPath", "shortest_in_wind"]

Floats = NDArray[np.float64]

_INSTANTS = 4096  # tried for the first arrival
_PARTS = 64  # of an interval, as often as it takes to close it
_CLOSED = 1e-14
_SAME = 1e-9  # way flown against way to go at an arrival, relative


@dataclass(frozen=True, slots=True, eq=False)
class WindPath:
    """A path that is a Dubins path in the air, and drifts over ground.

    Attributes
    ----------
    time : float [s]
        Of arrival.
    air : Paths
        The one path through the air, as if there were no wind.
    airspeed : float [m/s]
    wind : (float, float) [m/s]
        Where the air moves, east and north.
    earliest : bool
        False where an earlier arrival, by a path longer than the shortest, is not ruled out.
    """

    time: float
    air: Paths
    airspeed: float
    wind: tuple[float, float]
    earliest: bool

    def sample(self, times: ArrayLike) -> Floats:
        """Poses over ground.

        Parameters
        ----------
        times : (k,) array_like [s]
            Since the start, at least 0; beyond the arrival the pose is that of the arrival.

        Returns
        -------
        (k, 3) float array
            x, y [m], heading in (-pi, pi]. The course over ground differs from it by the drift.

        Raises
        ------
        StanielError
            A wrong shape, a time that is negative or not finite.
        """
        given = np.asarray(times, dtype=np.float64)
        if given.ndim != 1 or not (np.isfinite(given) & (given >= 0.0)).all():
            raise StanielError(f"times: expected (k,) seconds of at least 0, got {given.shape}")
        poses: Floats = self.air.sample(self.airspeed * given)[0]
        poses[:, :2] += np.minimum(given, self.time)[:, None] * self.wind
        return poses


def shortest_in_wind(
    start: ArrayLike, goal: ArrayLike, airspeed: float, wind: tuple[float, float], radius: float
) -> WindPath:
    r"""Path that is first at its goal, in a steady wind.

    Parameters
    ----------
    start, goal : (3,) array_like
        x, y over ground [m], heading [rad] counter-clockwise from east: where the nose points.
    airspeed : float [m/s]
        Greater than 0.
    wind : (float, float) [m/s]
        Where the air moves, east and north; slower than the aircraft.
    radius : float [m]
        Of the tightest turn in the air, greater than 0.

    Returns
    -------
    WindPath

    Raises
    ------
    StanielError
        A wrong shape, a value that is not finite or not positive, a wind that is too strong.

    Notes
    -----
    Seen from the air, the goal drifts against the wind (McGee, Spry and Hedrick 2005): arrival is
    at the least T at which a path to :math:`g - w T` is :math:`V T` long. The shortest length is
    compared with :math:`V T` at 4096 instants, and the first interval in which it falls below is
    closed: earlier there is no way at all, so this arrival is the earliest, if none lies between
    two instants.

    Where the length jumps below instead, the goal comes into reach at once by a path that is too
    short. Then the next instant is taken at which the shortest path has the right length, or LSL
    or RSR with one circle more, whichever is earlier; `earliest` is False, for some longer path may
    do better.

    Examples
    --------
    A hundred metres ahead, against the wind:

    >>> path = shortest_in_wind([0, 0, 0], [100, 0, 0], 15.0, (-5.0, 0.0), 30.0)
    >>> round(path.time, 9)
    10.0
    """
    values = {"airspeed": airspeed, "radius": radius}
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise StanielError(f"{name} = {value}: expected a finite number above 0")
    drift = np.asarray(wind, dtype=np.float64)
    if drift.shape != (2,) or not math.hypot(*drift) < airspeed:
        raise StanielError(f"wind = {wind}: expected two numbers, together below the airspeed")
    ends = [np.asarray(pose, dtype=np.float64) for pose in (start, goal)]
    for name, pose in zip(("start", "goal"), ends, strict=True):
        if pose.shape != (3,) or not np.isfinite(pose).all():
            raise StanielError(f"{name}: expected finite x, y, heading, got {pose.tolist()}")
    one, other = ends
    circled = min(
        (_with_a_circle(one, other, airspeed, drift, radius, side) for side in (1, -1)),
        key=lambda path: path.time,
    )
    now = _paths_at(one, other, drift, radius, np.zeros(1))
    if now.length[0] == 0.0:
        return WindPath(0.0, now, airspeed, circled.wind, True)
    low, earliest = 0.0, True
    while True:
        times = np.linspace(low, circled.time, _INSTANTS)
        found = _crossing(one, other, airspeed, drift, radius, times)
        if found is None:
            return circled
        time, air = found
        way = airspeed * time
        if abs(float(air.length[0]) - way) <= _SAME * (way + radius):
            return WindPath(time, air, airspeed, circled.wind, earliest)
        low, earliest = time, False


def _paths_at(start: Floats, goal: Floats, drift: Floats, radius: float, times: Floats) -> Paths:
    """Shortest paths through the air to where the goal has drifted at each time."""
    goals = np.tile(goal, (len(times), 1))
    goals[:, :2] -= times[:, None] * drift
    return shortest(start, goals, radius)


def _crossing(
    start: Floats, goal: Floats, airspeed: float, drift: Floats, radius: float, times: Floats
) -> tuple[float, Paths] | None:
    """First time at which the way to go changes sides with the way flown, just after it."""
    while True:
        far = _paths_at(start, goal, drift, radius, times).length > airspeed * times
        changes = np.flatnonzero(far[1:] != far[:-1])
        if len(changes) == 0:
            return None
        before, after = float(times[changes[0]]), float(times[changes[0] + 1])
        parts = np.linspace(before, after, _PARTS)
        if after - before <= _CLOSED * after or parts[1] == before:
            return after, _paths_at(start, goal, drift, radius, np.array([after]))
        times = parts


def _with_a_circle(
    start: Floats, goal: Floats, airspeed: float, drift: Floats, radius: float, side: int
) -> WindPath:
    """LSL (side 1) or RSR (-1) with a whole circle more than their turns: always possible.

    The straight leads from center to center, a - w T, and is what the turns C leave of V T:
    |a - w T| = V T - C.
    """
    x, y, heading = (goal - start).tolist()
    turns = side * heading % math.tau + math.tau
    x -= side * radius * (math.sin(goal[2]) - math.sin(start[2]))
    y += side * radius * (math.cos(goal[2]) - math.cos(start[2]))
    c = radius * turns
    slower = airspeed**2 - float(drift @ drift)
    half = airspeed * c - (x * drift[0] + y * drift[1])
    # The discriminant half² - slower (c² - x² - y²), in a form that does not cancel.
    apart = math.hypot(c * drift[0] - airspeed * x, c * drift[1] - airspeed * y)
    beside = abs(drift[0] * y - drift[1] * x)
    time = (half + math.sqrt(max((apart - beside) * (apart + beside), 0.0))) / slower
    dx, dy = x - drift[0] * time, y - drift[1] * time
    first = side * (math.atan2(dy, dx) - start[2]) % math.tau
    segments = np.array([[radius * first, math.hypot(dx, dy), radius * (turns - first)]])
    word = np.array([Word.LSL if side > 0 else Word.RSR], dtype=np.int8)
    air = Paths(start[None], radius, segments.sum(axis=1), word, segments)
    return WindPath(time, air, airspeed, (float(drift[0]), float(drift[1])), False)
