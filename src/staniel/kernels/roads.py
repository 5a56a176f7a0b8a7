"""Driving on roads: speed by corners and by who is ahead, stops, and the next step.

Columns, corners and legs are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.neighbours import neighbours, rebuild_every
from staniel.kernels.random import fold
from staniel.kernels.routes import (
    ARC,
    CLAIM,
    CURVE,
    CUT,
    DETOUR,
    FILLET,
    HOLD,
    LEFT,
    MEMORY_WIDTH,
    NEAR,
    NEXT,
    NX,
    NY,
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
    set_out,
    settle,
)
from staniel.kernels.traffic import wrapped
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["follow", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_GAP = 0.5  # kept to the vehicle ahead at rest [m]
_ASIDE = 0.3  # who is farther aside than two radii and that is not in the way [m]
_CRAWL = 1.0  # speed of who squeezes past [m/s]
_FARTHEST = 60.0  # no driver looks farther ahead [m]
_LEGS = 8  # at most so many legs and fillets in one dynamics step


@njit(cache=True, error_model="numpy")
def _in_the_way(
    vehicles: Array,
    other: int,
    x: float,
    y: float,
    ux: float,
    uy: float,
    length: float,
    r: float,
) -> float:
    """How far along a leg the other vehicle is [m], negative where it is not in the way."""
    dx, dy = vehicles[other, 0] - x, vehicles[other, 1] - y
    along, aside = dx * ux + dy * uy, abs(dx * uy - dy * ux)
    if aside > 2.0 * r + _ASIDE or along <= 0.0 or along > length + 2.0 * r:
        return -1.0
    return float(along)


@njit(cache=True, error_model="numpy")
def _behind(speed: float, gap: float, brake: float, dt: float) -> float:
    """Greatest speed from which one can slow down to `speed` within `gap`, in steps of `dt`."""
    if gap <= 0.0:
        return speed
    step = brake * dt
    return max(math.sqrt(step * step + speed * speed + 2.0 * brake * gap) - step, 0.0)


@njit(cache=True, error_model="numpy")
def _follow_speed(
    vehicles: Array,
    memory: Array,
    near: Indices,
    begin: int,
    end: int,
    i: int,
    habits: Array,
    dt: float,
) -> float:
    """Greatest speed that keeps the distance to whoever is on the next two legs [m/s]."""
    r, brake = habits[0], habits[3]
    x, y = vehicles[i, 0], vehicles[i, 1]
    wx, wy = memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY]
    second = math.hypot(wx, wy)
    wx, wy = (wx / second, wy / second) if second > 0.0 else (0.0, 0.0)
    cut = memory[i, CUT] if memory[i, PHASE] == FILLET else 0.0
    tx, ty = memory[i, TX] + cut * wx, memory[i, TY] + cut * wy
    ux, uy = tx - x, ty - y
    leg = math.hypot(ux, uy)
    ux, uy = (ux / leg, uy / leg) if leg > 0.0 else (wx, wy)
    most = math.inf
    for k in range(begin, end):
        j = near[k]
        speed, heading = vehicles[j, 3], vehicles[j, 2]
        along = _in_the_way(vehicles, j, x, y, ux, uy, leg, r)
        ahead = math.cos(heading) * ux + math.sin(heading) * uy
        if along < 0.0:
            along = _in_the_way(vehicles, j, tx, ty, wx, wy, second - cut, r)
            if along < 0.0:
                continue
            along += leg
            ahead = math.cos(heading) * wx + math.sin(heading) * wy
        gap = along - 2.0 * r - _GAP
        most = min(most, _behind(max(speed * ahead, 0.0), gap, brake, dt))
    return most


@njit(cache=True, error_model="numpy")
def _junction_speed(
    roads: Roads,
    vehicles: Array,
    memory: Array,
    near: Indices,
    begin: int,
    end: int,
    i: int,
    habits: Array,
    dt: float,
) -> float:
    """Greatest speed that stops before the next junction while it is somebody else's [m/s].

    Who comes so near that it would have to brake claims a junction that nobody is on, nobody has
    claimed and nobody is nearer to on the same arc: so one after the other goes through.
    """
    arc = memory[i, ARC]
    node = roads.arcs[int(arc), 1]
    x, y, size = roads.nodes[node, 0], roads.nodes[node, 1], _junction_size(habits)
    own = int(memory[i, CLAIM]) - 1
    if own >= 0 and own != node:
        dx, dy = vehicles[i, 0] - roads.nodes[own, 0], vehicles[i, 1] - roads.nodes[own, 1]
        if dx * dx + dy * dy > size * size:
            memory[i, CLAIM] = 0.0
    if own == node or roads.first[node + 1] - roads.first[node] < 3:
        return math.inf
    way = math.hypot(vehicles[i, 0] - x, vehicles[i, 1] - y)
    most = _behind(0.0, way - size - NEAR, habits[3], dt)
    if way <= size:
        return math.inf
    if most > vehicles[i, 3] + habits[3] * dt or way > _FARTHEST:
        return most
    for k in range(begin, end):
        j = near[k]
        apart = math.hypot(vehicles[j, 0] - x, vehicles[j, 1] - y)
        nearer = memory[j, ARC] == arc and apart < way
        if nearer or apart < size or memory[j, CLAIM] == node + 1.0:
            return most
    memory[i, CLAIM] = node + 1.0
    return math.inf


@njit(cache=True, error_model="numpy")
def _junction_size(habits: Array) -> float:
    """Distance from a junction's middle at which one waits for who is on it [m]."""
    return float(habits[1] + 2.0 * habits[0] + 1.0)


@njit(cache=True, error_model="numpy")
def _corner_speed(memory: Array, i: int, turn_rate: float) -> float:
    """Speed in the fillet at T, or 0 where one turns in place [m/s]."""
    if memory[i, CUT] > 0.0:
        return float(turn_rate * memory[i, CURVE])
    return math.inf if abs(memory[i, TURN]) < SLIGHT else 0.0


@njit(cache=True, error_model="numpy")
def _road_speed(
    roads: Roads, memory: Array, i: int, x: float, y: float, habits: Array, dt: float
) -> float:
    """Greatest speed that the corners ahead allow [m/s]."""
    corner = _corner_speed(memory, i, habits[2])
    leg = math.hypot(memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY])
    beyond = 0.0 if memory[i, DETOUR] != 0.0 else roads.entry[int(memory[i, NEXT])]
    if memory[i, PHASE] == FILLET:
        return min(corner, beyond)
    way = math.hypot(memory[i, TX] - x, memory[i, TY] - y)
    most = _behind(min(corner, beyond), way - memory[i, CUT], habits[3], dt)
    if memory[i, DETOUR] != 0.0:
        most = max(most, _behind(0.0, way + leg, habits[3], dt))
    return min(most, _behind(corner, way - memory[i, CUT], habits[3], dt))


@njit(cache=True, error_model="numpy")
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
            ux, uy = memory[i, TX] - pose[0], memory[i, TY] - pose[1]
            leg = math.hypot(ux, uy)
            left = leg - memory[i, CUT]
            if way < left - NEAR:
                pose[0] += way * ux / leg
                pose[1] += way * uy / leg
                return
            way -= left
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _wait(memory: Array, i: int, speed: float, habits: Array, dt: float, key: np.uint64) -> bool:
    """Keep the times of stops; whether the driver wants to stand now."""
    if habits[4] <= 0.0:
        return False
    if memory[i, HOLD] > 0.0:
        if speed == 0.0:
            memory[i, HOLD] -= dt
        return True
    memory[i, STOP_IN] -= dt
    if memory[i, STOP_IN] <= 0.0:
        memory[i, HOLD] = habits[5] * (0.5 + draw(memory, i, key))
        memory[i, STOP_IN] = habits[4] * (0.5 + draw(memory, i, key))
    return bool(memory[i, HOLD] > 0.0)


@njit(cache=True, error_model="numpy")
def _room_to_turn(
    vehicles: Array,
    trial: Array,
    near: Indices,
    begin: int,
    end: int,
    x: float,
    y: float,
    r: float,
) -> bool:
    """Whether nobody is on the first few metres towards T."""
    ux, uy = trial[0, TX] - x, trial[0, TY] - y
    leg = math.hypot(ux, uy)
    for k in range(begin, end):
        if _in_the_way(vehicles, near[k], x, y, ux / leg, uy / leg, 8.0 * r, r) > 0.0:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _follow_one(
    walls: Walls,
    roads: Roads,
    vehicles: Array,
    memory: Array,
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
) -> None:
    """One dynamics step of vehicle i, in place; `pose` and `trial` are scratch."""
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
    back, slowly = roads.arcs[int(memory[i, ARC]), 2], 1.0
    standing = _wait(memory, i, speed, habits, dt, key)
    wish = 0.0 if standing else min(top, _road_speed(roads, memory, i, x, y, habits, dt))
    if wish > 0.0 and begin < end:
        others = _follow_speed(vehicles, memory, near, begin, end, i, habits, dt)
        junction = _junction_speed(roads, vehicles, memory, near, begin, end, i, habits, dt)
        if memory[i, STUCK] > patience:
            others = max(others, _CRAWL)
            if back < 0:
                junction = max(junction, _CRAWL)
        # Who waits before a junction, and could also turn round, is patient.
        slowly = 0.25 if junction < others else 1.0
        wish = min(wish, others, junction)
    speed = min(max(wish, speed - brake * dt), speed + brake * dt)
    for c in range(3):
        pose[c] = vehicles[i, c]
    for c in range(MEMORY_WIDTH):
        trial[0, c] = memory[i, c]
    _advance(walls, roads, pose, trial, 0, speed * dt, habits, key)
    if begin == end or _swept_apart(vehicles, near, begin, end, i, pose[0], pose[1], r):
        for c in range(3):
            vehicles[i, c] = pose[c]
        vehicles[i, 3] = speed
        for c in range(MEMORY_WIDTH):
            memory[i, c] = trial[0, c]
    else:
        speed = vehicles[i, 3] = 0.0
    if standing or speed > 0.2 * min(top, _CRAWL):
        memory[i, STUCK] = 0.0
        return
    memory[i, STUCK] += slowly * dt
    if memory[i, STUCK] > 2.0 * patience:
        # Nobody gives way: turn round, where that is allowed and free, or try again later.
        memory[i, STUCK] = patience * draw(memory, i, key)
        if back >= 0:
            for c in range(MEMORY_WIDTH):
                trial[0, c] = memory[i, c]
            if set_out(walls, roads, trial, 0, x, y, back, habits, key) and _room_to_turn(
                vehicles, trial, near, begin, end, x, y, r
            ):
                for c in range(MEMORY_WIDTH):
                    memory[i, c] = trial[0, c]


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
    fastest = 0.0
    for i in range(n):
        fastest = max(fastest, speeds[i])
    braking = fastest * fastest / (2.0 * habits[3])
    reach = 4.0 * habits[0] + 2.0 * (_junction_size(habits) + min(braking, _FARTHEST))
    every = rebuild_every(reach, fastest, dt, substeps)
    first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
    for k in range(substeps):
        if k > 0 and k % every == 0:
            first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
        for i in range(n):
            begin, end, top, own = first[i], first[i + 1], speeds[i], fold(key, i)
            _follow_one(
                walls, roads, now, kept, near, begin, end, i, habits, top, own, dt, pose, trial
            )
        for i in range(n):
            for c in range(4):
                path[k, i, c] = now[i, c]
    return path, kept


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    walls = warm_walls()
    index = np.array([[0, 1, 1], [1, 0, 0]])
    first, leaving = np.array([0, 1, 2]), np.array([0, 1])
    roads = Roads(np.array([[0.5, 0.5], [0.5, 0.9]]), index, first, leaving, np.ones(2))
    habits, key = np.array([0.1, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]), np.uint64(0)
    vehicles, memory = settle(walls, roads, habits, 1, 0.1, 1, key)
    follow(walls, roads, vehicles, memory, habits, np.ones(len(vehicles)), key, 0.1, 1)
