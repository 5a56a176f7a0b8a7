"""Where no vehicle can be: the chart's buildings as a raster, made once a chart."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from staniel.city import City

__all__ = ["raster_of"]

Raster = tuple[NDArray[np.uint8], NDArray[np.float64]]

_FINEST = 1.0  # side of a cell [m]
_MOST = 4_000_000  # cells


def raster_of(chart: City | None) -> Raster:
    """Which cells of the ground are built over, and the frame of the raster.

    Parameters
    ----------
    chart : City, optional
        None, or one without buildings, gives an empty raster.

    Returns
    -------
    blocked : (rows, columns) uint8 array
        1 where the middle of a cell is inside a building; row 0 is the south edge.
    frame : (3,) float64 array
        West and south edge [m], cells per metre.
    """
    if chart is None or not len(chart.heights):
        return np.zeros((0, 0), np.uint8), np.zeros(3)
    return _raster(chart)


@lru_cache(maxsize=4)
def _raster(chart: City) -> Raster:
    width, height = chart.size
    cell = max(_FINEST, math.sqrt(width * height / _MOST))
    columns, rows = math.ceil(width / cell), math.ceil(height / cell)
    x, y = (np.arange(columns) + 0.5) * cell, (np.arange(rows) + 0.5) * cell
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    blocked = chart.inside(points).reshape(rows, columns).astype(np.uint8)
    return blocked, np.array([0.0, 0.0, 1.0 / cell])
