"""What it is worth to end a flight where it ends: the sight that may be hoped for from there on.

Over flat ground a flight's future depends only on where the target is, ahead and to the left of the
aircraft, and on its bank: so the worth of going on from there, for ever and at its best, is a small
table, made once by value iteration. Buildings enter as the share of lines of sight that are free at
a level distance, which the chart tells.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, in_cone
from staniel.kernels.lookout import Eye, aim, glide
from staniel.kernels.pieces import woven
from staniel.kernels.walls import Walls, inside, line_of_sight, warm_walls

__all__ = [
    "REACH",
    "RING",
    "RINGS",
    "SIZE",
    "Outlook",
    "free_shares",
    "new_outlook",
    "outlook",
    "warm",
]

Floats = NDArray[np.float64]

_CELL = 10.0  # of the table [m]
REACH = 200.0
"""Of the table, to each side [m]."""
SIZE = 2 * int(REACH / _CELL) + 1
"""Entries along a side."""
_BANKS = 5  # of the table, evenly from limit to limit
_ROUNDS = 80  # of the iteration
RINGS = 31
"""Level distances at which the share of free lines is known."""
RING = 10.0
"""Between two of them [m]."""
_PLACES, _SIDES = 300, 16  # from how many places, to how many sides, lines are tried
_GOLDEN, _PLASTIC = 0.7548776662466927, 0.5698402909980532  # of an even sequence in the plane


class Outlook(NamedTuple):
    """The table."""

    values: Floats
    """(u, v, b) discounted seconds of sight, of a target u ahead and v to the left, at a bank."""
    max_bank: float
    """[rad]"""
    fading: float
    """What a metre beyond the table leaves of a worth: the discount over the time it takes."""
    most: float
    """Greatest of the values."""


@njit(cache=True, error_model="numpy")
def free_shares(walls: Walls, width: float, depth: float, altitude: float, low: float) -> Floats:
    """Share of the lines from streets to the air that are free, by level distance.

    Parameters
    ----------
    walls : Walls
    width, depth : float [m]
        Of the city.
    altitude, low : float [m]
        Heights of the lines' ends, in the air and above the street.

    Returns
    -------
    (RINGS,) float array
        At multiples of `RING`; 1 where there is no street.
    """
    free, tried = np.zeros(RINGS), 0
    for k in range(_PLACES):
        x, y = (k * _GOLDEN) % 1.0 * width, (k * _PLASTIC) % 1.0 * depth
        if inside(walls, x, y) >= 0:
            continue
        for side in range(_SIDES):
            tried += 1
            angle = 2.0 * math.pi * (side + (k * 0.618) % 1.0) / _SIDES
            for r in range(RINGS):
                there_x, there_y = x + r * RING * math.cos(angle), y + r * RING * math.sin(angle)
                if line_of_sight(walls, x, y, low, there_x, there_y, altitude):
                    free[r] += 1.0
    if tried == 0:
        return np.ones(RINGS)
    return free / tried


@woven
def outlook(table: Outlook, ahead: float, left: float, bank: float) -> float:
    """Worth of a state: linear between the table's entries, fading beyond them."""
    reach = REACH - 1e-9
    out = max(abs(ahead), abs(left)) / reach
    faded = 1.0
    if out > 1.0:
        away = math.hypot(ahead, left) * (1.0 - 1.0 / out)
        ahead, left, faded = ahead / out, left / out, table.fading**away
    u, v = (ahead + REACH) / _CELL, (left + REACH) / _CELL
    b = (bank / table.max_bank + 1.0) * 0.5 * (_BANKS - 1)
    b = min(max(b, 0.0), _BANKS - 1.000001)
    i, j, k = int(u), int(v), int(b)
    u, v, b = u - i, v - j, b - k
    values = table.values
    low = (1.0 - u) * ((1.0 - v) * values[i, j, k] + v * values[i, j + 1, k])
    low += u * ((1.0 - v) * values[i + 1, j, k] + v * values[i + 1, j + 1, k])
    high = (1.0 - u) * ((1.0 - v) * values[i, j, k + 1] + v * values[i, j + 1, k + 1])
    high += u * ((1.0 - v) * values[i + 1, j, k + 1] + v * values[i + 1, j + 1, k + 1])
    worth: float = faded * ((1.0 - b) * low + b * high)
    return worth


@njit(cache=True, error_model="numpy")
def _sight(eye: Eye, free: Floats, u: float, v: float, height: float, bank: float) -> float:
    """Chance to see a target u ahead, v to the left and `height` below, where a gimbal looks."""
    ax, ay, az = aim(u, v, height, 0.0, bank, eye.mount)
    cosine = math.cos(eye.half_aperture)
    if not in_cone(u, v, -height, ax, ay, az, cosine, eye.reach):
        return 0.0
    ring = math.hypot(u, v) / RING
    r = int(ring)
    if r >= RINGS - 1:
        return float(free[-1])
    return float(free[r] + (ring - r) * (free[r + 1] - free[r]))


@njit(cache=True, error_model="numpy")
def new_outlook(
    eye: Eye,
    free: Floats,
    height: float,
    speed: float,
    banks: Floats,
    roll_gain: float,
    roll_rate: float,
    step: float,
    samples: int,
    discount: float,
) -> Outlook:
    r"""Solve for the table.

    Parameters
    ----------
    eye : Eye
    free : (RINGS,) float array
        As `free_shares` gives them.
    height : float [m]
        Of the aircraft above what it watches.
    speed : float [m/s]
    banks : (k,) float array [rad]
        What may be held, evenly from limit to limit.
    roll_gain, roll_rate : float [1/s, rad/s]
    step : float [s]
        Between two looks.
    samples : int
        Looks while one bank is held.
    discount : float
        What a second later is worth of one now.

    Returns
    -------
    Outlook

    Notes
    -----
    :math:`W(s) = \max_b \sum_k \gamma^{k \Delta t} p(s_k) \Delta t + \gamma^{h} W(s_h)`, the target
    at rest.
    """
    limit = banks[-1]
    moves = np.empty((_BANKS, banks.size, samples, 4))
    for b in range(_BANKS):
        for a in range(banks.size):
            x, y, heading, bank = 0.0, 0.0, 0.0, limit * (2.0 * b / (_BANKS - 1) - 1.0)
            for s in range(samples):
                x, y, heading, bank = glide(
                    x, y, heading, bank, speed, banks[a], roll_gain, roll_rate, step
                )
                moves[b, a, s, 0], moves[b, a, s, 1] = x, y
                moves[b, a, s, 2], moves[b, a, s, 3] = heading, bank
    sight = np.zeros((SIZE, SIZE, _BANKS, banks.size))
    worth = discount ** (step * np.arange(1.0, samples + 1.0)) * step
    for i in range(SIZE):
        for j in range(SIZE):
            u, v = i * _CELL - REACH, j * _CELL - REACH
            for b in range(_BANKS):
                for a in range(banks.size):
                    for s in range(samples):
                        x, y, heading, bank = moves[b, a, s]
                        c, d = math.cos(heading), math.sin(heading)
                        ahead, left = c * (u - x) + d * (v - y), c * (v - y) - d * (u - x)
                        sight[i, j, b, a] += worth[s] * _sight(eye, free, ahead, left, height, bank)
    later = discount ** (step * samples)
    table = Outlook(np.zeros((SIZE, SIZE, _BANKS)), limit, discount ** (1.0 / speed), 0.0)
    for _ in range(_ROUNDS):
        for i in range(SIZE):
            for j in range(SIZE):
                u, v = i * _CELL - REACH, j * _CELL - REACH
                for b in range(_BANKS):
                    best = -1.0
                    for a in range(banks.size):
                        x, y, heading, bank = moves[b, a, samples - 1]
                        c, d = math.cos(heading), math.sin(heading)
                        ahead, left = c * (u - x) + d * (v - y), c * (v - y) - d * (u - x)
                        total = sight[i, j, b, a] + later * outlook(table, ahead, left, bank)
                        best = max(best, total)
                    table.values[i, j, b] = best
    return Outlook(table.values, limit, table.fading, table.values.max())


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    free = free_shares(warm_walls(), 1.0, 1.0, 50.0, 1.0)
    table = new_outlook(
        Eye(BODY, 1.0, 100.0), free, 50.0, 15.0, np.array([-0.5, 0.5]), 3.0, 1.0, 0.5, 2, 0.5
    )
    outlook(table, 0.0, 0.0, 0.0)
