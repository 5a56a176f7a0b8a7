"""Recorded ways, read at any time: cubic between the knots, at rest before and after them."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["replay", "warm"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_HEADED = 0.3  # a slower vehicle keeps its heading [m/s]


@njit(cache=True, error_model="numpy")
def _until(knots: Array, begin: int, end: int, time: float) -> int:
    """How many of the knots are not later than `time`."""
    low, high = begin, end
    while low < high:
        middle = (low + high) // 2
        if knots[middle, 0] <= time:
            low = middle + 1
        else:
            high = middle
    return low - begin


@njit(cache=True, error_model="numpy")
def replay(
    knots: Array, first: Indices, vehicles: Array, start: float, dt: float, substeps: int
) -> Array:
    """Where each vehicle is after every dynamics step.

    Parameters
    ----------
    knots : (m, 5) float array
        Time [s], x, y [m] and the velocity to east and north [m/s] of every knot; those of one
        vehicle after another, each in order of time.
    first : (n + 1,) int array
        The knots of vehicle i are ``knots[first[i]:first[i + 1]]``, at least one.
    vehicles : (n, 4) float array
        x, y, heading, speed before; of these only the heading is read.
    start : float [s]
        Time before the first step.
    dt : float [s]
    substeps : int

    Returns
    -------
    (substeps, n, 4) float array
        x, y, heading, speed: cubic Hermite between knots; before the first and after the last knot
        at rest there. The heading is that of the motion, and is kept below 0.3 m/s.
    """
    n = vehicles.shape[0]
    path = np.empty((substeps, n, 4))
    for i in range(n):
        begin, end = first[i], first[i + 1]
        heading = vehicles[i, 2]
        k = begin + _until(knots, begin, end, start)
        for s in range(substeps):
            time = start + (s + 1) * dt
            while k < end and knots[k, 0] <= time:
                k += 1
            vx = vy = 0.0
            if k in (begin, end):
                rest = begin if k == begin else end - 1
                x, y = knots[rest, 1], knots[rest, 2]
            else:
                h = knots[k, 0] - knots[k - 1, 0]
                u = (time - knots[k - 1, 0]) / h
                # Hermite basis of the far end and of both slopes, and its derivative.
                far, near_slope = u * u * (3.0 - 2.0 * u), h * u * (1.0 - u) * (1.0 - u)
                far_slope = -h * u * u * (1.0 - u)
                d_far, d_near = 6.0 * u * (1.0 - u) / h, (1.0 - u) * (1.0 - 3.0 * u)
                d_far_slope = u * (3.0 * u - 2.0)
                ex, ey = knots[k, 1] - knots[k - 1, 1], knots[k, 2] - knots[k - 1, 2]
                x = knots[k - 1, 1] + far * ex
                y = knots[k - 1, 2] + far * ey
                x += near_slope * knots[k - 1, 3] + far_slope * knots[k, 3]
                y += near_slope * knots[k - 1, 4] + far_slope * knots[k, 4]
                vx = d_far * ex + d_near * knots[k - 1, 3] + d_far_slope * knots[k, 3]
                vy = d_far * ey + d_near * knots[k - 1, 4] + d_far_slope * knots[k, 4]
            speed = math.hypot(vx, vy)
            if speed >= _HEADED:
                heading = math.atan2(vy, vx)
            path[s, i, 0], path[s, i, 1], path[s, i, 2], path[s, i, 3] = x, y, heading, speed
    return path


def warm() -> None:
    """Compile, or load from the disk cache, what this module is driven with."""
    knots, first = (
        np.array([[0.0, 0.0, 0.0, 1.0, 0.0], [1.0, 1.0, 0.0, 1.0, 0.0]]),
        np.array([0, 2]),
    )
    replay(knots, first, np.zeros((1, 4)), 0.0, 0.1, 1)
