"""Polynomials against the C library's long double."""

import math

import numpy as np
import pytest
from numba import njit

from staniel.kernels.trigonometry import atan2, cosines, from_half_turns, from_turns, fused

Long = np.longdouble
EPS = np.finfo(float).eps


@njit
def cosines_of(angles):
    out = np.empty((2, angles.size))
    for i in range(angles.size):
        out[0, i], out[1, i] = cosines(angles[i])
    return out


@njit
def angles_of(y, x):
    out = np.empty(x.size)
    for i in range(x.size):
        out[i] = atan2(y[i], x[i])
    return out


@njit
def fused_of(a, b, c):
    return fused(a, b, c)


def test_cosines_to_a_unit_in_the_last_place_of_one():
    rng = np.random.default_rng(0)
    angles = np.concatenate([rng.uniform(-math.pi / 2, math.pi / 2, 100_000), [0.0, math.pi / 2]])
    cos, sin = cosines_of(angles)
    assert np.abs(cos - np.cos(angles.astype(Long))).max() <= 1.25 * EPS
    assert np.abs(sin - np.sin(angles.astype(Long))).max() <= 1.25 * EPS
    small = angles * 1e-9
    assert np.array_equal(cosines_of(small)[1], np.sin(small))


def test_angles_to_two_units_in_the_last_place():
    rng = np.random.default_rng(1)
    y, x = rng.standard_normal((2, 100_000)) * 10.0 ** rng.uniform(-8.0, 8.0, (2, 100_000))
    exact = np.arctan2(y.astype(Long), x.astype(Long))
    assert (np.abs(angles_of(y, x) - exact) <= 2.0 * EPS * np.abs(exact)).all()


@pytest.mark.parametrize("y", [-1.0, -0.0, 0.0, 1.0, 1e-310])
@pytest.mark.parametrize("x", [-1.0, 0.0, 1.0, 1e-310])
def test_angles_along_the_axes(y, x):
    if y == 1e-310:
        x = abs(x)  # The smallest numbers of all lose their direction, not their side.
        assert 0.0 <= atan2(y, x) <= math.pi / 2.0
    else:
        assert atan2(y, x) == pytest.approx(math.atan2(y, x), rel=2.0 * EPS, abs=0.0)


@pytest.mark.parametrize("reach", [10.0, 1e3, 1e6])
def test_whole_turns_come_off_exactly(reach):
    angles = np.random.default_rng(2).uniform(-reach, reach, 2000)
    for angle in angles.tolist():
        k, rest = from_half_turns(angle)
        assert k == round(k)
        assert abs(rest) <= 0.5 * math.pi + 1e-9
        # The C library reduces with hundreds of digits of pi.
        assert math.sin(rest) * (-1.0) ** int(k) == pytest.approx(math.sin(angle), abs=2.0 * EPS)
        turned = from_turns(angle)
        assert abs(turned) <= math.pi + 1e-9
        assert math.sin(turned) == pytest.approx(math.sin(angle), abs=3.0 * EPS)
        assert math.cos(turned) == pytest.approx(math.cos(angle), abs=3.0 * EPS)


def test_fused_rounds_once():
    a = 1.0 + EPS
    assert a * a - (1.0 + 2.0 * EPS) == 0.0
    assert fused_of(a, a, -(1.0 + 2.0 * EPS)) == EPS * EPS
