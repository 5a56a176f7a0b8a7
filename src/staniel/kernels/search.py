"""The search map's two loops: mark what was looked at, choose where to look next."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, camera_axes, in_cone
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["choose", "mark", "warm"]


@njit(cache=True, error_model="numpy")
def mark(
    walls: Walls,
    looked: NDArray[np.float64],
    places: NDArray[np.float64],
    cell: float,
    poses: NDArray[np.float64],
    axes: NDArray[np.float64],
    half_aperture: float,
    reach: float,
    time: float,
) -> None:
    """Write `time` where a camera at one of `poses` has a free view of a street cell.

    Parameters
    ----------
    walls : Walls
        Of the chart.
    looked : (rows, columns) float array [s]
        When each cell was last looked at; written in place.
    places : (rows, columns, 3) float array [m]
        The point that stands for each cell; NaN in the first coordinate where there is no street.
    cell : float [m]
        Side of a cell; the map's corner is the origin.
    poses : (k, 6) float array
        Aircraft poses as in `Truth.aircraft`.
    axes : (k, 3) float array
        Along which their cameras look; NaN where one sees nothing.
    half_aperture : float [rad]
    reach : float [m]
        Greatest slant range.
    time : float [s]
    """
    rows, columns = looked.shape
    cosine = math.cos(half_aperture)
    for k in range(poses.shape[0]):
        x, y, z = poses[k, 0], poses[k, 1], poses[k, 2]
        axis_x, axis_y, axis_z = axes[k, 0], axes[k, 1], axes[k, 2]
        first_column = max(0, int((x - reach) / cell))
        last_column = min(columns, int((x + reach) / cell) + 1)
        for row in range(max(0, int((y - reach) / cell)), min(rows, int((y + reach) / cell) + 1)):
            for column in range(first_column, last_column):
                px, py, pz = places[row, column]
                # A comparison with NaN is false: cells without a street fall out here.
                if in_cone(
                    px - x, py - y, pz - z, axis_x, axis_y, axis_z, cosine, reach
                ) and line_of_sight(walls, x, y, z, px, py, pz):
                    looked[row, column] = time


@njit(cache=True, error_model="numpy")
def choose(
    looked: NDArray[np.float64],
    places: NDArray[np.float64],
    pose: NDArray[np.float64],
    turn_radius: float,
    others: NDArray[np.float64],
    spacing: float,
    time: float,
) -> tuple[int, int]:
    """Row and column of the street cell most worth flying to; (-1, -1) where there is no street.

    The worth of a cell is its age less twice the time to get there (the turn towards it included),
    less a penalty that grows as it comes nearer than `spacing` to another aircraft's goal.

    Parameters
    ----------
    looked, places
        As in `mark`.
    pose : (6,) float array
        Of the aircraft.
    turn_radius : float [m]
    others : (k, 2) float array [m]
        Goals of the other searching aircraft.
    spacing : float [m]
    time : float [s]
    """
    best, best_row, best_column = -np.inf, -1, -1
    speed, east, north = pose[5], math.cos(pose[3]), math.sin(pose[3])
    for row in range(looked.shape[0]):
        for column in range(looked.shape[1]):
            px, py = places[row, column, 0], places[row, column, 1]
            if math.isnan(px):
                continue
            dx, dy = px - pose[0], py - pose[1]
            away = math.atan2(abs(east * dy - north * dx), east * dx + north * dy)
            travel = (math.sqrt(dx * dx + dy * dy) + turn_radius * away) / speed
            worth = (time - looked[row, column]) - 2.0 * travel
            for k in range(others.shape[0]):
                ox, oy = others[k, 0] - px, others[k, 1] - py
                near = 1.0 - math.sqrt(ox * ox + oy * oy) / spacing
                if near > 0.0:
                    worth -= 300.0 * near
            if worth > best:
                best, best_row, best_column = worth, row, column
    return best_row, best_column


def warm() -> None:
    """Compile, or load from the cache, what a flight calls."""
    looked, places = np.zeros((1, 1)), np.zeros((1, 1, 3))
    pose = np.array([[0.0, 0.0, 10.0, 0.0, 0.0, 15.0]])
    axes = camera_axes(pose, np.zeros((1, 2)), BODY)
    mark(warm_walls(), looked, places, 1.0, pose, axes, 1.0, 50.0, 1.0)
    choose(looked, places, pose[0], 30.0, np.zeros((1, 2)), 100.0, 1.0)
