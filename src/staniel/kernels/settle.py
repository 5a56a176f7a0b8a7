"""Where vehicles on roads begin.

Columns are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold
from staniel.kernels.routes import (
    MEMORY_WIDTH,
    PHASE,
    STOP_IN,
    STRAIGHT,
    TX,
    TY,
    Roads,
    contested,
    draw,
    set_out,
    way_left,
)
from staniel.kernels.walls import Walls, disc_clear

__all__ = ["settle"]

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def _at(upto: Array, way: float) -> int:
    """The first whose running total is greater than `way`, or the last."""
    low, high = 0, upto.shape[0] - 1
    while low < high:
        middle = (low + high) // 2
        if upto[middle] <= way:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True, error_model="numpy")
def settle(
    walls: Walls,
    roads: Roads,
    habits: Array,
    count: int,
    clearance: float,
    tries: int,
    key: np.uint64,
) -> tuple[Array, Array]:
    """Vehicles at rest on random places of the roads, on the right where that is free.

    Parameters
    ----------
    walls : Walls
    roads : Roads
        With at least one arc.
    habits : (7,) float array
    count : int
    clearance : float [m]
        Between any two.
    tries : int
        At most so many for each vehicle.
    key : uint64
        Of the draws of `follow`, too.

    Returns
    -------
    vehicles : (m, 4) float array
    memory : (m, `MEMORY_WIDTH`) float array
        Fewer than `count` rows when no place was found for the next.
    """
    nodes, arcs = roads.nodes, roads.arcs
    vehicles, memory = np.zeros((count, 4)), np.zeros((count, MEMORY_WIDTH))
    upto = np.empty(arcs.shape[0])
    total = 0.0
    for a in range(arcs.shape[0]):
        ex = nodes[arcs[a, 1], 0] - nodes[arcs[a, 0], 0]
        total += math.hypot(ex, nodes[arcs[a, 1], 1] - nodes[arcs[a, 0], 1])
        upto[a] = total
    for i in range(count):
        own = fold(key, i)
        placed = False
        for trial in range(tries):
            arc = _at(upto, total * draw(memory, i, own))
            share = draw(memory, i, own)
            px, py = nodes[arcs[arc, 0], 0], nodes[arcs[arc, 0], 1]
            ex, ey = nodes[arcs[arc, 1], 0] - px, nodes[arcs[arc, 1], 1] - py
            length = math.hypot(ex, ey)
            x, y = (
                px + share * ex + habits[1] * ey / length,
                py + share * ey - habits[1] * ex / length,
            )
            if not disc_clear(walls, x, y, habits[0]):
                x, y = px + share * ex, py + share * ey
                if not disc_clear(walls, x, y, habits[0]):
                    continue
            placed = True
            for j in range(i):
                if math.hypot(vehicles[j, 0] - x, vehicles[j, 1] - y) < clearance:
                    placed = False
                    break
            if placed and set_out(walls, roads, memory, i, x, y, arc, habits, own):
                # On a contested stretch only where there is hardly another place.
                left = way_left(roads.ends, memory, i, x, y)
                if 2 * trial < tries and contested(roads, arc, left):
                    placed = False
                    continue
                vehicles[i, 0], vehicles[i, 1] = x, y
                vehicles[i, 2] = math.atan2(memory[i, TY] - y, memory[i, TX] - x)
                memory[i, PHASE] = STRAIGHT
                memory[i, STOP_IN] = 2.0 * habits[4] * draw(memory, i, own)
                break
            placed = False
        if not placed:
            return vehicles[:i], memory[:i]
    return vehicles, memory
