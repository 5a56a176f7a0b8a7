"""Angles: wrapped to (-pi, pi], counter-clockwise from east."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["wrap", "wrap_array"]


def wrap(angle: float) -> float:
    """Wrap one angle to (-pi, pi].

    Parameters
    ----------
    angle : float [rad]

    Returns
    -------
    float [rad]
        In (-pi, pi].

    Examples
    --------
    >>> wrap(-math.pi) == math.pi
    True
    """
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped <= -math.pi else wrapped


def wrap_array(angles: ArrayLike) -> NDArray[np.float64]:
    """Wrap angles to (-pi, pi], element by element.

    Parameters
    ----------
    angles : array_like [rad]

    Returns
    -------
    float array [rad]
        Same shape, in (-pi, pi].

    Examples
    --------
    >>> np.rad2deg(wrap_array(np.deg2rad([190.0, -180.0, 360.0])))
    array([-170.,  180.,    0.])
    """
    values = np.asarray(angles, dtype=np.float64)
    return np.pi - np.mod(np.pi - values, 2.0 * np.pi)
