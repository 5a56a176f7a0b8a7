"""Exponentials, logarithms, sums and maxima of float32 arrays against NumPy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.kernels.lanes import (
    LANES,
    exp32,
    greatest,
    log32,
    total_of,
    weighted,
    weighted_product,
)

lengths = st.one_of(st.integers(1, 300), st.sampled_from([LANES - 1, LANES, LANES + 1, 4 * LANES]))


def scratch():
    return np.full(LANES, np.nan, np.float32)


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
    lanes = scratch()
    rounding = 1e-6 * (1 + n)
    assert total_of(a, lanes) == pytest.approx(math.fsum(a.tolist()), abs=rounding)
    exact = w.astype(float) @ a.astype(float)
    assert weighted(w, a, lanes) == pytest.approx(exact, abs=rounding)
    about_a, about_b = np.float32(0.25), np.float32(-0.5)
    exact = (w.astype(float) * (a - about_a)) @ (b - about_b).astype(float)
    ours = weighted_product(w, a, b, about_a, about_b, lanes)
    assert ours == pytest.approx(exact, abs=4 * rounding)


@given(lengths, st.integers(0, 9), st.sampled_from([1.0, 1e-30, 1e30]))
@settings(max_examples=100, deadline=None)
def test_greatest_of_any_length(n, seed, size):
    values = floats(n, seed, size)
    assert greatest(values, scratch()) == values.max()
    values -= np.float32(10.0 * size)
    assert greatest(values, scratch()) == values.max()
    for place in {0, n // 2, n - 1}:
        values[place] = np.float32(size)
        assert greatest(values, scratch()) == np.float32(size)
        values[place] = -np.inf
