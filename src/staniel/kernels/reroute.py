"""What a driver does for whom nobody gives way: another way, or back.

Columns are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.claims import give_back
from staniel.kernels.headway import in_the_way
from staniel.kernels.pieces import bare
from staniel.kernels.routes import (
    AFTER,
    ARC,
    CLAIM,
    CLAIMS,
    FILLET,
    INSIDE,
    NEXT,
    OVER,
    PHASE,
    TX,
    TY,
    Roads,
    contested,
    set_out,
    short_of,
    turn_round,
    way_left,
)
from staniel.kernels.walls import Walls

__all__ = ["other_way"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@bare
def _room_to_turn(
    vehicles: Array,
    memory: Array,
    trial: Array,
    near: Indices,
    begin: int,
    end: int,
    x: float,
    y: float,
    r: float,
    brake: float,
) -> bool:
    """Whether nobody is on the way to the other lane, or near there and going to come along it."""
    tx, ty, back = trial[0, TX], trial[0, TY], trial[0, ARC]
    ux, uy = tx - x, ty - y
    leg = math.hypot(ux, uy)
    for k in range(begin, end):
        j = near[k]
        if in_the_way(vehicles, j, x, y, ux / leg, uy / leg, leg, r, math.inf) > 0.0:
            return False
        comes = memory[j, ARC] == back or memory[j, NEXT] == back or memory[j, AFTER] == back
        apart = math.hypot(vehicles[j, 0] - tx, vehicles[j, 1] - ty) - 10.0 * r
        if comes and apart < 0.5 * vehicles[j, 3] * vehicles[j, 3] / brake:
            return False
    return True


@bare
def other_way(
    walls: Walls,
    roads: Roads,
    vehicles: Array,
    memory: Array,
    claimed: Indices,
    near: Indices,
    begin: int,
    end: int,
    i: int,
    waits: bool,
    habits: Array,
    key: np.uint64,
    trial: Array,
) -> None:
    """Who waits in vain for a visit chooses anew; who is blocked outside turns round if it can."""
    arc, x, y = int(memory[i, ARC]), vehicles[i, 0], vehicles[i, 1]
    if memory[i, INSIDE] > 0.0 or memory[i, OVER] != 0.0:
        return
    for c in range(CLAIM):
        trial[0, c] = memory[i, c]
    if waits:
        if memory[i, PHASE] == FILLET:
            return
        left = way_left(roads.ends, memory, i, x, y)
        done = (
            set_out(walls, roads, trial, 0, x, y, arc, habits, key)
            and short_of(roads.ends, arc, trial[0, TX], trial[0, TY]) < left
        )
    else:
        done = (
            roads.arcs[arc, 2] >= 0
            and turn_round(walls, roads, trial, 0, x, y, habits, key)
            and _room_to_turn(vehicles, memory, trial, near, begin, end, x, y, habits[0], habits[3])
        )
    if done and not contested(roads, int(trial[0, ARC]), way_left(roads.ends, trial, 0, x, y)):
        give_back(memory, i, claimed, 0, CLAIMS)
        for c in range(CLAIM):
            memory[i, c] = trial[0, c]
