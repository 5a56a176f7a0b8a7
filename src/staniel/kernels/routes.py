"""Routes on roads: a path of straight legs and fillets, of which two corners are known.

An *arc* is a piece of road in one direction. A vehicle drives straight to the corner `T` at the
end of its arc, round it on a fillet, and on to the corner `N` after it. Corners lie to the right of
the road's middle where that is free. Every leg is tested for walls once, when it is chosen; then
only other vehicles can be in the way.

Columns of a vehicle row: x, y, heading, speed. Columns of a driver's memory:

- `TX`, `TY`, `NX`, `NY`: the corner ahead and the one after it [m];
- `ARC`, `NEXT`, `AFTER`: the arc that ends at T, the one that ends at N, the one after;
- `DETOUR`: 1 where N is a node's middle, from where the next leg is surely free;
- `CUT`, `CURVE`, `TURN`: the fillet at T: way cut off each leg [m], radius [m], angle [rad, left
  positive]; no fillet where `CUT` is 0;
- `PHASE`: `STRAIGHT`, `FILLET` or `ROTATING` in place towards T;
- `LEFT`: angle left in the fillet [rad];
- `STOP_IN`, `HOLD`: seconds until the next stop, and of the present one;
- `STUCK`: seconds for which others have been in the way;
- `DRAWN`: random numbers taken: with the vehicle's index it names the next;
- `CLAIM`: node + 1 of the junction that is the vehicle's own until it has crossed it, or 0.

Columns of the habits: radius, lane_offset, turn_rate [rad/s], max_acceleration, stop_interval [s],
stop_duration [s], patience [s].
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform
from staniel.kernels.traffic import corridor
from staniel.kernels.walls import Walls, disc_clear

__all__ = ["MEMORY_WIDTH", "SHARP", "SLIGHT", "Roads", "draw", "pass_corner", "set_out", "settle"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TX, TY, NX, NY, ARC, NEXT, AFTER, DETOUR, CUT, CURVE, TURN = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
PHASE, LEFT, STOP_IN, HOLD, STUCK, DRAWN, CLAIM = 11, 12, 13, 14, 15, 16, 17
MEMORY_WIDTH = 18
STRAIGHT, FILLET, ROTATING = 0.0, 1.0, 2.0
SHARP = 2.6
"""A greater turn is made in place [rad]."""
SLIGHT = 0.2
"""A smaller one needs no fillet [rad]."""
NEAR = 1e-3
"""A corner nearer than that is reached [m]."""


class Roads(NamedTuple):
    """A road network as the kernels see it, driven in arcs."""

    nodes: Array
    """(n, 2) east and north [m]."""
    arcs: Indices
    """(m, 3) of each arc: node it leaves, node it reaches, the arc back or -1."""
    first: Indices
    """(n + 1,) the arcs that leave node k are ``leaving[first[k]:first[k + 1]]``."""
    leaving: Indices
    """(m,)"""
    entry: Array
    """(m,) speed at which an arc may be entered, whatever comes after it [m/s]."""


@njit(cache=True, error_model="numpy")
def draw(memory: Array, i: int, key: np.uint64) -> float:
    """The vehicle's next random number in [0, 1)."""
    memory[i, DRAWN] += 1.0
    return uniform(key, int(memory[i, DRAWN]))


@njit(cache=True, error_model="numpy")
def _choose(roads: Roads, arc: int, chance: float) -> int:
    """An arc to go on with, by chance; back only where there is no other."""
    node, back = roads.arcs[arc, 1], roads.arcs[arc, 2]
    begin, end = roads.first[node], roads.first[node + 1]
    others = 0
    for k in range(begin, end):
        others += roads.leaving[k] != back
    if others == 0:
        return int(back)
    pick = int(chance * others)
    for k in range(begin, end):
        if roads.leaving[k] != back:
            if pick == 0:
                return int(roads.leaving[k])
            pick -= 1
    return int(back)


@njit(cache=True, error_model="numpy")
def _leg_clear(walls: Walls, ax: float, ay: float, bx: float, by: float, r: float) -> bool:
    """Whether a disc that fits at a can move straight to b."""
    if not disc_clear(walls, bx, by, r):
        return False
    length = math.hypot(bx - ax, by - ay)
    if length == 0.0:
        return True
    return corridor(walls, ax, ay, math.atan2(by - ay, bx - ax), 0.0, length, r) >= r


@njit(cache=True, error_model="numpy")
def _corner(
    walls: Walls, roads: Roads, x: float, y: float, arc: int, then: int, offset: float, r: float
) -> tuple[bool, float, float]:
    """Where to end `arc`, coming from (x, y), when `then` is next; and whether one can get there.

    As far to the right as is free. From there the node's middle can be reached, too.
    """
    nodes, arcs = roads.nodes, roads.arcs
    node = arcs[arc, 1]
    px, py = nodes[node, 0], nodes[node, 1]
    ux, uy = px - nodes[arcs[arc, 0], 0], py - nodes[arcs[arc, 0], 1]
    wx, wy = nodes[arcs[then, 1], 0] - px, nodes[arcs[then, 1], 1] - py
    u, w = math.hypot(ux, uy), math.hypot(wx, wy)
    # Where the two lanes' lines meet, but not far from the node.
    sx, sy = uy / u + wy / w, -ux / u - wx / w
    scale = 1.0 / max(0.5 * (sx * sx + sy * sy), 0.8)
    if arcs[arc, 2] != then:
        for part in (1.0, 0.5):
            cx, cy = px + part * offset * scale * sx, py + part * offset * scale * sy
            if _leg_clear(walls, x, y, cx, cy, r) and _leg_clear(walls, cx, cy, px, py, r):
                return True, cx, cy
    return _leg_clear(walls, x, y, px, py, r), px, py


@njit(cache=True, error_model="numpy")
def _plan_fillet(walls: Walls, memory: Array, i: int, x: float, y: float, r: float) -> None:
    """Fillet at T for who comes straight from (x, y); wall-free like the legs and its chord.

    Its inscribed circle is smaller than the vehicle while the cut is at most 3 radii, so nothing
    fits between the legs and the chord that none of them meets.
    """
    ux, uy = memory[i, TX] - x, memory[i, TY] - y
    wx, wy = memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY]
    u, w = math.hypot(ux, uy), math.hypot(wx, wy)
    memory[i, CUT] = memory[i, CURVE] = memory[i, TURN] = 0.0
    if u < NEAR or w < NEAR:
        return
    turn = math.atan2(ux * wy - uy * wx, ux * wx + uy * wy)
    memory[i, TURN] = turn
    cut = min(3.0 * r, u, 0.5 * w)
    if not (0.01 < abs(turn) < SHARP) or cut < 0.3 * r:
        return
    ax, ay = memory[i, TX] - cut * ux / u, memory[i, TY] - cut * uy / u
    bx, by = memory[i, TX] + cut * wx / w, memory[i, TY] + cut * wy / w
    if _leg_clear(walls, ax, ay, bx, by, r):
        memory[i, CUT], memory[i, CURVE] = cut, cut / math.tan(0.5 * abs(turn))


@njit(cache=True, error_model="numpy")
def _look_beyond(
    walls: Walls, roads: Roads, memory: Array, i: int, x: float, y: float, habits: Array
) -> None:
    """Find N, beyond T, for who is at (x, y)."""
    tx, ty = memory[i, TX], memory[i, TY]
    then, after = int(memory[i, NEXT]), int(memory[i, AFTER])
    free, nx, ny = _corner(walls, roads, tx, ty, then, after, habits[1], habits[0])
    memory[i, DETOUR] = 0.0
    if not free:
        node = roads.arcs[int(memory[i, ARC]), 1]
        nx, ny = roads.nodes[node, 0], roads.nodes[node, 1]
        memory[i, DETOUR] = 1.0
    memory[i, NX], memory[i, NY] = nx, ny
    _plan_fillet(walls, memory, i, x, y, habits[0])


@njit(cache=True, error_model="numpy")
def pass_corner(
    walls: Walls,
    roads: Roads,
    memory: Array,
    i: int,
    x: float,
    y: float,
    habits: Array,
    key: np.uint64,
) -> None:
    """T is behind: N takes its place."""
    if memory[i, DETOUR] == 0.0:
        memory[i, ARC], memory[i, NEXT] = memory[i, NEXT], memory[i, AFTER]
        memory[i, AFTER] = _choose(roads, int(memory[i, NEXT]), draw(memory, i, key))
    memory[i, TX], memory[i, TY] = memory[i, NX], memory[i, NY]
    _look_beyond(walls, roads, memory, i, x, y, habits)


@njit(cache=True, error_model="numpy")
def set_out(
    walls: Walls,
    roads: Roads,
    memory: Array,
    i: int,
    x: float,
    y: float,
    arc: int,
    habits: Array,
    key: np.uint64,
) -> bool:
    """Begin to follow `arc` from (x, y) beside it; False, and nothing done, where T is not free."""
    then = _choose(roads, arc, draw(memory, i, key))
    free, tx, ty = _corner(walls, roads, x, y, arc, then, habits[1], habits[0])
    if not free or math.hypot(tx - x, ty - y) < NEAR:
        return False
    memory[i, TX], memory[i, TY] = tx, ty
    memory[i, ARC], memory[i, NEXT] = arc, then
    memory[i, AFTER] = _choose(roads, then, draw(memory, i, key))
    _look_beyond(walls, roads, memory, i, x, y, habits)
    memory[i, PHASE] = ROTATING
    return True


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
        for _ in range(tries):
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
                vehicles[i, 0], vehicles[i, 1] = x, y
                vehicles[i, 2] = math.atan2(memory[i, TY] - y, memory[i, TX] - x)
                memory[i, PHASE] = STRAIGHT
                memory[i, STOP_IN] = 2.0 * habits[4] * draw(memory, i, own)
                break
            placed = False
        if not placed:
            return vehicles[:i], memory[:i]
    return vehicles, memory
