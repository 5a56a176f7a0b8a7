"""Driving on roads: stops, turns, and the next step.

Columns, corners and legs are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.claims import all_claims, claim_speed
from staniel.kernels.corners import corners
from staniel.kernels.headway import (
    FARTHEST,
    GAP,
    anybody_within,
    follow_speed,
    queue_speed,
    road_speed,
    sight,
)
from staniel.kernels.neighbours import neighbours, rebuild_every
from staniel.kernels.pieces import bare
from staniel.kernels.random import fold
from staniel.kernels.reroute import other_way
from staniel.kernels.routes import (
    ARC,
    CLAIM,
    CLAIMS,
    CROSSING,
    CURVE,
    CUT,
    FILLET,
    HOLD,
    LEFT,
    MEMORY_WIDTH,
    NEAR,
    NX,
    NY,
    OVER,
    PHASE,
    ROTATING,
    SLIGHT,
    STOP_IN,
    STRAIGHT,
    STUCK,
    TURN,
    TX,
    TY,
    Roads,
    draw,
    pass_corner,
)
from staniel.kernels.settle import settle
from staniel.kernels.traffic import wrapped
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["follow", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_CRAWL = 1.0  # speed of who squeezes past [m/s]
_LEGS = 8  # at most so many legs and fillets in one dynamics step


@bare
def _straight_on(pose: Array, memory: Array, i: int, way: float) -> bool:
    """Move the pose on its leg; False, and nothing done, where that ends before."""
    ux, uy = memory[i, TX] - pose[0], memory[i, TY] - pose[1]
    leg = math.hypot(ux, uy)
    if way >= leg - memory[i, CUT] - NEAR:
        return False
    pose[0] += way * ux / leg
    pose[1] += way * uy / leg
    return True


@bare
def _advance(
    walls: Walls,
    roads: Roads,
    pose: Array,
    memory: Array,
    i: int,
    way: float,
    habits: Array,
    key: np.uint64,
) -> None:
    """Move the pose x, y, heading along its legs and fillets."""
    for _ in range(_LEGS):
        if way <= 0.0 or memory[i, PHASE] == ROTATING:
            return
        wx, wy = memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY]
        if memory[i, PHASE] == STRAIGHT:
            if _straight_on(pose, memory, i, way):
                return
            ux, uy = memory[i, TX] - pose[0], memory[i, TY] - pose[1]
            leg = math.hypot(ux, uy)
            way -= leg - memory[i, CUT]
            if memory[i, CUT] > 0.0:
                pose[0] = memory[i, TX] - memory[i, CUT] * ux / leg
                pose[1] = memory[i, TY] - memory[i, CUT] * uy / leg
                memory[i, PHASE], memory[i, LEFT] = FILLET, abs(memory[i, TURN])
                continue
            pose[0], pose[1] = memory[i, TX], memory[i, TY]
            slight = abs(memory[i, TURN]) < SLIGHT
            if slight and math.hypot(wx, wy) >= NEAR:
                pose[2] = math.atan2(wy, wx)
            else:
                memory[i, PHASE] = ROTATING
        else:
            side = 1.0 if memory[i, TURN] > 0.0 else -1.0
            curve = memory[i, CURVE]
            turned = min(way / curve, memory[i, LEFT])
            chord, bearing = 2.0 * curve * math.sin(0.5 * turned), pose[2] + side * 0.5 * turned
            pose[0] += chord * math.cos(bearing)
            pose[1] += chord * math.sin(bearing)
            pose[2] = wrapped(pose[2] + side * turned)
            way -= curve * turned
            memory[i, LEFT] -= turned
            if memory[i, LEFT] > 1e-9:
                return
            second = math.hypot(wx, wy)
            pose[0] = memory[i, TX] + memory[i, CUT] * wx / second
            pose[1] = memory[i, TY] + memory[i, CUT] * wy / second
            pose[2] = math.atan2(wy, wx)
            memory[i, PHASE] = STRAIGHT
        pass_corner(walls, roads, memory, i, pose[0], pose[1], habits, key)


@bare
def _swept_apart(
    vehicles: Array, near: Indices, begin: int, end: int, i: int, x: float, y: float, r: float
) -> bool:
    """Whether vehicle i meets nobody on its way to (x, y)."""
    ex, ey = x - vehicles[i, 0], y - vehicles[i, 1]
    square = ex * ex + ey * ey
    for k in range(begin, end):
        dx, dy = vehicles[near[k], 0] - vehicles[i, 0], vehicles[near[k], 1] - vehicles[i, 1]
        share = min(max((dx * ex + dy * ey) / square, 0.0), 1.0) if square > 0.0 else 0.0
        if share > 0.0 and (dx - share * ex) ** 2 + (dy - share * ey) ** 2 < 4.0 * r * r:
            return False
    return True


@bare
def _wait(memory: Array, i: int, speed: float, habits: Array, dt: float, key: np.uint64) -> bool:
    """Keep the times of stops; whether the driver wants to stand now."""
    if habits[4] <= 0.0:
        return False
    if memory[i, CLAIM] > 0.0:
        return False  # others wait for it
    if memory[i, HOLD] > 0.0:
        if speed == 0.0:
            memory[i, HOLD] -= dt
        return True
    memory[i, STOP_IN] -= dt
    if memory[i, STOP_IN] <= 0.0:
        memory[i, HOLD] = habits[5] * (0.5 + draw(memory, i, key))
        memory[i, STOP_IN] = habits[4] * (0.5 + draw(memory, i, key))
    return bool(memory[i, HOLD] > 0.0)


@bare
def _follow_one(
    walls: Walls,
    roads: Roads,
    vehicles: Array,
    memory: Array,
    claimed: Indices,
    queue: Indices,
    after: Indices,
    near: Indices,
    begin: int,
    end: int,
    i: int,
    habits: Array,
    top: float,
    key: np.uint64,
    dt: float,
    pose: Array,
    trial: Array,
    ids: Indices,
    ways: Array,
) -> None:
    """One dynamics step of vehicle i, in place; the last four are scratch."""
    if top <= 0.0:
        return  # parked
    r, turn_rate, brake, patience = habits[0], habits[2], habits[3], habits[6]
    x, y, heading, speed = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2], vehicles[i, 3]
    if memory[i, PHASE] == ROTATING:
        bearing = math.atan2(memory[i, TY] - y, memory[i, TX] - x)
        left, most = wrapped(bearing - heading), turn_rate * dt
        if abs(left) <= most:
            vehicles[i, 2], memory[i, PHASE] = bearing, STRAIGHT
        else:
            vehicles[i, 2] = wrapped(heading + (most if left > 0.0 else -most))
        vehicles[i, 3] = 0.0
        return
    claim = claim_speed(roads, vehicles, memory, claimed, queue, after, i, habits, dt, ids, ways)
    standing = _wait(memory, i, speed, habits, dt, key)
    wish, others = 0.0, math.inf
    if not standing:
        wish = min(top, road_speed(roads.entry, memory, i, x, y, habits, dt), claim)
        if wish > 0.0 and anybody_within(vehicles, near, begin, end, i, sight(speed, habits, dt)):
            others = min(
                queue_speed(roads, vehicles, memory, queue, after, i, habits, dt),
                follow_speed(vehicles, memory, near, begin, end, i, habits, dt),
            )
            if memory[i, STUCK] > patience:
                others = max(others, _CRAWL)
            wish = min(wish, others)
    speed = min(max(wish, speed - brake * dt), speed + brake * dt)
    for c in range(3):
        pose[c] = vehicles[i, c]
    plain = memory[i, PHASE] == STRAIGHT and _straight_on(pose, memory, i, speed * dt)
    if not plain:
        for c in range(CLAIM):
            trial[0, c] = memory[i, c]
        _advance(walls, roads, pose, trial, 0, speed * dt, habits, key)
    if begin == end or _swept_apart(vehicles, near, begin, end, i, pose[0], pose[1], r):
        for c in range(3):
            vehicles[i, c] = pose[c]
        vehicles[i, 3] = speed
        for c in range(0 if plain else CLAIM):
            memory[i, c] = trial[0, c]
    else:
        speed = vehicles[i, 3] = 0.0
    if standing or speed > 0.2 * min(top, _CRAWL):
        memory[i, STUCK] = 0.0
        return
    waits = claim < others
    # Who waits for a visit is patient.
    memory[i, STUCK] += 0.25 * dt if waits else dt
    if memory[i, STUCK] > 2.0 * patience:
        memory[i, STUCK] = patience * draw(memory, i, key)
        other_way(
            walls,
            roads,
            vehicles,
            memory,
            claimed,
            near,
            begin,
            end,
            i,
            waits,
            habits,
            key,
            trial,
        )


@njit(cache=True, error_model="numpy")
def follow(
    walls: Walls,
    roads: Roads,
    vehicles: Array,
    memory: Array,
    habits: Array,
    speeds: Array,
    key: np.uint64,
    dt: float,
    substeps: int,
) -> tuple[Array, Array]:
    """Drive every vehicle along the roads for `substeps` dynamics steps.

    One vehicle moves after the other, and only where it meets no other: no two ever overlap. All
    legs were tested for walls when they were chosen.

    Parameters
    ----------
    walls : Walls
    roads : Roads
    vehicles : (n, 4) float array
    memory : (n, `MEMORY_WIDTH`) float array
    habits : (7,) float array
        For the columns of all three see the module's head; neither of the first two is changed.
    speeds : (n,) float array [m/s]
        Of each vehicle on a free road.
    key : uint64
        With the vehicle's index and how many it has taken before it names every draw.
    dt : float [s]
    substeps : int

    Returns
    -------
    path : (substeps, n, 4) float array
        Vehicles after each step.
    memory : (n, `MEMORY_WIDTH`) float array
        After the last.
    """
    n = vehicles.shape[0]
    now, kept = vehicles.copy(), memory.copy()
    path = np.empty((substeps, n, 4))
    pose, trial = np.empty(3), np.empty((1, MEMORY_WIDTH))
    ids, ways = np.empty(CLAIMS, dtype=np.int64), np.empty((CLAIMS, 2))
    fastest = 0.0
    for i in range(n):
        fastest = max(fastest, speeds[i])
    braking = fastest * fastest / (2.0 * habits[3])
    reach = 4.0 * habits[0] + GAP + min(braking, FARTHEST)
    every = rebuild_every(reach, fastest, dt, substeps)
    first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
    claimed = all_claims(kept, len(roads.contested))
    queue = np.full(roads.arcs.shape[0], -1, dtype=np.int64)
    after, listed = np.empty(2 * n, dtype=np.int64), np.zeros(2 * n, dtype=np.int64)
    for k in range(substeps):
        if k > 0 and k % every == 0:
            first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
        for e in range(2 * n):
            queue[listed[e]] = -1
        for e in range(2 * n):
            i = e if e < n else e - n
            arc = int(kept[i, ARC])
            if e >= n:
                if kept[i, OVER] != CROSSING:
                    listed[e] = listed[i]
                    continue
                # Who crosses over is still in the way of those behind.
                arc = roads.arcs[arc, 2]
            listed[e] = arc
            after[e] = queue[arc]
            queue[arc] = e
        for nth in range(n):
            # Now the first, now the last begins: at junctions nobody always comes first.
            i = nth if k % 2 == 0 else n - 1 - nth
            _follow_one(
                walls,
                roads,
                now,
                kept,
                claimed,
                queue,
                after,
                near,
                first[i],
                first[i + 1],
                i,
                habits,
                speeds[i],
                fold(key, i),
                dt,
                pose,
                trial,
                ids,
                ways,
            )
        for i in range(n):
            for c in range(4):
                path[k, i, c] = now[i, c]
    return path, kept


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    walls = warm_walls()
    nodes = np.array([[0.5, 0.5], [0.5, 0.9]])
    arcs, zeros = np.array([[0, 1, 1, 0, 0], [1, 0, 0, 0, 1]]), np.zeros((2, 4))
    first, leaving = np.array([0, 1, 2]), np.array([0, 1])
    habits, key = np.array([0.1, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]), np.uint64(0)
    corners(walls, nodes, arcs, first, leaving, habits)
    roads = Roads(
        nodes=nodes,
        arcs=arcs,
        ends=zeros,
        first=first,
        leaving=leaving,
        entry=np.ones(2),
        corners=zeros,
        stretch=np.zeros(3, dtype=np.int64),
        contested=np.zeros((0, 2)),
        first_rival=np.zeros(1, dtype=np.int64),
        rivals=np.zeros(0, dtype=np.int64),
    )
    vehicles, memory = settle(walls, roads, habits, 1, 0.1, 1, key)
    follow(walls, roads, vehicles, memory, habits, np.ones(len(vehicles)), key, 0.1, 1)
