"""Which particle each new one copies: the four schemes of the literature (Douc, Cappé 2005)."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import uniform

__all__ = ["MULTINOMIAL", "RESIDUAL", "SCHEMES", "STRATIFIED", "SYSTEMATIC", "resample", "warm"]

Array = NDArray[Any]

SYSTEMATIC, STRATIFIED, MULTINOMIAL, RESIDUAL = range(4)
SCHEMES = {
    "systematic": SYSTEMATIC,
    "stratified": STRATIFIED,
    "multinomial": MULTINOMIAL,
    "residual": RESIDUAL,
}
"""Names to numbers."""


@njit(cache=True, error_model="numpy")
def _along(weights: Array, points: Array, count: int, total: float, ancestors: Array) -> None:
    """Who owns each of the first `count` ascending points in [0, 1) of the weights laid end to end.

    Filled from the start of `ancestors`; a particle without weight owns nothing.
    """
    last = 0
    for i in range(weights.size):
        last = i if weights[i] > 0.0 else last
    i = 0
    reached = np.float64(weights[0])
    for j in range(count):
        point = points[j] * total
        # `last` bears weight: rounding at the end cannot hand offspring to an empty particle.
        while reached <= point and i < last:
            i += 1
            reached += weights[i]
        ancestors[j] = i


@njit(cache=True, error_model="numpy")
def _sorted_uniforms(key: np.uint64, first: int, count: int, points: Array) -> None:
    """`count` independent uniform numbers in ascending order: spacings of a Poisson process."""
    total = 0.0
    for j in range(count):
        total -= np.log(1.0 - uniform(key, first + j))
        points[j] = total
    total -= np.log(1.0 - uniform(key, first + count))
    for j in range(count):
        points[j] /= total


@njit(cache=True, error_model="numpy")
def _systematic(weights: Array, total: float, start: float, ancestors: Array) -> None:
    """As `_along` with the points (start + j)/n, and without a branch that nobody foresees.

    Particle i owns the points from the one after its predecessor's last to ⌈n Wᵢ - start⌉ - 1, W
    the running sum. Each writes its number where its own begin; one that owns none is overwritten
    by the next. What was written last before a point is its owner.
    """
    n = weights.size
    scale = n / total
    begins = np.zeros(n + 1, np.int32)
    reached, end, last = -start, 0, 0
    for i in range(n):
        begins[end] = i
        last = i if weights[i] > 0.0 else last
        reached += weights[i] * scale
        end = min(int(np.ceil(reached)), n)
    owner = np.int32(0)
    for j in range(n):
        begun = begins[j]
        owner = begun if begun > owner else owner
        ancestors[j] = owner
    # Rounding may leave the last points to nobody, or to particles without weight.
    for j in range(end, n):
        ancestors[j] = last


@njit(cache=True, error_model="numpy")
def resample(
    weights: Array, total: float, scheme: int, key: np.uint64, first: int, ancestors: Array
) -> None:
    """Draw ancestors, particle i on average N wᵢ times, and never where its weight is zero.

    Parameters
    ----------
    weights : (n,) float32 array
        Not negative, not all zero; need not be normalised.
    total : float
        Their sum, to within rounding.
    scheme : int
        `SYSTEMATIC`: one draw shifts n even points, ⌊N wᵢ⌋ or ⌈N wᵢ⌉ copies each. `STRATIFIED`: one
        draw in each of n even strata. `MULTINOMIAL`: n independent draws. `RESIDUAL`: ⌊N wᵢ⌋ copies
        for certain, the rest by independent draws from what is left.
    key : uint64
    first : int
        Counter of the first draw; n + 1 are used at most.
    ancestors : (n,) int32 array
        Filled; ascending but for `RESIDUAL`.
    """
    n = weights.size
    if scheme == SYSTEMATIC:
        _systematic(weights, total, uniform(key, first), ancestors)
        return
    points = np.empty(n)
    if scheme == STRATIFIED:
        for j in range(n):
            points[j] = (j + uniform(key, first + j)) / n
        _along(weights, points, n, total, ancestors)
        return
    if scheme == MULTINOMIAL:
        _sorted_uniforms(key, first, n, points)
        _along(weights, points, n, total, ancestors)
        return
    rest = np.empty(n)
    left, filled = 0.0, 0
    for i in range(n):
        expected = n * (weights[i] / total)
        whole = min(int(expected), n - filled)
        rest[i] = max(expected - whole, 0.0)
        left += rest[i]
        for _ in range(whole):
            ancestors[n - 1 - filled] = i
            filled += 1
    if filled < n:
        _sorted_uniforms(key, first, n - filled, points)
        _along(rest, points, n - filled, left, ancestors)


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight: nothing."""
