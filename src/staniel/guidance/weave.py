"""Weaving: a sinusoidal course, so that a single beam ahead sweeps what it flies towards."""

import math

from staniel.angles import wrap
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyBanks
from staniel.datatypes.equipment import GRAVITY, Airframe

__all__ = ["weave"]

_HOLD = 0.2  # of each bank [s]
_BANKS = 16  # what a command holds: 3.2 s of the manoeuvre
_SHARE = 0.8  # of the bank limit and of the roll rate limit; the rest corrects the course


def weave(
    time: float,
    pose: Pose,
    airframe: Airframe,
    *,
    course: float,
    amplitude: float,
    period: float,
) -> FlyBanks:
    r"""Swing the heading sinusoidally about a course (thesis 4.5, end).

    Parameters
    ----------
    time : float [s]
        Since the manoeuvre began; the heading then passes the course to the left.
    pose : Pose
        Of the aircraft, now.
    airframe : Airframe
        Its limits of bank and roll rate bound the amplitude.
    course : float [rad]
        Mean heading.
    amplitude : float [rad]
        Of the heading, in (0, pi/2]; less is flown where the airframe cannot follow.
    period : float [s]
        Of one swing to both sides, greater than 0.

    Returns
    -------
    FlyBanks
        For the next 3.2 s; called again each decision step, it stays in phase and on course.

    Raises
    ------
    ValueError
        A value out of its range.

    Notes
    -----
    The heading :math:`\chi + A \sin\omega t` needs the turn rate :math:`A \omega \cos\omega t`, and
    with it the bank :math:`\varphi = \arctan(V \theta' / g)` (thesis eq. 3.3, corrected). An error
    of the heading is taken out with the airframe's course gain k, so that it decays as
    :math:`e^{-kt}`; the command :math:`\varphi + \varphi'/K` leads the first-order roll.

    Examples
    --------
    >>> pose = Pose(0.0, 0.0, 20.0, 0.0, 0.0, 15.0)
    >>> banks = weave(0.0, pose, Airframe(), course=0.0, amplitude=0.3, period=6.0).banks
    >>> banks[0] > 0.0 > banks[-1]
    True
    """
    if not (math.isfinite(time) and math.isfinite(course)):
        raise ValueError(f"time = {time}, course = {course}: expected finite numbers")
    if not 0.0 < amplitude <= math.pi / 2.0:
        raise ValueError(f"amplitude = {amplitude}: expected above 0 and at most pi/2 rad")
    if not 0.0 < period < math.inf:
        raise ValueError(f"period = {period}: expected a positive number of seconds")
    omega, speed = math.tau / period, airframe.speed
    steepest = math.tan(_SHARE * airframe.max_bank)
    fastest = _SHARE * math.radians(airframe.max_roll_rate_deg) / omega
    swing = min(amplitude, min(steepest, fastest) * GRAVITY / (speed * omega))
    gain = airframe.course_gain
    error = wrap(course + swing * math.sin(omega * time) - pose.heading)
    banks = []
    for n in range(_BANKS):
        ahead = (n + 0.5) * _HOLD
        phase, left = omega * (time + ahead), gain * error * math.exp(-gain * ahead)
        rate = swing * omega * math.cos(phase) + left
        change = -swing * omega * omega * math.sin(phase) - gain * left
        tangent = speed * rate / GRAVITY
        roll = speed * change / GRAVITY / (1.0 + tangent * tangent)
        bank = math.atan(tangent) + roll / airframe.roll_gain
        banks.append(min(max(bank, -airframe.max_bank), airframe.max_bank))
    return FlyBanks(tuple(banks), _HOLD, speed, airframe.altitude)
