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

from staniel.kernels.footprint import BODY
from staniel.kernels.lookout import Eye, danger, glide, no_regions, strikes, watch
from staniel.kernels.risk import Regions
from staniel.kernels.sightlines import Sightlines, new_sightlines, slot_of
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["Search", "plan", "warm"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_TWO_PI = 2.0 * math.pi
_NEAR = 30.0  # no nearer need a flight be to what it watches [m]
_PULL = 0.02  # seconds of sight that each metre beyond is held to cost, when flights are compared
_SAME_PLACE, _SAME_HEADING, _SAME_BANK = 8.0, 0.35, 0.2  # within these two states are one


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
    """(t + 1, m, 2) where the target may be at each instant [m]."""
    weights: Floats
    """(t + 1, m)"""
    centers: Floats
    """(t + 1, 2) middle of the places [m]."""
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
def _hold(
    scene: Scene, first: int, row: Floats, wanted: float
) -> tuple[float, float, float, float, float]:
    """A row after one more hold, from instant `first` on; worth -inf where it may not be flown."""
    x, y, heading, bank, worth = row[0], row[1], row[2], row[3], row[4]
    search, speed, altitude = scene.search, scene.start[5], scene.memory.altitude
    for s in range(search.samples):
        t = first + s + 1
        from_x, from_y = x, y
        x, y, heading, bank = glide(
            x, y, heading, bank, speed, wanted, search.roll_gain, search.roll_rate, search.step
        )
        if strikes(scene.walls, from_x, from_y, x, y, altitude):
            return x, y, heading, bank, -math.inf
        seen = watch(
            scene.memory, scene.walls, scene.eye, scene.slots[t], scene.places[t],
            scene.weights[t], x, y, heading, bank,
        )  # fmt: skip
        cost = search.effort * bank * bank
        if scene.rates.size > 0:
            cost += danger(scene.regions, scene.rates, x, y, altitude)
        worth += scene.worths[t] * (seen - cost) * search.step
    return x, y, heading, bank, worth


@njit(cache=True, error_model="numpy")
def _begin(start: Floats, rows: Floats) -> None:
    """Fill the first row from a pose."""
    rows[0, 0], rows[0, 1], rows[0, 2] = start[0], start[1], start[3]
    rows[0, 3], rows[0, 4] = start[4], 0.0


@njit(cache=True, error_model="numpy")
def _rank(scene: Scene, row: Floats, t: int) -> float:
    """Worth of a row at instant t, less what its distance costs.

    Flights far from where the target may be see nothing yet, all alike: the nearer is preferred.
    """
    away = math.hypot(row[0] - scene.centers[t, 0], row[1] - scene.centers[t, 1])
    return float(row[4] - scene.worths[t] * (_PULL * max(0.0, away - _NEAR)))


@njit(cache=True, error_model="numpy")
def _flown(scene: Scene, sequence: Floats, rows: Floats, level: int) -> float:
    """Rank of a whole sequence of banks; -inf where it may not be flown.

    ``rows[:level + 1]`` are the states before each bank; those after are filled in.
    """
    samples = scene.search.samples
    for k in range(level, sequence.size):
        x, y, heading, bank, worth = _hold(scene, k * samples, rows[k], sequence[k])
        if worth == -math.inf:
            return -math.inf
        rows[k + 1, 0], rows[k + 1, 1], rows[k + 1, 2] = x, y, heading
        rows[k + 1, 3], rows[k + 1, 4] = bank, worth
    return _rank(scene, rows[sequence.size], sequence.size * samples)


@njit(cache=True, error_model="numpy")
def _polished(scene: Scene, sequence: Floats) -> float:
    """Change one bank after the other a little, in place, where it pays; the rank in the end."""
    search, rows = scene.search, np.zeros((sequence.size + 1, 5))
    _begin(scene.start, rows)
    limit, size = search.banks[-1], search.banks[1] - search.banks[0]
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
    table[:] = -1
    count, banks = 0, scene.search.banks
    for i in range(rows.shape[0]):
        for k in range(banks.size):
            x, y, heading, bank, worth = _hold(scene, first, rows[i], banks[k])
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
    return count


@njit(cache=True, error_model="numpy")
def _beam(scene: Scene) -> Floats:
    """The best sequence of the search's banks that a beam finds; empty where none may be flown."""
    search = scene.search
    most, size = search.width * search.banks.size, 64
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
        ranks = np.empty(count)
        for c in range(count):
            ranks[c] = -_rank(scene, grown[c], first + search.samples)
        order = np.argsort(ranks, kind="mergesort")[: search.width]
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
    instants, m = places.shape[0], places.shape[1]
    slots = np.empty((instants, m), dtype=np.int64)
    centers, worths = np.empty((instants, 2)), np.empty(instants)
    for t in range(instants):
        for j in range(m):
            slots[t, j] = slot_of(memory, places[t, j, 0], places[t, j, 1])
        centers[t, 0], centers[t, 1] = places[t, :, 0].mean(), places[t, :, 1].mean()
        worths[t] = search.discount ** (t * search.step)
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
    memory, eye = new_sightlines(50.0, 1.0), Eye(BODY, 1.0, 100.0)
    search = Search(np.array([-0.5, 0.5]), 1, 2, 0.5, 3.0, 1.0, 4, 0.95, 0.0, 1)
    start = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0])
    places, weights = np.zeros((3, 1, 2)), np.ones((3, 1))
    regions, rates = no_regions()
    plan(warm_walls(), memory, eye, search, regions, rates, start, places, weights, np.zeros(1))
