"""OSPA against brute force over permutations, Stone Soup's, known values, and its axioms."""

import itertools
import math
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.metrics import Ospa, ospa

coordinate = st.integers(-240, 240).map(lambda n: n / 8)
points = st.lists(st.tuples(coordinate, coordinate), max_size=4)
some = st.lists(st.tuples(coordinate, coordinate), max_size=5)
cutoffs, orders = st.sampled_from([0.5, 5.0, 20.0]), st.sampled_from([1.0, 2.0, 2.5, 3.0])


def brute_force(a, b, cutoff, order):
    """The least over all ways to give each of the smaller set one of the larger."""
    small, large = sorted((a, b), key=len)
    if not large:
        return 0.0
    best = min(
        sum(min(cutoff, math.dist(x, y)) ** order for x, y in zip(small, others, strict=True))
        for others in itertools.permutations(large, len(small))
    )
    total = best + cutoff**order * (len(large) - len(small))
    return (total / len(large)) ** (1 / order)


@settings(max_examples=150, deadline=None)
@given(points, some, cutoffs, orders)
def test_equals_the_least_over_all_permutations(truth, estimates, cutoff, order):
    result = ospa(truth, estimates, cutoff=cutoff, order=order)
    expected = brute_force(truth, estimates, cutoff, order)
    assert result.distance == pytest.approx(expected, rel=1e-9, abs=1e-7)


@settings(max_examples=100, deadline=None)
@given(points, points, cutoffs, orders)
def test_parts_sum_to_the_distance(truth, estimates, cutoff, order):
    distance, localisation, cardinality = ospa(truth, estimates, cutoff=cutoff, order=order)
    assert distance**order == pytest.approx(localisation + cardinality, rel=1e-9, abs=1e-9)
    assert 0.0 <= distance <= cutoff * (1.0 + 1e-12)
    larger = max(len(truth), len(estimates), 1)
    surplus = abs(len(truth) - len(estimates))
    assert cardinality == pytest.approx(cutoff**order * surplus / larger)


@settings(max_examples=100, deadline=None)
@given(some, some, some)
def test_is_a_metric(a, b, c):
    ab, bc, ac = ospa(a, b).distance, ospa(b, c).distance, ospa(a, c).distance
    assert ab == pytest.approx(ospa(b, a).distance, rel=1e-12)
    assert ac <= ab + bc + 1e-9
    assert ospa(a, a).distance == 0.0
    assert (ab == 0.0) == (sorted(a) == sorted(b))


def test_known_values():
    assert ospa([], []) == Ospa(0.0, 0.0, 0.0)
    assert ospa([[0, 0]], []) == Ospa(20.0, 0.0, 400.0)
    assert ospa([[0, 0]], [[3, 4]]) == Ospa(5.0, 25.0, 0.0)
    # Farther apart than the cut-off: as far as the cut-off, once.
    assert ospa([[0, 0]], [[500, 0]]) == Ospa(20.0, 400.0, 0.0)
    assert ospa([[0, 0]], [[3, 0]], cutoff=2.0, order=1.0) == Ospa(2.0, 2.0, 0.0)
    # It averages: the fifth of five missed costs less than the second of two.
    five = [[100.0 * k, 0.0] for k in range(5)]
    assert ospa(five, five[:4]).distance == math.sqrt(400.0 / 5)
    assert ospa(five[:2], five[:1]).distance == math.sqrt(400.0 / 2)


def by_stone_soup(truth, estimates, cutoff, order):
    pytest.importorskip("stonesoup", reason="Stone Soup is the extra `stonesoup`")
    from stonesoup.metricgenerator.ospametric import OSPAMetric
    from stonesoup.types.state import State

    now = datetime(2000, 1, 1)
    sets = ([State(row, timestamp=now) for row in rows] for rows in (estimates, truth))
    return OSPAMetric(p=order, c=cutoff).compute_OSPA_distance(*sets).value


@pytest.mark.parametrize("seed", range(5))
def test_equals_stone_soup_of_order_one(seed):
    g = np.random.default_rng(seed)
    for cutoff, n, m in ((20.0, 6, 4), (5.0, 3, 7), (50.0, 5, 5)):
        truth, estimates = g.uniform(0.0, 40.0, (n, 2)), g.uniform(0.0, 40.0, (m, 2))
        theirs = by_stone_soup(truth, estimates, cutoff, 1)
        assert ospa(truth, estimates, cutoff=cutoff, order=1.0).distance == pytest.approx(theirs)


@pytest.mark.parametrize("order", [2, 3])
def test_equals_stone_soup_of_higher_order_where_the_pairs_are_plain(order):
    """It pairs by distances without their power, so it is never less, and more where they cross."""
    g = np.random.default_rng(order)
    truth = 100.0 * g.permutation(12)[:, None] + np.zeros(2)
    estimates = truth[:9] + g.normal(0.0, 10.0, (9, 2))
    theirs = by_stone_soup(truth, estimates, 15.0, order)
    assert ospa(truth, estimates, cutoff=15.0, order=order).distance == pytest.approx(theirs)
    for _ in range(10):
        truth, estimates = g.uniform(0.0, 40.0, (6, 2)), g.uniform(0.0, 40.0, (5, 2))
        theirs = by_stone_soup(truth, estimates, 50.0, order)
        assert ospa(truth, estimates, cutoff=50.0, order=order).distance <= theirs + 1e-9


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"truth": [[0.0, 0.0, 0.0]], "estimates": []}, "truth has shape"),
        ({"truth": [], "estimates": [1.0, 2.0]}, "estimates has shape"),
        ({"truth": [[math.nan, 0.0]], "estimates": []}, "truth = .*finite"),
        ({"truth": [], "estimates": [], "cutoff": 0.0}, "cutoff = 0.0"),
        ({"truth": [], "estimates": [], "order": 0.5}, "order = 0.5"),
    ],
)
def test_refuses_what_it_cannot_use(arguments, word):
    with pytest.raises(ValueError, match=word):
        ospa(**arguments)
