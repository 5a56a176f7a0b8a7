"""Who copies whom, by all four schemes: nobody is favoured, nobody without weight is copied."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.stats import chi2

from staniel.kernels.resampling import (
    MULTINOMIAL,
    RESIDUAL,
    SCHEMES,
    STRATIFIED,
    SYSTEMATIC,
    resample,
)

KEY = np.uint64(11)

some_weights = hnp.arrays(
    np.float32,
    st.integers(1, 200),
    elements=st.one_of(st.just(0.0), st.floats(2.0**-20, 1.0, width=32)),
).filter(lambda w: w.sum() > 0.0)


def drawn(weights, scheme, draw=0, total=None):
    """Ancestors under one of many independent draws."""
    total = weights.sum(dtype=float) if total is None else total
    ancestors = np.full(len(weights), -1, np.int32)
    resample(weights, total, scheme, KEY, draw * (len(weights) + 1), ancestors)
    return ancestors


def offspring_of(weights, *args, **kwargs):
    return np.bincount(drawn(weights, *args, **kwargs), minlength=len(weights))


def expected_of(weights):
    return len(weights) * weights.astype(float) / weights.sum(dtype=float)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
@pytest.mark.parametrize("power", [1, 6])
def test_the_mean_number_of_offspring_is_n_times_the_weight(scheme, power):
    """Pearson's statistic: a chi-square number for independent draws, less for the other three."""
    draws = 4000
    weights = (0.02 + 0.98 * np.random.default_rng(3).random(40).astype(np.float32)) ** power
    weights[7] = 0.0
    offspring = sum(offspring_of(weights, scheme, draw) for draw in range(draws))
    expected = draws * expected_of(weights)
    assert offspring[7] == 0
    own = expected > 0.0
    statistic = ((offspring - expected)[own] ** 2 / expected[own]).sum()
    assert statistic < chi2.ppf(0.999, own.sum() - 1)
    if scheme == MULTINOMIAL:
        assert statistic > chi2.ppf(0.001, own.sum() - 1)


@given(some_weights, st.sampled_from(list(SCHEMES.values())), st.integers(0, 50))
@settings(max_examples=200, deadline=None)
def test_none_without_weight_has_offspring_and_all_places_are_filled(weights, scheme, draw):
    ancestors = drawn(weights, scheme, draw)
    assert (ancestors >= 0).all()
    assert (weights[ancestors] > 0.0).all()


@given(some_weights, st.integers(0, 50))
@settings(max_examples=200, deadline=None)
def test_systematic_gives_the_floor_or_the_ceiling(weights, draw):
    off = offspring_of(weights, SYSTEMATIC, draw) - expected_of(weights)
    assert (np.abs(off) < 1.0 + 1e-9).all()


@given(some_weights, st.integers(0, 50))
@settings(max_examples=100, deadline=None)
def test_stratified_is_less_than_two_off(weights, draw):
    off = offspring_of(weights, STRATIFIED, draw) - expected_of(weights)
    assert (np.abs(off) < 2.0 + 1e-9).all()


@given(some_weights, st.integers(0, 50))
@example(np.full(49, 1.0, np.float32), 0)
@settings(max_examples=200, deadline=None)
def test_residual_gives_at_least_the_floor(weights, draw):
    assert (offspring_of(weights, RESIDUAL, draw) >= np.floor(expected_of(weights) - 1e-9)).all()


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_empty_last_particles_stay_without_offspring(scheme):
    weights = np.array([0.3, 0.7, 0.0, 0.0], np.float32)
    assert max(drawn(weights, scheme, draw).max() for draw in range(200)) == 1
    assert drawn(np.array([0.0, 1.0, 0.0], np.float32), scheme).tolist() == [1, 1, 1]


@given(
    some_weights,
    st.sampled_from(list(SCHEMES.values())),
    st.floats(-1e-5, 1e-5),
    st.integers(0, 50),
)
@settings(max_examples=200, deadline=None)
def test_a_total_that_is_slightly_off_does_no_harm(weights, scheme, error, draw):
    ancestors = drawn(weights, scheme, draw, weights.sum(dtype=float) * (1.0 + error))
    assert (ancestors >= 0).all()
    assert (ancestors < len(weights)).all()
    assert (weights[ancestors] > 0.0).all()
    if scheme == SYSTEMATIC:
        off = np.bincount(ancestors, minlength=len(weights)) - expected_of(weights)
        assert (np.abs(off) < 1.0 + 1e-4 + 1e-5 * len(weights)).all()


@pytest.mark.parametrize("scheme", [SYSTEMATIC, STRATIFIED, MULTINOMIAL])
def test_copies_stand_side_by_side(scheme):
    weights = np.random.default_rng(0).random(300).astype(np.float32)
    assert (np.diff(drawn(weights, scheme)) >= 0).all()


def test_the_other_schemes_scatter_less_than_multinomial():
    """Of the mean of a function of the particles (Douc, Cappé 2005)."""
    weights = np.random.default_rng(1).random(60).astype(np.float32)
    scatter = {
        scheme: np.var([drawn(weights, scheme, draw).mean() for draw in range(600)])
        for scheme in SCHEMES.values()
    }
    for scheme in (RESIDUAL, STRATIFIED, SYSTEMATIC):
        assert scatter[scheme] < 0.7 * scatter[MULTINOMIAL]
