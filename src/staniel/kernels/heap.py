"""A binary heap in two arrays: the smallest key first, of equal keys the smallest number."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["pop", "push", "warm"]

Floats = NDArray[np.float64]
Numbers = NDArray[np.int32]


@njit(cache=True, error_model="numpy")
def push(keys: Floats, items: Numbers, size: int, key: float, item: int) -> int:
    """Put an item in; the arrays have room for it. Returns the new size."""
    hole = size
    while hole > 0:
        above = (hole - 1) >> 1
        if keys[above] < key or (keys[above] == key and items[above] <= item):
            break
        keys[hole], items[hole] = keys[above], items[above]
        hole = above
    keys[hole], items[hole] = key, item
    return size + 1


@njit(cache=True, error_model="numpy")
def pop(keys: Floats, items: Numbers, size: int) -> int:
    """Take the first item off, which the caller has read at index 0. Returns the new size."""
    size -= 1
    key, item = keys[size], items[size]
    hole, below = 0, 1
    while below < size:
        right = below + 1
        if right < size and (
            keys[right] < keys[below]
            or (keys[right] == keys[below] and items[right] < items[below])
        ):
            below = right
        if key < keys[below] or (key == keys[below] and item <= items[below]):
            break
        keys[hole], items[hole] = keys[below], items[below]
        hole, below = below, 2 * below + 1
    keys[hole], items[hole] = key, item
    return size


def warm() -> None:
    """Compile, or load from the cache, on one item."""
    keys, items = np.empty(1), np.empty(1, dtype=np.int32)
    pop(keys, items, push(keys, items, 0, 0.0, 0))
