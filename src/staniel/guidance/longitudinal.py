"""Height along a path: what to hold where, and what to ask of the altitude hold for it."""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.datatypes.checks import checked_floats, checked_places
from staniel.datatypes.equipment import Airframe

__all__ = ["altitude_command", "altitude_zone", "line_altitude"]


def line_altitude(
    position: ArrayLike, start: ArrayLike, direction: ArrayLike
) -> NDArray[np.float64]:
    r"""Height of a climbing line abeam each aircraft.

    Parameters
    ----------
    position : (n, 2) array_like [m]
        Aircraft positions, east and north.
    start : (3,) array_like [m]
        A point of the line: east, north, up.
    direction : (3,) array_like
        Along the line; of any length, and not straight up.

    Returns
    -------
    (n,) float array [m]

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite, a direction that is vertical or none.

    Notes
    -----
    Thesis eq. 5.7-5.11 (corrected): :math:`h_d = r_u + s\,q_u/\sqrt{q_e^2+q_n^2}` with
    :math:`s = (p-r)\cdot(q_e, q_n)/\sqrt{q_e^2+q_n^2}` the signed horizontal way from the start.

    Examples
    --------
    Up by 1 in 10; the way to the side does not count, the way back does.

    >>> line_altitude([[50.0, 7.0], [-50.0, 0.0]], [0.0, 0.0, 80.0], [10.0, 0.0, 1.0])
    array([85., 75.])
    """
    places = checked_places(position, "position")
    origin = checked_floats(start, (3,), "start")
    q = checked_floats(direction, (3,), "direction")
    flat = math.hypot(q[0], q[1])
    if flat <= 1e-9 * abs(q[2]):
        raise ValueError(f"direction = {q.tolist()}: expected one that is not vertical")
    heights: NDArray[np.float64] = origin[2] + (places - origin[:2]) @ (q[:2] / flat) * q[2] / flat
    return heights


def altitude_command(height: float, climb: float, airframe: Airframe) -> float:
    r"""What to ask of the altitude hold so that it follows a height that changes.

    Parameters
    ----------
    height : float [m]
        Wanted now.
    climb : float [m/s]
        Its rate.
    airframe : Airframe

    Returns
    -------
    float [m]

    Notes
    -----
    The hold obeys thesis eq. 5.12 (corrected) with a commanded climb rate of zero,
    :math:`h'' = -b'h' + b(c - h)`. Asked for :math:`c = h_c + (b'/b)\,h'_c` it obeys the whole,
    :math:`h'' = b'(h'_c - h') + b(h_c - h)`, whose error
    :math:`e_h/h_c = s^2/(s^2 + b's + b)` vanishes for steps and ramps (eq. 5.13-5.16, corrected).

    Examples
    --------
    >>> altitude_command(80.0, 1.5, Airframe())
    86.0
    """
    return height + airframe.climb_gain / airframe.altitude_gain * climb


def altitude_zone(
    height: float, command: float, airframe: Airframe
) -> Literal["climb", "hold", "descend"]:
    """Zone of the altitude hold (thesis 5.2.0.1): at the greatest climb rate, or holding.

    Parameters
    ----------
    height : float [m]
        Of the aircraft.
    command : float [m]
        What is asked of the hold.
    airframe : Airframe

    Returns
    -------
    str
        ``"climb"`` or ``"descend"`` where the hold asks for more than the greatest climb rate and
        flies that; ``"hold"`` in between, where its response is linear.

    Examples
    --------
    >>> [altitude_zone(80.0, command, Airframe()) for command in (60.0, 85.0, 100.0)]
    ['descend', 'hold', 'climb']
    """
    rate = airframe.altitude_gain / airframe.climb_gain * (command - height)
    if abs(rate) <= airframe.max_climb:
        return "hold"
    return "climb" if rate > 0.0 else "descend"
