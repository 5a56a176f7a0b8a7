"""Checks that words made of arrays share: shapes, finite numbers, covariances."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["checked_covariance", "checked_floats", "checked_places", "checked_positive"]


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


def checked_places(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """`values` as (n, 2) places, east and north, with no negative zero.

    Raises
    ------
    ValueError
        Another shape, or a number that is not finite; the message starts with `name`.
    """
    places = np.asarray(values, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 2:
        raise ValueError(f"{name} has shape {places.shape}: expected (n, 2)")
    strange = ~np.isfinite(places).all(axis=1)
    if strange.any():
        row = int(np.argmax(strange))
        raise ValueError(f"{name}[{row}] = {places[row].tolist()}: expected finite numbers")
    return places + 0.0


def checked_positive(value: float, name: str) -> float:
    """`value` as a float.

    Raises
    ------
    ValueError
        It is not finite or not greater than 0; the message starts with `name`.
    """
    number = float(value)
    if not 0.0 < number < math.inf:
        raise ValueError(f"{name} = {number}: expected a finite number greater than 0")
    return number
