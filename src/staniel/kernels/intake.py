"""Sightings in rows: whether they can be used, and which of them are one look."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["arranged", "warm"]

Array = NDArray[Any]

# A millimetre: no camera is better, and inverse covariances stay inside float32.
_SMALLEST = 1e-6


@njit(cache=True, error_model="numpy")
def arranged(
    rows: Array, latest: float, farthest: float, widest: float
) -> tuple[int, Array, Array]:
    """Check sightings and number their looks.

    Parameters
    ----------
    rows : (m, 7) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²], reporter; in ascending order of time.
    latest : float [s]
        No sighting is later.
    farthest : float [m]
        None is farther from the origin on either axis.
    widest : float [m²]
        None has a greater sum of variances.

    Returns
    -------
    fault : int
        Number of the first sighting that breaks a limit; -1: none.
    values : (m, 6) float64 array
        The first six columns, a millimetre of noise added on both axes.
    looks : (m,) int64 array
        Number of the look, that is reporter and time, that each belongs to: from 0, as they come.
    """
    m = rows.shape[0]
    values, looks = np.empty((m, 6)), np.empty(m, np.int64)
    fault, known = -1, 0
    firsts = np.empty(m, np.int64)  # sighting of each look of the present time
    for j in range(m):
        row = rows[j]
        wrong = row[0] > latest or row[3] + row[5] > widest
        if fault < 0 and (wrong or abs(row[1]) > farthest or abs(row[2]) > farthest):
            fault = j
        for column in range(6):
            values[j, column] = row[column]
        values[j, 3] += _SMALLEST
        values[j, 5] += _SMALLEST
        looks[j] = known
        for look in range(known - 1, -1, -1):
            first = rows[firsts[look]]
            if first[0] != row[0]:
                break
            if first[6] == row[6]:
                looks[j] = look
                break
        if looks[j] == known:
            firsts[known] = j
            known += 1
    return fault, values, looks


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    arranged(np.frombuffer(bytearray(56)).reshape(-1, 7), 0.0, 1.0, 1.0)
