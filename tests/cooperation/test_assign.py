"""`assign` against scipy, all permutations, and what its prices have to prove."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linear_sum_assignment

from staniel.cooperation.auction import assign
from staniel.errors import StanielError
from staniel.kernels import auction

SHAPES = st.tuples(st.integers(1, 8), st.integers(1, 8))
REALS = st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1.0, 1e-6])
INTEGERS = st.integers(-20, 20).map(float)


def matrices(elements):
    return SHAPES.flatmap(lambda shape: arrays(np.float64, shape, elements=elements))


def least(cost):
    """Most pairs, and their least cost, by scipy on costs that bar what is forbidden."""
    allowed = np.isfinite(cost)
    size = 1.0 + np.abs(cost[allowed]).max(initial=0.0)
    rows, columns = linear_sum_assignment(np.where(allowed, cost, 4.0 * max(cost.shape) * size))
    kept = allowed[rows, columns]
    return kept.sum(), cost[rows, columns][kept].sum()


def by_permutations(cost):
    n, m = cost.shape
    if n > m:
        return by_permutations(cost.T)
    return min(cost[np.arange(n), list(p)].sum() for p in itertools.permutations(range(m), n))


def check(cost, found, epsilon=0.0):
    """One to one, as many as can be, within n ε, and prices that prove it from the definition."""
    n, m = cost.shape
    slack = 1e-9 * (1.0 + np.abs(cost[np.isfinite(cost)]).max(initial=0.0)) * max(n, m)
    has = found.columns >= 0
    most, optimum = least(cost)
    assert has.sum() == most == len(set(found.columns[has].tolist()))
    own = cost[np.flatnonzero(has), found.columns[has]]
    assert np.isfinite(own).all()
    assert found.cost == pytest.approx(own.sum(), abs=slack)
    assert optimum - slack <= found.cost <= optimum + min(n, m) * epsilon + slack
    # ε-complementary slackness.
    assert (found.prices >= 0.0).all()
    totals = cost + found.prices
    assert (own + found.prices[found.columns[has]] <= totals[has].min(1) + epsilon + slack).all()
    free = np.setdiff1d(np.arange(m), found.columns)
    assert (found.prices[free] <= epsilon + slack).all()
    if np.isfinite(cost).all():
        assert (found.prices[free] == 0.0).all()
    # Who goes without would pay no less than those who have a column.
    if has.any() and not has.all():
        dearest = (own + found.prices[found.columns[has]]).max()
        if np.isfinite(cost).all():
            assert totals[~has].min() >= dearest - epsilon - slack
    assert (found.happiness == has).all()


def test_the_figure_of_the_thesis():
    values = np.array([[3.0, 3.0, 6.0], [2.0, 5.0, 3.0], [8.0, 2.0, 7.0]])
    for epsilon in (None, 0.25, 0.3):
        found = assign(-values, epsilon)
        assert found.columns.tolist() == [2, 1, 0]
        assert found.happiness.all()
        assert found.cost == -19.0


@settings(deadline=None, max_examples=200)
@given(matrices(REALS))
def test_reals_cost_the_least(cost):
    check(cost, assign(cost))


@settings(deadline=None, max_examples=200)
@given(matrices(REALS | st.just(np.inf)), st.none() | st.floats(0.01, 500.0))
def test_forbidden_pairs_are_left_out_and_most_rows_served(cost, epsilon):
    check(cost, assign(cost, epsilon), epsilon or 0.0)


@settings(deadline=None, max_examples=200)
@given(matrices(REALS), st.floats(0.01, 500.0))
@example(np.array([[1e-6, 0.0], [0.0, 0.0]]), 1.0)
def test_a_step_bounds_what_is_lost(cost, epsilon):
    check(cost, assign(cost, epsilon), epsilon)


@settings(deadline=None, max_examples=200)
@given(matrices(INTEGERS | st.just(np.inf)))
def test_integers_are_exact_with_a_step_below_one_nth(cost):
    found = assign(cost, 0.99 / min(cost.shape))
    most, optimum = least(cost)
    assert ((found.columns >= 0).sum(), found.cost) == (most, optimum)


@settings(deadline=None, max_examples=50)
@given(
    st.tuples(st.integers(1, 6), st.integers(1, 6)).flatmap(
        lambda shape: arrays(np.float64, shape, elements=INTEGERS)
    )
)
def test_no_permutation_costs_less(cost):
    assert assign(cost).cost == by_permutations(cost)


@pytest.mark.parametrize("shape", [(300, 300), (60, 300), (300, 60)])
@pytest.mark.parametrize("kind", ["uniform", "ties", "places"])
def test_many(shape, kind):
    rng = np.random.default_rng(3)
    a, b = rng.random((shape[0], 1, 2)), rng.random((1, shape[1], 2))
    cost = {
        "uniform": lambda: rng.random(shape),
        "ties": lambda: rng.integers(0, 50, shape).astype(float),
        "places": lambda: np.linalg.norm(a - b, axis=2),
    }[kind]()
    check(cost, assign(cost))
    check(cost, assign(cost, 1e-3), 1e-3)


def test_a_price_war_among_equals():
    # Three rows want two columns, and the third is dear: ε by ε the classic auction is endless.
    cost = np.array([[0.0, 0.0, 1e6]] * 3)
    for epsilon in (None, 1e-3):
        check(cost, assign(cost, epsilon), epsilon or 0.0)


def test_a_step_below_rounding_ends():
    cost = 1e9 + np.random.default_rng(0).random((20, 20))
    check(cost, assign(cost, 1e-12))


def test_nothing_allowed():
    found = assign(np.full((2, 3), np.inf))
    assert found.columns.tolist() == [-1, -1]
    assert found.prices.tolist() == [0.0, 0.0, 0.0]
    assert not found.happiness.any()
    assert found.cost == 0.0


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (2, 0)])
def test_empty(shape):
    found = assign(np.zeros(shape))
    assert found.columns.tolist() == [-1] * shape[0]
    assert found.prices.tolist() == [0.0] * shape[1]
    assert found.happiness.tolist() == [False] * shape[0]
    assert found.cost == 0.0


def test_what_is_handed_in_stays_as_it_is():
    cost = np.asfortranarray([[1.0, np.inf], [2.0, 3.0], [0.0, 1.0]])
    before = cost.copy()
    assign(cost)
    assign(cost, 0.1)
    assert (cost == before).all()


def test_kernels_may_call_the_exact_method():
    from numba import njit

    @njit
    def total(costs):
        summed = 0.0
        for k in range(len(costs)):
            columns, _ = auction.optimal(costs[k])
            for i in range(len(columns)):
                summed += costs[k, i, columns[i]]
        return summed

    costs = np.random.default_rng(0).random((50, 3, 4))
    assert total(costs) == pytest.approx(sum(by_permutations(c) for c in costs))


@pytest.mark.parametrize(
    ("cost", "epsilon", "words"),
    [
        ([1.0, 2.0], None, "cost has shape (2,): expected (n, m)"),
        ([[1.0], [2.0, 3.0]], None, "cost: expected an (n, m) matrix of numbers"),
        ([["a"]], None, "cost: expected an (n, m) matrix of numbers"),
        ([[1.0, np.nan]], None, "cost[0, 1] = nan: expected a finite number or +inf"),
        ([[1.0], [-np.inf]], None, "cost[1, 0] = -inf: expected a finite number or +inf"),
        ([[1e101]], None, "within ±1e+100"),
        ([[1.0]], 0.0, "epsilon = 0.0: expected a finite number greater than 0"),
        ([[1.0]], np.nan, "epsilon = nan"),
        ([[1.0]], np.inf, "epsilon = inf"),
        ([[1.0]], "small", "epsilon = small"),
    ],
)
def test_what_is_refused(cost, epsilon, words):
    with pytest.raises(StanielError) as error:
        assign(cost, epsilon)
    assert words in str(error.value)


def test_too_many_costs_are_refused():
    wide = np.broadcast_to(np.zeros(1), (20_000, 20_000))
    with pytest.raises(StanielError, match=r"expected at most 100000000 costs"):
        assign(wide)
