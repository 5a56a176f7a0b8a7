"""Vehicles that wander the streets on two forward feelers (thesis 4.2).

Columns of a vehicle row: x, y, heading, speed. Columns of a driver's memory:

- `DRIFT`: curvature of the present drift [1/m], left positive; 0 straight on;
- `WAY`: way left before the drift begins or ends [m];
- `SIDE`: side to which a blocked vehicle rotates, +1 left, -1 right; 0 when not blocked;
- `ROOM`, `AHEAD`, `BEND`: what is left of the last corridor that was found free of walls: to each
  side [m], ahead [m], and how far the heading has turned since [rad]. As long as it lasts no wall
  need be tested. After a survey that found no corridor `ROOM` is negative, and `AHEAD` counts the
  steps until the next.

Columns of the habits: radius, axle, feeler_length, feeler_angle [rad], turn_rate [rad/s],
cruise_distance, drift_distance, drift_radius.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.neighbours import neighbours, rebuild_every
from staniel.kernels.random import fold, uniform
from staniel.kernels.walls import Walls, disc_clear, path_clear, warm_walls

__all__ = [
    "AHEAD",
    "BEND",
    "DRIFT",
    "MEMORY_WIDTH",
    "ROOM",
    "SIDE",
    "WAY",
    "corridor",
    "drive",
    "warm",
    "wrapped",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

DRIFT, WAY, SIDE, ROOM, AHEAD, BEND = 0, 1, 2, 3, 4, 5
MEMORY_WIDTH = 6
_TWO_PI = 2.0 * math.pi
_DRAWS = 4  # counters that one vehicle has for one dynamics step
_SPARE = 1.5  # how far beyond its feelers a driver surveys to either side [m]
_STEPS = 8.0  # dynamics steps that a corridor is meant to last
_PAUSE = 4.0  # dynamics steps between a survey that found no corridor and the next
_SAFE = 1e-6  # far above the rounding of the tests that a corridor replaces [m]


@njit(cache=True, error_model="numpy")
def corridor(
    walls: Walls, x: float, y: float, heading: float, behind: float, ahead: float, side: float
) -> float:
    """Half-width, at most `side`, of a wall-free rectangle along the heading; 0: none that wide.

    It reaches from `behind` the point to `ahead` of it [m]. Near the city's edge none is found.
    """
    ux, uy = math.cos(heading), math.sin(heading)
    inset = side + behind
    end_x, end_y = x + ahead * ux, y + ahead * uy
    if min(x, end_x) < inset or max(x, end_x) > walls.width - inset:
        return 0.0
    if min(y, end_y) < inset or max(y, end_y) > walls.height - inset:
        return 0.0
    # The cells of the box around the rectangle.
    half = 0.5 * (ahead + behind)
    mid_x, mid_y = x + (half - behind) * ux, y + (half - behind) * uy
    reach_x = half * abs(ux) + side * abs(uy)
    reach_y = half * abs(uy) + side * abs(ux)
    cell, pieces, cells = walls.cell, walls.pieces, walls.cells
    i0, i1 = max(int((mid_x - reach_x) / cell), 0), min(int((mid_x + reach_x) / cell), walls.nx - 1)
    j0, j1 = max(int((mid_y - reach_y) / cell), 0), min(int((mid_y + reach_y) / cell), walls.ny - 1)
    free = side
    for j in range(j0, j1 + 1):
        row = j * walls.nx
        for k in range(int(cells[row + i0, 0]), int(cells[row + i1 + 1, 0])):
            px, py = pieces[k, 0] - x, pieces[k, 1] - y
            qx, qy = pieces[k, 2] - x, pieces[k, 3] - y
            b0, b1 = ux * py - uy * px, ux * qy - uy * qx
            if min(b0, b1) >= free or max(b0, b1) <= -free:
                continue
            a0, a1 = ux * px + uy * py, ux * qx + uy * qy
            if min(a0, a1) >= ahead or max(a0, a1) <= -behind:
                continue
            # The part of the wall between the rectangle's ends, and how near it comes to the axis.
            slope = (b1 - b0) / (a1 - a0) if a1 != a0 else 0.0
            low, high = min(max(a0, -behind), ahead), min(max(a1, -behind), ahead)
            c0, c1 = b0, b1
            if a1 != a0:
                c0, c1 = b0 + slope * (low - a0), b1 + slope * (high - a1)
            if (c0 <= 0.0) != (c1 <= 0.0):
                return 0.0
            free = min(free, abs(c0), abs(c1))
    return free


@njit(cache=True, error_model="numpy")
def _apart(
    vehicles: Array, near: Indices, begin: int, end: int, x: float, y: float, r: float
) -> bool:
    """Whether a disc at (x, y) overlaps none of the neighbours."""
    for k in range(begin, end):
        dx, dy = vehicles[near[k], 0] - x, vehicles[near[k], 1] - y
        if dx * dx + dy * dy < 4.0 * r * r:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _off_walls(walls: Walls, x0: float, y0: float, x: float, y: float, r: float) -> bool:
    """Whether a vehicle may move from (x0, y0) to (x, y): no wall between, and its disc fits."""
    if not disc_clear(walls, x, y, r):
        return False
    # From a free place no wall is nearer than r: a step up to r long cannot cross one.
    step = (x - x0) ** 2 + (y - y0) ** 2
    return step <= r * r or path_clear(walls, x0, y0, x, y)


@njit(cache=True, error_model="numpy")
def _unfelt(
    vehicles: Array,
    near: Indices,
    begin: int,
    end: int,
    x: float,
    y: float,
    angle: float,
    length: float,
    r: float,
) -> bool:
    """Whether the feeler in the direction `angle` from (x, y) is clear of the neighbours."""
    ux, uy = math.cos(angle), math.sin(angle)
    for k in range(begin, end):
        dx, dy = vehicles[near[k], 0] - x, vehicles[near[k], 1] - y
        along = min(max(dx * ux + dy * uy, 0.0), length)
        if (dx - along * ux) ** 2 + (dy - along * uy) ** 2 < r * r:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _way_clear(walls: Walls, x: float, y: float, angle: float, length: float) -> bool:
    """Whether the feeler in the direction `angle` from (x, y) is clear of walls."""
    return path_clear(walls, x, y, x + length * math.cos(angle), y + length * math.sin(angle))


@njit(cache=True, error_model="numpy")
def _new_way(memory: Array, i: int, habits: Array, stream: np.uint64, counter: int) -> None:
    """After a cruise begin a drift to a random side, after a drift a cruise; lengths are random."""
    length = 0.5 + uniform(stream, counter + 1)
    if memory[i, DRIFT] == 0.0:
        side = 1.0 if uniform(stream, counter) < 0.5 else -1.0
        memory[i, DRIFT] = side / habits[7]
        memory[i, WAY] = length * habits[6]
    else:
        memory[i, DRIFT] = 0.0
        memory[i, WAY] = length * habits[5]


@njit(cache=True, error_model="numpy", inline="always")
def _wish(
    memory: Array, i: int, habits: Array, speed: float, left_clear: bool, right_clear: bool
) -> tuple[float, float]:
    """Speed and turn rate that a driver wishes: thesis 4.2."""
    turn = habits[4]
    if left_clear and right_clear:
        return speed, min(max(speed * memory[i, DRIFT], -turn), turn)
    if memory[i, SIDE] != 0.0 or not (left_clear or right_clear):
        return 0.0, turn
    # Away from what was felt, slowly enough to come round within half a feeler.
    return min(speed, 0.5 * turn * habits[2]), (turn if left_clear else -turn)


@njit(cache=True, error_model="numpy")
def _open_side(
    walls: Walls,
    vehicles: Array,
    near: Indices,
    begin: int,
    end: int,
    i: int,
    r: float,
    chance: float,
) -> float:
    """Side to which a blocked vehicle turns: the one with room for its body, or else by chance."""
    x, y, heading = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2]
    roomy = 0
    for side in (1, -1):
        angle = heading + side * 0.5 * math.pi
        a, b = x + r * math.cos(angle), y + r * math.sin(angle)
        if _apart(vehicles, near, begin, end, a, b, r) and _off_walls(walls, x, y, a, b, r):
            roomy += side
    if roomy != 0:
        return float(roomy)
    return 1.0 if chance < 0.5 else -1.0


@njit(cache=True, error_model="numpy")
def _survey(
    walls: Walls, vehicles: Array, memory: Array, i: int, habits: Array, way: float
) -> bool:
    """Look for a wall-free corridor that holds both feelers over `way`; whether there is one."""
    length = habits[0] + habits[2]
    need = max(habits[0], length * math.sin(habits[3])) + _SAFE
    x, y, heading = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2]
    side = corridor(walls, x, y, heading, habits[0] + _SAFE, length + way, need + _SPARE)
    memory[i, BEND] = 0.0
    memory[i, ROOM] = side - need
    memory[i, AHEAD] = way if side >= need else _PAUSE
    return bool(side >= need)


@njit(cache=True, error_model="numpy", inline="always")
def _spend(memory: Array, i: int, length: float, way: float, turned: float) -> bool:
    """Take a step's way and turn from the corridor; whether the step stays in it.

    At an angle to the corridor of at most `angle` the step goes at most ``way angle`` aside, and
    the feelers' ends, `length` away, ``length angle``. One radian ends it: no step goes backwards.
    """
    angle = max(abs(memory[i, BEND]), abs(memory[i, BEND] + turned))
    memory[i, BEND] += turned
    memory[i, AHEAD] -= way
    memory[i, ROOM] -= way * angle
    lasts = memory[i, AHEAD] >= 0.0 and memory[i, ROOM] >= length * angle and angle < 1.0
    if not lasts:
        memory[i, ROOM], memory[i, AHEAD] = -1.0, 0.0
    return bool(lasts)


@njit(cache=True, error_model="numpy")
def _step(
    walls: Walls,
    vehicles: Array,
    memory: Array,
    first: Indices,
    near: Indices,
    habits: Array,
    speeds: Array,
    key: np.uint64,
    counter: int,
    dt: float,
) -> None:
    """One dynamics step of every vehicle in turn, in place."""
    radius, axle, length = habits[0], habits[1], habits[0] + habits[2]
    for i in range(vehicles.shape[0]):
        top, begin, end = speeds[i], first[i], first[i + 1]
        if top <= 0.0:
            continue  # parked
        if memory[i, WAY] <= 0.0:
            _new_way(memory, i, habits, fold(key, i), counter)
        x, y, heading = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2]
        open_way = memory[i, ROOM] >= 0.0
        if not open_way:
            if memory[i, AHEAD] > 0.0:
                memory[i, AHEAD] -= 1.0
            else:
                open_way = _survey(walls, vehicles, memory, i, habits, _STEPS * top * dt)
        left_clear = right_clear = True
        if not open_way:
            left_clear = _way_clear(walls, x, y, heading + habits[3], length)
            right_clear = _way_clear(walls, x, y, heading - habits[3], length)
        if begin < end:
            left, right = heading + habits[3], heading - habits[3]
            if left_clear:
                left_clear = _unfelt(vehicles, near, begin, end, x, y, left, length, radius)
            if right_clear:
                right_clear = _unfelt(vehicles, near, begin, end, x, y, right, length, radius)
        speed, rate = _wish(memory, i, habits, top, left_clear, right_clear)
        if speed > 0.0:
            # What each wheel rolls, and where that leads: thesis eq. 4.1 (corrected).
            right_wheel = (speed + 0.5 * axle * rate) * dt
            left_wheel = (speed - 0.5 * axle * rate) * dt
            way, turned = 0.5 * (right_wheel + left_wheel), (right_wheel - left_wheel) / axle
            new_x = x + way * math.cos(heading + 0.5 * turned)
            new_y = y + way * math.sin(heading + 0.5 * turned)
            open_way = open_way and _spend(memory, i, length, way, turned)
            free = begin == end or _apart(vehicles, near, begin, end, new_x, new_y, radius)
            if free and (open_way or _off_walls(walls, x, y, new_x, new_y, radius)):
                vehicles[i, 0], vehicles[i, 1], vehicles[i, 3] = new_x, new_y, speed
                vehicles[i, 2] = wrapped(heading + turned)
                memory[i, WAY] -= way
                memory[i, SIDE] = 0.0
                continue
        memory[i, ROOM], memory[i, AHEAD] = -1.0, _PAUSE  # rotating
        if memory[i, SIDE] == 0.0:
            chance = uniform(fold(key, i), counter + 2)
            memory[i, SIDE] = _open_side(walls, vehicles, near, begin, end, i, radius, chance)
        vehicles[i, 2] = wrapped(heading + memory[i, SIDE] * habits[4] * dt)
        vehicles[i, 3] = 0.0


@njit(cache=True, error_model="numpy")
def wrapped(angle: float) -> float:
    """Angle in (-pi, pi]."""
    if -math.pi < angle <= math.pi:
        return angle
    within = angle - _TWO_PI * math.ceil((angle - math.pi) / _TWO_PI)
    return math.pi if within <= -math.pi else within


@njit(cache=True, error_model="numpy")
def drive(
    walls: Walls,
    vehicles: Array,
    memory: Array,
    habits: Array,
    speeds: Array,
    key: np.uint64,
    tick: int,
    dt: float,
    substeps: int,
) -> tuple[Array, Array]:
    """Drive every vehicle for `substeps` dynamics steps.

    In each step one vehicle moves after the other, and only to where its disc meets no building, no
    edge of the city and no other vehicle: no two ever overlap. What cannot move rotates in place.

    Parameters
    ----------
    walls : Walls
    vehicles : (n, 4) float array
    memory : (n, `MEMORY_WIDTH`) float array
    habits : (8,) float array
        For the columns of all three see the module's head; neither of the first two is changed.
    speeds : (n,) float array [m/s]
        Of each vehicle on a clear path.
    key : uint64
    tick : int
        With `key`, the vehicle's index and the step it names every draw.
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
    fastest = 0.0
    for i in range(n):
        fastest = max(fastest, speeds[i])
    reach = 4.0 * habits[0] + habits[2]
    every = rebuild_every(reach, fastest, dt, substeps)
    first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
    for k in range(substeps):
        if k > 0 and k % every == 0:
            first, near = neighbours(now, reach + 2.0 * fastest * dt * every)
        counter = (tick * substeps + k) * _DRAWS
        _step(walls, now, kept, first, near, habits, speeds, key, counter, dt)
        for i in range(n):
            for c in range(4):
                path[k, i, c] = now[i, c]
    return path, kept


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    habits = np.array([0.1, 0.1, 0.1, 0.3, 1.0, 1.0, 1.0, 1.0])
    vehicles, memory = np.array([[0.5, 0.5, 0.0, 0.0]]), np.zeros((1, MEMORY_WIDTH))
    drive(warm_walls(), vehicles, memory, habits, np.ones(1), np.uint64(0), 0, 0.1, 1)
