"""What every aircraft's camera delivers in one look: detections, misses, false alarms."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import camera_axis, in_cone, look
from staniel.kernels.random import fold, uniform
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["detect", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_VEHICLE, _ALARM, _PLACE, _ORDER = 0, 1, 2, 3  # streams of one aircraft's look
_STREAMS = 4
_DRAWS = 4  # counters of each vehicle in a look: one for the detection, two for the noise
_MOST_TRIES = 1000


@njit(cache=True, error_model="numpy")
def _poisson(mean: float, stream: np.uint64) -> int:
    """One Poisson number: arrivals of unit rate counted up to `mean` (a sum of exponentials)."""
    count, time = 0, 0.0
    while True:
        time -= math.log(1.0 - uniform(stream, count))
        if time >= mean:
            return count
        count += 1


@njit(cache=True, error_model="numpy")
def _geometry(pose: Array, x: float, y: float, delta: float) -> tuple[float, float, float, float]:
    """Errors of a ground point seen from `pose`, along and across the look, and its direction.

    A direction that is off by a small angle delta moves the point where it meets the ground by
    s delta across the look and by s delta / sin(elevation) = s² delta / h along it.
    """
    dx, dy, h = x - pose[0], y - pose[1], pose[2]
    flat = math.hypot(dx, dy)
    slant = math.hypot(flat, h)
    cosine, sine = (dx / flat, dy / flat) if flat > 0.0 else (1.0, 0.0)
    return slant * slant / h * delta, slant * delta, cosine, sine


@njit(cache=True, error_model="numpy")
def _write(row: Array, pose: Array, x: float, y: float, delta: float) -> None:
    """A detection at the measured place, with the covariance of the measured geometry."""
    along, across, cosine, sine = _geometry(pose, x, y, delta)
    a, b = along * along, across * across
    row[0], row[1] = x, y
    row[2] = a * cosine * cosine + b * sine * sine
    row[3] = (a - b) * cosine * sine
    row[4] = a * sine * sine + b * cosine * cosine


@njit(cache=True, error_model="numpy")
def _measured(
    pose: Array, x: float, y: float, delta: float, stream: np.uint64, counter: int
) -> tuple[float, float]:
    """The true place plus Gaussian noise of its geometry (Box and Muller)."""
    along, across, cosine, sine = _geometry(pose, x, y, delta)
    size = math.sqrt(-2.0 * math.log(1.0 - uniform(stream, counter)))
    angle = 2.0 * math.pi * uniform(stream, counter + 1)
    u, v = along * size * math.cos(angle), across * size * math.sin(angle)
    return x + u * cosine - v * sine, y + u * sine + v * cosine


@njit(cache=True, error_model="numpy")
def _somewhere(
    pose: Array, half_aperture: float, reach: float, height: float, stream: np.uint64
) -> tuple[bool, float, float]:
    """A point uniform over the footprint at `height`: rejection from a box around the footprint.

    Along the swing of the camera the footprint ends where the cone's edges or the range end; to the
    sides a point at slant range s is at most s sin(half_aperture) away.
    """
    h, bank, heading = pose[2] - height, pose[4], pose[3]
    if h <= 0.0 or h > reach:
        return False, 0.0, 0.0
    farthest = math.acos(h / reach)  # from straight down, where the range ends
    # Angles from straight down, positive to the right, where the camera swings in a left bank.
    low, high = max(bank - half_aperture, -farthest), min(bank + half_aperture, farthest)
    if low > high:
        return False, 0.0, 0.0
    near, far = h * math.tan(low), h * math.tan(high)
    half_width = h / math.cos(max(abs(low), abs(high))) * math.sin(half_aperture)
    axis_x, axis_y, axis_z = camera_axis(heading, bank)
    cosine = math.cos(half_aperture)
    right_x, right_y = math.sin(heading), -math.cos(heading)
    for k in range(_MOST_TRIES):
        u = near + (far - near) * uniform(stream, 2 * k)
        v = half_width * (2.0 * uniform(stream, 2 * k + 1) - 1.0)
        dx, dy = u * right_x - v * right_y, u * right_y + v * right_x
        if in_cone(dx, dy, -h, axis_x, axis_y, axis_z, cosine, reach):
            return True, pose[0] + dx, pose[1] + dy
    return False, 0.0, 0.0


@njit(cache=True, error_model="numpy")
def _shuffle(rows: Array, origins: Indices, first: int, last: int, stream: np.uint64) -> None:
    """Put rows first..last - 1 into a random order (Fisher and Yates)."""
    for k in range(last - 1, first, -1):
        j = first + int((k - first + 1) * uniform(stream, k - first))
        origins[k], origins[j] = origins[j], origins[k]
        for c in range(rows.shape[1]):
            rows[k, c], rows[j, c] = rows[j, c], rows[k, c]


@njit(cache=True, error_model="numpy")
def detect(
    walls: Walls,
    aircraft: Array,
    vehicles: Array,
    half_aperture: float,
    reach: float,
    height: float,
    delta: float,
    chance: float,
    clutter: float,
    key: np.uint64,
    tick: int,
) -> tuple[Array, Indices, Indices]:
    """All detections of all aircraft in one look.

    Parameters
    ----------
    walls : Walls
        Of the true city.
    aircraft : (n, 6) float array
    vehicles : (m, 4) float array
    half_aperture : float [rad]
    reach : float [m]
        Greatest slant range.
    height : float [m]
        Of the point at which a vehicle, or what is taken for one, is seen.
    delta : float [rad]
        Standard deviation of the angular error.
    chance : float
        Probability of a detection of what is visible.
    clutter : float
        Mean number of false alarms over the footprint.
    key : uint64
        With the aircraft's and the vehicle's index and the tick it names every draw.
    tick : int

    Returns
    -------
    rows : (k, 5) float array
        x, y [m], and the covariance's xx, xy, yy [m²], grouped by aircraft, in random order inside.
    origins : (k,) int array
        The vehicle of each row, -1 for a false alarm.
    first : (n + 1,) int array
        Where each aircraft's rows start.
    """
    n, m = aircraft.shape[0], vehicles.shape[0]
    points = np.empty((m, 3))
    for j in range(m):
        points[j, 0], points[j, 1], points[j, 2] = vehicles[j, 0], vehicles[j, 1], height
    seen = look(walls, aircraft, points, half_aperture, reach)
    alarms = np.empty(n, dtype=np.int64)
    streams = np.empty(n, dtype=np.uint64)
    for i in range(n):
        streams[i] = fold(key, i)
        alarms[i] = _poisson(clutter, fold(streams[i], _STREAMS * tick + _ALARM))
    most = 0
    for i in range(n):
        most += alarms[i]
        for j in range(m):
            most += seen[i, j]
    rows, origins = np.empty((most, 5)), np.empty(most, dtype=np.int64)
    first = np.zeros(n + 1, dtype=np.int64)
    k = 0
    for i in range(n):
        pose = aircraft[i]
        stream = fold(streams[i], _STREAMS * tick + _VEHICLE)
        for j in range(m):
            if seen[i, j] and uniform(stream, _DRAWS * j) < chance:
                x, y = points[j, 0], points[j, 1]
                x, y = _measured(pose, x, y, delta, stream, _DRAWS * j + 1)
                _write(rows[k], pose, x, y, delta)
                origins[k] = j
                k += 1
        stream = fold(streams[i], _STREAMS * tick + _PLACE)
        for a in range(alarms[i]):
            found, x, y = _somewhere(pose, half_aperture, reach, height, fold(stream, a))
            inside = 0.0 <= x <= walls.width and 0.0 <= y <= walls.height
            if found and inside and line_of_sight(walls, pose[0], pose[1], pose[2], x, y, height):
                _write(rows[k], pose, x, y, delta)
                origins[k] = -1
                k += 1
        first[i + 1] = k
        stream = fold(streams[i], _STREAMS * tick + _ORDER)
        _shuffle(rows, origins, first[i], first[i + 1], stream)
    return rows[:k], origins[:k], first


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    aircraft, vehicles = np.array([[0.0, 0.0, 9.0, 0.0, 0.0, 1.0]]), np.zeros((1, 4))
    detect(warm_walls(), aircraft, vehicles, 1.0, 20.0, 0.0, 0.1, 0.9, 0.1, np.uint64(0), 0)
