"""Circling a place, turning the way that is nearer."""

import math

from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.guidance.config import GuidanceConfig

__all__ = ["loiter"]


def loiter(
    pose: Pose, center: tuple[float, float], airframe: Airframe, config: GuidanceConfig
) -> FlyOrbit:
    """Orbit around `center` with the scenario's loiter radius.

    Parameters
    ----------
    pose : Pose
        Of the aircraft; a center on its left is circled counter-clockwise, so that an aircraft
        already circling keeps its sense of turn.
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
    dx, dy = center[0] - pose.x, center[1] - pose.y
    left = math.cos(pose.heading) * dy - math.sin(pose.heading) * dx >= 0.0
    radius = max(config.loiter_radius, airframe.min_turn_radius)
    return FlyOrbit(center, radius, 1 if left else -1, airframe.speed, airframe.altitude)
