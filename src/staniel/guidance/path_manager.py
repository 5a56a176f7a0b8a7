"""The path manager: from where the aircraft is, which leg of its path to fly now (thesis 5.4.1).

`follow` is a pure function of a path, a pose and a state, called once every decision step.
"""

import math
from dataclasses import dataclass

from staniel.angles import wrap
from staniel.datatypes.belief import Pose
from staniel.datatypes.checks import checked_positive
from staniel.datatypes.command import FlyLine, FlyOrbit
from staniel.guidance.paths import Arc, Path, Straight

__all__ = ["PathState", "follow"]

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PathState:
    """How far an aircraft has come along its path.

    Attributes
    ----------
    leg : int
        Which one is flown; as many as there are when the path is done.
    to_go : float [rad]
        On an arc: angle that is left.
    bearing : float [rad]
        On an arc: from the center to the aircraft at the last step.
    last : (float, float) or None [m]
        Where the aircraft was at the last step.
    """

    leg: int = 0
    to_go: float = math.nan
    bearing: float = math.nan
    last: Point | None = None


def follow(
    path: Path,
    pose: Pose,
    state: PathState = PathState(),
    *,
    ball: float | None = None,
    lead: float = 1.0,
) -> tuple[FlyLine | FlyOrbit, PathState]:
    """Command for the leg that the aircraft has come to.

    Parameters
    ----------
    path : Path
    pose : Pose
        Of the aircraft, now.
    state : PathState, optional
        As the last call returned it; a new one at the beginning of the path.
    ball : float [m], optional
        Waypoints that are flown over are reached this near (eq. 5.35), and where an aircraft misses
        that ball, in the half-plane all the same. None: in the half-plane only.
    lead : float
        Begin and end arcs this many decision steps ahead, as far as the aircraft came in the last
        one: half a step makes good that there are steps at all, the rest the time to roll. 0 is the
        thesis. The path's end and waypoints that are flown over are reached first.

    Returns
    -------
    command : FlyLine or FlyOrbit
        When the path is done: circle its end, counter-clockwise.
    state : PathState

    Raises
    ------
    ValueError
        A pose that is not finite, a ball that is not positive, a negative lead, a leg that the path
        does not have.

    Notes
    -----
    A straight leg is done in the half-plane through its end whose normal bisects the turn
    (eq. 5.36-5.38, corrected), an arc when its angle is turned: up to half a circle that is the
    half-plane of alg. 5.2, and beyond it, as in Dubins paths, still right. The bisecting plane of a
    sharp corner runs along the leg, and who flies a little beside the leg is in its half-plane long
    before the waypoint; so one turn radius before the waypoint is the earliest.

    Examples
    --------
    >>> from staniel.datatypes.equipment import Airframe
    >>> from staniel.guidance.paths import waypoint_path
    >>> path = waypoint_path([[0.0, 0.0], [200.0, 0.0], [200.0, 200.0]], Airframe(), radius=50.0)
    >>> command, state = follow(path, Pose(140.0, 0.0, 80.0, 0.0, 0.0, 15.0))
    >>> type(command).__name__, state.leg
    ('FlyLine', 0)
    >>> command, state = follow(path, Pose(155.0, 0.0, 80.0, 0.0, 0.0, 15.0), state)
    >>> [round(x, 6) for x in command.center], command.turn, state.leg
    ([150.0, 50.0], 1, 1)
    """
    here = _checked(path, pose, state, ball, lead)
    before = here if state.last is None else state.last
    ahead = (here[0] + lead * (here[0] - before[0]), here[1] + lead * (here[1] - before[1]))
    leg, to_go, bearing = state.leg, state.to_go, state.bearing
    while leg < len(path.legs):
        current = path.legs[leg]
        final = leg == len(path.legs) - 1
        if isinstance(current, Arc):
            to_go, bearing = _turned(current, here if final else ahead, to_go, bearing)
            if to_go > 0.0:
                break
        else:
            place = here if final or current.waypoint else ahead
            if not _passed(current, place, path.airframe.min_turn_radius, ball):
                break
        leg, to_go, bearing = leg + 1, math.nan, math.nan
    after = PathState(leg, to_go, bearing, here)
    return _command(path, after, ahead), after


def _turned(arc: Arc, place: Point, to_go: float, bearing: float) -> tuple[float, float]:
    """Angle that is left on an arc, and the bearing from its center."""
    now = math.atan2(place[1] - arc.center[1], place[0] - arc.center[0])
    if math.isnan(bearing):
        to_go, bearing = arc.sweep, arc.bearing
    return to_go - arc.turn * wrap(now - bearing), now


def _passed(leg: Straight, place: Point, margin: float, ball: float | None) -> bool:
    """Whether a straight leg is done at a place."""
    (x0, y0), (x1, y1) = leg.start, leg.end
    dx, dy = place[0] - x1, place[1] - y1
    if leg.waypoint and ball is not None and math.hypot(dx, dy) <= ball:
        return True
    along = (dx * (x1 - x0) + dy * (y1 - y0)) / leg.length
    return dx * leg.normal[0] + dy * leg.normal[1] >= 0.0 and along >= -margin


def _command(path: Path, state: PathState, place: Point) -> FlyLine | FlyOrbit:
    """The command for a leg, its height read where the altitude hold will be able to have it."""
    airframe = path.airframe
    # A ramp seen b'/b earlier is what the hold needs: see `altitude_command`.
    earlier = airframe.speed * airframe.climb_gain / airframe.altitude_gain
    if state.leg == len(path.legs):
        radius = 1.5 * airframe.min_turn_radius
        return FlyOrbit(path.end, radius, 1, airframe.speed, path.heights[-1])
    leg, station = path.legs[state.leg], path.stations[state.leg]
    if isinstance(leg, Arc):
        height = path.height(station + leg.radius * (leg.sweep - state.to_go) + earlier)
        return FlyOrbit(leg.center, leg.radius, leg.turn, airframe.speed, height)
    (x0, y0), (x1, y1) = leg.start, leg.end
    along = ((place[0] - x0) * (x1 - x0) + (place[1] - y0) * (y1 - y0)) / leg.length
    return FlyLine(leg.start, leg.end, airframe.speed, path.height(station + along + earlier))


def _checked(path: Path, pose: Pose, state: PathState, ball: float | None, lead: float) -> Point:
    """The aircraft's place."""
    if not (math.isfinite(pose.x) and math.isfinite(pose.y)):
        raise ValueError(f"pose = {pose}: expected finite numbers")
    if ball is not None:
        checked_positive(ball, "ball")
    if not 0.0 <= lead < math.inf:
        raise ValueError(f"lead = {lead}: expected a finite number, at least 0")
    if not 0 <= state.leg <= len(path.legs):
        raise ValueError(f"state.leg = {state.leg}: expected 0 to {len(path.legs)} on this path")
    return pose.x, pose.y
