"""What a camera covers: its axis, its closed cone, and the one test of seeing."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.pieces import woven
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = [
    "BODY",
    "Mount",
    "camera_axes",
    "camera_axis",
    "in_cone",
    "in_range",
    "look",
    "swung",
    "warm",
]

Array = NDArray[np.float64]
Mount = tuple[float, float, float, float, float, float]
"""How a camera sits in its aircraft: its axis in forward-left-up axes (a unit vector), 1.0 where
these axes bank with the aircraft or 0.0 where they stay level, the height above ground [m] beyond
which it sees nothing, and how far a gimbal swings from body-down [rad], or -1.0 without one."""

BODY: Mount = (0.0, 0.0, -1.0, 1.0, math.inf, -1.0)
"""A belly camera, fixed to the body."""

_ROUNDING = 1e-12
"""Slack of the closed cone, relative to the distance: a boundary computed elsewhere is inside."""


@njit(cache=True, error_model="numpy")
def camera_axis(heading: float, bank: float) -> tuple[float, float, float]:
    r"""Unit vector along which a belly camera looks, east-north-up.

    :math:`R_z(\theta) R_x(-\varphi) (0, 0, -1)^T` in forward-left-up body axes, thesis eq. 4.2
    (corrected): in a left bank (positive) the camera swings to the right, away from the turn's
    centre.
    """
    aside = math.sin(bank)
    return math.sin(heading) * aside, -math.cos(heading) * aside, -math.cos(bank)


@woven
def swung(
    down: tuple[float, float, float],
    east: float,
    north: float,
    below: float,
    least: float,
    most: float,
) -> tuple[float, float, float]:
    """Axis of a gimbal towards a point, or as near to it as its limit lets.

    The point is `east`, `north` and `below` of the camera [m]. Straight down is the wish where it
    is NaN, or where the camera itself is. `down` is the aircraft's own down axis, `least` and
    `most` are cosine and sine of how far the gimbal swings from it.
    """
    down_x, down_y, down_z = down
    dx, dy, dz = east, north, -below
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not distance > 0.0:
        dx, dy, dz, distance = 0.0, 0.0, -1.0, 1.0
    dx, dy, dz = dx / distance, dy / distance, dz / distance
    cosine = dx * down_x + dy * down_y + dz * down_z
    if cosine >= least:
        return dx, dy, dz
    # What of the wish is across body-down: its length is the sine of the angle between them.
    side_x, side_y, side_z = dx - cosine * down_x, dy - cosine * down_y, dz - cosine * down_z
    sine = math.sqrt(side_x * side_x + side_y * side_y + side_z * side_z)
    b = most / sine if sine > 0.0 else 0.0
    return least * down_x + b * side_x, least * down_y + b * side_y, least * down_z + b * side_z


@njit(cache=True, error_model="numpy")
def camera_axes(aircraft: Array, looks: Array, mount: Mount) -> Array:
    r"""Unit vectors along which mounted cameras look, east-north-up.

    :math:`R_z(\theta) R_x(-\varphi) R_{mount} (0, 0, -1)^T`, thesis eq. 4.2 (corrected), without
    the middle rotation where the mount stays level. A gimbal is stabilised and turns at once to the
    ground point that it is to look at, within its limit from the aircraft's own down axis.

    Parameters
    ----------
    aircraft : (n, 6) float array
        x, y, z [m], heading, bank [rad], speed.
    looks : (n, 2) float array [m]
        Ground points for gimbals to look at, NaN for straight down; not read for other mounts.
    mount : Mount

    Returns
    -------
    (n, 3) float array
        NaN where a camera sees nothing, because it is too high: no comparison with NaN is true.
    """
    forward, left, up, rolls, ceiling, limit = mount
    axes = np.empty((aircraft.shape[0], 3))
    for i in range(aircraft.shape[0]):
        if aircraft[i, 2] > ceiling:
            axes[i, 0] = axes[i, 1] = axes[i, 2] = math.nan
            continue
        if limit >= 0.0:
            east, north = looks[i, 0] - aircraft[i, 0], looks[i, 1] - aircraft[i, 1]
            down = camera_axis(aircraft[i, 3], aircraft[i, 4])
            x, y, z = swung(down, east, north, aircraft[i, 2], math.cos(limit), math.sin(limit))
            axes[i, 0], axes[i, 1], axes[i, 2] = x, y, z
            continue
        bank = rolls * aircraft[i, 4]
        cosine, sine = math.cos(bank), math.sin(bank)
        aside = cosine * left + sine * up
        east, north = math.cos(aircraft[i, 3]), math.sin(aircraft[i, 3])
        axes[i, 0] = east * forward - north * aside
        axes[i, 1] = north * forward + east * aside
        axes[i, 2] = cosine * up - sine * left
    return axes


@njit(cache=True, error_model="numpy")
def in_range(slant: float, reach: float) -> bool:
    """Whether a point `slant` away is within the slant range `reach` [m], which is in it."""
    return slant <= reach * (1.0 + _ROUNDING)


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
    return along >= (cosine - _ROUNDING) * slant and in_range(slant, reach)


@njit(cache=True, error_model="numpy")
def look(
    walls: Walls, aircraft: Array, axes: Array, points: Array, half_aperture: float, reach: float
) -> NDArray[np.bool_]:
    """Which points each aircraft's camera sees: in its cone, in range, in free line of sight.

    Every detection passes this test, and no other.

    Parameters
    ----------
    walls : Walls
        Of the true city.
    aircraft : (n, 6) float array
        x, y, z [m], heading, bank [rad], speed.
    axes : (n, 3) float array
        Along which each camera looks, as of `camera_axes`.
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
        for j in range(m):
            dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
            if in_cone(dx, dy, dz, axes[i, 0], axes[i, 1], axes[i, 2], cosine, reach):
                seen[i, j] = line_of_sight(walls, x, y, z, points[j, 0], points[j, 1], points[j, 2])
    return seen


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    aircraft = np.zeros((1, 6))
    axes = camera_axes(aircraft, np.zeros((1, 2)), BODY)
    look(warm_walls(), aircraft, axes, np.zeros((1, 3)), 1.0, 1.0)
