"""What a look-ahead scores its flights by: the target's places, the camera, buildings and dangers.

The parts of a flight are here, one hold of a bank after the other: where it ends, and what would be
seen meanwhile.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import swung
from staniel.kernels.lookout import Eye, danger, strikes, watch
from staniel.kernels.moves import Moves
from staniel.kernels.outlook import Outlook
from staniel.kernels.pieces import woven
from staniel.kernels.risk import Regions
from staniel.kernels.sightlines import Sightlines, slot_of
from staniel.kernels.walls import Walls

__all__ = ["Scene", "Search", "ended", "gained", "merged"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_TOGETHER = 6.0  # places nearer than that are one [m]


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
    tops: Floats
    """(t + 1,) what the look at each instant gains if it shows every place [s]."""
    start: Floats
    """(6,) pose: x, y, z, heading, bank, speed."""


@njit(cache=True, error_model="numpy")
def merged(memory: Sightlines, places: Floats, weights: Floats) -> tuple[Indices, Floats, Floats]:
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


@woven
def ended(
    moves: Moves,
    last: int,
    x: float,
    y: float,
    east: float,
    north: float,
    entry: int,
    share: float,
    k: int,
) -> tuple[float, float, float, float, float, float]:
    """Where a hold ends: x, y [m], what it turned [rad], its direction, and its bank [rad].

    Parameters
    ----------
    moves : Moves
    last : int
        Sample of it that is the end.
    x, y : float [m]
        Where it begins.
    east, north : float
        Cosine and sine of the heading there.
    entry, share : int, float
        Of the bank there, see `staniel.kernels.moves.entry_of`.
    k : int
        The bank that is held.
    """
    ends, rest = moves.ends, 1.0 - share
    ahead = rest * ends[entry, k, last, 0] + share * ends[entry + 1, k, last, 0]
    left = rest * ends[entry, k, last, 1] + share * ends[entry + 1, k, last, 1]
    turned = rest * ends[entry, k, last, 2] + share * ends[entry + 1, k, last, 2]
    cosine = rest * ends[entry, k, last, 3] + share * ends[entry + 1, k, last, 3]
    sine = rest * ends[entry, k, last, 4] + share * ends[entry + 1, k, last, 4]
    bank = rest * ends[entry, k, last, 5] + share * ends[entry + 1, k, last, 5]
    there_x, there_y = x + east * ahead - north * left, y + north * ahead + east * left
    there_east, there_north = east * cosine - north * sine, north * cosine + east * sine
    return there_x, there_y, turned, there_east, there_north, bank


@woven
def gained(
    scene: Scene,
    low: bool,
    swing: tuple[float, float],
    first: int,
    x: float,
    y: float,
    east: float,
    north: float,
    entry: int,
    share: float,
    k: int,
    slack: float,
) -> float:
    """Worth of what a hold shows, less what it costs; -inf where it may not be flown.

    Parameters
    ----------
    scene : Scene
    low : bool
        Whether buildings can be in the way.
    swing : (float, float)
        Cosine and sine of a gimbal's limit.
    first : int
        Instant at which it begins.
    x, y, east, north, entry, share, k
        See `ended`.
    slack : float
        How much less than `Scene.tops` it may gain; below that it is -inf, too.
    """
    search, walls, memory, centers = scene.search, scene.walls, scene.memory, scene.centers
    moves, ends, rest = search.moves, search.moves.ends, 1.0 - share
    altitude = memory.altitude
    swings, dangerous = scene.eye.mount[5] >= 0.0, scene.rates.size > 0
    total, from_x, from_y = 0.0, x, y
    for n in range(search.samples):
        t = first + n + 1
        there_x, there_y, _, ahead_x, ahead_y, bank = ended(
            moves, n, x, y, east, north, entry, share, k
        )
        if low and strikes(walls, from_x, from_y, there_x, there_y, altitude):
            return -math.inf
        from_x, from_y = there_x, there_y
        aside = rest * ends[entry, k, n, 6] + share * ends[entry + 1, k, n, 6]
        up = rest * ends[entry, k, n, 7] + share * ends[entry + 1, k, n, 7]
        ahead = moves.forward
        axis = (ahead_x * ahead - ahead_y * aside, ahead_y * ahead + ahead_x * aside, up)
        if swings:
            away_x, away_y = centers[t, 0] - there_x, centers[t, 1] - there_y
            axis = swung(axis, away_x, away_y, altitude, swing[0], swing[1])
        seen = watch(
            memory, walls, scene.eye, scene.slots[t], scene.places[t], scene.weights[t],
            there_x, there_y, axis,
        )  # fmt: skip
        seen -= search.effort * bank * bank
        if dangerous:
            seen -= danger(scene.regions, scene.rates, there_x, there_y, altitude)
        gain = scene.worths[t] * seen * search.step
        slack -= scene.tops[t] - gain
        if slack <= 0.0:
            return -math.inf
        total += gain
    return total
