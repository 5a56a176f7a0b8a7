"""What the distances between sets of points ask of their arguments."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["checked_cutoff", "checked_order", "checked_positions"]


def checked_positions(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """`values` as (n, 2) positions; anything empty is no positions.

    Raises
    ------
    ValueError
        Another shape, or a number that is not finite; the message starts with `name`.
    """
    array: NDArray[Any] = np.asarray(values, dtype=np.float64)
    if array.size == 0:
        array = array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{name} has shape {array.shape}: expected (n, 2)")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} = {array.tolist()}: expected finite numbers")
    return array


def checked_cutoff(cutoff: float) -> float:
    """`cutoff`, which has to be finite and greater than 0, else ValueError."""
    if not (np.isfinite(cutoff) and cutoff > 0.0):
        raise ValueError(f"cutoff = {cutoff}: expected a number of metres greater than 0")
    return cutoff


def checked_order(order: float) -> float:
    """`order`, which has to be finite and at least 1, else ValueError."""
    if not (np.isfinite(order) and order >= 1.0):
        raise ValueError(f"order = {order}: expected a number of at least 1")
    return order
