"""How fast a driver on a road may go: by corners, by junctions, by who is ahead.

Columns, corners and legs are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.routes import (
    ARC,
    CLAIM,
    CURVE,
    CUT,
    DETOUR,
    FILLET,
    NEAR,
    NEXT,
    NX,
    NY,
    PHASE,
    SLIGHT,
    TURN,
    TX,
    TY,
    Roads,
)

__all__ = [
    "FARTHEST",
    "follow_speed",
    "in_the_way",
    "junction_size",
    "junction_speed",
    "road_speed",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_GAP = 0.5  # kept to the vehicle ahead at rest [m]
_ASIDE = 0.3  # who is farther aside than two radii and that is not in the way [m]
FARTHEST = 60.0  # no driver looks farther ahead [m]


@njit(cache=True, error_model="numpy")
def in_the_way(
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
def follow_speed(
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
        along = in_the_way(vehicles, j, x, y, ux, uy, leg, r)
        ahead = math.cos(heading) * ux + math.sin(heading) * uy
        if along < 0.0:
            along = in_the_way(vehicles, j, tx, ty, wx, wy, second - cut, r)
            if along < 0.0:
                continue
            along += leg
            ahead = math.cos(heading) * wx + math.sin(heading) * wy
        gap = along - 2.0 * r - _GAP
        most = min(most, _behind(max(speed * ahead, 0.0), gap, brake, dt))
    return most


@njit(cache=True, error_model="numpy")
def junction_speed(
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
    x, y, size = roads.nodes[node, 0], roads.nodes[node, 1], junction_size(habits)
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
    if most > vehicles[i, 3] + habits[3] * dt or way > FARTHEST:
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
def junction_size(habits: Array) -> float:
    """Distance from a junction's middle at which one waits for who is on it [m]."""
    return float(habits[1] + 2.0 * habits[0] + 1.0)


@njit(cache=True, error_model="numpy")
def _corner_speed(memory: Array, i: int, turn_rate: float) -> float:
    """Speed in the fillet at T, or 0 where one turns in place [m/s]."""
    if memory[i, CUT] > 0.0:
        return float(turn_rate * memory[i, CURVE])
    return math.inf if abs(memory[i, TURN]) < SLIGHT else 0.0


@njit(cache=True, error_model="numpy")
def road_speed(
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
