"""NEES on exact Gaussian draws, and against its definition."""

import math

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from staniel.metrics import anees, consistency_band, nees


def some_covariances(g, *shape, d):
    """Symmetric and positive definite, of all sizes and tilts."""
    root = g.normal(size=(*shape, d, d)) * np.exp(g.normal(size=(*shape, 1, 1)))
    return root @ np.swapaxes(root, -1, -2) + 1e-3 * np.eye(d)


def draws(g, covariances):
    root = np.linalg.cholesky(covariances)
    return (root @ g.standard_normal((*covariances.shape[:-1], 1)))[..., 0]


@pytest.mark.parametrize("d", [1, 2, 4])
def test_is_the_definition(d):
    g = np.random.default_rng(d)
    P = some_covariances(g, 3, 5, d=d)
    e = g.normal(size=(3, 5, d))
    expected = [
        [row @ np.linalg.inv(matrix) @ row for row, matrix in zip(*pair, strict=True)]
        for pair in zip(e, P, strict=True)
    ]
    np.testing.assert_allclose(nees(e, P), expected, rtol=1e-6)


@pytest.mark.parametrize("d", [1, 2, 4])
def test_is_chi_squared_of_exact_gaussian_errors(d):
    g = np.random.default_rng(20 + d)
    P = some_covariances(g, 4000, d=d)
    assert kstest(nees(draws(g, P), P), chi2(d).cdf).pvalue > 0.01


@pytest.mark.parametrize(("runs", "d"), [(10, 1), (50, 2), (20, 4)])
def test_average_is_inside_the_band_as_often_as_said(runs, d):
    g = np.random.default_rng(runs)
    P = some_covariances(g, runs, 2000, d=d)
    averages = anees(nees(draws(g, P), P), d, axis=0)
    for confidence in (0.8, 0.95):
        low, high = consistency_band(runs, d, confidence)
        inside = np.mean((averages > low) & (averages < high))
        # Three standard deviations of a share of 2000.
        assert inside == pytest.approx(confidence, abs=0.027)
    assert averages.mean() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("claimed", "side"), [(0.5, "above"), (2.0, "below")])
def test_detects_overconfidence_and_false_modesty(claimed, side):
    g = np.random.default_rng(4)
    P = some_covariances(g, 50, 200, d=2)
    averages = anees(nees(draws(g, P), claimed * P), 2, axis=0)
    low, high = consistency_band(50, 2)
    out = averages > high if side == "above" else averages < low
    assert out.mean() > 0.99


def test_one_number_in_one_out():
    assert nees([3.0, 0.0], 2.25 * np.eye(2)) == 4.0
    assert anees([1.0, 2.0, 3.0], 2) == 1.0
    assert anees([[1.0, 3.0], [3.0, 5.0]], 1, axis=0).tolist() == [2.0, 4.0]
    low, high = consistency_band(1, 2, 0.95)
    assert (low, high) == pytest.approx((-2 * math.log(0.975) / 2, -2 * math.log(0.025) / 2))


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: nees([1.0, 2.0], np.eye(3)), r"covariances has shape \(3, 3\)"),
        (lambda: nees(1.0, 1.0), "covariances has shape"),
        (lambda: nees([math.nan, 0.0], np.eye(2)), "errors: expected finite"),
        (lambda: nees([0.0, 0.0], np.full((2, 2), math.inf)), "covariances: expected finite"),
        (lambda: nees([0.0, 0.0], [[1.0, 2.0], [2.0, 1.0]]), "positive definite"),
        (lambda: nees([0.0, 0.0], [[1.0, 0.5], [0.0, 1.0]]), "symmetric"),
        (lambda: anees([], 2), "at least one"),
        (lambda: anees([1.0], 0), "dimension = 0"),
        (lambda: consistency_band(0, 2), "count = 0"),
        (lambda: consistency_band(1, 0), "dimension = 0"),
        (lambda: consistency_band(1, 2, 1.0), "confidence = 1.0"),
    ],
)
def test_refuses_what_it_cannot_use(call, word):
    with pytest.raises(ValueError, match=word):
        call()
