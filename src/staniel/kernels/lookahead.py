"""Which sequence of banks keeps a target in sight: a beam search, scored by what would be seen.

A *row* is a state of the search: x, y [m], heading, bank [rad], worth. Flights that end a hold in
nearly the same state are one from then on: the most promising goes on. So a beam of some tens of
rows stands for the best of all the sequences, where as many random ones would be a drop in the sea.
What cannot come among the best even if it saw everything is not looked at.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY
from staniel.kernels.lookout import Eye, flies_low, no_regions
from staniel.kernels.moves import entry_of, nearest, new_moves
from staniel.kernels.outlook import Outlook, free_shares, new_outlook, outlook
from staniel.kernels.pieces import bare, woven
from staniel.kernels.risk import Regions
from staniel.kernels.scene import Scene, Search, ended, gained, merged
from staniel.kernels.sightlines import Sightlines, new_sightlines
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["plan", "warm"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_TWO_PI = 2.0 * math.pi
_SAME_PLACE, _SAME_HEADING, _SAME_BANK = 12.0, 0.5, 0.2  # within these two states are one


@bare
def _key(x: float, y: float, heading: float, bank: float) -> int:
    """Number that states have in common which are nearly the same."""
    turned = heading - _TWO_PI * math.floor(heading / _TWO_PI)
    key = math.floor(x / _SAME_PLACE) + (1 << 20)
    key = (key << 21) + math.floor(y / _SAME_PLACE) + (1 << 20)
    key = (key << 5) + int(turned / _SAME_HEADING)
    return (key << 2) + (0 if bank < -_SAME_BANK else (2 if bank > _SAME_BANK else 1))


@bare
def _entry(table: Indices, keys: Indices, key: int) -> int:
    """Where a key is in an open hash table, or would be; -1 in `table` is an empty entry."""
    mask = table.size - 1
    at = ((key * 0x9E3779B1) >> 17) & mask
    while table[at] >= 0 and keys[at] != key:
        at = (at + 1) & mask
    return at


@bare
def _begin(start: Floats, rows: Floats) -> None:
    """Fill the first row from a pose."""
    rows[0, 0], rows[0, 1], rows[0, 2] = start[0], start[1], start[3]
    rows[0, 3], rows[0, 4] = start[4], 0.0


@bare
def _swing(eye: Eye) -> tuple[float, float]:
    """Cosine and sine of the limit of a gimbal."""
    return math.cos(eye.mount[5]), math.sin(eye.mount[5])


@woven
def _hoped(
    beyond: Outlook, center: Floats, x: float, y: float, east: float, north: float, bank: float
) -> float:
    """Outlook of a state, `east` and `north` the cosine and sine of its heading."""
    away_x, away_y = center[0] - x, center[1] - y
    ahead, left = east * away_x + north * away_y, east * away_y - north * away_x
    return float(outlook(beyond, ahead, left, bank))


@bare
def _flown(scene: Scene, sequence: Indices, rows: Floats, level: int, least: float) -> float:
    """Worth of a whole sequence of banks and its outlook; -inf unless it is above `least`.

    ``rows[:level + 1]`` are the states before each bank; those after are filled in.
    """
    search, samples = scene.search, scene.search.samples
    moves, last = search.moves, samples - 1
    low, swing = flies_low(scene.walls, scene.memory.altitude), _swing(scene.eye)
    end = sequence.size * samples
    later, center = scene.worths[end], scene.centers[end]
    slack = rows[level, 4] + later * search.beyond.most - least
    for t in range(level * samples + 1, end + 1):
        slack += scene.tops[t]
    hoped = 0.0
    for k in range(level, sequence.size):
        x, y, heading = rows[k, 0], rows[k, 1], rows[k, 2]
        east, north = math.cos(heading), math.sin(heading)
        entry, share = entry_of(moves, rows[k, 3])
        first, held = k * samples, sequence[k]
        gain = gained(scene, low, swing, first, x, y, east, north, entry, share, held, slack)
        if gain == -math.inf:
            return -math.inf
        for t in range(first + 1, first + samples + 1):
            slack -= scene.tops[t]
        slack += gain
        x, y, turned, east, north, bank = ended(
            moves, last, x, y, east, north, entry, share, held
        )  # fmt: skip
        rows[k + 1, 0], rows[k + 1, 1], rows[k + 1, 2] = x, y, heading + turned
        rows[k + 1, 3], rows[k + 1, 4] = bank, rows[k, 4] + gain
        if k == sequence.size - 1:
            hoped = _hoped(search.beyond, center, x, y, east, north, bank)
    rank: float = rows[sequence.size, 4] + later * hoped
    return rank if rank > least else -math.inf


@njit(cache=True, error_model="numpy")
def _polished(scene: Scene, sequence: Indices) -> float:
    """Change one bank after the other a little, in place, where it pays; the rank in the end."""
    search, rows = scene.search, np.zeros((sequence.size + 1, 5))
    _begin(scene.start, rows)
    size, top = search.moves.stride, search.moves.banks.size - 1
    best = _flown(scene, sequence, rows, 0, -math.inf)
    if best == -math.inf:
        return best  # The rows after its end were never filled in.
    trial = rows.copy()
    for _ in range(search.polish):
        size = max(size // 2, 1)
        for level in range(sequence.size):
            for side in (-1, 1):
                kept = sequence[level]
                sequence[level] = min(max(kept + side * size, 0), top)
                trial[level] = rows[level]
                rank = _flown(scene, sequence, trial, level, best)
                if rank > best:
                    best, rows[level:] = rank, trial[level:]
                else:
                    sequence[level] = kept
    return best


@bare
def _raised(best: Indices, ranks: Floats, at: int) -> None:
    """Move the entry `at` of `best` up to where it belongs by its rank, in place."""
    g = best[at]
    while at > 0 and ranks[best[at - 1]] < ranks[g]:
        best[at] = best[at - 1]
        at -= 1
    best[at] = g


@bare
def _grown(
    scene: Scene,
    first: int,
    rows: Floats,
    table: Indices,
    keys: Indices,
    grown: Floats,
    ranks: Floats,
    origin: Indices,
    best: Indices,
) -> int:
    """The most promising states after every bank of every row, one of each kind; how many.

    `best` are their rows in `grown`, in order of `ranks`; `origin` says of what row and bank each
    comes. `table` and `keys` are scratch: a hash table of the kinds.
    """
    search, samples = scene.search, scene.search.samples
    moves, stride, last = search.moves, search.moves.stride, samples - 1
    low, swing = flies_low(scene.walls, scene.memory.altitude), _swing(scene.eye)
    end = first + samples
    later, center, top = scene.worths[end], scene.centers[end], 0.0
    for t in range(first + 1, end + 1):
        top += scene.tops[t]
    table[:] = -1
    count, kept = 0, 0
    for i in range(rows.shape[0]):
        x, y, heading, worth = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 4]
        east, north = math.cos(heading), math.sin(heading)
        entry, share = entry_of(moves, rows[i, 3])
        for k in range(0, moves.banks.size, stride):
            there_x, there_y, turned, there_east, there_north, bank = ended(
                moves, last, x, y, east, north, entry, share, k
            )
            hoped = later * _hoped(
                search.beyond, center, there_x, there_y, there_east, there_north, bank
            )  # fmt: skip
            slack = math.inf
            if kept == best.size:
                slack = worth + top + hoped - ranks[best[kept - 1]]
                if slack <= 0.0:
                    continue
            gain = gained(scene, low, swing, first, x, y, east, north, entry, share, k, slack)
            if gain == -math.inf:
                continue
            rank, key = worth + gain + hoped, _key(there_x, there_y, heading + turned, bank)
            at = _entry(table, keys, key)
            g = table[at]
            if g < 0:
                g, table[at], keys[at] = count, count, key
                count += 1
                place = kept
            elif ranks[g] >= rank:
                continue
            else:
                place = 0
                while place < kept and best[place] != g:
                    place += 1
            grown[g, 0], grown[g, 1], grown[g, 2] = there_x, there_y, heading + turned
            grown[g, 3], grown[g, 4], ranks[g] = bank, worth + gain, rank
            origin[g, 0], origin[g, 1] = i, k
            if place == kept:  # not among the best until now
                kept = min(kept + 1, best.size)
                place = kept - 1
                best[place] = g
            _raised(best, ranks, place)
    return kept


@njit(cache=True, error_model="numpy")
def _beam(scene: Scene) -> Indices:
    """The best sequence of the search's banks that a beam finds; empty where none may be flown."""
    search, width = scene.search, scene.search.width
    most, size = width * ((search.moves.banks.size - 1) // search.moves.stride + 1), 64
    while size < 3 * most:
        size *= 2
    table, keys = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    parents = np.zeros((search.holds, width), dtype=np.int64)
    choices = np.zeros((search.holds, width), dtype=np.int64)
    grown, ranks = np.empty((most, 5)), np.empty(most)
    origin, order = np.empty((most, 2), dtype=np.int64), np.empty(width, dtype=np.int64)
    rows = np.zeros((1, 5))
    _begin(scene.start, rows)
    for level in range(search.holds):
        first = level * search.samples
        kept = _grown(scene, first, rows, table, keys, grown, ranks, origin, order)
        if kept == 0:
            return np.zeros(0, dtype=np.int64)
        rows = np.empty((kept, 5))
        for q in range(kept):
            c = order[q]
            parents[level, q], choices[level, q] = origin[c, 0], origin[c, 1]
            for e in range(5):
                rows[q, e] = grown[c, e]
    best, q = np.empty(search.holds, dtype=np.int64), 0
    for level in range(search.holds - 1, -1, -1):
        best[level], q = choices[level, q], parents[level, q]
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
        Where the target may be, now and after each step of the search. A gimbal is led to their
        mean.
    weights : (t + 1, m) float array
        What seeing it there is worth.
    previous : (holds,) float array [rad]
        A sequence that the search has to beat: what is left of the last plan, each bank taken for
        the nearest of `search.moves`.

    Returns
    -------
    banks : (holds,) float array [rad]
        Empty where every sequence ends in a building or a no-fly region.
    worth : float [s]
        Expected discounted seconds of sight, less exposure and effort,
        :math:`\sum_t \gamma^{t} (\sum_j w_{tj} [j\ seen] - cost_t)\,\Delta t`, and the outlook at
        the end.
    """
    instants, moves = places.shape[0], search.moves
    centers, worths, tops = np.empty((instants, 2)), np.empty(instants), np.empty(instants)
    for t in range(instants):
        centers[t, 0], centers[t, 1] = places[t, :, 0].mean(), places[t, :, 1].mean()
        worths[t] = search.discount ** (t * search.step)
        tops[t] = worths[t] * weights[t].sum() * search.step
    slots, places, weights = merged(memory, places, weights)
    scene = Scene(
        walls, memory, eye, search, regions, rates, slots, places, weights, centers, worths, tops,
        start,
    )  # fmt: skip
    best, worth = np.zeros(0), -math.inf
    for sequence in (nearest(moves, previous), _beam(scene)):
        if sequence.size > 0:
            rank = _polished(scene, sequence)
            if rank > worth:
                best, worth = moves.banks[sequence], rank
    return best, worth


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    memory, eye, walls = new_sightlines(50.0, 1.0), Eye(BODY, 1.0, 100.0), warm_walls()
    banks, free = np.array([-0.5, 0.5]), free_shares(walls, 1.0, 1.0, 50.0, 1.0)
    moves = new_moves(banks, 2, 15.0, 3.0, 1.0, 0.5, 2, BODY)
    beyond = new_outlook(eye, free, 50.0, 15.0, banks, 3.0, 1.0, 0.5, 2, 0.95)
    search = Search(moves, 1, 2, 0.5, 4, 0.95, 0.0, 1, beyond)
    start = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0])
    places, weights = np.zeros((3, 1, 2)), np.ones((3, 1))
    regions, rates = no_regions()
    plan(walls, memory, eye, search, regions, rates, start, places, weights, np.zeros(1))
