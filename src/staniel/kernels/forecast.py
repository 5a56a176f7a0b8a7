"""Where a target may be: what looks in vain say of the past, and the chart's streets of the future.

A row of a cloud is x, y [m], vx, vy [m/s]; a row of looks is time [s], x, y, z [m], heading, bank
[rad], of a camera that saw nothing of the target then, and x, y [m] of where a gimbal looked.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, Mount, camera_axes, in_cone
from staniel.kernels.pieces import bare, woven
from staniel.kernels.walls import Walls, inside, line_of_sight, path_clear, warm_walls

__all__ = ["discredit", "forecast", "thinned", "warm"]

Floats = NDArray[np.float64]

_FEELER = 6.0  # how far ahead of its middle a vehicle minds walls [m]
_FEELER_ANGLE = math.radians(20.0)  # to both sides of its heading
_TURN_RATE = math.radians(60.0)  # away from walls [rad/s]
_ASIDE = 3.0  # room that a blocked vehicle wants on the side to which it turns [m]
_STANDING = 0.05  # a slower particle stays where it is [m/s]


@woven
def _clear(walls: Walls, x: float, y: float, angle: float, length: float) -> bool:
    """Whether no wall is within `length` of (x, y) in the direction `angle`."""
    there_x, there_y = x + length * math.cos(angle), y + length * math.sin(angle)
    return bool(path_clear(walls, x, y, there_x, there_y))


@bare
def _drive(walls: Walls, particle: Floats, dt: float, turning: float, tie: float) -> float:
    """Move one vehicle (x, y, heading, speed) by `dt`, in place.

    `turning` is the side to which it turned on the spot until now, 0 if it did not, and so is what
    comes back; `tie` (+1 or -1) decides where both sides have as much room.
    """
    x, y, heading, speed = particle[0], particle[1], particle[2], particle[3]
    left = _clear(walls, x, y, heading + _FEELER_ANGLE, _FEELER)
    right = _clear(walls, x, y, heading - _FEELER_ANGLE, _FEELER)
    rate = 0.0
    if left and right:
        turning = 0.0
    elif turning == 0.0 and (left or right):
        rate = _TURN_RATE if left else -_TURN_RATE
    else:
        if turning == 0.0:
            room = _clear(walls, x, y, heading + 0.5 * math.pi, _ASIDE)
            other = _clear(walls, x, y, heading - 0.5 * math.pi, _ASIDE)
            turning = tie if room == other else (1.0 if room else -1.0)
        rate, speed = turning * _TURN_RATE, 0.0
    middle = heading + 0.5 * rate * dt
    new_x, new_y = x + speed * dt * math.cos(middle), y + speed * dt * math.sin(middle)
    if speed > 0.0 and path_clear(walls, x, y, new_x, new_y):
        particle[0], particle[1] = new_x, new_y
    particle[2] = heading + rate * dt
    return turning


@njit(cache=True, error_model="numpy")
def forecast(walls: Walls, cloud: Floats, steps: int, dt: float) -> Floats:
    """Places of vehicles that keep their speed, and their course but for walls.

    As in thesis 4.2, two feelers ahead mind the chart's walls: one that meets a wall turns the
    vehicle away, both stop it and turn it on the spot until they are free. A particle inside a
    building drives straight on until it is out.

    Parameters
    ----------
    walls : Walls
        Of the chart.
    cloud : (m, 4) float array
    steps : int
    dt : float [s]

    Returns
    -------
    (steps + 1, m, 2) float array [m]
        Now and after each step.
    """
    m = cloud.shape[0]
    places = np.empty((steps + 1, m, 2))
    particle = np.empty(4)
    for j in range(m):
        vx, vy = cloud[j, 2], cloud[j, 3]
        particle[0], particle[1] = cloud[j, 0], cloud[j, 1]
        particle[2], particle[3] = math.atan2(vy, vx), math.hypot(vx, vy)
        buried = inside(walls, particle[0], particle[1]) >= 0
        turning, tie = 0.0, (1.0 if j % 2 == 0 else -1.0)
        for t in range(steps + 1):
            places[t, j, 0], places[t, j, 1] = particle[0], particle[1]
            if particle[3] <= _STANDING:
                continue
            if buried:
                particle[0] += vx * dt
                particle[1] += vy * dt
                buried = inside(walls, particle[0], particle[1]) >= 0
            else:
                turning = _drive(walls, particle, dt, turning, tie)
    return places


@njit(cache=True, error_model="numpy")
def discredit(
    walls: Walls,
    cloud: Floats,
    weights: Floats,
    now: float,
    looks: Floats,
    mount: Mount,
    height: float,
    half_aperture: float,
    reach: float,
    miss: float,
) -> None:
    """Take weight from particles that the chart or looks in vain speak against, in place.

    A particle inside a building of the chart keeps a `miss` of its weight, and so does one for each
    look that would have shown it where it then was (it is taken back along its velocity). The
    weights are normalised afterwards; if next to nothing is left they stay as they were.

    Parameters
    ----------
    walls : Walls
        Of the chart.
    cloud : (n, 4) float array
    weights : (n,) float array
    now : float [s]
    looks : (k, 8) float array
    mount : Mount
    height : float [m]
        Where on a vehicle it is seen.
    half_aperture, reach : float [rad, m]
    miss : float
        Probability that a camera misses what it could see.
    """
    n = cloud.shape[0]
    left = weights.copy()
    cosine = math.cos(half_aperture)
    for i in range(n):
        if inside(walls, cloud[i, 0], cloud[i, 1]) >= 0:
            left[i] *= miss
    pose = np.zeros((1, 6))
    for k in range(looks.shape[0]):
        ago, x, y, z = now - looks[k, 0], looks[k, 1], looks[k, 2], looks[k, 3]
        pose[0, :5] = looks[k, 1:6]
        axis = camera_axes(pose, looks[k : k + 1, 6:], mount)[0]
        for i in range(n):
            px, py = cloud[i, 0] - ago * cloud[i, 2], cloud[i, 1] - ago * cloud[i, 3]
            if in_cone(
                px - x, py - y, height - z, axis[0], axis[1], axis[2], cosine, reach
            ) and line_of_sight(walls, x, y, z, px, py, height):
                left[i] *= miss
    total = left.sum()
    if total > 1e-6:
        weights[:] = left / total


@njit(cache=True, error_model="numpy")
def thinned(cloud: Floats, weights: Floats, count: int) -> Floats:
    """(count, 4) particles of equal weight that stand for the cloud, evenly by its weights."""
    picked = np.empty((count, cloud.shape[1]))
    total, before, i = weights.sum(), weights[0], 0
    for k in range(count):
        wanted = (k + 0.5) / count * total
        while before < wanted and i < cloud.shape[0] - 1:
            i += 1
            before += weights[i]
        picked[k] = cloud[i]
    return picked


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    walls, cloud = warm_walls(), np.zeros((1, 4))
    forecast(walls, thinned(cloud, np.ones(1), 1), 1, 0.5)
    discredit(walls, cloud, np.ones(1), 0.0, np.zeros((1, 8)), BODY, 1.0, 1.0, 1.0, 0.1)
