"""Checks that words made of arrays share: shapes, finite numbers, covariances."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["checked_covariance", "checked_floats"]


def checked_floats(values: ArrayLike, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """`values` as a float array of a shape.

    Raises
    ------
    ValueError
        Another shape, or a number that is not finite; the message starts with `name`.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: expected {shape}")
    if not all(map(math.isfinite, array.ravel().tolist())):
        raise ValueError(f"{name} = {array.tolist()}: expected finite numbers")
    return array


def checked_covariance(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """`values` as the (2, 2) covariance of a place.

    Raises
    ------
    ValueError
        Another shape, a number that is not finite, or a matrix that is not symmetric and positive
        definite; the message starts with `name`.
    """
    covariance = checked_floats(values, (2, 2), name)
    a, b, c, d = covariance.ravel().tolist()
    if abs(b - c) > 1e-9 * (abs(a) + abs(d)) or a <= 0.0 or a * d - b * c <= 0.0:
        raise ValueError(
            f"{name} = {covariance.tolist()}: expected a symmetric, positive definite matrix"
        )
    return covariance
