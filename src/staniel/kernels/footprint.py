"""What a body-fixed belly camera covers: its axis, its closed cone, and the one test of seeing."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["camera_axis", "in_cone", "look", "warm"]

Array = NDArray[np.float64]

_ROUNDING = 1e-12
"""Slack of the closed cone, relative to the distance: a boundary computed elsewhere is inside."""


@njit(cache=True, error_model="numpy")
def camera_axis(heading: float, bank: float) -> tuple[float, float, float]:
    r"""Unit vector along which the camera looks, east-north-up.

    :math:`R_z(\theta) R_x(-\varphi) (0, 0, -1)^T` in forward-left-up body axes, thesis eq. 4.2
    (corrected): in a left bank (positive) the camera swings to the right, away from the turn's
    centre.
    """
    aside = math.sin(bank)
    return math.sin(heading) * aside, -math.cos(heading) * aside, -math.cos(bank)


@njit(cache=True, error_model="numpy")
def in_cone(
    dx: float,
    dy: float,
    dz: float,
    axis_x: float,
    axis_y: float,
    axis_z: float,
    cosine: float,
    reach: float,
) -> bool:
    """Whether the point (dx, dy, dz) from the camera is in its closed cone and within `reach`.

    `cosine` is that of the half-aperture, `reach` the greatest slant range [m]; thesis eq. 4.3
    (corrected), of which only the sheet in front of the camera is kept.
    """
    slant = math.sqrt(dx * dx + dy * dy + dz * dz)
    along = dx * axis_x + dy * axis_y + dz * axis_z
    return along >= (cosine - _ROUNDING) * slant and slant <= reach * (1.0 + _ROUNDING)


@njit(cache=True, error_model="numpy")
def look(
    walls: Walls, aircraft: Array, points: Array, half_aperture: float, reach: float
) -> NDArray[np.bool_]:
    """Which points each aircraft's camera sees: in its cone, in range, in free line of sight.

    Every detection passes this test, and no other.

    Parameters
    ----------
    walls : Walls
        Of the true city.
    aircraft : (n, 6) float array
        x, y, z [m], heading, bank [rad], speed.
    points : (m, 3) float array [m]
    half_aperture : float [rad]
    reach : float [m]
        Greatest slant range.

    Returns
    -------
    (n, m) bool array
    """
    n, m = aircraft.shape[0], points.shape[0]
    seen = np.zeros((n, m), dtype=np.bool_)
    cosine = math.cos(half_aperture)
    for i in range(n):
        x, y, z = aircraft[i, 0], aircraft[i, 1], aircraft[i, 2]
        axis_x, axis_y, axis_z = camera_axis(aircraft[i, 3], aircraft[i, 4])
        for j in range(m):
            dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
            if in_cone(dx, dy, dz, axis_x, axis_y, axis_z, cosine, reach):
                seen[i, j] = line_of_sight(walls, x, y, z, points[j, 0], points[j, 1], points[j, 2])
    return seen


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    look(warm_walls(), np.zeros((1, 6)), np.zeros((1, 3)), 1.0, 1.0)
