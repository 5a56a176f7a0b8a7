"""Circling a place, turning the way that is nearer; and a loiter that nothing stands in."""

import math
from itertools import pairwise

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.guidance.config import GuidanceConfig
from staniel.kernels.walls import line_of_sight

__all__ = ["circle", "loiter", "safe_loiter"]

_OVER = 5.0  # that a safe loiter keeps above the tallest roof [m]
_POINTS = 24  # at which its circle is looked at


def circle(pose: Pose, center: tuple[float, float], radius: float, airframe: Airframe) -> FlyOrbit:
    """Orbit around `center`, turning the way that is nearer.

    Parameters
    ----------
    pose : Pose
        Of the aircraft; a center on its left is circled counter-clockwise, so that an aircraft
        already circling keeps its sense of turn.
    center : (float, float) [m]
    radius : float [m]
        Bounded from below by the tightest turn.
    airframe : Airframe

    Returns
    -------
    FlyOrbit
    """
    dx, dy = center[0] - pose.x, center[1] - pose.y
    left = math.cos(pose.heading) * dy - math.sin(pose.heading) * dx >= 0.0
    radius = max(radius, airframe.min_turn_radius)
    return FlyOrbit(center, radius, 1 if left else -1, airframe.speed, airframe.altitude)


def loiter(
    pose: Pose, center: tuple[float, float], airframe: Airframe, config: GuidanceConfig
) -> FlyOrbit:
    """Orbit around `center` with the scenario's loiter radius.

    Parameters
    ----------
    pose : Pose
        Of the aircraft; see `circle` for the sense of turn.
    center : (float, float) [m]
    airframe : Airframe
        Its tightest turn bounds the radius from below.
    config : GuidanceConfig

    Returns
    -------
    FlyOrbit

    Examples
    --------
    Flying east with the center to the north, on the left:

    >>> pose = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0)
    >>> loiter(pose, (0.0, 50.0), Airframe(), GuidanceConfig()).turn
    1
    """
    return circle(pose, center, config.loiter_radius, airframe)


def safe_loiter(pose: Pose, airframe: Airframe, chart: City) -> FlyOrbit:
    """The tightest circle beside the aircraft that meets fewer buildings, climbing above them all.

    Parameters
    ----------
    pose : Pose
    airframe : Airframe
    chart : City
        What the aircraft knows of the buildings.

    Returns
    -------
    FlyOrbit
        At the cruise altitude, or where that is lower, 5 m above the chart's tallest roof.

    Examples
    --------
    >>> pose = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0)
    >>> safe_loiter(pose, Airframe(), City.open((100.0, 100.0))).turn
    1
    """
    radius = airframe.min_turn_radius
    altitude = max(airframe.altitude, chart.tallest + _OVER)

    def center(turn: int) -> tuple[float, float]:
        aside = pose.heading + turn * 0.5 * math.pi
        return pose.x + radius * math.cos(aside), pose.y + radius * math.sin(aside)

    def strikes(turn: int) -> int:
        x, y = center(turn)
        angles = [2.0 * math.pi * k / _POINTS for k in range(_POINTS + 1)]
        ring = [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
        return sum(
            not line_of_sight(chart.walls, *here, pose.z, *there, pose.z)
            for here, there in pairwise(ring)
        )

    turn = min((1, -1), key=strikes)
    return FlyOrbit(center(turn), radius, turn, airframe.speed, altitude)
