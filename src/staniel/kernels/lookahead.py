"""Which sequence of banks keeps a target in sight: a beam search over many, scored by what they see.

A *row* is a state of the search: x, y [m], heading, bank [rad], worth. Flights that end a hold in
nearly the same state are one from then on: the worthiest goes on. So a beam of some tens of rows
stands for the best of all the sequences, where as many random ones would be a drop in the sea.

The dynamics are those of `staniel.kernels.flight`, at a steady airspeed and height and without
wind, which an agent does not know.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.flight import lagged
from staniel.kernels.footprint import BODY, Mount, in_cone
from staniel.kernels.risk import Regions
from staniel.kernels.sightlines import Sightlines, new_sightlines, sees, slot_of
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["Eye", "Search", "glide", "no_regions", "plan", "roll_out", "shade", "warm", "watch"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_G = 9.80665
_TWO_PI = 2.0 * math.pi
_NEAR = 30.0  # no nearer need a flight be to what it watches [m]
_PULL = 0.02  # seconds of sight that each metre beyond is held to cost, when flights are compared
_SAME_PLACE, _SAME_HEADING, _SAME_BANK = 8.0, 0.35, 0.2  # within these two states are one
_SIDE, _BELOW = 4.0, 2.0  # kept free of buildings, to each side and below [m]


class Eye(NamedTuple):
    """A camera, as the search takes it."""

    mount: Mount
    half_aperture: float
    """[rad]"""
    reach: float
    """Greatest slant range [m]."""


class Search(NamedTuple):
    """What is searched, and what counts."""

    banks: Floats
    """(k,) what may be held [rad]."""
    holds: int
    """How many are held one after the other."""
    samples: int
    """Instants of each hold at which it is looked."""
    step: float
    """Between two of them [s]."""
    roll_gain: float
    """[1/s]"""
    roll_rate: float
    """[rad/s]"""
    width: int
    """Rows of the beam."""
    discount: float
    """What a second later is worth of one now."""
    effort: float
    """Seconds of sight that a second at a bank of one radian costs, by its square."""
    polish: int
    """How often the best sequences are gone through for small changes."""


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
    before = int(math.ceil(age / dt - 1e-9))
    for k in range(before + steps + 1):
        if k >= before:
            row = k - before
            poses[row, 0], poses[row, 1], poses[row, 2] = x, y, start[2]
            poses[row, 3], poses[row, 4], poses[row, 5] = heading, bank, speed
        held = banks[min(int(k * dt / hold + 1e-9), banks.size - 1)]
        x, y, heading, bank = glide(x, y, heading, bank, speed, held, roll_gain, roll_rate, dt)
    return poses


@njit(cache=True, error_model="numpy")
def _axis(heading: float, bank: float, mount: Mount) -> tuple[float, float, float]:
    """Along which a mounted camera looks, as `camera_axes`; a gimbal looks straight down."""
    forward, left, up, rolls, _, limit = mount
    if limit >= 0.0:
        forward, left, up, rolls = 0.0, 0.0, -1.0, 0.0
    cosine, sine = math.cos(rolls * bank), math.sin(rolls * bank)
    aside = cosine * left + sine * up
    east, north = math.cos(heading), math.sin(heading)
    return east * forward - north * aside, north * forward + east * aside, cosine * up - sine * left


@njit(cache=True, error_model="numpy")
def watch(
    memory: Sightlines,
    walls: Walls,
    eye: Eye,
    slots: Indices,
    places: Floats,
    weights: Floats,
    x: float,
    y: float,
    heading: float,
    bank: float,
) -> float:
    """Weight of the places in the cone, in range and in free sight from a pose.

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
    x, y, heading, bank : float
    """
    ax, ay, az = _axis(heading, bank, eye.mount)
    cosine = math.cos(eye.half_aperture)
    dz = memory.target_height - memory.altitude
    seen = 0.0
    for j in range(weights.size):
        if weights[j] > 0.0:
            dx, dy = places[j, 0] - x, places[j, 1] - y
            if in_cone(dx, dy, dz, ax, ay, az, cosine, eye.reach) and sees(
                memory, walls, slots[j], x, y
            ):
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
        ax, ay, az = _axis(poses[t, 3], poses[t, 4], eye.mount)
        for j in range(weights.shape[1]):
            px, py = places[t, j, 0], places[t, j, 1]
            if in_cone(px - x, py - y, height - z, ax, ay, az, cosine, eye.reach) and line_of_sight(
                walls, x, y, z, px, py, height
            ):
                weights[t, j] *= 1.0 - trust


@njit(cache=True, error_model="numpy")
def _danger(regions: Regions, rates: Floats, x: float, y: float, z: float) -> float:
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
def _strikes(walls: Walls, x0: float, y0: float, x1: float, y1: float, z: float) -> bool:
    """Whether a straight piece of flight comes too near to a building of the chart."""
    low = z - _BELOW
    if low >= walls.tallest:
        return False
    length = math.hypot(x1 - x0, y1 - y0)
    aside_x, aside_y = _SIDE * (y0 - y1) / length, _SIDE * (x1 - x0) / length
    for side in (-1.0, 0.0, 1.0):
        dx, dy = side * aside_x, side * aside_y
        if not line_of_sight(walls, x0 + dx, y0 + dy, low, x1 + dx, y1 + dy, low):
            return True
    return False


@njit(cache=True, error_model="numpy")
def _key(x: float, y: float, heading: float, bank: float) -> int:
    """Number that states have in common which are nearly the same."""
    turned = heading - _TWO_PI * math.floor(heading / _TWO_PI)
    key = int(math.floor(x / _SAME_PLACE)) + (1 << 20)
    key = (key << 21) + int(math.floor(y / _SAME_PLACE)) + (1 << 20)
    key = (key << 5) + int(turned / _SAME_HEADING)
    return (key << 2) + (0 if bank < -_SAME_BANK else (2 if bank > _SAME_BANK else 1))


@njit(cache=True, error_model="numpy")
def _entry(table: Indices, keys: Indices, key: int) -> int:
    """Where a key is in an open hash table, or would be; -1 in `table` is an empty entry."""
    mask = table.size - 1
    at = ((key * 0x9E3779B1) >> 17) & mask
    while table[at] >= 0 and keys[at] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, error_model="numpy")
def _hold(
    walls: Walls,
    memory: Sightlines,
    eye: Eye,
    search: Search,
    regions: Regions,
    rates: Floats,
    slots: Indices,
    places: Floats,
    weights: Floats,
    first: int,
    speed: float,
    row: Floats,
    wanted: float,
) -> tuple[float, float, float, float, float]:
    """A row after one more hold, from instant `first` on; its worth is -inf where it may not fly."""
    x, y, heading, bank, worth = row[0], row[1], row[2], row[3], row[4]
    step = search.step
    for s in range(search.samples):
        t = first + s + 1
        from_x, from_y = x, y
        x, y, heading, bank = glide(
            x, y, heading, bank, speed, wanted, search.roll_gain, search.roll_rate, step
        )
        if _strikes(walls, from_x, from_y, x, y, memory.altitude):
            return x, y, heading, bank, -math.inf
        seen = watch(memory, walls, eye, slots[t], places[t], weights[t], x, y, heading, bank)
        cost = search.effort * bank * bank
        if rates.size > 0:
            cost += _danger(regions, rates, x, y, memory.altitude)
        worth += search.discount ** (t * step) * (seen - cost) * step
    return x, y, heading, bank, worth


@njit(cache=True, error_model="numpy")
def _flown(
    walls: Walls,
    memory: Sightlines,
    eye: Eye,
    search: Search,
    regions: Regions,
    rates: Floats,
    slots: Indices,
    places: Floats,
    weights: Floats,
    speed: float,
    sequence: Floats,
    rows: Floats,
    level: int,
) -> float:
    """Rank of a sequence of banks: its worth, less what the distance at its end costs.

    ``rows[:level + 1]`` are the states before each bank; those after are filled in.
    """
    for k in range(level, sequence.size):
        x, y, heading, bank, worth = _hold(
            walls, memory, eye, search, regions, rates, slots, places, weights,
            k * search.samples, speed, rows[k], sequence[k],
        )  # fmt: skip
        if worth == -math.inf:
            return -math.inf
        rows[k + 1, 0], rows[k + 1, 1], rows[k + 1, 2] = x, y, heading
        rows[k + 1, 3], rows[k + 1, 4] = bank, worth
    end, t = rows[sequence.size], sequence.size * search.samples
    away = math.hypot(end[0] - places[t, :, 0].mean(), end[1] - places[t, :, 1].mean())
    far = _PULL * max(0.0, away - _NEAR)
    return float(end[4] - search.discount ** (t * search.step) * far)


@njit(cache=True, error_model="numpy")
def _polished(
    walls: Walls,
    memory: Sightlines,
    eye: Eye,
    search: Search,
    regions: Regions,
    rates: Floats,
    slots: Indices,
    places: Floats,
    weights: Floats,
    start: Floats,
    sequence: Floats,
) -> float:
    """Change one bank after the other a little, in place, where that is worth more; the worth."""
    rows = np.zeros((sequence.size + 1, 5))
    rows[0, 0], rows[0, 1], rows[0, 2], rows[0, 3] = start[0], start[1], start[3], start[4]
    limit, size = search.banks[-1], search.banks[1] - search.banks[0]
    best = _flown(
        walls, memory, eye, search, regions, rates, slots, places, weights,
        start[5], sequence, rows, 0,
    )  # fmt: skip
    trial = rows.copy()
    for _ in range(search.polish):
        size *= 0.5
        for level in range(sequence.size):
            for side in (-1.0, 1.0):
                kept = sequence[level]
                sequence[level] = min(max(kept + side * size, -limit), limit)
                trial[level] = rows[level]
                worth = _flown(
                    walls, memory, eye, search, regions, rates, slots, places, weights,
                    start[5], sequence, trial, level,
                )  # fmt: skip
                if worth > best:
                    best, rows[level:] = worth, trial[level:]
                else:
                    sequence[level] = kept
    return best


@njit(cache=True, error_model="numpy")
def _chosen(rows: Floats, count: int, width: int, center: Floats, worth: float) -> Indices:
    """The `width` worthiest of `count` rows, the first the best.

    Flights far from where the target may be see nothing yet, all alike: the nearer is preferred.
    """
    ranks = np.empty(count)
    for c in range(count):
        away = math.hypot(rows[c, 0] - center[0], rows[c, 1] - center[1])
        ranks[c] = worth * _PULL * max(0.0, away - _NEAR) - rows[c, 4]
    return np.argsort(ranks, kind="mergesort")[:width]


@njit(cache=True, error_model="numpy")
def _beam(
    walls: Walls,
    memory: Sightlines,
    eye: Eye,
    search: Search,
    regions: Regions,
    rates: Floats,
    slots: Indices,
    places: Floats,
    weights: Floats,
    start: Floats,
) -> Floats:
    """The best sequence of the search's banks that a beam finds; empty where none may be flown."""
    kinds, size = search.banks.size, 64
    while size < 3 * search.width * kinds:
        size *= 2
    table, keys = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    parents = np.zeros((search.holds, search.width), dtype=np.int64)
    choices = np.zeros((search.holds, search.width), dtype=np.int64)
    grown = np.empty((search.width * kinds, 5))
    origin = np.empty((search.width * kinds, 2), dtype=np.int64)
    rows, center = np.zeros((1, 5)), np.empty(2)
    rows[0, 0], rows[0, 1], rows[0, 2], rows[0, 3] = start[0], start[1], start[3], start[4]
    for level in range(search.holds):
        table[:] = -1
        count, first = 0, level * search.samples
        for i in range(rows.shape[0]):
            for k in range(kinds):
                x, y, heading, bank, worth = _hold(
                    walls, memory, eye, search, regions, rates, slots, places, weights,
                    first, start[5], rows[i], search.banks[k],
                )  # fmt: skip
                if worth == -math.inf:
                    continue
                key = _key(x, y, heading, bank)
                at = _entry(table, keys, key)
                c = table[at]
                if c < 0:
                    c, table[at], keys[at] = count, count, key
                    count += 1
                elif grown[c, 4] >= worth:
                    continue
                grown[c, 0], grown[c, 1], grown[c, 2] = x, y, heading
                grown[c, 3], grown[c, 4] = bank, worth
                origin[c, 0], origin[c, 1] = i, k
        if count == 0:
            return np.zeros(0)
        t = first + search.samples
        center[0], center[1] = places[t, :, 0].mean(), places[t, :, 1].mean()
        order = _chosen(grown, count, search.width, center, search.discount ** (t * search.step))
        rows = np.empty((order.size, 5))
        for q in range(order.size):
            c = order[q]
            parents[level, q], choices[level, q] = origin[c, 0], origin[c, 1]
            for e in range(5):
                rows[q, e] = grown[c, e]
    best, q = np.empty(search.holds), 0
    for level in range(search.holds - 1, -1, -1):
        best[level], q = search.banks[choices[level, q]], parents[level, q]
    return best


@njit(cache=True, error_model="numpy")
def plan(
    walls: Walls,
    memory: Sightlines,
    eye: Eye,
    search: Search,
    regions: Regions,
    rates: Floats,
    start: Floats,
    places: Floats,
    weights: Floats,
    previous: Floats,
) -> tuple[Floats, float]:
    r"""The sequence of banks that is worth most: the beam's best, or the last plan's rest, polished.

    Parameters
    ----------
    walls : Walls
        Of the chart.
    memory : Sightlines
        At the flight height; learns.
    eye : Eye
    search : Search
    regions, rates : Regions, (r,) float array
        Where it is dangerous to fly, and what a second there costs, in seconds of sight; infinite
        where it is forbidden.
    start : (6,) float array
        The aircraft's pose: x, y, z, heading, bank, speed.
    places : (t + 1, m, 2) float array [m]
        Where the target may be, now and after each step of the search.
    weights : (t + 1, m) float array
        What seeing it there is worth.
    previous : (holds,) float array [rad]
        A sequence that the search has to beat: what is left of the last plan.

    Returns
    -------
    banks : (holds,) float array [rad]
        Empty where every sequence ends in a building or a no-fly region.
    worth : float [s]
        Expected discounted seconds of sight, less exposure and effort,
        :math:`\sum_t \gamma^{t} (\sum_j w_{tj} [j\ seen] - cost_t)\,\Delta t`, and less what the
        distance at the end costs.
    """
    steps, m = places.shape[0] - 1, places.shape[1]
    slots = np.empty((steps + 1, m), dtype=np.int64)
    for t in range(steps + 1):
        for j in range(m):
            slots[t, j] = slot_of(memory, places[t, j, 0], places[t, j, 1])
    best, worth = previous.copy(), -math.inf
    for sequence in (
        previous.copy(),
        _beam(walls, memory, eye, search, regions, rates, slots, places, weights, start),
    ):
        if sequence.size == 0:
            continue
        value = _polished(
            walls, memory, eye, search, regions, rates, slots, places, weights, start, sequence
        )
        if value > worth:
            best, worth = sequence, value
    return (best if worth > -math.inf else np.zeros(0)), worth


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    walls, memory, eye = warm_walls(), new_sightlines(50.0, 1.0), Eye(BODY, 1.0, 100.0)
    start = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0])
    poses = roll_out(start, np.zeros(2), 1.0, 0.0, 2, 0.5, 3.0, 1.0)
    places, weights = np.zeros((3, 1, 2)), np.ones((3, 1))
    shade(walls, eye, poses, places, weights, 1.0, 0.9)
    search = Search(np.array([-0.5, 0.5]), 1, 2, 0.5, 3.0, 1.0, 4, 0.95, 0.0, 1)
    plan(
        walls, memory, eye, search, *no_regions(), start, places, weights,
        np.zeros(1),
    )  # fmt: skip
