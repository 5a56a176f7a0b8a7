"""Coordinated-turn flight: many aircraft, many dynamics steps, one call.

Columns of a state row: x, y, z, heading, bank, speed. Columns of a command row (what
`staniel.world.aircraft.encode` writes): kind, speed, altitude, then

- `LINE`: start x, start y, end x, end y;
- `ORBIT`: center x, center y, radius, turn (+1 counter-clockwise);
- `BANKS`: hold [s], count, and up to `MAX_BANKS` banks [rad].

Columns of the limits: min_speed, max_speed, max_acceleration, max_climb, max_bank, max_roll_rate,
roll_gain, course_gain.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["BANKS", "COMMAND_WIDTH", "LINE", "MAX_BANKS", "ORBIT", "fly", "warm"]

Array = NDArray[np.float64]

LINE, ORBIT, BANKS = 0, 1, 2
MAX_BANKS = 16
COMMAND_WIDTH = 5 + MAX_BANKS
_G = 9.80665
_TWO_PI = 2.0 * math.pi


@njit(cache=True, error_model="numpy")
def _wrapped(angle: float) -> float:
    """Angle in (-pi, pi]."""
    wrapped = angle - _TWO_PI * math.ceil((angle - math.pi) / _TWO_PI)
    # Rounding may leave the quotient a hair off a whole number.
    return math.pi if wrapped <= -math.pi else wrapped


@njit(cache=True, error_model="numpy")
def _line_rate(state: Array, command: Array, gain: float) -> float:
    """Turn rate that follows a line: thesis algorithm 5.3 (corrected).

    The carrot runs ``delta = 4 V / gain`` ahead of the foot of the perpendicular. With roll at
    once, the cross-track error d obeys d'' + gain d' + gain V / delta d = 0, critically damped for
    this delta. With first-order roll K the roots are those of s³ + K s² + K gain s + K gain²/4:
    a slow real one and a pair, damped by 0.69 at K = 2 gain and better above.
    """
    x, y, speed = state[0], state[1], state[5]
    start_x, start_y = command[3], command[4]
    along_x, along_y = command[5] - start_x, command[6] - start_y
    length = math.hypot(along_x, along_y)
    if length > 0.0:
        along_x, along_y = along_x / length, along_y / length
        ahead = (x - start_x) * along_x + (y - start_y) * along_y + 4.0 * speed / gain
    else:
        ahead = 0.0  # No direction: the carrot stays at the point.
    carrot_x, carrot_y = start_x + ahead * along_x, start_y + ahead * along_y
    rate: float = gain * _wrapped(math.atan2(carrot_y - y, carrot_x - x) - state[3])
    return rate


@njit(cache=True, error_model="numpy")
def _orbit_rate(state: Array, command: Array, gain: float) -> float:
    r"""Turn rate that joins and keeps an orbit: thesis algorithm 5.3 (corrected).

    The carrot runs a look-ahead angle :math:`\lambda` ahead on the circle. From a place on the
    circle it lies :math:`\lambda/2` inside the tangent, so that much is taken off the course again
    (fading with r/D outside, where it would spoil the approach), and the steady turn's own rate V/D
    is added. What is left is zero on the orbit: no standing error of the radius. To first order the
    look-ahead distance is then 2 r tan(lambda/2); lambda makes it the line's 4 V / gain.
    """
    x, y, speed = state[0] - command[3], state[1] - command[4], state[5]
    radius, turn = command[5], command[6]
    distance = math.hypot(x, y)
    outside = max(distance, radius)
    half = math.atan(2.0 * speed / (gain * radius))
    # Angle of the carrot's direction against the outward radius, for a counter-clockwise orbit.
    aside = math.atan2(radius * math.sin(2.0 * half), radius * math.cos(2.0 * half) - distance)
    aside -= half * radius / outside
    error = _wrapped(math.atan2(y, x) + turn * aside - state[3])
    rate: float = gain * error + turn * speed / outside * max(0.0, math.sin(aside))
    return rate


@njit(cache=True, error_model="numpy")
def _bank_after(bank: float, wanted: float, gain: float, max_rate: float, time: float) -> float:
    """Exact solution of bank' = clip(gain (wanted - bank), ±max_rate) after `time`."""
    error = wanted - bank
    linear = max_rate / gain
    saturated = min(max((abs(error) - linear) / max_rate, 0.0), time)
    moved = math.copysign(saturated * max_rate, error)
    after: float = wanted - (error - moved) * math.exp(-gain * (time - saturated))
    return after


@njit(cache=True, error_model="numpy")
def _wanted_bank(state: Array, command: Array, limits: Array, elapsed: float) -> float:
    """Bank that the command asks for now, inside the bank limit."""
    kind = command[0]
    if kind == BANKS:
        step = min(int(elapsed / command[3] + 1e-9), int(command[4]) - 1)
        wanted = command[5 + step]
    elif kind == ORBIT:
        wanted = math.atan(state[5] * _orbit_rate(state, command, limits[7]) / _G)
    else:
        wanted = math.atan(state[5] * _line_rate(state, command, limits[7]) / _G)
    inside: float = min(max(wanted, -limits[4]), limits[4])
    return inside


@njit(cache=True, error_model="numpy")
def _step(state: Array, command: Array, limits: Array, elapsed: float, dt: float) -> None:
    """One dynamics step of one aircraft, in place."""
    wanted = _wanted_bank(state, command, limits, elapsed)
    bank, speed, heading = state[4], state[5], state[3]
    middle_bank = _bank_after(bank, wanted, limits[6], limits[5], 0.5 * dt)
    end_bank = _bank_after(bank, wanted, limits[6], limits[5], dt)
    change = min(max(command[1], limits[0]), limits[1]) - speed
    most = limits[2] * dt
    middle_speed = speed + min(max(change, -0.5 * most), 0.5 * most)
    end_speed = speed + min(max(change, -most), most)
    # Simpson's rule for heading, its companion for the half step, and Simpson again for the way.
    rate = _G / speed * math.tan(bank)
    middle_rate = _G / middle_speed * math.tan(middle_bank)
    end_rate = _G / end_speed * math.tan(end_bank)
    middle_heading = heading + dt / 24.0 * (5.0 * rate + 8.0 * middle_rate - end_rate)
    end_heading = heading + dt / 6.0 * (rate + 4.0 * middle_rate + end_rate)
    state[0] += (
        speed * math.cos(heading)
        + 4.0 * middle_speed * math.cos(middle_heading)
        + end_speed * math.cos(end_heading)
    ) * (dt / 6.0)
    state[1] += (
        speed * math.sin(heading)
        + 4.0 * middle_speed * math.sin(middle_heading)
        + end_speed * math.sin(end_heading)
    ) * (dt / 6.0)
    climb = limits[3] * dt
    state[2] += min(max(command[2] - state[2], -climb), climb)
    state[3] = _wrapped(end_heading)
    state[4] = end_bank
    state[5] = end_speed


@njit(cache=True, error_model="numpy")
def fly(aircraft: Array, commands: Array, limits: Array, dt: float, substeps: int) -> Array:
    r"""Fly every aircraft on its command for `substeps` dynamics steps.

    Parameters
    ----------
    aircraft : (n, 6) float array
        States before; not changed.
    commands : (n, `COMMAND_WIDTH`) float array
        See the module's head. A bank sequence begins with the call.
    limits : (8,) float array
        See the module's head.
    dt : float [s]
    substeps : int

    Returns
    -------
    (substeps, n, 6) float array
        States after each step; headings in (-pi, pi].

    Notes
    -----
    Thesis eq. 3.3 (corrected): :math:`\theta' = (g/V)\tan\varphi`,
    :math:`\varphi' = K(\varphi_c - \varphi)` with :math:`|\varphi| \le \varphi_{max}`,
    :math:`|\varphi'| \le p_{max}`, :math:`|V'| \le a_{max}`. Bank and speed are integrated exactly,
    heading and way by Simpson's rule; the command steers at the beginning of every step.
    """
    n = aircraft.shape[0]
    path = np.empty((substeps, n, 6))
    for i in range(n):
        state = aircraft[i].copy()
        for k in range(substeps):
            _step(state, commands[i], limits, k * dt, dt)
            for c in range(6):  # a row at once costs seconds to compile
                path[k, i, c] = state[c]
    return path


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    limits = np.array([11.0, 20.0, 1.5, 3.0, 0.6, 1.0, 3.0, 1.2])
    command = np.zeros((1, COMMAND_WIDTH))
    command[0, 1] = 15.0
    fly(np.array([[0.0, 0.0, 80.0, 0.0, 0.0, 15.0]]), command, limits, 0.1, 1)
