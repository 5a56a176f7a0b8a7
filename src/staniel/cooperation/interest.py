"""Which streets matter more to a search: the operator's areas, and where lost targets may be."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.cooperation.config import Area
from staniel.datatypes.equipment import Airframe, Camera

__all__ = ["Cloud", "lost_factors", "priorities", "sight_radius"]

Floats = NDArray[np.float64]

Cloud = tuple[Floats, Floats]
"""Where a lost target may be: places (n, 2) [m] and their weights (n,), which sum to 1."""

_GAIN = 4.0  # of a place from where a look shows a lost target for sure, over another


def priorities(areas: Sequence[Area], places: Floats) -> Floats:
    """`priority_at` of every cell, (rows, columns) float array; 1 where there is no street.

    Parameters
    ----------
    areas : sequence of Area
    places : (rows, columns, 3) float array [m]
        As of `staniel.city.street_cells`.
    """
    highest = np.zeros(places.shape[:2])
    for area in areas:
        away = np.hypot(places[:, :, 0] - area.center[0], places[:, :, 1] - area.center[1])
        highest = np.where(away <= area.radius, np.maximum(highest, area.priority), highest)
    return np.where(highest > 0.0, highest, 1.0)


def sight_radius(airframe: Airframe, camera: Camera) -> float:
    """How far around the point below it a level belly camera sees the ground, unobstructed [m]."""
    height = max(airframe.altitude - camera.target_height, 0.0)
    reach = math.sqrt(max(camera.range**2 - height**2, 0.0))
    return min(height * math.tan(camera.half_aperture), reach)


def lost_factors(
    clouds: Iterable[Cloud], shape: tuple[int, int], cell: float, radius: float
) -> Floats:
    """How much more each cell matters for the lost targets that a look at it may show.

    Parameters
    ----------
    clouds : iterable of (places, weights)
        One a lost target.
    shape : (int, int)
        Rows and columns of the map.
    cell : float [m]
        Side of a cell.
    radius : float [m]
        How far a look from above a cell reaches; half of it is counted on, for buildings hide.

    Returns
    -------
    (rows, columns) float array
        One and `_GAIN` less one times the expected number of lost targets in the square around the
        cell; 1 where none can be.
    """
    rows, columns = shape
    expected = np.zeros(shape)
    for places, weights in clouds:
        row = np.clip(places[:, 1] // cell, 0, rows - 1).astype(np.int64)
        column = np.clip(places[:, 0] // cell, 0, columns - 1).astype(np.int64)
        expected += np.bincount(row * columns + column, weights, rows * columns).reshape(shape)
    if not expected.any():
        return np.ones(shape)
    return 1.0 + (_GAIN - 1.0) * _in_squares(expected, math.ceil(0.5 * radius / cell))


def _in_squares(values: Floats, reach: int) -> Floats:
    """Sum over the square of so many cells to each side, (rows, columns) float array."""
    sums = np.pad(values.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    spans = [(np.arange(count) - reach, np.arange(count) + reach + 1) for count in values.shape]
    (south, north), (west, east) = (
        (np.maximum(first, 0), np.minimum(last, count))
        for (first, last), count in zip(spans, values.shape, strict=True)
    )
    rows: Floats = sums[north] - sums[south]
    squares: Floats = rows[:, east] - rows[:, west]
    return squares
