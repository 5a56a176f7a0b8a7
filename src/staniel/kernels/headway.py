"""How fast a driver on a road may go: by corners, and by who is ahead.

Columns, corners and legs are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.pieces import bare
from staniel.kernels.routes import (
    AHEAD,
    CURVE,
    CUT,
    FILLET,
    LEFT,
    NEXT,
    NX,
    NY,
    OVER,
    PHASE,
    ROUTE,
    SLIGHT,
    TURN,
    TX,
    TY,
    Roads,
    corner_ahead,
    left_on,
    way_left,
)

__all__ = [
    "ASIDE",
    "FARTHEST",
    "GAP",
    "anybody_within",
    "behind",
    "follow_speed",
    "in_the_way",
    "queue_speed",
    "road_speed",
    "sight",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

GAP = 0.5
"""Kept to the vehicle ahead at rest [m]."""
ASIDE = 0.1
"""Who is farther aside than two radii and that is not in the way [m]."""
_NEARER = 0.05  # who comes no nearer than that, passes [m]
FARTHEST = 60.0
"""No driver looks farther ahead [m]."""


@bare
def in_the_way(
    vehicles: Array,
    other: int,
    x: float,
    y: float,
    ux: float,
    uy: float,
    length: float,
    r: float,
    apart: float,
) -> float:
    """How far along a leg the other vehicle is [m], negative where it is not in the way.

    Who is `apart` metres from the driver now, and would hardly be nearer, is not.
    """
    dx, dy = vehicles[other, 0] - x, vehicles[other, 1] - y
    along, aside = dx * ux + dy * uy, dx * uy - dy * ux
    beyond = max(along - length, 0.0)
    reach = min(2.0 * r + ASIDE, max(apart - _NEARER, 2.0 * r))
    if along <= 0.0 or aside * aside + beyond * beyond > reach * reach:
        return -1.0
    return float(along)


@bare
def behind(speed: float, gap: float, brake: float, dt: float) -> float:
    """Greatest speed from which one can slow down to `speed` within `gap`, in steps of `dt`."""
    if gap <= 0.0:
        return speed
    step = brake * dt
    return max(math.sqrt(step * step + speed * speed + 2.0 * brake * gap) - step, 0.0)


@bare
def sight(speed: float, habits: Array, dt: float) -> float:
    """How far away somebody can be that a driver must slow down for [m]."""
    fast = speed + habits[3] * dt
    return float(4.0 * habits[0] + 2.0 * GAP + 0.5 * fast * fast / habits[3] + fast * dt)


@bare
def anybody_within(
    vehicles: Array, near: Indices, begin: int, end: int, i: int, reach: float
) -> bool:
    """Whether a neighbour is nearer than `reach`."""
    for k in range(begin, end):
        dx, dy = vehicles[near[k], 0] - vehicles[i, 0], vehicles[near[k], 1] - vehicles[i, 1]
        if dx * dx + dy * dy < reach * reach:
            return True
    return False


@bare
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
    tx, ty = memory[i, TX], memory[i, TY]
    if memory[i, PHASE] == FILLET:
        # As if one went on straight and turned where the second leg is met.
        ahead = memory[i, CURVE] * math.tan(0.5 * memory[i, LEFT])
        tx = x + ahead * math.cos(vehicles[i, 2])
        ty = y + ahead * math.sin(vehicles[i, 2])
        second = math.hypot(memory[i, NX] - tx, memory[i, NY] - ty)
    ux, uy = tx - x, ty - y
    leg = math.hypot(ux, uy)
    ux, uy = (ux / leg, uy / leg) if leg > 0.0 else (wx, wy)
    most, far = math.inf, sight(vehicles[i, 3], habits, dt)
    for k in range(begin, end):
        j = near[k]
        speed, heading = vehicles[j, 3], vehicles[j, 2]
        apart = math.hypot(vehicles[j, 0] - x, vehicles[j, 1] - y)
        if apart > far:
            continue
        along = in_the_way(vehicles, j, x, y, ux, uy, leg, r, apart)
        ahead = math.cos(heading) * ux + math.sin(heading) * uy
        if along < 0.0:
            along = in_the_way(vehicles, j, tx, ty, wx, wy, second, r, apart)
            if along < 0.0:
                continue
            along += leg
            ahead = math.cos(heading) * wx + math.sin(heading) * wy
        gap = along - 2.0 * r - GAP
        most = min(most, behind(max(speed * ahead, 0.0), gap, brake, dt))
    return most


@bare
def queue_speed(
    roads: Roads,
    vehicles: Array,
    memory: Array,
    queue: Indices,
    after: Indices,
    i: int,
    habits: Array,
    dt: float,
) -> float:
    """Greatest speed that keeps the distance to whoever is ahead on the same arcs [m/s].

    However many corners are between: `follow_speed` sees no farther than the next two. For `queue`
    and `after` see `staniel.kernels.claims`.
    """
    r, brake = habits[0], habits[3]
    arcs, ends, corners = roads.arcs, roads.ends, roads.corners
    left = way_left(ends, memory, i, vehicles[i, 0], vehicles[i, 1])
    horizon = sight(vehicles[i, 3], habits, dt)
    n, upto, most = vehicles.shape[0], left, math.inf
    for k in range(AHEAD):
        if k > 0:
            place = corner_ahead(arcs, memory, i, k)
            if upto - corners[place, 2] > horizon:
                break
            upto += corners[place, 3]
        arc = int(memory[i, ROUTE + k])
        entry = queue[arc]
        while entry >= 0:
            j = entry if entry < n else entry - n
            entry = after[entry]
            if j == i:
                continue
            along = upto - left_on(ends, memory, j, arc, vehicles[j, 0], vehicles[j, 1])
            if 0.0 < along < horizon:
                gap = along - 2.0 * r - GAP
                most = min(most, behind(vehicles[j, 3], gap, brake, dt))
    return most


@bare
def _corner_speed(memory: Array, i: int, turn_rate: float) -> float:
    """Speed in the fillet at T, or 0 where one turns in place [m/s]."""
    if memory[i, CUT] > 0.0:
        return float(turn_rate * memory[i, CURVE])
    return math.inf if abs(memory[i, TURN]) < SLIGHT else 0.0


@bare
def road_speed(
    entry: Array, memory: Array, i: int, x: float, y: float, habits: Array, dt: float
) -> float:
    """Greatest speed that the corners ahead allow [m/s]."""
    corner, brake = _corner_speed(memory, i, habits[2]), habits[3]
    leg = math.hypot(memory[i, NX] - memory[i, TX], memory[i, NY] - memory[i, TY])
    if memory[i, OVER] != 0.0:
        beyond = behind(0.0, leg - memory[i, CUT], brake, dt)
    else:
        beyond = entry[int(memory[i, NEXT])]
    if memory[i, PHASE] == FILLET:
        return min(corner, beyond)
    way = math.hypot(memory[i, TX] - x, memory[i, TY] - y) - memory[i, CUT]
    return behind(min(corner, beyond), way, brake, dt)
