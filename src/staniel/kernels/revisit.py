"""How long street cells wait for the next look: one pass over all instants, in place."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import in_cone
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["revisits", "warm"]

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def revisits(
    walls: Walls,
    times: Floats,
    aircraft: Floats,
    axes: Floats,
    optics: Floats,
    places: Floats,
    cell: float,
    step: float,
) -> tuple[Floats, Floats, NDArray[np.int64], Floats, Floats]:
    """When each cell was last seen, how long the waits in between were, and how old it was.

    Parameters
    ----------
    walls : Walls
    times : (n,) float array [s]
        Ascending.
    aircraft : (n, a, 6) float array
        x, y, z [m], heading, bank [rad], speed.
    axes : (n, a, 3) float array
        Along which each camera looks; NaN where it sees nothing.
    optics : (a, 3) float array
        Of each camera half-aperture [rad], greatest slant range [m], height of what it looks
        for above ground [m].
    places : (rows, columns, 2) float array [m]
        The point that stands for each cell; NaN where there is no street.
    cell : float [m]
        Side of a cell; the map's corner is the origin.
    step : float [s]
        Two looks no farther apart than this are one.

    Returns
    -------
    last : (rows, columns) float array [s]
        When each cell was last seen; NaN for never.
    waits : (rows, columns) float array [s]
        Sum of the times between two looks that are farther apart than `step`.
    returns : (rows, columns) int array
        How many these are.
    longest : (rows, columns) float array [s]
        The greatest age that each cell reached: the time since it was last seen, or since the first
        instant where it was not seen yet.
    ages : (rows, columns) float array [s]
        Sum of each cell's ages at all instants.
    """
    rows, columns = places.shape[:2]
    last = np.full((rows, columns), math.nan)
    waits, longest = np.zeros((rows, columns)), np.zeros((rows, columns))
    ages = np.zeros((rows, columns))
    returns = np.zeros((rows, columns), dtype=np.int64)
    for t in range(times.shape[0]):
        now = times[t]
        for i in range(aircraft.shape[1]):
            axis_x, axis_y, axis_z = axes[t, i]
            if math.isnan(axis_x):
                continue
            x, y, z = aircraft[t, i, 0], aircraft[t, i, 1], aircraft[t, i, 2]
            cosine, reach, height = math.cos(optics[i, 0]), optics[i, 1], optics[i, 2]
            left = max(0, int((x - reach) / cell))
            right = min(columns, int((x + reach) / cell) + 1)
            top = min(rows, int((y + reach) / cell) + 1)
            for row in range(max(0, int((y - reach) / cell)), top):
                for column in range(left, right):
                    px, py = places[row, column]
                    # A comparison with NaN is false: cells without a street fall out here.
                    if last[row, column] == now or not (
                        in_cone(px - x, py - y, height - z, axis_x, axis_y, axis_z, cosine, reach)
                        and line_of_sight(walls, x, y, z, px, py, height)
                    ):
                        continue
                    before = last[row, column]
                    since = now - (times[0] if math.isnan(before) else before)
                    longest[row, column] = max(longest[row, column], since)
                    if since > step and not math.isnan(before):
                        waits[row, column] += since
                        returns[row, column] += 1
                    last[row, column] = now
        for row in range(rows):
            for column in range(columns):
                before = times[0] if math.isnan(last[row, column]) else last[row, column]
                ages[row, column] += now - before
                longest[row, column] = max(longest[row, column], now - before)
    return last, waits, returns, longest, ages


def warm() -> None:
    """Compile, or load from the cache, what a flight's metrics call."""
    one = np.zeros((1, 1, 3))
    revisits(
        warm_walls(), np.zeros(1), np.zeros((1, 1, 6)), one, one[0], one[:, :, :2].copy(), 1.0, 1.0
    )
