import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from staniel.kernels.random import bits, fold, normals, uniform

KEY = np.uint64(0x5EED)


def draw(key, first, n):
    out = np.empty(n, dtype=np.float32)
    normals(np.uint64(key), first, out)
    return out


def splitmix64(seed, n):
    """The published generator, in Python integers."""
    mask, state, out = (1 << 64) - 1, seed, []
    for _ in range(n):
        state = (state + 0x9E3779B97F4A7C15) & mask
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        out.append(z ^ (z >> 31))
    return out


def test_bits_are_splitmix64():
    # First outputs for seed 1234567, as published with the reference implementation.
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    assert splitmix64(1234567, 3) == published
    assert [int(bits(np.uint64(1234567), np.uint64(i))) for i in range(3)] == published


def test_normals_are_normal():
    sample = draw(KEY, 0, 2_000_000).astype(np.float64)
    assert stats.kstest(sample, "norm").pvalue > 1e-3
    n = sample.size
    for power, moment, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96)):
        assert abs(np.mean(sample**power) - moment) < 4.0 * np.sqrt(variance / n)
    tail = np.count_nonzero(np.abs(sample) > 4.0)
    expected = n * 2.0 * stats.norm.sf(4.0)
    assert abs(tail - expected) < 4.0 * np.sqrt(expected)


def test_the_two_halves_and_neighbours_are_independent():
    sample = draw(KEY, 0, 1_000_000).astype(np.float64)
    first, second = sample[:500_000], sample[500_000:]
    bound = 4.0 / np.sqrt(first.size)
    for a, b in ((first, second), (first**2, second**2), (first[:-1], first[1:])):
        assert abs(np.corrcoef(a, b)[0, 1]) < bound


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**63), st.integers(0, 2**63))
def test_streams_of_different_keys_are_independent(a, b):
    if a == b:
        return
    u, v = draw(a, 0, 20_000), draw(b, 0, 20_000)
    assert abs(np.corrcoef(u, v)[0, 1]) < 5.0 / np.sqrt(u.size)


def test_a_stream_can_be_read_at_any_place():
    whole = draw(KEY, 0, 2000)
    part = draw(KEY, 300, 400)
    assert np.array_equal(part[:200], whole[300:500])
    assert np.array_equal(part[200:], whole[1300:1500])


def test_uniforms_are_uniform_and_folded_keys_differ():
    sample = np.array([uniform(KEY, i) for i in range(20_000)])
    assert stats.kstest(sample, "uniform").pvalue > 1e-3
    assert 0.0 <= sample.min() < sample.max() < 1.0
    keys = {int(fold(KEY, i)) for i in range(1000)}
    assert len(keys) == 1000
    assert int(KEY) not in keys


def test_no_draw_is_infinite_even_at_the_ends_of_the_unit_interval():
    sample = draw(np.uint64(2**64 - 1), 2**40, 4_000_000)
    assert np.isfinite(sample).all()
    assert np.abs(sample).max() < 6.8
    assert np.abs(sample).max() == pytest.approx(5.1, abs=0.7)
