"""Exponentials, logarithms, sums and maxima of float32 arrays against NumPy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from staniel.kernels import lanes
from staniel.kernels.lanes import exp32, log32

lengths = st.one_of(st.integers(1, 300), st.sampled_from([7, 8, 9, 31, 32, 33, 1000]))


@njit
def total_of(values):
    return lanes.total_of(values)


@njit
def weighted(weights, values):
    return lanes.weighted(weights, values)


@njit
def weighted_product(weights, a, b, about_a, about_b):
    return lanes.weighted_product(weights, a, b, about_a, about_b)


@njit
def greatest(values):
    return lanes.greatest(values)


def floats(n, seed, size=1.0):
    return (size * np.random.default_rng(seed).normal(size=n)).astype(np.float32)


def test_exponential_over_its_whole_range():
    x = np.concatenate([-np.geomspace(1e-30, 87.0, 5000), -np.linspace(0.0, 87.0, 20_001)])
    x = x.astype(np.float32)
    ours = np.array([exp32(v) for v in x])
    np.testing.assert_allclose(ours, np.exp(x.astype(float)), rtol=3e-7)
    assert exp32(np.float32(0.0)) == 1.0


@pytest.mark.parametrize("x", [-87.5, -1e4, -3e38, -np.inf])
def test_what_is_less_counts_as_the_least(x):
    assert exp32(np.float32(x)) == exp32(np.float32(-87.0)) > 0.0


def test_logarithm_of_every_size():
    x = np.concatenate([np.geomspace(1.2e-38, 3.4e38, 20_000), np.linspace(0.9, 1.1, 5001)])
    x = x.astype(np.float32)
    ours = np.array([log32(v) for v in x])
    exact = np.log(x.astype(float))
    assert (np.abs(ours - exact) < 2e-7 * np.maximum(np.abs(exact), 1.0)).all()
    assert log32(np.float32(1.0)) == 0.0


@given(lengths, st.integers(0, 9))
@settings(max_examples=100, deadline=None)
def test_sums_of_any_length(n, seed):
    a, b, w = floats(n, seed), floats(n, seed + 100), np.abs(floats(n, seed + 200))
    rounding = 1e-6 * (1 + n)
    assert total_of(a) == pytest.approx(math.fsum(a.tolist()), abs=rounding)
    exact = w.astype(float) @ a.astype(float)
    assert weighted(w, a) == pytest.approx(exact, abs=rounding)
    about_a, about_b = np.float32(0.25), np.float32(-0.5)
    exact = (w.astype(float) * (a - about_a)) @ (b - about_b).astype(float)
    ours = weighted_product(w, a, b, about_a, about_b)
    assert ours == pytest.approx(exact, abs=4 * rounding)


@given(lengths, st.integers(0, 9), st.sampled_from([1.0, 1e-30, 1e30]))
@settings(max_examples=100, deadline=None)
def test_greatest_of_any_length(n, seed, size):
    values = floats(n, seed, size)
    assert greatest(values) == values.max()
    values -= np.float32(10.0 * size)
    assert greatest(values) == values.max()
    for place in {0, n // 2, n - 1}:
        values[place] = np.float32(size)
        assert greatest(values) == np.float32(size)
        values[place] = -np.inf


def test_a_sum_says_its_order():
    """32 lanes, side by side, then 8, then one after the other."""
    values = floats(32 * 3 + 8 * 2 + 5, 3, 100.0)
    rows = np.zeros((4, 8), np.float32)
    for first in range(0, 96, 32):
        rows += values[first : first + 32].reshape(4, 8)
    for first in (96, 104):
        rows[0] += values[first : first + 8]
    rest = np.float32(0.0)
    for value in values[112:]:
        rest += value
    together = ((rows[0] + rows[1]) + rows[2]) + rows[3]
    for width in (4, 2, 1):
        together = together[:width] + together[width:]
    assert total_of(values) == together[0] + rest


def test_of_nothing():
    nothing = np.zeros(0, np.float32)
    assert total_of(nothing) == 0.0
    assert greatest(nothing) == -math.inf
