"""The search map's two loops: mark what was looked at, choose where to look next."""

import math
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, camera_axes, in_cone
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["SPACING", "choose", "mark", "warm"]

TRAVEL: Final = 2.0
"""A second on the way costs so many seconds of age."""

SPACING: Final = 150.0
"""Two searching aircraft keep their goals this far apart if they can [m]."""

PENALTY: Final = 300.0
"""What a goal at another one's goal costs [s of age]."""

LEFT: Final = 0.8
"""Share of a cell's age that is left to an aircraft which is much nearer to it."""

SOFT: Final = 10.0
"""Whoever is so much nearer is much nearer [s]."""


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
    times: NDArray[np.float64],
) -> None:
    """Write when a camera at one of `poses` had a free view of a street cell.

    What was looked at later stays as it is.

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
    times : (k,) float array [s]
        When the aircraft had these poses.
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
                    looked[row, column] = max(looked[row, column], times[k])


@njit(cache=True, error_model="numpy")
def choose(
    looked: NDArray[np.float64],
    places: NDArray[np.float64],
    factors: NDArray[np.float64],
    pose: NDArray[np.float64],
    turn_radius: float,
    others: NDArray[np.float64],
    goals: NDArray[np.float64],
    fresh: NDArray[np.float64],
    time: float,
) -> tuple[int, int]:
    r"""Row and column of the street cell most worth flying to; (-1, -1) where there is no street.

    Parameters
    ----------
    looked, places
        As in `mark`.
    factors : (rows, columns) float array
        How much each cell matters.
    pose : (6,) float array
        Of the aircraft.
    turn_radius : float [m]
    others : (k, 6) float array
        Poses of the other searching aircraft, as last heard.
    goals : (k, 2) float array [m]
        Where they were heading.
    fresh : (k,) float array
        How much that is to be heeded, 0 to 1.
    time : float [s]

    Notes
    -----
    The worth of a cell i is

    .. math:: a_i p_i \prod_k (1 - S f_k \, h_{ik}) - T t_i - P \sum_k f_k (1 - d_{ik}/D)^+

    with its age :math:`a_i`, factor :math:`p_i`, the time to get there :math:`t_i` (the turn
    towards it included), the distance :math:`d_{ik}` from the goal of another aircraft k, heeded by
    :math:`f_k`, and :math:`h_{ik}` from 0 to 1 as k is from ten seconds farther away to ten seconds
    nearer than the aircraft itself. S, T, P and D are `LEFT`, `TRAVEL`, `PENALTY` and `SPACING`.
    """
    best, best_row, best_column = -np.inf, -1, -1
    for row in range(looked.shape[0]):
        for column in range(looked.shape[1]):
            px, py = places[row, column, 0], places[row, column, 1]
            if math.isnan(px):
                continue
            own = _travel(pose, px, py, turn_radius)
            age, cost = factors[row, column] * (time - looked[row, column]), TRAVEL * own
            for k in range(others.shape[0]):
                lead = own - _travel(others[k], px, py, turn_radius)
                age *= 1.0 - LEFT * fresh[k] * min(max(0.5 + 0.5 * lead / SOFT, 0.0), 1.0)
                ox, oy = goals[k, 0] - px, goals[k, 1] - py
                near = 1.0 - math.sqrt(ox * ox + oy * oy) / SPACING
                cost += PENALTY * fresh[k] * max(near, 0.0)
            if age - cost > best:
                best, best_row, best_column = age - cost, row, column
    return best_row, best_column


@njit(cache=True, error_model="numpy")
def _travel(pose: NDArray[np.float64], x: float, y: float, turn_radius: float) -> float:
    """Time to turn towards a place and fly there [s]."""
    east, north, dx, dy = math.cos(pose[3]), math.sin(pose[3]), x - pose[0], y - pose[1]
    away = math.atan2(abs(east * dy - north * dx), east * dx + north * dy)
    travel: float = (math.sqrt(dx * dx + dy * dy) + turn_radius * away) / pose[5]
    return travel


def warm() -> None:
    """Compile, or load from the cache, what a flight calls."""
    looked, places = np.zeros((1, 1)), np.zeros((1, 1, 3))
    pose = np.array([[0.0, 0.0, 10.0, 0.0, 0.0, 15.0]])
    axes = camera_axes(pose, np.zeros((1, 2)), BODY)
    mark(warm_walls(), looked, places, 1.0, pose, axes, 1.0, 50.0, np.zeros(1))
    choose(looked, places, looked, pose[0], 30.0, pose, np.zeros((1, 2)), np.zeros(1), 1.0)
