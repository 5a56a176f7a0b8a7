"""Gusts: the wind around each aircraft, a Gauss-Markov process that it flies through."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform

__all__ = ["blow", "warm"]

Array = NDArray[np.float64]

_STILL = 1.0  # the turbulence passes an aircraft at least this fast [m/s]


@njit(cache=True, error_model="numpy")
def blow(
    wind: Array,
    mean: Array,
    speeds: Array,
    sigmas: Array,
    lengths: Array,
    key: np.uint64,
    first: int,
    dt: float,
    substeps: int,
) -> Array:
    r"""Wind around every aircraft during the next dynamics steps.

    Parameters
    ----------
    wind : (n, 2) float array [m/s]
        Before, east and north; not changed.
    mean : (2,) float array [m/s]
        What the gusts are added to.
    speeds : (n,) float array [m/s]
        Airspeeds: how fast each flies through the turbulence, at least 1 m/s.
    sigmas, lengths : (n,) float array [m/s], [m]
        Intensity and length scale of the turbulence for each.
    key : uint64
        With an aircraft's index and the step it names every draw.
    first : int
        Number of the first step since the start.
    dt : float [s]
    substeps : int

    Returns
    -------
    (substeps, n, 2) float array [m/s]

    Notes
    -----
    Each horizontal component is :math:`g' = -(V/L) g + \sigma\sqrt{2V/L}\,n`, sampled exactly: its
    spectrum is Dryden's longitudinal one,
    :math:`\Phi(\omega) = \sigma^2 (2L/\pi V) / (1 + (L\omega/V)^2)`. With one :math:`\sigma` and
    one L for both components, as at low altitude, it is the same in every direction.
    """
    n = wind.shape[0]
    path = np.empty((substeps, n, 2))
    for i in range(n):
        stream = fold(key, i)
        keep = math.exp(-max(speeds[i], _STILL) * dt / lengths[i])
        fresh = sigmas[i] * math.sqrt(1.0 - keep * keep)
        east, north = wind[i, 0] - mean[0], wind[i, 1] - mean[1]
        for k in range(substeps):
            counter = 2 * (first + k)
            # Box and Muller: one pair of normals.
            size = fresh * math.sqrt(-2.0 * math.log(1.0 - uniform(stream, counter)))
            angle = 2.0 * math.pi * uniform(stream, counter + 1)
            east = keep * east + size * math.cos(angle)
            north = keep * north + size * math.sin(angle)
            path[k, i, 0], path[k, i, 1] = mean[0] + east, mean[1] + north
    return path


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    one = np.ones(1)
    blow(np.zeros((1, 2)), np.zeros(2), one, one, one, np.uint64(0), 0, 0.1, 1)
