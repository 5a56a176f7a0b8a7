"""One flight by banks, what a camera shows from it, and what it risks: the parts of a look-ahead.

The dynamics are those of `staniel.kernels.flight`, at a steady airspeed and height and without
wind, which an agent does not know.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.flight import lagged
from staniel.kernels.footprint import BODY, Mount, in_cone, swung
from staniel.kernels.pieces import woven
from staniel.kernels.risk import Regions
from staniel.kernels.sightlines import Sightlines, new_sightlines, sees, slot_of
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = [
    "Eye",
    "aim",
    "axis_of",
    "danger",
    "flies_low",
    "glide",
    "no_regions",
    "roll_out",
    "shade",
    "strikes",
    "warm",
    "watch",
]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_G = 9.80665
_SIDE, _BELOW = 4.0, 2.0  # kept free of buildings, to each side and below [m]


class Eye(NamedTuple):
    """A camera, as the search takes it."""

    mount: Mount
    half_aperture: float
    """[rad]"""
    reach: float
    """Greatest slant range [m]."""


def no_regions() -> tuple[Regions, Floats]:
    """No regions, and the rates of none."""
    empty = Regions(
        np.zeros((0, 6)), np.zeros((0, 3)), np.zeros(1, dtype=np.int64), np.zeros((0, 2))
    )
    return empty, np.zeros(0)


@njit(cache=True, error_model="numpy")
def glide(
    x: float,
    y: float,
    heading: float,
    bank: float,
    speed: float,
    wanted: float,
    roll_gain: float,
    roll_rate: float,
    dt: float,
) -> tuple[float, float, float, float]:
    """x, y, heading and bank after `dt` at a wanted bank: thesis eq. 3.3 (corrected).

    As in `staniel.kernels.flight.fly`: the bank exactly, heading and way by Simpson's rule.
    """
    middle_bank = lagged(bank, wanted, roll_gain, roll_rate, 0.5 * dt)
    end_bank = lagged(bank, wanted, roll_gain, roll_rate, dt)
    gain = _G / speed
    rate, middle_rate = gain * math.tan(bank), gain * math.tan(middle_bank)
    end_rate = gain * math.tan(end_bank)
    middle = heading + dt / 24.0 * (5.0 * rate + 8.0 * middle_rate - end_rate)
    end = heading + dt / 6.0 * (rate + 4.0 * middle_rate + end_rate)
    way = speed * dt / 6.0
    x += way * (math.cos(heading) + 4.0 * math.cos(middle) + math.cos(end))
    y += way * (math.sin(heading) + 4.0 * math.sin(middle) + math.sin(end))
    return x, y, end, end_bank


@njit(cache=True, error_model="numpy")
def roll_out(
    start: Floats,
    banks: Floats,
    hold: float,
    age: float,
    steps: int,
    dt: float,
    roll_gain: float,
    roll_rate: float,
) -> Floats:
    """Poses of a flight that holds each bank for `hold` [s] in turn, then the last one.

    Parameters
    ----------
    start : (6,) float array
        x, y, z, heading, bank, speed, `age` seconds ago, when the sequence began.
    banks : (n,) float array [rad]
    hold, age : float [s]
    steps : int
    dt : float [s]
    roll_gain, roll_rate : float [1/s, rad/s]

    Returns
    -------
    (steps + 1, 6) float array
        Now and after each step.
    """
    poses = np.empty((steps + 1, 6))
    x, y, heading, bank, speed = start[0], start[1], start[3], start[4], start[5]
    before = math.ceil(age / dt - 1e-9)
    for k in range(before + steps + 1):
        if k >= before:
            row = k - before
            poses[row, 0], poses[row, 1], poses[row, 2] = x, y, start[2]
            poses[row, 3], poses[row, 4], poses[row, 5] = heading, bank, speed
        held = banks[min(int(k * dt / hold + 1e-9), banks.size - 1)]
        x, y, heading, bank = glide(x, y, heading, bank, speed, held, roll_gain, roll_rate, dt)
    return poses


@njit(cache=True, error_model="numpy")
def axis_of(heading: float, bank: float, mount: Mount) -> tuple[float, float, float]:
    """Along which a mounted camera looks, as `camera_axes`; of a gimbal its aircraft's down."""
    forward, left, up, rolls, _, _ = mount
    cosine, sine = math.cos(rolls * bank), math.sin(rolls * bank)
    aside = cosine * left + sine * up
    east, north = math.cos(heading), math.sin(heading)
    return east * forward - north * aside, north * forward + east * aside, cosine * up - sine * left


@njit(cache=True, error_model="numpy")
def aim(
    east: float, north: float, below: float, heading: float, bank: float, mount: Mount
) -> tuple[float, float, float]:
    """Along which any camera looks whose gimbal, if it has one, is led to a point.

    The point is `east`, `north` and `below` of the camera [m].
    """
    axis, limit = axis_of(heading, bank, mount), mount[5]
    if limit >= 0.0:
        axis = swung(axis, east, north, below, math.cos(limit), math.sin(limit))
    return axis


@woven
def watch(
    memory: Sightlines,
    walls: Walls,
    eye: Eye,
    slots: Indices,
    places: Floats,
    weights: Floats,
    x: float,
    y: float,
    axis: tuple[float, float, float],
) -> float:
    """Weight of the places in the cone, in range and in free sight of a camera.

    Parameters
    ----------
    memory : Sightlines
        Says how high the aircraft and the places are.
    walls : Walls
    eye : Eye
    slots : (m,) int array
        Of the places in `memory`.
    places : (m, 2) float array [m]
    weights : (m,) float array
        After the first that is 0 all are.
    x, y : float [m]
    axis : (float, float, float)
        Along which it looks.
    """
    ax, ay, az = axis
    dz = memory.target_height - memory.altitude
    down, height_2, reach_2 = az * dz, dz * dz, eye.reach * eye.reach
    cosine_2 = math.cos(eye.half_aperture) ** 2
    seen = 0.0
    for j in range(weights.size):
        if weights[j] == 0.0:
            break
        dx, dy = places[j, 0] - x, places[j, 1] - y
        slant_2, along = dx * dx + dy * dy + height_2, dx * ax + dy * ay + down
        # As `in_cone`, without its root: this is where a search spends its time.
        if along <= 0.0 or along * along < cosine_2 * slant_2 or slant_2 > reach_2:
            continue
        if sees(memory, walls, slots[j], x, y):
            seen += weights[j]
    return seen


@njit(cache=True, error_model="numpy")
def shade(
    walls: Walls,
    eye: Eye,
    poses: Floats,
    places: Floats,
    weights: Floats,
    height: float,
    trust: float,
) -> None:
    """Take from the weights what a partner sees who flies the poses, in place.

    A gimbal looks at the middle of the places.

    Parameters
    ----------
    walls : Walls
    eye : Eye
        The partner's.
    poses : (t + 1, 6) float array
    places : (t + 1, m, 2) float array [m]
    weights : (t + 1, m) float array
    height : float [m]
        Where on a vehicle it is seen.
    trust : float
        Share of the weight that is taken.
    """
    cosine = math.cos(eye.half_aperture)
    for t in range(weights.shape[0]):
        x, y, z = poses[t, 0], poses[t, 1], poses[t, 2]
        east, north = places[t, :, 0].mean() - x, places[t, :, 1].mean() - y
        ax, ay, az = aim(east, north, z, poses[t, 3], poses[t, 4], eye.mount)
        for j in range(weights.shape[1]):
            px, py = places[t, j, 0], places[t, j, 1]
            if in_cone(px - x, py - y, height - z, ax, ay, az, cosine, eye.reach) and line_of_sight(
                walls, x, y, z, px, py, height
            ):
                weights[t, j] *= 1.0 - trust


@njit(cache=True, error_model="numpy")
def danger(regions: Regions, rates: Floats, x: float, y: float, z: float) -> float:
    """Exposure a second at a place; infinite in a no-fly region, whose rate is."""
    total = 0.0
    for k in range(rates.size):
        box, disc = regions.box[k], regions.disc[k]
        if not (box[0] <= x <= box[1] and box[2] <= y <= box[3] and box[4] <= z <= box[5]):
            continue
        if disc[2] > 0.0:
            within = math.hypot(x - disc[0], y - disc[1]) <= disc[2]
        else:
            within, first, end = False, regions.first[k], regions.first[k + 1]
            for c in range(first, end):
                a, b = regions.corners[c], regions.corners[c + 1 if c + 1 < end else first]
                if (a[1] > y) != (b[1] > y):
                    within ^= x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        total += rates[k] if within else 0.0
    return total


@njit(cache=True, error_model="numpy")
def flies_low(walls: Walls, z: float) -> bool:
    """Whether buildings can be in the way at a height at all."""
    return bool(z - _BELOW < walls.tallest)


@njit(cache=True, error_model="numpy")
def strikes(walls: Walls, x0: float, y0: float, x1: float, y1: float, z: float) -> bool:
    """Whether a straight piece of flight comes too near to a building of the chart."""
    low = z - _BELOW
    length = math.hypot(x1 - x0, y1 - y0)
    aside_x, aside_y = _SIDE * (y0 - y1) / length, _SIDE * (x1 - x0) / length
    for side in (-1.0, 0.0, 1.0):
        dx, dy = side * aside_x, side * aside_y
        if not line_of_sight(walls, x0 + dx, y0 + dy, low, x1 + dx, y1 + dy, low):
            return True
    return False


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    walls, eye, memory = warm_walls(), Eye(BODY, 1.0, 100.0), new_sightlines(50.0, 1.0)
    poses = roll_out(
        np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0]), np.zeros(2), 1.0, 0.0, 2, 0.5, 3.0, 1.0
    )
    places, weights = np.zeros((3, 1, 2)), np.ones((3, 1))
    shade(walls, eye, poses, places, weights, 1.0, 0.9)
    slots = np.array([slot_of(memory, 0.0, 0.0)])
    watch(memory, walls, eye, slots, places[0], weights[0], 0.0, 0.0, (0.0, 0.0, -1.0))
