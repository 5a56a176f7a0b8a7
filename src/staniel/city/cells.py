"""Streets as square cells, one point each: what a search map and its metric are about."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city.city import City

__all__ = ["street_cells"]


def street_cells(city: City, cell: float, height: float) -> NDArray[np.float64]:
    """One point a cell: of nine, the free one nearest to the cell's middle; NaN if none is free.

    Parameters
    ----------
    city : City
    cell : float [m]
        Side of a cell; the city's corner is the origin.
    height : float [m]
        Of the points, above ground.

    Returns
    -------
    (rows, columns, 3) float array [m]
        Rows from the south. Cells that reach over the city's edge have their points inside it.

    Examples
    --------
    >>> street_cells(City.open((40.0, 20.0)), 20.0, 1.0)[0].tolist()
    [[10.0, 10.0, 1.0], [30.0, 10.0, 1.0]]
    """
    columns, rows = (math.ceil(side / cell) for side in city.size)
    steps = np.array([0.5, 1.0 / 6.0, 5.0 / 6.0])
    x = np.arange(columns)[None, :]
    y = np.arange(rows)[:, None]
    places = np.full((rows, columns, 3), np.nan)
    places[:, :, 2] = height
    candidates = sorted(
        ((a, b) for a in steps for b in steps), key=lambda p: abs(p[0] - 0.5) + abs(p[1] - 0.5)
    )
    for a, b in candidates:
        px = np.minimum((x + a) * cell + 0.0 * y, city.size[0])
        py = np.minimum((y + b) * cell + 0.0 * x, city.size[1])
        free = ~city.inside(np.stack([px, py], axis=-1).reshape(-1, 2)).reshape(rows, columns)
        take = free & np.isnan(places[:, :, 0])
        places[:, :, 0][take] = px[take]
        places[:, :, 1][take] = py[take]
    return places
