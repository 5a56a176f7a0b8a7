"""What every aircraft's camera delivers in one look: detections, misses, false alarms."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, camera_axes, in_cone, look
from staniel.kernels.random import fold, uniform
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["Optics", "detect", "measure", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_VEHICLE, _ALARM, _PLACE, _ORDER = 0, 1, 2, 3  # streams of one aircraft's look
_STREAMS = 4
_DRAWS = 4  # counters of each vehicle in a look: one for the detection, two for the noise
_MOST_TRIES = 1000
_HORIZON = 2.0  # a measured place farther than so many ranges is taken for sky


class Optics(NamedTuple):
    """What a camera resolves and how surely it detects; all floats, one argument for a kernel."""

    half_aperture: float
    """[rad]"""
    reach: float
    """Greatest slant range [m]."""
    height: float
    """Of the point at which a vehicle, or what is taken for one, is seen [m]."""
    delta: float
    """Standard deviation of a measured direction [rad], the same in every direction."""
    chance: float
    """Probability of a detection of what is visible."""
    falloff: float
    """Exponent k of the factor 1 - (s/reach)^k at slant range s, 0 for none."""
    gaussian: float
    """1 where detections get rarer towards the image's edge, like a Gaussian; 0 where not."""
    clutter: float
    """Mean number of false alarms over the footprint."""
    blur: float
    """Rays nearer than this make one spot on the image [rad], 0 where all are told apart."""


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
def _write(row: Array, pose: Array, x: float, y: float, delta: float) -> None:
    """A detection at the measured place, with the covariance of the measured geometry.

    A direction that is off by a small angle delta moves the point where it meets the ground by
    s delta across the look and by s delta / sin(elevation) = s² delta / h along it: what `measure`
    does, to the first order.
    """
    dx, dy, h = x - pose[0], y - pose[1], pose[2]
    flat = math.hypot(dx, dy)
    slant = math.hypot(flat, h)
    cosine, sine = (dx / flat, dy / flat) if flat > 0.0 else (1.0, 0.0)
    a, b = (slant * slant / h * delta) ** 2, (slant * delta) ** 2
    row[0], row[1] = x, y
    row[2] = a * cosine * cosine + b * sine * sine
    row[3] = (a - b) * cosine * sine
    row[4] = a * sine * sine + b * cosine * cosine


@njit(cache=True, error_model="numpy")
def measure(
    pose: Array, x: float, y: float, up: float, aside: float, farthest: float
) -> tuple[bool, float, float]:
    r"""Where a ray that is off by a small turn meets the ground: thesis eq. 4.20, in exact form.

    Through the pixel of the ground point (x, y) goes the ray d from the camera, whatever mount,
    bank and heading brought it there. The pixel that was measured lies on the ray
    :math:`\cos|\epsilon|\, d + \sin|\epsilon|\, \epsilon/|\epsilon|`, and this one is
    intersected with the ground.

    Parameters
    ----------
    pose : (6,) float array
        Of the camera.
    x, y : float [m]
        The ground point.
    up, aside : float [rad]
        The two components of the turn epsilon: up from the ground, and to the left of the look.
    farthest : float [m]
        Slant range beyond which nothing is taken to be on the ground.

    Returns
    -------
    found : bool
        False for a ray into the sky, or to the ground farther away.
    x, y : float [m]
    """
    dx, dy, h = x - pose[0], y - pose[1], pose[2]
    flat = math.hypot(dx, dy)
    slant = math.hypot(flat, h)
    cosine, sine = (dx / flat, dy / flat) if flat > 0.0 else (1.0, 0.0)
    turn = math.hypot(up, aside)
    share = math.sin(turn) / turn if turn > 0.0 else 1.0
    # Components of the turned ray: onward over the ground, to the left of it, and down.
    onward = (flat * math.cos(turn) + h * share * up) / slant
    left = share * aside
    down = (h * math.cos(turn) - flat * share * up) / slant
    if down * farthest < h:
        return False, 0.0, 0.0
    u, v = h * onward / down, h * left / down
    return True, pose[0] + u * cosine - v * sine, pose[1] + u * sine + v * cosine


@njit(cache=True, error_model="numpy")
def _noisy(
    pose: Array, x: float, y: float, optics: Optics, stream: np.uint64, counter: int
) -> tuple[bool, float, float]:
    """The true place as measured with Gaussian noise of the direction (Box and Muller)."""
    size = optics.delta * math.sqrt(-2.0 * math.log(1.0 - uniform(stream, counter)))
    angle = 2.0 * math.pi * uniform(stream, counter + 1)
    up, aside = size * math.cos(angle), size * math.sin(angle)
    return measure(pose, x, y, up, aside, _HORIZON * optics.reach)


@njit(cache=True, error_model="numpy")
def _chance(pose: Array, axis: Array, x: float, y: float, optics: Optics) -> float:
    r"""Probability that what is visible at (x, y) is detected.

    The Gaussian weight (thesis fig. 4.5) is :math:`\exp(-\frac12 (\tan\theta/\tan\alpha)^2)` at the
    angle theta off the axis: over a level camera's disc the Gaussian whose covariance ellipse is
    the footprint's edge, and the same over the image of a tilted one, whatever its conic is.
    """
    chance = optics.chance
    if optics.falloff > 0.0 or optics.gaussian > 0.0:
        dx, dy, dz = x - pose[0], y - pose[1], optics.height - pose[2]
        square = dx * dx + dy * dy + dz * dz
        if optics.falloff > 0.0:
            chance *= max(0.0, 1.0 - (math.sqrt(square) / optics.reach) ** optics.falloff)
        if optics.gaussian > 0.0:
            along = dx * axis[0] + dy * axis[1] + dz * axis[2]
            tangent = math.tan(optics.half_aperture)
            chance *= math.exp(-0.5 * (square / (along * along) - 1.0) / (tangent * tangent))
    return chance


@njit(cache=True, error_model="numpy")
def _somewhere(
    pose: Array, axis: Array, optics: Optics, stream: np.uint64
) -> tuple[bool, float, float]:
    """A point uniform over the footprint at the seen height: rejection from a box around it.

    Along the swing of the camera the footprint ends where the cone's edges or the range end; to the
    sides a point at slant range s is at most s sin(half_aperture) away.
    """
    h, reach, half_aperture = pose[2] - optics.height, optics.reach, optics.half_aperture
    if h <= 0.0 or h > reach or math.isnan(axis[2]):
        return False, 0.0, 0.0
    farthest = math.acos(h / reach)  # from straight down, where the range ends
    # Angles from straight down, positive to where the camera swings.
    aside = math.hypot(axis[0], axis[1])
    swing = math.atan2(aside, -axis[2])
    low, high = max(swing - half_aperture, -farthest), min(swing + half_aperture, farthest)
    if low > high:
        return False, 0.0, 0.0
    near, far = h * math.tan(low), h * math.tan(high)
    half_width = h / math.cos(max(abs(low), abs(high))) * math.sin(half_aperture)
    cosine = math.cos(half_aperture)
    east, north = (axis[0] / aside, axis[1] / aside) if aside > 0.0 else (1.0, 0.0)
    for k in range(_MOST_TRIES):
        u = near + (far - near) * uniform(stream, 2 * k)
        v = half_width * (2.0 * uniform(stream, 2 * k + 1) - 1.0)
        dx, dy = u * east - v * north, u * north + v * east
        if in_cone(dx, dy, -h, axis[0], axis[1], axis[2], cosine, reach):
            return True, pose[0] + dx, pose[1] + dy
    return False, 0.0, 0.0


@njit(cache=True, error_model="numpy")
def _merge(
    rows: Array, origins: Indices, first: int, last: int, pose: Array, optics: Optics
) -> int:
    """Join rows first..last - 1 whose rays are nearer than the blur, also through others.

    Each spot is left at the mean of its places, under the first of its vehicles. Returns where the
    rows now end.
    """
    count = last - first
    root, rays = np.empty(count, dtype=np.int64), np.empty((count, 3))
    chord = 2.0 * math.sin(0.5 * optics.blur)
    for a in range(count):
        root[a] = a
        rays[a, 0], rays[a, 1] = rows[first + a, 0] - pose[0], rows[first + a, 1] - pose[1]
        rays[a, 2] = optics.height - pose[2]
        slant = math.sqrt(rays[a, 0] ** 2 + rays[a, 1] ** 2 + rays[a, 2] ** 2)
        for c in range(3):
            rays[a, c] /= slant
        for b in range(a):
            dx, dy, dz = rays[a, 0] - rays[b, 0], rays[a, 1] - rays[b, 1], rays[a, 2] - rays[b, 2]
            if dx * dx + dy * dy + dz * dz < chord * chord and root[a] != root[b]:
                low, high = min(root[a], root[b]), max(root[a], root[b])
                for c in range(a + 1):
                    if root[c] == high:
                        root[c] = low
    k = first
    for a in range(count):
        if root[a] != a:
            continue
        x, y, members = 0.0, 0.0, 0
        for b in range(a, count):
            if root[b] == a:
                x, y, members = x + rows[first + b, 0], y + rows[first + b, 1], members + 1
        # The rays have done their work: here go the means, as the rows are still to be read.
        rays[a, 0], rays[a, 1] = x / members, y / members
    for a in range(count):
        if root[a] == a:
            rows[k, 0], rows[k, 1], origins[k] = rays[a, 0], rays[a, 1], origins[first + a]
            k += 1
    return k


@njit(cache=True, error_model="numpy")
def _shuffle(rows: Array, origins: Indices, first: int, last: int, stream: np.uint64) -> None:
    """Put rows first..last - 1 into a random order (Fisher and Yates)."""
    for k in range(last - 1, first, -1):
        j = first + int((k - first + 1) * uniform(stream, k - first))
        origins[k], origins[j] = origins[j], origins[k]
        for c in range(rows.shape[1]):
            rows[k, c], rows[j, c] = rows[j, c], rows[k, c]


@njit(cache=True, error_model="numpy")
def _vehicles(
    rows: Array,
    origins: Indices,
    first: int,
    pose: Array,
    axis: Array,
    points: Array,
    seen: NDArray[np.bool_],
    optics: Optics,
    stream: np.uint64,
) -> int:
    """Write one aircraft's detections of vehicles from row `first` on; returns where they end."""
    k = first
    for j in range(points.shape[0]):
        if seen[j]:
            x, y = points[j, 0], points[j, 1]
            if uniform(stream, _DRAWS * j) < _chance(pose, axis, x, y, optics):
                rows[k, 0], rows[k, 1], origins[k] = x, y, j
                k += 1
    if optics.blur > 0.0:
        k = _merge(rows, origins, first, k, pose, optics)
    end = first
    for r in range(first, k):
        j = origins[r]
        found, x, y = _noisy(pose, rows[r, 0], rows[r, 1], optics, stream, _DRAWS * j + 1)
        if found:
            _write(rows[end], pose, x, y, optics.delta)
            origins[end] = j
            end += 1
    return end


@njit(cache=True, error_model="numpy")
def detect(
    walls: Walls,
    aircraft: Array,
    axes: Array,
    vehicles: Array,
    optics: Optics,
    key: np.uint64,
    number: int,
) -> tuple[Array, Indices, Indices]:
    """All detections of all aircraft in one look.

    Parameters
    ----------
    walls : Walls
        Of the true city.
    aircraft : (n, 6) float array
    axes : (n, 3) float array
        Along which each camera looks; NaN where it sees nothing.
    vehicles : (m, 4) float array
    optics : Optics
    key : uint64
        With the aircraft's and the vehicle's index and the look's number it names every draw.
    number : int
        Of the look, counted since the start.

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
        points[j, 0], points[j, 1], points[j, 2] = vehicles[j, 0], vehicles[j, 1], optics.height
    seen = look(walls, aircraft, axes, points, optics.half_aperture, optics.reach)
    alarms = np.empty(n, dtype=np.int64)
    streams = np.empty(n, dtype=np.uint64)
    most = 0
    for i in range(n):
        streams[i] = fold(key, i)
        alarms[i] = _poisson(optics.clutter, fold(streams[i], _STREAMS * number + _ALARM))
        most += alarms[i]
        for j in range(m):
            most += seen[i, j]
    rows, origins = np.empty((most, 5)), np.empty(most, dtype=np.int64)
    first = np.zeros(n + 1, dtype=np.int64)
    k = 0
    for i in range(n):
        pose, axis = aircraft[i], axes[i]
        stream = fold(streams[i], _STREAMS * number + _VEHICLE)
        k = _vehicles(rows, origins, k, pose, axis, points, seen[i], optics, stream)
        stream = fold(streams[i], _STREAMS * number + _PLACE)
        for a in range(alarms[i]):
            found, x, y = _somewhere(pose, axis, optics, fold(stream, a))
            if (
                found
                and 0.0 <= x <= walls.width
                and 0.0 <= y <= walls.height
                and line_of_sight(walls, pose[0], pose[1], pose[2], x, y, optics.height)
            ):
                _write(rows[k], pose, x, y, optics.delta)
                origins[k] = -1
                k += 1
        first[i + 1] = k
        stream = fold(streams[i], _STREAMS * number + _ORDER)
        _shuffle(rows, origins, first[i], first[i + 1], stream)
    return rows[:k], origins[:k], first


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    aircraft, vehicles = np.array([[0.0, 0.0, 9.0, 0.0, 0.0, 1.0]]), np.zeros((1, 4))
    optics = Optics(1.0, 20.0, 0.0, 0.1, 0.9, 0.0, 0.0, 0.1, 0.0)
    axes = camera_axes(aircraft, np.zeros((1, 2)), BODY)
    detect(warm_walls(), aircraft, axes, vehicles, optics, np.uint64(0), 0)
