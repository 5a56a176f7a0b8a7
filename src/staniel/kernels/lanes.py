"""Sums, maxima, exponentials and logarithms over float32 arrays, the same on every machine.

A sum that vectorises depends on how wide the processor's registers are, unless its order is fixed:
here it runs in `LANES` lanes, which are added up in the end.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "LANES",
    "exp32",
    "greatest",
    "log32",
    "total_of",
    "warm",
    "weighted",
    "weighted_product",
]

Array = NDArray[Any]

LANES = 64
"""Of a sum; a multiple of every register's width."""

_F0, _F05, _F1 = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_LOWEST = np.float32(-87.0)
_LOG2E = np.float32(1.44269504)
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
_LN2 = np.float32(0.69314718)
_EXP = tuple(np.float32(c) for c in (1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0))
# Odd series of 2 atanh(t) = log((1 + t)/(1 - t)); |t| <= 0.172, so the rest is below 1e-8.
_LOG = tuple(np.float32(2.0 / n) for n in (1, 3, 5, 7, 9))


@njit(cache=True, error_model="numpy", inline="always")
def exp32(x: np.float32) -> np.float32:
    """Exponential of a float32 in [-87, 0] (less counts as -87), relative error below 3e-7."""
    x = max(x, _LOWEST)
    k = np.floor(x * _LOG2E + _F05)
    f = (x - k * _LN2_HIGH) - k * _LN2_LOW
    p = _EXP[0] + f * (_EXP[1] + f * (_EXP[2] + f * (_EXP[3] + f * (_EXP[4] + f * _EXP[5]))))
    power = np.int32((np.int32(k) + np.int32(127)) << np.int32(23)).view(np.float32)
    result: np.float32 = (_F1 + f * p) * power
    return result


@njit(cache=True, error_model="numpy", inline="always")
def log32(x: np.float32) -> np.float32:
    """Natural logarithm of a positive normal float32, error below 2e-7 of it or of 1."""
    raw = np.float32(x).view(np.int32)
    # x = 2^exponent * mantissa by bits, mantissa in [sqrt(1/2), sqrt(2)).
    exponent = (raw - np.int32(0x3F3504F3)) >> np.int32(23)
    mantissa = np.int32(raw - (exponent << np.int32(23))).view(np.float32)
    t = (mantissa - _F1) / (mantissa + _F1)
    t2 = t * t
    log = t * (_LOG[0] + t2 * (_LOG[1] + t2 * (_LOG[2] + t2 * (_LOG[3] + t2 * _LOG[4]))))
    result: np.float32 = log + np.float32(exponent) * _LN2
    return result


@njit(cache=True, error_model="numpy")
def _folded(lanes: Array) -> float:
    """Sum of the lanes; they are overwritten."""
    width = LANES // 2
    while width >= 4:
        for lane in range(width):
            lanes[lane] += lanes[lane + width]
        width //= 2
    return float((lanes[0] + lanes[2]) + (lanes[1] + lanes[3]))


@njit(cache=True, error_model="numpy")
def total_of(values: Array, lanes: Array) -> float:
    """Sum of a float32 array in `LANES` lanes."""
    n = values.size
    whole = n - n % LANES
    lanes[:] = _F0
    for first in range(0, whole, LANES):
        for lane in range(LANES):
            lanes[lane] += values[first + lane]
    for lane in range(n - whole):
        lanes[lane] += values[whole + lane]
    return _folded(lanes)


@njit(cache=True, error_model="numpy")
def weighted(weights: Array, values: Array, lanes: Array) -> float:
    """Sum of products of two float32 arrays in `LANES` lanes."""
    n = weights.size
    whole = n - n % LANES
    lanes[:] = _F0
    for first in range(0, whole, LANES):
        for lane in range(LANES):
            lanes[lane] += weights[first + lane] * values[first + lane]
    for lane in range(n - whole):
        lanes[lane] += weights[whole + lane] * values[whole + lane]
    return _folded(lanes)


@njit(cache=True, error_model="numpy")
def weighted_product(
    weights: Array, a: Array, b: Array, about_a: np.float32, about_b: np.float32, lanes: Array
) -> float:
    """Sum of ``w (a - about_a) (b - about_b)`` over float32 arrays, in `LANES` lanes."""
    n = weights.size
    whole = n - n % LANES
    lanes[:] = _F0
    for first in range(0, whole, LANES):
        for lane in range(LANES):
            i = first + lane
            lanes[lane] += weights[i] * ((a[i] - about_a) * (b[i] - about_b))
    for lane in range(n - whole):
        i = whole + lane
        lanes[lane] += weights[i] * ((a[i] - about_a) * (b[i] - about_b))
    return _folded(lanes)


# Without the promise that there is no NaN the comparisons do not become one instruction.
@njit(cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def greatest(values: Array, lanes: Array) -> np.float32:
    """Greatest of a float32 array without NaN, in `LANES` lanes as well."""
    n = values.size
    whole = n - n % LANES
    lanes[:] = values[0]
    for first in range(0, whole, LANES):
        for lane in range(LANES):
            value, best = values[first + lane], lanes[lane]
            lanes[lane] = value if value > best else best
    width = LANES // 2
    while width >= 1:
        for lane in range(width):
            value, best = lanes[lane + width], lanes[lane]
            lanes[lane] = value if value > best else best
        width //= 2
    top: np.float32 = lanes[0]
    for i in range(whole, n):
        top = values[i] if values[i] > top else top
    return top


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight: nothing."""
