"""Which sequence of banks keeps a target in sight: a beam search, scored by what would be seen.

A *row* is a state of the search: x, y [m], heading, bank [rad], worth. Flights that end a hold in
nearly the same state are one from then on: the worthiest goes on. So a beam of some tens of rows
stands for the best of all the sequences, where as many random ones would be a drop in the sea.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, swung
from staniel.kernels.lookout import (
    Eye,
    axis_of,
    danger,
    flies_low,
    glide,
    no_regions,
    strikes,
    watch,
)
from staniel.kernels.moves import Moves, entry_of, new_moves
from staniel.kernels.outlook import Outlook, free_shares, new_outlook, outlook
from staniel.kernels.risk import Regions
from staniel.kernels.sightlines import Sightlines, new_sightlines, slot_of
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["Search", "plan", "warm"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_TWO_PI = 2.0 * math.pi
_TOGETHER = 6.0  # places nearer than that are one [m]
_SAME_PLACE, _SAME_HEADING, _SAME_BANK = 12.0, 0.5, 0.2  # within these two states are one


class Search(NamedTuple):
    """What is searched, and what counts."""

    moves: Moves
    """What may be held, and what comes of it."""
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
    beyond: Outlook
    """What a flight's end is worth."""


class Scene(NamedTuple):
    """Everything that a flight is scored by."""

    walls: Walls
    memory: Sightlines
    eye: Eye
    search: Search
    regions: Regions
    rates: Floats
    slots: Indices
    """(t + 1, m) of the places in `memory`."""
    places: Floats
    """(t + 1, m, 2) where the target may be at each instant, `_TOGETHER` apart [m]."""
    weights: Floats
    """(t + 1, m), those of 0 last."""
    centers: Floats
    """(t + 1, 2) middle of the places, where a gimbal looks [m]."""
    worths: Floats
    """(t + 1,) what a second at each instant counts."""
    start: Floats
    """(6,) pose: x, y, z, heading, bank, speed."""


@njit(cache=True, error_model="numpy")
def _key(x: float, y: float, heading: float, bank: float) -> int:
    """Number that states have in common which are nearly the same."""
    turned = heading - _TWO_PI * math.floor(heading / _TWO_PI)
    key = math.floor(x / _SAME_PLACE) + (1 << 20)
    key = (key << 21) + math.floor(y / _SAME_PLACE) + (1 << 20)
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
def _begin(start: Floats, rows: Floats) -> None:
    """Fill the first row from a pose."""
    rows[0, 0], rows[0, 1], rows[0, 2] = start[0], start[1], start[3]
    rows[0, 3], rows[0, 4] = start[4], 0.0


@njit(cache=True, error_model="numpy")
def _rank(beyond: Outlook, center: Floats, later: float, row: Floats) -> float:
    """Worth of a row, and of what may be hoped for from there on, which counts for `later`."""
    east, north = center[0] - row[0], center[1] - row[1]
    c, s = math.cos(row[2]), math.sin(row[2])
    hoped = outlook(beyond, c * east + s * north, c * north - s * east, row[3])
    return float(row[4] + later * hoped)


@njit(cache=True, error_model="numpy")
def _flown(scene: Scene, sequence: Floats, rows: Floats, level: int) -> float:
    """Rank of a whole sequence of banks; -inf where it may not be flown.

    ``rows[:level + 1]`` are the states before each bank; those after are filled in.
    """
    # A call that hands the whole scene on costs more than a look: hence this and `_grown` are long.
    search, walls, memory, eye = scene.search, scene.walls, scene.memory, scene.eye
    samples, step, altitude, speed = search.samples, search.step, memory.altitude, scene.start[5]
    gain, rate, worths = search.roll_gain, search.roll_rate, scene.worths
    centers, limit = scene.centers, eye.mount[5]
    swings, least, most = limit >= 0.0, math.cos(limit), math.sin(limit)
    low, dangerous = flies_low(walls, altitude), scene.rates.size > 0
    for k in range(level, sequence.size):
        x, y, heading, bank = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        worth = rows[k, 4]
        for t in range(k * samples + 1, (k + 1) * samples + 1):
            from_x, from_y = x, y
            x, y, heading, bank = glide(x, y, heading, bank, speed, sequence[k], gain, rate, step)
            if low and strikes(walls, from_x, from_y, x, y, altitude):
                return -math.inf
            axis = axis_of(heading, bank, eye.mount)
            if swings:
                east, north = centers[t, 0] - x, centers[t, 1] - y
                axis = swung(axis, east, north, altitude, least, most)
            seen = watch(
                memory, walls, eye, scene.slots[t], scene.places[t], scene.weights[t], x, y, axis
            )
            seen -= search.effort * bank * bank
            if dangerous:
                seen -= danger(scene.regions, scene.rates, x, y, altitude)
            worth += worths[t] * seen * step
        rows[k + 1, 0], rows[k + 1, 1], rows[k + 1, 2] = x, y, heading
        rows[k + 1, 3], rows[k + 1, 4] = bank, worth
        if worth == -math.inf:
            return -math.inf
    t = sequence.size * samples
    return _rank(search.beyond, scene.centers[t], worths[t], rows[sequence.size])


@njit(cache=True, error_model="numpy")
def _polished(scene: Scene, sequence: Floats) -> float:
    """Change one bank after the other a little, in place, where it pays; the rank in the end."""
    search, rows = scene.search, np.zeros((sequence.size + 1, 5))
    _begin(scene.start, rows)
    banks = search.moves.banks
    limit, size = banks[-1], banks[1] - banks[0]
    best = _flown(scene, sequence, rows, 0)
    if best == -math.inf:
        return best  # The rows after its end were never filled in.
    trial = rows.copy()
    for _ in range(search.polish):
        size *= 0.5
        for level in range(sequence.size):
            for side in (-1.0, 1.0):
                kept = sequence[level]
                sequence[level] = min(max(kept + side * size, -limit), limit)
                trial[level] = rows[level]
                rank = _flown(scene, sequence, trial, level)
                if rank > best:
                    best, rows[level:] = rank, trial[level:]
                else:
                    sequence[level] = kept
    return best


@njit(cache=True, error_model="numpy")
def _grown(
    scene: Scene,
    first: int,
    rows: Floats,
    table: Indices,
    keys: Indices,
    grown: Floats,
    origin: Indices,
) -> int:
    """Every row after every bank, one of each state; how many. `origin` says of what row and bank.

    `table` and `keys` are scratch: a hash table of the states.
    """
    search, walls, memory, eye = scene.search, scene.walls, scene.memory, scene.eye
    samples, step, altitude = search.samples, search.step, memory.altitude
    low, dangerous = flies_low(walls, altitude), scene.rates.size > 0
    moves, worths, centers = search.moves, scene.worths, scene.centers
    limit = eye.mount[5]
    swings, least, most = limit >= 0.0, math.cos(limit), math.sin(limit)
    end = np.empty(moves.ends.shape[3])
    table[:] = -1
    count = 0
    for i in range(rows.shape[0]):
        start_x, start_y, heading = rows[i, 0], rows[i, 1], rows[i, 2]
        cosine, sine = math.cos(heading), math.sin(heading)
        entry, share = entry_of(moves, rows[i, 3])
        for k in range(moves.banks.size):
            x, y, worth = start_x, start_y, rows[i, 4]
            for s in range(samples):
                t, from_x, from_y = first + s + 1, x, y
                for c in range(end.size):
                    before = moves.ends[entry, k, s, c]
                    end[c] = before + share * (moves.ends[entry + 1, k, s, c] - before)
                ahead, left, turned_c, turned_s = end[0], end[1], end[3], end[4]
                bank, aside, up = end[5], end[6], end[7]
                x = start_x + cosine * ahead - sine * left
                y = start_y + sine * ahead + cosine * left
                if low and strikes(walls, from_x, from_y, x, y, altitude):
                    worth = -math.inf
                    break
                east = cosine * turned_c - sine * turned_s
                north = sine * turned_c + cosine * turned_s
                axis = (
                    east * moves.forward - north * aside, north * moves.forward + east * aside, up
                )  # fmt: skip
                if swings:
                    east, north = centers[t, 0] - x, centers[t, 1] - y
                    axis = swung(axis, east, north, altitude, least, most)
                seen = watch(
                    memory, walls, eye, scene.slots[t], scene.places[t], scene.weights[t],
                    x, y, axis,
                )  # fmt: skip
                seen -= search.effort * bank * bank
                if dangerous:
                    seen -= danger(scene.regions, scene.rates, x, y, altitude)
                worth += worths[t] * seen * step
            if worth == -math.inf:
                continue
            key = _key(x, y, heading + end[2], end[5])
            at = _entry(table, keys, key)
            g = table[at]
            if g < 0:
                g, table[at], keys[at] = count, count, key
                count += 1
            elif grown[g, 4] >= worth:
                continue
            grown[g, 0], grown[g, 1], grown[g, 2] = x, y, heading + end[2]
            grown[g, 3], grown[g, 4] = end[5], worth
            origin[g, 0], origin[g, 1] = i, k
    return count


@njit(cache=True, error_model="numpy")
def _beam(scene: Scene) -> Floats:
    """The best sequence of the search's banks that a beam finds; empty where none may be flown."""
    search = scene.search
    banks = search.moves.banks
    most, size = search.width * banks.size, 64
    while size < 3 * most:
        size *= 2
    table, keys = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    parents = np.zeros((search.holds, search.width), dtype=np.int64)
    choices = np.zeros((search.holds, search.width), dtype=np.int64)
    grown, origin = np.empty((most, 5)), np.empty((most, 2), dtype=np.int64)
    rows = np.zeros((1, 5))
    _begin(scene.start, rows)
    for level in range(search.holds):
        first = level * search.samples
        count = _grown(scene, first, rows, table, keys, grown, origin)
        if count == 0:
            return np.zeros(0)
        ranks, t = np.empty(count), first + search.samples
        center, later = scene.centers[t], scene.worths[t]
        for c in range(count):
            ranks[c] = -_rank(search.beyond, center, later, grown[c])
        order = np.argsort(ranks, kind="mergesort")[: search.width]
        rows = np.empty((order.size, 5))
        for q in range(order.size):
            c = order[q]
            parents[level, q], choices[level, q] = origin[c, 0], origin[c, 1]
            for e in range(5):
                rows[q, e] = grown[c, e]
    best, q = np.empty(search.holds), 0
    for level in range(search.holds - 1, -1, -1):
        best[level], q = banks[choices[level, q]], parents[level, q]
    return best


@njit(cache=True, error_model="numpy")
def _merged(memory: Sightlines, places: Floats, weights: Floats) -> tuple[Indices, Floats, Floats]:
    """Slots, places and weights: of places near to each other the first stands for all."""
    instants, m = weights.shape
    slots = np.zeros((instants, m), dtype=np.int64)
    kept, sums = np.zeros((instants, m, 2)), np.zeros((instants, m))
    for t in range(instants):
        count = 0
        for j in range(m):
            x, y, weight = places[t, j, 0], places[t, j, 1], weights[t, j]
            if weight == 0.0:
                continue
            at = 0
            while at < count and math.hypot(kept[t, at, 0] - x, kept[t, at, 1] - y) > _TOGETHER:
                at += 1
            if at == count:
                kept[t, at, 0], kept[t, at, 1] = x, y
                slots[t, at], count = slot_of(memory, x, y), count + 1
            sums[t, at] += weight
    return slots, kept, sums


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
    r"""The sequence of banks that is worth most: the beam's best or the last plan's rest, polished.

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
        Where the target may be, now and after each step of the search. A gimbal is led to their
        mean.
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
        :math:`\sum_t \gamma^{t} (\sum_j w_{tj} [j\ seen] - cost_t)\,\Delta t`, and the outlook at
        the end.
    """
    instants = places.shape[0]
    centers, worths = np.empty((instants, 2)), np.empty(instants)
    for t in range(instants):
        centers[t, 0], centers[t, 1] = places[t, :, 0].mean(), places[t, :, 1].mean()
        worths[t] = search.discount ** (t * search.step)
    slots, places, weights = _merged(memory, places, weights)
    scene = Scene(
        walls, memory, eye, search, regions, rates, slots, places, weights, centers, worths, start
    )
    best, worth = np.zeros(0), -math.inf
    for sequence in (previous.copy(), _beam(scene)):
        if sequence.size > 0:
            rank = _polished(scene, sequence)
            if rank > worth:
                best, worth = sequence, rank
    return best, worth


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    memory, eye, walls = new_sightlines(50.0, 1.0), Eye(BODY, 1.0, 100.0), warm_walls()
    banks, free = np.array([-0.5, 0.5]), free_shares(walls, 1.0, 1.0, 50.0, 1.0)
    moves = new_moves(banks, 15.0, 3.0, 1.0, 0.5, 2, BODY)
    beyond = new_outlook(eye, free, 50.0, 15.0, banks, 3.0, 1.0, 0.5, 2, 0.95)
    search = Search(moves, 1, 2, 0.5, 3.0, 1.0, 4, 0.95, 0.0, 1, beyond)
    start = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0])
    places, weights = np.zeros((3, 1, 2)), np.ones((3, 1))
    regions, rates = no_regions()
    plan(walls, memory, eye, search, regions, rates, start, places, weights, np.zeros(1))
