"""Paths to fly: straight legs and arcs, from waypoints, with or without fillets, or from poses.

A `Path` is what `staniel.guidance.path_manager.follow` turns into commands. Three kinds of path,
one kind of leg: waypoints flown over (thesis alg. 5.1), waypoints with fillets (alg. 5.2), and
Dubins paths between poses (5.4.2).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.angles import wrap
from staniel.datatypes.checks import checked_positive
from staniel.datatypes.equipment import Airframe
from staniel.guidance.dubins import Word, shortest
from staniel.guidance.fillets import checked_route, fillet, fillet_radii

__all__ = ["Arc", "Leg", "Path", "Straight", "dubins_path", "waypoint_path"]

Floats = NDArray[np.float64]
Point = tuple[float, float]

_SHORT = 1e-6  # legs that are shorter are left out [m]

_SIDES = {"L": 1, "R": -1}


class Straight(NamedTuple):
    """A straight leg.

    Attributes
    ----------
    start, end : (float, float) [m]
    normal : (float, float)
        Unit normal of the half-plane through `end` in which the leg is done (eq. 5.36).
    waypoint : bool
        It ends at a waypoint that is to be flown over.
    """

    start: Point
    end: Point
    normal: Point
    waypoint: bool

    @property
    def length(self) -> float:
        """Length [m]."""
        return math.dist(self.start, self.end)

    def at(self, way: float) -> Point:
        """The place `way` metres after the start."""
        share = way / self.length
        (x0, y0), (x1, y1) = self.start, self.end
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


class Arc(NamedTuple):
    """A leg on a circle.

    Attributes
    ----------
    center : (float, float) [m]
    radius : float [m]
    turn : {+1, -1}
        +1 counter-clockwise.
    bearing : float [rad]
        From the center to the start.
    sweep : float [rad]
        Angle that is turned, in (0, 2 pi).
    """

    center: Point
    radius: float
    turn: int
    bearing: float
    sweep: float

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.radius * self.sweep

    def at(self, way: float) -> Point:
        """The place `way` metres after the start."""
        angle = self.bearing + self.turn * way / self.radius
        x, y = self.center
        return x + self.radius * math.cos(angle), y + self.radius * math.sin(angle)


Leg = Straight | Arc


@dataclass(frozen=True, slots=True)
class Path:
    """Legs one after the other, and the height along them.

    Made by `waypoint_path` and `dubins_path`.

    Attributes
    ----------
    legs : tuple of Straight or Arc
        Each begins where the one before it ends.
    stations : tuple of float [m]
        Way along the path to the beginning of each leg, and to the end.
    heights : tuple of float [m]
        Above ground at the stations, linear in between.
    airframe : Airframe
        Gives speed, tightest turn and the altitude hold.
    """

    legs: tuple[Leg, ...]
    stations: tuple[float, ...]
    heights: tuple[float, ...]
    airframe: Airframe

    @property
    def length(self) -> float:
        """Way over ground from end to end [m]."""
        return self.stations[-1]

    @property
    def end(self) -> Point:
        """Where it ends [m]."""
        return self.legs[-1].at(self.legs[-1].length)

    def height(self, way: float) -> float:
        """Height above ground `way` metres along the path [m]; beyond its ends that of the end."""
        return float(np.interp(way, self.stations, self.heights))

    def places(self, spacing: float) -> Floats:
        """The path as a polyline.

        Parameters
        ----------
        spacing : float [m]
            Greatest distance along the path between two places, greater than 0.

        Returns
        -------
        (n, 3) float array [m]
            East, north, up; the beginning and the end of every leg are among them.

        Raises
        ------
        ValueError
            A spacing that is not positive.
        """
        spacing = checked_positive(spacing, "spacing")
        rows: list[tuple[float, float, float]] = []
        for leg, station in zip(self.legs, self.stations, strict=False):
            count = max(1, math.ceil(leg.length / spacing))
            ways = np.linspace(0.0, leg.length, count + 1)[1 if rows else 0 :].tolist()
            rows.extend((*leg.at(way), self.height(station + way)) for way in ways)
        return np.array(rows)


def waypoint_path(
    waypoints: ArrayLike,
    airframe: Airframe,
    *,
    radius: float | None = None,
    min_radius: float | None = None,
) -> Path:
    """The path through waypoints, flown over or with rounded corners (thesis alg. 5.1, 5.2).

    Parameters
    ----------
    waypoints : (n, 2) or (n, 3) array_like [m]
        At least 2; east and north, at the airframe's altitude, or east, north and up.
    airframe : Airframe
    radius : float [m], optional
        Of the fillets. Where legs are too short for them, see `fillet_radii`. None: all waypoints
        are flown over, and the aircraft joins each next leg as it can.
    min_radius : float [m], optional
        Tightest turn to be asked for, at least the airframe's, which is the default. In a wind W it
        takes (V + W)²/(g tan φ) to hold an arc on every course.

    Returns
    -------
    Path
        Straight legs have the height of the line between their waypoints (eq. 5.11, corrected).

    Raises
    ------
    ValueError
        Fewer than two waypoints, consecutive ones that coincide in the plane, a value that is not
        finite, a radius tighter than can be flown, a leg that climbs faster than the aircraft.

    Examples
    --------
    >>> path = waypoint_path([[0.0, 0.0], [200.0, 0.0], [200.0, 200.0]], Airframe(), radius=50.0)
    >>> [type(leg).__name__ for leg in path.legs], round(path.length, 2)
    (['Straight', 'Arc', 'Straight'], 378.54)
    """
    points, heights = _route(waypoints, airframe)
    tightest = _min_radius(min_radius, airframe)
    inner = len(points) - 2
    radii = np.zeros(inner) if radius is None else fillet_radii(points, radius, tightest)
    flat = np.hypot(*np.diff(points, axis=0).T)
    directions = np.diff(points, axis=0) / flat[:, None]
    legs: list[Leg] = []
    knots: list[tuple[float, float]] = []  # height at the beginning and end of each leg
    begin, low = _point(points[0]), float(heights[0])
    for i, direction in enumerate(directions):
        corner = points[i + 1]
        last = i == inner
        arc = (
            fillet(points[i], corner, points[i + 2], float(radii[i]))
            if not last and radii[i] > 0.0
            else None
        )
        if arc is None:
            after = direction if last else directions[i + 1]
            legs.append(Straight(begin, _point(corner), _bisector(direction, after), True))
            high = float(heights[i + 1])
            knots.append((low, high))
            begin, low = _point(corner), high
            continue
        reach = math.dist(arc.entry, corner)
        high = float(heights[i + 1] + reach / flat[i] * (heights[i] - heights[i + 1]))
        legs.append(Straight(begin, arc.entry, _point(direction), False))
        knots.append((low, high))
        low = float(heights[i + 1] + reach / flat[i + 1] * (heights[i + 2] - heights[i + 1]))
        (x, y), (cx, cy) = arc.entry, arc.center
        legs.append(Arc(arc.center, arc.radius, arc.turn, math.atan2(y - cy, x - cx), arc.sweep))
        knots.append((high, low))
        begin = arc.exit
    return _joined(legs, knots, airframe)


def dubins_path(
    poses: ArrayLike,
    airframe: Airframe,
    *,
    radius: float | None = None,
) -> Path:
    """The path through poses by the shortest legs of bounded curvature (thesis 5.4.2).

    Parameters
    ----------
    poses : (n, 3) array_like
        At least 2: east, north [m], course [rad].
    airframe : Airframe
        Gives the height, too.
    radius : float [m], optional
        Of the turns, at least the airframe's tightest, which is the default. Somewhat more leaves
        the autopilot room to correct.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        Wrong shape, fewer than two poses, a value that is not finite, consecutive poses that
        coincide in place and course, a radius tighter than can be flown.

    Examples
    --------
    >>> path = dubins_path([[0.0, 0.0, 0.0], [0.0, 100.0, np.pi]], Airframe(), radius=50.0)
    >>> round(path.length, 6) == round(50.0 * np.pi, 6)
    True
    """
    rows = np.asarray(poses, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 2:
        raise ValueError(f"poses has shape {rows.shape}: expected (n, 3), n at least 2")
    if not np.isfinite(rows).all():
        raise ValueError(f"poses = {rows.tolist()}: expected finite numbers")
    tightest = _min_radius(radius, airframe)
    legs: list[Leg] = []
    for number, (start, goal) in enumerate(zip(rows[:-1].tolist(), rows[1:].tolist(), strict=True)):
        found = list(_dubins(start, goal, tightest))
        if not found:
            raise ValueError(
                f"poses[{number}] and poses[{number + 1}] coincide at {start}: expected a way "
                "between them"
            )
        legs.extend(found)
    return _joined(legs, [(airframe.altitude, airframe.altitude)] * len(legs), airframe)


def _dubins(start: Sequence[float], goal: Sequence[float], radius: float) -> Iterable[Leg]:
    """Legs from one pose to another."""
    x, y, course = start
    found = shortest(start, goal, radius)
    if found.length[0] < _SHORT:
        return
    for turn, way in zip(Word(found.word[0]).name, found.segments[0].tolist(), strict=True):
        if way < _SHORT:
            continue
        if turn == "S":
            along = (math.cos(course), math.sin(course))
            end = (x + way * along[0], y + way * along[1])
            yield Straight((x, y), end, along, False)
            x, y = end
            continue
        side, angle = _SIDES[turn], way / radius
        center = (x - side * radius * math.sin(course), y + side * radius * math.cos(course))
        arc = Arc(center, radius, side, wrap(course - side * 0.5 * math.pi), angle)
        yield arc
        x, y = arc.at(arc.length)
        course += side * angle


def _joined(legs: list[Leg], knots: list[tuple[float, float]], airframe: Airframe) -> Path:
    """Legs that are long enough to fly, with stations and heights."""
    kept = [(leg, pair) for leg, pair in zip(legs, knots, strict=True) if leg.length >= _SHORT]
    stations, heights = [0.0], [kept[0][1][0]]
    for leg, (_, high) in kept:
        stations.append(stations[-1] + leg.length)
        heights.append(high)
    return Path(tuple(leg for leg, _ in kept), tuple(stations), tuple(heights), airframe)


def _route(waypoints: ArrayLike, airframe: Airframe) -> tuple[Floats, Floats]:
    """Checked places and heights of waypoints."""
    rows = np.asarray(waypoints, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] not in (2, 3):
        raise ValueError(f"waypoints has shape {rows.shape}: expected (n, 2) or (n, 3)")
    points = checked_route(rows[:, :2])
    if rows.shape[1] == 2:
        return points, np.full(len(points), airframe.altitude)
    heights = rows[:, 2]
    if not (np.isfinite(heights).all() and (heights > 0.0).all()):
        raise ValueError(f"heights of waypoints = {heights.tolist()}: expected greater than 0 m")
    climbs = np.diff(heights) / np.hypot(*np.diff(points, axis=0).T) * airframe.speed
    steepest = int(np.argmax(np.abs(climbs)))
    if abs(climbs[steepest]) > airframe.max_climb:
        raise ValueError(
            f"waypoints[{steepest}] to waypoints[{steepest + 1}] climbs {climbs[steepest]:.3g} m/s "
            f"at {airframe.speed:g} m/s: expected at most max_climb = {airframe.max_climb:g} m/s"
        )
    return points, heights


def _min_radius(radius: float | None, airframe: Airframe) -> float:
    """A radius that the airframe can fly."""
    tightest = airframe.min_turn_radius
    if radius is None:
        return tightest
    wanted = checked_positive(radius, "radius")
    if wanted < tightest:
        raise ValueError(
            f"radius = {wanted:g} m: expected at least {tightest:.1f} m, the tightest turn at "
            f"{airframe.speed:g} m/s"
        )
    return wanted


def _bisector(before: Floats, after: Floats) -> Point:
    """Normal of the half-plane between two legs (eq. 5.38, corrected); of a reversal the first."""
    both = before + after
    size = math.hypot(*both)
    return _point(both / size) if size > 1e-6 else _point(before)


def _point(place: Floats) -> Point:
    return float(place[0]), float(place[1])
