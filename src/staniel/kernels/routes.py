"""Routes on roads: a path of straight legs and fillets, of which two corners are known.

An *arc* is a piece of road in one direction. A vehicle drives straight to the corner `T` at the
end of its arc, round it on a fillet, and on to the corner `N` after it. Corners lie to the right of
the road's middle where that is free, always at the same place for the same two arcs. Every leg is
tested for walls once, when it is chosen; then only other vehicles can be in the way.

Columns of a vehicle row: x, y, heading, speed. Columns of a driver's memory:

- `TX`, `TY`, `NX`, `NY`: the corner ahead and the one after it [m];
- `OVER`: `TURNING` where T ends a dead end and N is on the other lane, `CROSSING` where T is on the
  other lane and N ends its arc, else 0;
- `CUT`, `CURVE`, `TURN`: the fillet at T: way cut off each leg [m], radius [m], angle [rad, left
  positive]; no fillet where `CUT` is 0;
- `PHASE`: `STRAIGHT`, `FILLET` or `ROTATING` in place towards T;
- `LEFT`: angle left in the fillet [rad];
- `STOP_IN`, `HOLD`: seconds until the next stop, and of the present one;
- `STUCK`: seconds for which others have been in the way;
- `DRAWN`: random numbers taken: with the vehicle's index it names the next;
- `INSIDE`: 1 while it is on a contested stretch (see `staniel.kernels.claims`);
- `QUIET`: for so many metres there is no contested stretch ahead, if greater than 0;
- `ROUTE` and the `AHEAD` - 1 after it: its arcs; `ARC` is the first of them, which ends at T,
  `NEXT` the one that ends at N, `AFTER` the one after;
- `CLAIM` and the `CLAIMS` - 1 after it: the stretches ahead that are its own, each plus 1, then 0.

Columns of the habits: radius, lane_offset, turn_rate [rad/s], max_acceleration, stop_interval [s],
stop_duration [s], patience [s].
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.pieces import bare
from staniel.kernels.random import uniform
from staniel.kernels.traffic import corridor
from staniel.kernels.walls import Walls, disc_clear

__all__ = [
    "AHEAD",
    "CLAIMS",
    "MEMORY_WIDTH",
    "SHARP",
    "SLIGHT",
    "Roads",
    "contested",
    "corner_ahead",
    "draw",
    "left_on",
    "leg_clear",
    "pass_corner",
    "set_out",
    "short_of",
    "turn_round",
    "way_left",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TX, TY, NX, NY, OVER, CUT, CURVE, TURN = 0, 1, 2, 3, 4, 5, 6, 7
PHASE, LEFT, STOP_IN, HOLD, STUCK, DRAWN, INSIDE, QUIET = 8, 9, 10, 11, 12, 13, 14, 15
ROUTE, AHEAD = 16, 24
ARC, NEXT, AFTER = ROUTE, ROUTE + 1, ROUTE + 2
CLAIM, CLAIMS = ROUTE + AHEAD, 72
MEMORY_WIDTH = CLAIM + CLAIMS
STRAIGHT, FILLET, ROTATING = 0.0, 1.0, 2.0
TURNING, CROSSING = 1.0, 2.0
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
    """(m, 5) of each arc: node it leaves, node it reaches, the arc back or -1, which of those that
    leave its node it is, and where its corners begin."""
    ends: Array
    """(m, 4) of each arc: the node it reaches, and its direction."""
    first: Indices
    """(n + 1,) the arcs that leave node k are ``leaving[first[k]:first[k + 1]]``."""
    leaving: Indices
    """(m,)"""
    entry: Array
    """(m,) speed at which an arc may be entered, whatever comes after it [m/s]."""
    corners: Array
    """(c, 4) of each corner: east, north, how far before its arc's end node it is, and how much
    farther before the next arc's, each along the arc [m]; ``arcs[a, 4] + arcs[b, 3]`` joins a to b.
    """
    stretch: Indices
    """(m + 1,) where an arc's contested stretches begin; one comes to the first first."""
    contested: Array
    """(s, 2) how far before the arc's end node a stretch begins and ends [m].

    Infinite where the arc itself begins or ends.
    """
    first_rival: Indices
    """(s + 1,) the rivals of stretch k are ``rivals[first_rival[k]:first_rival[k + 1]]``."""
    rivals: Indices
    """Stretches on which somebody would touch who is on it."""


@bare
def draw(memory: Array, i: int, key: np.uint64) -> float:
    """The vehicle's next random number in [0, 1)."""
    memory[i, DRAWN] += 1.0
    return uniform(key, int(memory[i, DRAWN]))


@bare
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


@bare
def leg_clear(walls: Walls, ax: float, ay: float, bx: float, by: float, r: float) -> bool:
    """Whether a disc that fits at a can move straight to b."""
    if not disc_clear(walls, bx, by, r):
        return False
    length = math.hypot(bx - ax, by - ay)
    if length == 0.0:
        return True
    return corridor(walls, ax, ay, math.atan2(by - ay, bx - ax), 0.0, length, r) >= r


@bare
def short_of(ends: Array, arc: int, x: float, y: float) -> float:
    """How far (x, y) is before the node that an arc leads to, measured along the arc [m]."""
    return float((ends[arc, 0] - x) * ends[arc, 2] + (ends[arc, 1] - y) * ends[arc, 3])


@bare
def way_left(ends: Array, memory: Array, i: int, x: float, y: float) -> float:
    """How far a vehicle at (x, y) is before the node that its arc leads to [m].

    Round a corner it is counted on as if the arc went on straight.
    """
    arc = int(memory[i, ARC])
    if memory[i, PHASE] == FILLET:
        share = 2.0 * memory[i, LEFT] / abs(memory[i, TURN]) - 1.0
        at_corner = short_of(ends, arc, memory[i, TX], memory[i, TY])
        return float(at_corner + share * memory[i, CUT])
    return short_of(ends, arc, x, y)


@bare
def left_on(ends: Array, memory: Array, i: int, arc: int, x: float, y: float) -> float:
    """`way_left` on an arc that need not be the vehicle's own, but may be the one it crosses."""
    if memory[i, ARC] == arc:
        return way_left(ends, memory, i, x, y)
    return short_of(ends, arc, x, y)


@bare
def corner_ahead(arcs: Indices, memory: Array, i: int, k: int) -> int:
    """Which of `Roads.corners` joins the `k`-th arc ahead to the one before it."""
    return int(arcs[int(memory[i, ROUTE + k - 1]), 4] + arcs[int(memory[i, ROUTE + k]), 3])


@bare
def _plan_fillet(walls: Walls, memory: Array, i: int, x: float, y: float, r: float) -> None:
    """Fillet at T for who comes straight from (x, y); wall-free like the legs and its chord.

    Its inscribed circle is smaller than the vehicle while the cut is at most 3 radii, so nothing
    fits between the legs and the chord that none of them meets.
    """
    ux, uy = memory[i, TX] - x, memory[i, TY] - y
    wx, wy = memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY]
    u, w = math.hypot(ux, uy), math.hypot(wx, wy)
    memory[i, CUT], memory[i, CURVE], memory[i, TURN] = 0.0, 0.0, math.pi
    if u < NEAR or w < NEAR:
        return  # in place
    turn = math.atan2(ux * wy - uy * wx, ux * wx + uy * wy)
    memory[i, TURN] = turn
    cut = min(3.0 * r, u, 0.5 * w)
    if not (0.01 < abs(turn) < SHARP) or cut < 0.3 * r:
        return
    ax, ay = memory[i, TX] - cut * ux / u, memory[i, TY] - cut * uy / u
    bx, by = memory[i, TX] + cut * wx / w, memory[i, TY] + cut * wy / w
    if leg_clear(walls, ax, ay, bx, by, r):
        memory[i, CUT], memory[i, CURVE] = cut, cut / math.tan(0.5 * abs(turn))


@bare
def _look_beyond(
    walls: Walls, roads: Roads, memory: Array, i: int, x: float, y: float, habits: Array
) -> None:
    """Find N, beyond T, for who is at (x, y)."""
    tx, ty = memory[i, TX], memory[i, TY]
    arc, then, after = int(memory[i, ARC]), int(memory[i, NEXT]), int(memory[i, AFTER])
    place, node = roads.arcs[then, 4] + roads.arcs[after, 3], roads.arcs[arc, 1]
    nx, ny = roads.corners[place, 0], roads.corners[place, 1]
    mx, my = roads.nodes[node, 0], roads.nodes[node, 1]
    memory[i, NX], memory[i, NY] = nx, ny
    _plan_fillet(walls, memory, i, x, y, habits[0])
    memory[i, OVER] = 0.0
    if then == roads.arcs[arc, 2] and math.hypot(tx - mx, ty - my) > habits[0]:
        memory[i, OVER], memory[i, CUT] = TURNING, 0.0
        memory[i, NX], memory[i, NY] = 2.0 * mx - tx, 2.0 * my - ty


@bare
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
    was = memory[i, OVER]
    if was != CROSSING:
        for k in range(ROUTE, ROUTE + AHEAD - 1):
            memory[i, k] = memory[i, k + 1]
        last = ROUTE + AHEAD - 1
        memory[i, last] = _choose(roads, int(memory[i, last]), draw(memory, i, key))
    memory[i, TX], memory[i, TY] = memory[i, NX], memory[i, NY]
    if was == TURNING:
        place = corner_ahead(roads.arcs, memory, i, 1)
        memory[i, NX], memory[i, NY] = roads.corners[place, 0], roads.corners[place, 1]
        memory[i, OVER], memory[i, CUT], memory[i, TURN] = CROSSING, 0.0, math.pi
        return
    _look_beyond(walls, roads, memory, i, x, y, habits)


@bare
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
    then, node = _choose(roads, arc, draw(memory, i, key)), roads.arcs[arc, 1]
    place = roads.arcs[arc, 4] + roads.arcs[then, 3]
    tx, ty = roads.corners[place, 0], roads.corners[place, 1]
    if not leg_clear(walls, x, y, tx, ty, habits[0]):
        tx, ty = roads.nodes[node, 0], roads.nodes[node, 1]
        if not leg_clear(walls, x, y, tx, ty, habits[0]):
            return False
    if math.hypot(tx - x, ty - y) < NEAR:
        return False
    memory[i, TX], memory[i, TY] = tx, ty
    _draw_route(roads, memory, i, arc, then, key)
    _look_beyond(walls, roads, memory, i, x, y, habits)
    memory[i, PHASE] = ROTATING
    return True


@bare
def _draw_route(roads: Roads, memory: Array, i: int, arc: int, then: int, key: np.uint64) -> None:
    memory[i, ARC], memory[i, NEXT], memory[i, QUIET] = arc, then, 0.0
    for k in range(ROUTE + 2, ROUTE + AHEAD):
        memory[i, k] = _choose(roads, int(memory[i, k - 1]), draw(memory, i, key))


@bare
def turn_round(
    walls: Walls,
    roads: Roads,
    memory: Array,
    i: int,
    x: float,
    y: float,
    habits: Array,
    key: np.uint64,
) -> bool:
    """Cross over from (x, y) and go back; False where the way back is not free.

    Straight across, to where one is as far on the other side of the road's middle.
    """
    arc, r = int(memory[i, ARC]), habits[0]
    back, start = roads.arcs[arc, 2], roads.arcs[arc, 0]
    then = _choose(roads, back, draw(memory, i, key))
    px, py, node = roads.nodes[start, 0], roads.nodes[start, 1], roads.arcs[arc, 1]
    ux, uy = roads.nodes[node, 0] - px, roads.nodes[node, 1] - py
    u = math.hypot(ux, uy)
    ux, uy = ux / u, uy / u
    aside = (x - px) * uy - (y - py) * ux
    # Who comes round the corner at the beginning of the way back must see it in time.
    to_node = u - (x - px) * ux - (y - py) * uy
    if aside < r or to_node < 10.0 * r:
        return False
    tx, ty = x - 2.0 * aside * uy, y + 2.0 * aside * ux
    place = roads.arcs[back, 4] + roads.arcs[then, 3]
    nx, ny = roads.corners[place, 0], roads.corners[place, 1]
    if (nx - tx) * ux + (ny - ty) * uy > -2.0 * r:
        return False
    if not (leg_clear(walls, x, y, tx, ty, r) and leg_clear(walls, tx, ty, nx, ny, r)):
        return False
    memory[i, TX], memory[i, TY], memory[i, NX], memory[i, NY] = tx, ty, nx, ny
    _draw_route(roads, memory, i, back, then, key)
    memory[i, OVER], memory[i, PHASE] = CROSSING, ROTATING
    memory[i, CUT], memory[i, TURN] = 0.0, math.pi
    return True


@bare
def contested(roads: Roads, arc: int, left: float) -> bool:
    """Whether a place so far before the arc's end is contested."""
    for k in range(roads.stretch[arc], roads.stretch[arc + 1]):
        if roads.contested[k, 1] < left < roads.contested[k, 0]:
            return True
    return False
