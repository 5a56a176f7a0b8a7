"""Remembered lines of sight between the air at one height and the ground.

A planner asks for the same lines over and over: many flights through one piece of air, towards
places that hardly move between two decisions. So what was once looked up is kept, for cells of the
ground (`GROUND` a side) and of the air (`AIR` a side). The memory is a torus: a ground cell has its
slot by its place, cells that are `SLOTS` cells apart share one, and the newer evicts the older. A
line is looked up when it is first asked for, from the middle of the air cell to the place that
first asked for the ground cell (the middle of that might be in a wall).
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.pieces import bare, woven
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["AIR", "GROUND", "SLOTS", "Sightlines", "new_sightlines", "sees", "slot_of", "warm"]

GROUND = 4.0
"""Side of a cell of the ground [m]."""

AIR = 6.0
"""Side of a cell of the air [m]."""

SLOTS = 64
"""Cells of the ground along each side of the torus; a power of two."""

_HALF = 24  # air cells to each side of a place: lines to what is beyond are not kept
_WIDE = 2 * _HALF
_UNKNOWN, _HIDDEN, _FREE = 0, 1, 2
_MASK = SLOTS - 1
_FAR = 1 << 24  # makes the number of a cell positive


class Sightlines(NamedTuple):
    """What is known of lines of sight at one flight height."""

    altitude: float
    """Of the air cells above ground [m]."""
    target_height: float
    """Of the places above ground [m]."""
    owners: NDArray[np.int64]
    """(SLOTS²,) number of the ground cell that has the slot, -1 for none."""
    places: NDArray[np.float64]
    """(SLOTS², 2) the place that stands for it [m]."""
    lines: NDArray[np.uint8]
    """(SLOTS², air cells) unknown, hidden or free."""


def new_sightlines(altitude: float, target_height: float) -> Sightlines:
    """Nothing known yet: 9 MiB, of which only what is used becomes real memory.

    Parameters
    ----------
    altitude, target_height : float [m]
    """
    slots = SLOTS * SLOTS
    return Sightlines(
        altitude,
        target_height,
        np.full(slots, -1, dtype=np.int64),
        np.zeros((slots, 2)),
        np.zeros((slots, _WIDE * _WIDE), dtype=np.uint8),
    )


@njit(cache=True, error_model="numpy")
def slot_of(memory: Sightlines, x: float, y: float) -> int:
    """Slot of the ground cell around (x, y); takes it from another cell where need be."""
    i, j = math.floor(x / GROUND) + _FAR, math.floor(y / GROUND) + _FAR
    slot = (i & _MASK) * SLOTS + (j & _MASK)
    number = (i << 25) + j
    if memory.owners[slot] != number:
        memory.owners[slot] = number
        memory.places[slot, 0], memory.places[slot, 1] = x, y
        memory.lines[slot, :] = _UNKNOWN
    return slot


@bare
def _looked_up(memory: Sightlines, walls: Walls, slot: int, x: float, y: float) -> bool:
    """As `sees`, of a line that nobody asked for before, or that is not kept."""
    px, py = memory.places[slot, 0], memory.places[slot, 1]
    low, high = memory.target_height, memory.altitude
    i = math.floor((x - px) * (1.0 / AIR))
    j = math.floor((y - py) * (1.0 / AIR))
    if not (-_HALF <= i < _HALF and -_HALF <= j < _HALF):
        return bool(line_of_sight(walls, px, py, low, x, y, high))
    middle_x, middle_y = px + (i + 0.5) * AIR, py + (j + 0.5) * AIR
    free = line_of_sight(walls, px, py, low, middle_x, middle_y, high)
    memory.lines[slot, (i + _HALF) * _WIDE + j + _HALF] = _FREE if free else _HIDDEN
    return bool(free)


@woven
def sees(memory: Sightlines, walls: Walls, slot: int, x: float, y: float) -> bool:
    """Whether the slot's place is in free sight from around (x, y) at the flight height."""
    # Truncation rounds the way that floor does where what it is given is positive.
    i = int((x - memory.places[slot, 0]) * (1.0 / AIR) + (_HALF + 1.0)) - 1
    j = int((y - memory.places[slot, 1]) * (1.0 / AIR) + (_HALF + 1.0)) - 1
    known = _UNKNOWN
    if 0 <= i < _WIDE and 0 <= j < _WIDE:
        known = int(memory.lines[slot, i * _WIDE + j])
    if known == _UNKNOWN:
        return _looked_up(memory, walls, slot, x, y)
    return known == _FREE


def warm() -> None:
    """Compile, or load from the disk cache."""
    memory = new_sightlines(50.0, 1.0)
    sees(memory, warm_walls(), slot_of(memory, 0.0, 0.0), 1.0, 1.0)
