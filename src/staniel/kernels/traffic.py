"""Vehicles that wander the streets: where they can start, and how they drive.

Columns of a vehicle row: x, y, heading, speed. Columns of a driver's memory:

- `DRIFT`: curvature of the present drift [1/m], left positive; 0 straight on;
- `WAY`: way left before the drift begins or ends [m];
- `SIDE`: side to which a blocked vehicle rotates, +1 left, -1 right; 0 when not blocked.

Columns of the habits: speed, radius, axle, feeler_length, feeler_angle [rad], turn_rate [rad/s],
cruise_distance, drift_distance, drift_radius.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform
from staniel.kernels.walls import Walls, disc_clear, path_clear, warm_walls

__all__ = ["DRIFT", "MEMORY_WIDTH", "SIDE", "WAY", "drive", "place", "streets", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

DRIFT, WAY, SIDE = 0, 1, 2
MEMORY_WIDTH = 3
_TWO_PI = 2.0 * math.pi
_DRAWS = 4  # counters that one vehicle has for one dynamics step


@njit(cache=True, error_model="numpy")
def _neighbours(vehicles: Array, reach: float) -> tuple[Indices, Indices]:
    """Who is nearer than `reach` to whom: the neighbours of i are ``near[first[i]:first[i + 1]]``.

    Found in a grid of cells not smaller than `reach`, and not many more than there are vehicles.
    """
    n = vehicles.shape[0]
    first = np.zeros(n + 1, dtype=np.int64)
    if n == 0:
        return first, first[:0]
    # Loops, here and below: what arrays do at once costs seconds to compile.
    west = east = vehicles[0, 0]
    south = north = vehicles[0, 1]
    for i in range(n):
        west, east = min(west, vehicles[i, 0]), max(east, vehicles[i, 0])
        south, north = min(south, vehicles[i, 1]), max(north, vehicles[i, 1])
    east, north = east - west, north - south
    cell = max(reach, math.sqrt(east * north / n), (east + north) / (n + 1))
    nx, ny = int(east / cell) + 1, int(north / cell) + 1
    head = np.zeros((ny, nx), dtype=np.int64)  # number of the last vehicle, plus 1
    following = np.empty(n, dtype=np.int64)
    for i in range(n):
        a, b = int((vehicles[i, 0] - west) / cell), int((vehicles[i, 1] - south) / cell)
        following[i] = head[b, a] - 1
        head[b, a] = i + 1
    near = first[:0]
    for filling in range(2):
        found = 0
        for i in range(n):
            first[i] = found
            a, b = int((vehicles[i, 0] - west) / cell), int((vehicles[i, 1] - south) / cell)
            for row in range(max(b - 1, 0), min(b + 2, ny)):
                for column in range(max(a - 1, 0), min(a + 2, nx)):
                    j = head[row, column] - 1
                    while j >= 0:
                        dx = vehicles[j, 0] - vehicles[i, 0]
                        dy = vehicles[j, 1] - vehicles[i, 1]
                        if j != i and dx * dx + dy * dy < reach * reach:
                            if filling == 1:
                                near[found] = j
                            found += 1
                        j = following[j]
        first[n] = found
        if filling == 0:
            near = np.empty(found, dtype=np.int64)
    return first, near


@njit(cache=True, error_model="numpy")
def _free(
    walls: Walls, vehicles: Array, near: Indices, x0: float, y0: float, x: float, y: float, r: float
) -> bool:
    """Whether a vehicle may move from (x0, y0) to (x, y): no wall between, and its disc fits."""
    for k in range(near.shape[0]):
        dx, dy = vehicles[near[k], 0] - x, vehicles[near[k], 1] - y
        if dx * dx + dy * dy < 4.0 * r * r:
            return False
    if not disc_clear(walls, x, y, r):
        return False
    # From a free place no wall is nearer than r: a step up to r long cannot cross one.
    step = (x - x0) ** 2 + (y - y0) ** 2
    return step <= r * r or path_clear(walls, x0, y0, x, y)


@njit(cache=True, error_model="numpy")
def _feel(
    walls: Walls, vehicles: Array, near: Indices, i: int, angle: float, length: float, r: float
) -> bool:
    """Whether the feeler `angle` off the heading of vehicle i is clear of walls and vehicles."""
    x, y = vehicles[i, 0], vehicles[i, 1]
    ux, uy = math.cos(vehicles[i, 2] + angle), math.sin(vehicles[i, 2] + angle)
    for k in range(near.shape[0]):
        dx, dy = vehicles[near[k], 0] - x, vehicles[near[k], 1] - y
        along = min(max(dx * ux + dy * uy, 0.0), length)
        if (dx - along * ux) ** 2 + (dy - along * uy) ** 2 < r * r:
            return False
    return path_clear(walls, x, y, x + length * ux, y + length * uy)


@njit(cache=True, error_model="numpy")
def _new_way(memory: Array, habits: Array, stream: np.uint64, counter: int) -> None:
    """After a cruise begin a drift to a random side, after a drift a cruise; lengths are random."""
    length = 0.5 + uniform(stream, counter + 1)
    if memory[DRIFT] == 0.0:
        side = 1.0 if uniform(stream, counter) < 0.5 else -1.0
        memory[DRIFT] = side / habits[8]
        memory[WAY] = length * habits[7]
    else:
        memory[DRIFT] = 0.0
        memory[WAY] = length * habits[6]


@njit(cache=True, error_model="numpy")
def _wish(memory: Array, habits: Array, left_clear: bool, right_clear: bool) -> tuple[float, float]:
    """Speed and turn rate that a driver wishes: thesis 4.2."""
    speed, turn = habits[0], habits[5]
    if left_clear and right_clear:
        return speed, min(max(speed * memory[DRIFT], -turn), turn)
    if memory[SIDE] != 0.0 or not (left_clear or right_clear):
        return 0.0, turn
    # Away from what was felt, slowly enough to come round within half a feeler.
    return min(speed, 0.5 * turn * habits[3]), (turn if left_clear else -turn)


@njit(cache=True, error_model="numpy")
def _open_side(
    walls: Walls, vehicles: Array, near: Indices, i: int, habits: Array, chance: float
) -> float:
    """Side to which a blocked vehicle turns: the one with room for its body, or else by chance."""
    x, y, heading, r = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2], habits[1]
    a, b = heading + 0.5 * math.pi, heading - 0.5 * math.pi
    left = _free(walls, vehicles, near, x, y, x + r * math.cos(a), y + r * math.sin(a), r)
    right = _free(walls, vehicles, near, x, y, x + r * math.cos(b), y + r * math.sin(b), r)
    if left != right:
        return 1.0 if left else -1.0
    return 1.0 if chance < 0.5 else -1.0


@njit(cache=True, error_model="numpy")
def _drive_one(
    walls: Walls,
    vehicles: Array,
    memory: Array,
    near: Indices,
    i: int,
    habits: Array,
    stream: np.uint64,
    counter: int,
    dt: float,
) -> None:
    """One dynamics step of vehicle i, in place."""
    if habits[0] <= 0.0:
        return  # parked
    if memory[i, WAY] <= 0.0:
        _new_way(memory[i], habits, stream, counter)
    radius, axle = habits[1], habits[2]
    length = radius + habits[3]
    left_clear = _feel(walls, vehicles, near, i, habits[4], length, radius)
    right_clear = _feel(walls, vehicles, near, i, -habits[4], length, radius)
    speed, rate = _wish(memory[i], habits, left_clear, right_clear)
    x, y, heading = vehicles[i, 0], vehicles[i, 1], vehicles[i, 2]
    if speed > 0.0:
        # What each wheel rolls, and where that leads: thesis eq. 4.1 (corrected).
        right_wheel = (speed + 0.5 * axle * rate) * dt
        left_wheel = (speed - 0.5 * axle * rate) * dt
        way, turned = 0.5 * (right_wheel + left_wheel), (right_wheel - left_wheel) / axle
        new_x = x + way * math.cos(heading + 0.5 * turned)
        new_y = y + way * math.sin(heading + 0.5 * turned)
        if _free(walls, vehicles, near, x, y, new_x, new_y, radius):
            vehicles[i, 0], vehicles[i, 1], vehicles[i, 3] = new_x, new_y, speed
            vehicles[i, 2] = _wrapped(heading + turned)
            memory[i, WAY] -= way
            memory[i, SIDE] = 0.0
            return
    if memory[i, SIDE] == 0.0:
        chance = uniform(stream, counter + 2)
        memory[i, SIDE] = _open_side(walls, vehicles, near, i, habits, chance)
    vehicles[i, 2] = _wrapped(heading + memory[i, SIDE] * habits[5] * dt)
    vehicles[i, 3] = 0.0


@njit(cache=True, error_model="numpy")
def _wrapped(angle: float) -> float:
    """Angle in (-pi, pi]."""
    wrapped = angle - _TWO_PI * math.ceil((angle - math.pi) / _TWO_PI)
    return math.pi if wrapped <= -math.pi else wrapped


@njit(cache=True, error_model="numpy")
def drive(
    walls: Walls,
    vehicles: Array,
    memory: Array,
    habits: Array,
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
    habits : (9,) float array
        For the columns of all three see the module's head; neither of the first two is changed.
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
    farthest = 2.0 * habits[0] * dt * substeps
    first, near = _neighbours(vehicles, 4.0 * habits[1] + habits[3] + farthest)
    for k in range(substeps):
        counter = (tick * substeps + k) * _DRAWS
        for i in range(n):
            stream = fold(key, i)
            others = near[first[i] : first[i + 1]]
            _drive_one(walls, now, kept, others, i, habits, stream, counter, dt)
        for i in range(n):
            for c in range(4):
                path[k, i, c] = now[i, c]
    return path, kept


@njit(cache=True, error_model="numpy")
def streets(walls: Walls, radius: float, spacing: float) -> NDArray[np.bool_]:
    """Nodes of a square grid on the largest connected part of the ground where a disc can drive.

    Parameters
    ----------
    walls : Walls
    radius : float [m]
        Of the disc.
    spacing : float [m]
        Of the grid.

    Returns
    -------
    (rows, columns) bool array
        Of the node at ``((column + 1/2) spacing, (row + 1/2) spacing)``: is it in that part?
        Nowhere true in a city without free space.
    """
    rows, columns = int(walls.height / spacing) + 1, int(walls.width / spacing) + 1
    part = np.zeros((rows, columns), dtype=np.int64)  # 0 not visited, -1 blocked, else its number
    stack = np.empty(rows * columns, dtype=np.int64)
    parts, best, most = 0, 0, 0
    for start in range(rows * columns):
        if part[start // columns, start % columns] != 0:
            continue
        parts += 1
        count, top = 0, 0
        stack[0] = start
        part[start // columns, start % columns] = parts
        while top >= 0:
            node = stack[top]
            top -= 1
            row, column = node // columns, node % columns
            x, y = (column + 0.5) * spacing, (row + 0.5) * spacing
            if not disc_clear(walls, x, y, radius):
                part[row, column] = -1
                continue
            count += 1
            for side in range(4):
                a, b = row + (side == 0) - (side == 1), column + (side == 2) - (side == 3)
                if 0 <= a < rows and 0 <= b < columns and part[a, b] == 0:
                    xb, yb = (b + 0.5) * spacing, (a + 0.5) * spacing
                    if path_clear(walls, x, y, xb, yb):
                        part[a, b] = parts
                        top += 1
                        stack[top] = a * columns + b
        if count > most:
            best, most = parts, count
    largest = np.zeros((rows, columns), dtype=np.bool_)
    for row in range(rows):
        for column in range(columns):
            largest[row, column] = most > 0 and part[row, column] == best
    return largest


@njit(cache=True, error_model="numpy")
def place(
    walls: Walls,
    street: NDArray[np.bool_],
    spacing: float,
    count: int,
    clearance: float,
    tries: int,
    key: np.uint64,
) -> Array:
    """Random places on the streets, none nearer than `clearance` to a wall or to another place.

    Parameters
    ----------
    walls : Walls
    street, spacing
        From `streets`.
    count : int
    clearance : float [m]
    tries : int
        At most so many for each place.
    key : uint64
        With a place's index it names its draws: one more place does not move those before it.

    Returns
    -------
    (m, 3) float array
        x, y [m] and a heading [rad]; fewer than `count` rows when no place was found for the next.
    """
    rows, columns = street.shape
    places = np.empty((count, 3))
    for i in range(count):
        stream = fold(key, i)
        placed = False
        for k in range(tries):
            x = walls.width * uniform(stream, 3 * k)
            y = walls.height * uniform(stream, 3 * k + 1)
            row, column = min(int(y / spacing), rows - 1), min(int(x / spacing), columns - 1)
            if not street[row, column] or not disc_clear(walls, x, y, clearance):
                continue
            if not path_clear(walls, x, y, (column + 0.5) * spacing, (row + 0.5) * spacing):
                continue
            placed = True
            for j in range(i):
                if math.hypot(places[j, 0] - x, places[j, 1] - y) < clearance:
                    placed = False
                    break
            if placed:
                places[i, 0], places[i, 1] = x, y
                places[i, 2] = math.pi * (1.0 - 2.0 * uniform(stream, 3 * k + 2))
                break
        if not placed:
            return places[:i]
    return places


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    walls, key = warm_walls(), np.uint64(0)
    street = streets(walls, 0.1, 1.0)
    place(walls, street, 1.0, 1, 0.1, 1, key)
    habits = np.array([1.0, 0.1, 0.1, 0.1, 0.3, 1.0, 1.0, 1.0, 1.0])
    drive(walls, np.array([[0.5, 0.5, 0.0, 0.0]]), np.zeros((1, 3)), habits, key, 0, 0.1, 1)
