"""Where the particles of now were before: their own recent paths, through every resampling.

After each step a tracker writes down where its particles stand, in a ring of slots, and of a
resampling who copied whom. What was seen late is held against where each particle really was then;
nothing is copied but what is asked for.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["SLOTS", "advance", "descend", "places_at", "warm"]

Array = NDArray[Any]

SLOTS = 8
"""Of the ring; the last but one of them can be asked for."""


@njit(cache=True, error_model="numpy")
def advance(past: Array, copied: Array, depth: Array, state: Array, k: int, head: int) -> None:
    """Write down where track `k` stands before it moves on, as slot number `head`.

    Parameters
    ----------
    past : (capacity, SLOTS, 2, n) float32 array
        x, y [m, from the track's origin] of each slot.
    copied : (capacity, SLOTS) bool array
        Whether there was a resampling in the step that ends with this slot.
    depth : (capacity,) int64 array
        How many slots of each track are written.
    state : (capacity, 4, n) float32 array
    k, head : int
        The ring's place of a slot is its number modulo `SLOTS`.
    """
    slot = head % SLOTS
    n = state.shape[2]
    for row in range(2):
        for i in range(n):
            past[k, slot, row, i] = state[k, row, i]
    copied[k, (head + 1) % SLOTS] = False
    depth[k] = min(depth[k] + 1, SLOTS - 1)


@njit(cache=True, error_model="numpy")
def descend(ancestors: Array, copied: Array, k: int, head: int, chosen: Array) -> None:
    """Write down who copied whom in the step that will end with slot `head`.

    Parameters
    ----------
    ancestors : (capacity, SLOTS, n) int32 array
    copied, k, head : as in `advance`
    chosen : (n,) int32 array
        Ancestor of each particle.
    """
    own = ancestors[k, head % SLOTS]
    if copied[k, head % SLOTS]:
        # A second resampling at one time: the copies of copies.
        before = own.copy()
        for i in range(chosen.size):
            own[i] = before[chosen[i]]
    else:
        for i in range(chosen.size):
            own[i] = chosen[i]
        copied[k, head % SLOTS] = True


@njit(cache=True, error_model="numpy")
def places_at(
    time: float,
    now: float,
    state: Array,
    past: Array,
    ancestors: Array,
    copied: Array,
    times: Array,
    depth: Array,
    k: int,
    head: int,
    index: Array,
    out: Array,
) -> None:
    """Where the particles of track `k` were at `time`, along their own paths.

    Between two slots along a straight line; before the oldest, straight back along the velocity.

    Parameters
    ----------
    time, now : float [s]
        Not after `now`, to which the particles were moved.
    state, past, ancestors, copied, depth, k : as in `advance` and `descend`
        After the move and before the next resampling.
    times : (SLOTS,) float64 array [s]
        Of each slot.
    head : int
        Slots written so far; ``head - 1`` is the newest.
    index : (n,) int32 array
        Scratch.
    out : (2, n) float32 array
        Filled [m, from the track's origin].
    """
    n = state.shape[2]
    for i in range(n):
        index[i] = i
        out[0, i], out[1, i] = state[k, 0, i], state[k, 1, i]
    later = now
    slot = head
    while later > time and head - slot < depth[k]:
        # Of the newest slot only where a step before this one ended at the same time.
        if copied[k, slot % SLOTS]:
            for i in range(n):
                index[i] = ancestors[k, slot % SLOTS, index[i]]
        slot -= 1
        earlier = times[slot % SLOTS]
        here = past[k, slot % SLOTS]
        if earlier >= time:
            for i in range(n):
                out[0, i], out[1, i] = here[0, index[i]], here[1, index[i]]
        else:
            share = np.float32((later - time) / (later - earlier))
            for i in range(n):
                out[0, i] += share * (here[0, index[i]] - out[0, i])
                out[1, i] += share * (here[1, index[i]] - out[1, i])
        later = earlier
    if later > time:
        back = np.float32(later - time)
        for i in range(n):
            out[0, i] -= back * state[k, 2, i]
            out[1, i] -= back * state[k, 3, i]


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight: nothing."""
