"""Circling the target all the time, on the circle from which a belly camera sees best."""

import math

from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.equipment import GRAVITY, Airframe
from staniel.guidance.loiter import circle
from staniel.guidance.pursuit import Pursuit, pursuit_policy

__all__ = ["best_radius", "orbit"]


def best_radius(airframe: Airframe) -> float:
    r"""Radius [m] of the orbit whose center is the nearest to the axis of a body-fixed camera.

    Parameters
    ----------
    airframe : Airframe

    Returns
    -------
    float [m]
        At least the tightest turn's.

    Notes
    -----
    On an orbit of radius r at height z the center is :math:`\arctan(r/z)` off the vertical, and the
    bank of the turn, :math:`\arctan(V^2/(g r))`, adds to that, for the camera swings outwards. With
    :math:`a = V^2/g` the sum is least at :math:`r = \sqrt{a z}`, and there
    :math:`2\arctan\sqrt{a/z}`. Where z < a it is above a right angle on every orbit, and the
    tightest is as good as any.

    Examples
    --------
    >>> round(best_radius(Airframe(speed=15.0, altitude=80.0)), 1)
    42.8
    """
    reach = airframe.speed * airframe.speed / GRAVITY
    best = math.sqrt(reach * airframe.altitude) if airframe.altitude > reach else 0.0
    return max(best, airframe.min_turn_radius)


@pursuit_policy("orbit")
def orbit(pursuit: Pursuit) -> FlyOrbit:
    """Orbit the predicted place, from wherever the aircraft is (thesis alg. 5.3).

    The radius is ``guidance.orbit_radius``, or where that is not set `best_radius`.
    """
    x, y = pursuit.waypoint.tolist()
    radius = pursuit.config.orbit_radius or best_radius(pursuit.airframe)
    return circle(pursuit.pose, (x, y), radius, pursuit.airframe)
