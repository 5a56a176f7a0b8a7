"""Coordinated-turn flight: many aircraft, many dynamics steps, one call.

Columns of a state row: x, y, z, heading, bank, speed. Columns of a command row (what
`staniel.datatypes.autopilot.encode` writes): kind, speed, altitude, then

- `LINE`: start x, start y, end x, end y;
- `ORBIT`: center x, center y, radius, turn (+1 counter-clockwise);
- `BANKS`: hold [s], count, and up to `MAX_BANKS` banks [rad].

Columns of a limits row: min_speed, max_speed, max_acceleration, max_climb, max_bank, max_roll_rate,
roll_gain, course_gain, speed_gain, climb_gain, altitude_gain, follower (a number of
`staniel.kernels.following`), approach (of its vector field [rad]).

The autopilot steers its *course over ground*, which it measures: in wind it crabs. Without wind
course and heading are the same number.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.following import line_rate, orbit_rate, wrapped

__all__ = [
    "BANKS",
    "COMMAND_WIDTH",
    "LINE",
    "MAX_BANKS",
    "ORBIT",
    "fly",
    "fly_step",
    "lagged",
    "warm",
]

Array = NDArray[np.float64]

LINE, ORBIT, BANKS = 0, 1, 2
MAX_BANKS = 16
COMMAND_WIDTH = 5 + MAX_BANKS
_G = 9.80665


@njit(cache=True, error_model="numpy")
def _over_ground(state: Array, east: float, north: float) -> tuple[float, float, float]:
    """Course [rad], ground speed [m/s], and the heading's rate for one rad/s of the course's.

    In a steady wind course' = heading' V cos(crab) / V_g. The gearing is bounded for winds that
    nearly stop the aircraft, where no course can be held anyway.
    """
    if east == 0.0 and north == 0.0:
        return state[3], state[5], 1.0
    x = state[5] * math.cos(state[3]) + east
    y = state[5] * math.sin(state[3]) + north
    course, speed = math.atan2(y, x), math.hypot(x, y)
    along = max(state[5] * math.cos(state[3] - course), 0.25 * state[5])
    return course, speed, speed / along


@njit(cache=True, error_model="numpy")
def lagged(value: float, wanted: float, gain: float, max_rate: float, time: float) -> float:
    """Exact solution of value' = clip(gain (wanted - value), ±max_rate) after `time`."""
    error = wanted - value
    linear = max_rate / gain
    saturated = min(max((abs(error) - linear) / max_rate, 0.0), time)
    moved = math.copysign(saturated * max_rate, error)
    after: float = wanted - (error - moved) * math.exp(-gain * (time - saturated))
    return after


@njit(cache=True, error_model="numpy")
def _vertical(height: float, climb: float, wanted: float, limits: Array) -> float:
    """Vertical acceleration of the altitude hold, see `fly`."""
    rate = limits[10] / limits[9] * (wanted - height)
    force: float = limits[9] * (min(max(rate, -limits[3]), limits[3]) - climb)
    return force


@njit(cache=True, error_model="numpy")
def _climbed(
    height: float, climb: float, wanted: float, limits: Array, dt: float
) -> tuple[float, float]:
    """Height and climb rate one step later (Runge and Kutta, fourth order)."""
    if height == wanted and climb == 0.0:
        return height, climb
    c1, half = climb, 0.5 * dt
    a1 = _vertical(height, c1, wanted, limits)
    c2 = climb + half * a1
    a2 = _vertical(height + half * c1, c2, wanted, limits)
    c3 = climb + half * a2
    a3 = _vertical(height + half * c2, c3, wanted, limits)
    c4 = climb + dt * a3
    a4 = _vertical(height + dt * c3, c4, wanted, limits)
    rise = dt / 6.0 * (c1 + 2.0 * c2 + 2.0 * c3 + c4)
    gain = dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return height + rise, climb + gain


@njit(cache=True, error_model="numpy")
def _wanted_bank(
    state: Array, command: Array, limits: Array, east: float, north: float, elapsed: float
) -> float:
    """Bank that the command asks for now, inside the bank limit."""
    kind = command[0]
    if kind == BANKS:
        step = min(int(elapsed / command[3] + 1e-9), int(command[4]) - 1)
        wanted = command[5 + step]
    else:
        course, speed, gearing = _over_ground(state, east, north)
        law = int(limits[11])
        if kind == ORBIT:
            rate = orbit_rate(law, state, command, limits[7], course, speed)
        else:
            rate = line_rate(law, state, command, limits[7], limits[12], course, speed)
        wanted = math.atan(state[5] * rate * gearing / _G)
    inside: float = min(max(wanted, -limits[4]), limits[4])
    return inside


@njit(cache=True, error_model="numpy")
def _step(
    state: Array,
    command: Array,
    limits: Array,
    east: float,
    north: float,
    elapsed: float,
    dt: float,
) -> None:
    """One dynamics step of one aircraft, height excepted, in place; the wind is (east, north)."""
    wanted = _wanted_bank(state, command, limits, east, north, elapsed)
    bank, speed, heading = state[4], state[5], state[3]
    middle_bank = lagged(bank, wanted, limits[6], limits[5], 0.5 * dt)
    end_bank = lagged(bank, wanted, limits[6], limits[5], dt)
    wanted_speed = min(max(command[1], limits[0]), limits[1])
    middle_speed = lagged(speed, wanted_speed, limits[8], limits[2], 0.5 * dt)
    end_speed = lagged(speed, wanted_speed, limits[8], limits[2], dt)
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
    ) * (dt / 6.0) + east * dt
    state[1] += (
        speed * math.sin(heading)
        + 4.0 * middle_speed * math.sin(middle_heading)
        + end_speed * math.sin(end_heading)
    ) * (dt / 6.0) + north * dt
    state[3] = wrapped(end_heading)
    state[4] = end_bank
    state[5] = end_speed


@njit(cache=True, error_model="numpy")
def fly_step(
    state: Array,
    climb: float,
    command: Array,
    limits: Array,
    east: float,
    north: float,
    elapsed: float,
    dt: float,
) -> float:
    """One dynamics step of one aircraft, in place, as `fly` does it.

    Parameters
    ----------
    state : (6,) float array
        Changed.
    climb : float [m/s]
    command : (`COMMAND_WIDTH`,) float array
    limits : (11,) float array
    east, north : float [m/s]
        The wind.
    elapsed : float [s]
        Since the command was given.
    dt : float [s]

    Returns
    -------
    climb : float [m/s]
        After the step.
    """
    _step(state, command, limits, east, north, elapsed, dt)
    state[2], after = _climbed(state[2], climb, command[2], limits, dt)
    return after


@njit(cache=True, error_model="numpy")
def fly(
    aircraft: Array,
    climbs: Array,
    commands: Array,
    limits: Array,
    wind: Array,
    dt: float,
    substeps: int,
) -> tuple[Array, Array]:
    r"""Fly every aircraft on its command for `substeps` dynamics steps.

    Parameters
    ----------
    aircraft : (n, 6) float array
        States before; not changed.
    climbs : (n,) float array [m/s]
        Climb rates before; not changed.
    commands : (n, `COMMAND_WIDTH`) float array
        See the module's head. A bank sequence begins with the call.
    limits : (n, 13) float array
        See the module's head.
    wind : (substeps, n, 2) float array [m/s]
        Velocity of the air around each aircraft, to east and north, held over a step.
    dt : float [s]
    substeps : int

    Returns
    -------
    path : (substeps, n, 6) float array
        States after each step; headings in (-pi, pi].
    climbs : (n,) float array [m/s]
        After the last.

    Notes
    -----
    Thesis eq. 3.3 (corrected): :math:`\theta' = (g/V)\tan\varphi`,
    :math:`\varphi' = K(\varphi_c - \varphi)` with :math:`|\varphi| \le \varphi_{max}`,
    :math:`|\varphi'| \le p_{max}`; airspeed :math:`V' = k(V_c - V)` with
    :math:`|V'| \le a_{max}`; velocity over ground is that through the air plus the wind's. Bank and
    speed are integrated exactly, heading and way by Simpson's rule; the command steers at the
    beginning of every step.

    Height, thesis eq. 5.12 (corrected) with :math:`h'_c = 0`:
    :math:`h'' = b'(\mathrm{clip}(b/b'\,(h_c - h)) - h')`, which is
    :math:`b'(h'_c - h') + b(h_c - h)` unless that asked for more than the greatest climb rate.
    """
    n = aircraft.shape[0]
    path = np.empty((substeps, n, 6))
    after = climbs.copy()
    for i in range(n):
        state = aircraft[i].copy()
        for k in range(substeps):
            east, north = wind[k, i, 0], wind[k, i, 1]
            after[i] = fly_step(state, after[i], commands[i], limits[i], east, north, k * dt, dt)
            for c in range(6):  # a row at once costs seconds to compile
                path[k, i, c] = state[c]
    return path, after


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    limits = np.array([[11.0, 20.0, 1.5, 3.0, 0.6, 1.0, 3.0, 1.2, 1.0, 1.0, 0.25, 0.0, 1.0]])
    command = np.zeros((1, COMMAND_WIDTH))
    command[0, 1] = 15.0
    start = np.array([[0.0, 0.0, 80.0, 0.0, 0.0, 15.0]])
    fly(start, np.zeros(1), command, limits, np.zeros((1, 1, 2)), 0.1, 1)
