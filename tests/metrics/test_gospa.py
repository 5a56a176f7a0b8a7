"""GOSPA against brute force over all partial assignments, known values, and its axioms."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.metrics import Gospa, gospa

coordinate = st.integers(-240, 240).map(lambda n: n / 8)
points = st.lists(st.tuples(coordinate, coordinate), max_size=4)
some = st.lists(st.tuples(coordinate, coordinate), max_size=5)


def brute_force(truth, estimates, cutoff, order):
    """Definition 1 with alpha = 2: the least over all partial one-to-one assignments."""
    best = math.inf
    n, m = len(truth), len(estimates)
    for size in range(min(n, m) + 1):
        for left in itertools.combinations(range(n), size):
            for right in itertools.permutations(range(m), size):
                total = sum(
                    math.dist(truth[i], estimates[j]) ** order
                    for i, j in zip(left, right, strict=True)
                )
                best = min(best, total + cutoff**order / 2 * (n + m - 2 * size))
    return best ** (1 / order)


@settings(max_examples=100, deadline=None)
@given(points, points, st.sampled_from([5.0, 20.0]), st.sampled_from([1.0, 2.0, 3.0]))
def test_equals_the_least_over_all_partial_assignments(truth, estimates, cutoff, order):
    result = gospa(truth, estimates, cutoff=cutoff, order=order)
    expected = brute_force(truth, estimates, cutoff, order)
    assert result.distance == pytest.approx(expected, rel=1e-9, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(points, points)
def test_parts_sum_to_the_distance_and_count_whole_targets(truth, estimates):
    result = gospa(truth, estimates)
    parts = result.localisation + result.missed + result.false
    assert result.distance**2 == pytest.approx(parts, rel=1e-9, abs=1e-9)
    missed, false = result.missed / 200.0, result.false / 200.0
    assert missed == int(missed)
    assert false == int(false)
    assert len(truth) - missed == len(estimates) - false


@settings(max_examples=100, deadline=None)
@given(some, some, some)
def test_is_a_metric(a, b, c):
    ab, bc, ac = gospa(a, b).distance, gospa(b, c).distance, gospa(a, c).distance
    assert ab == pytest.approx(gospa(b, a).distance, rel=1e-12)
    assert ac <= ab + bc + 1e-9
    assert gospa(a, a).distance == 0.0
    assert (ab == 0.0) == (sorted(a) == sorted(b))


def test_known_values():
    assert gospa([], []) == Gospa(0.0, 0.0, 0.0, 0.0)
    assert gospa([[0, 0], [100, 0]], []) == Gospa(20.0, 0.0, 400.0, 0.0)
    assert gospa([], [[0, 0]]) == Gospa(math.sqrt(200.0), 0.0, 0.0, 200.0)
    assert gospa([[0, 0]], [[3, 4]]) == Gospa(5.0, 25.0, 0.0, 0.0)
    # Farther apart than the cut-off: one missed and one false, c in all.
    assert gospa([[0, 0]], [[500, 0]]) == Gospa(20.0, 0.0, 200.0, 200.0)
    # The nearest pairs are not the best pairs: 6² + 6² beats 2² + 14².
    assert gospa([[0, 0], [8, 0]], [[6, 0], [14, 0]]) == Gospa(math.sqrt(72.0), 72.0, 0.0, 0.0)
    assert gospa([[0, 0]], [[3, 0]], cutoff=2.0, order=1.0) == Gospa(2.0, 0.0, 1.0, 1.0)


def test_an_extra_estimate_costs_half_the_cutoff_power():
    truth = np.array([[0.0, 0.0], [50.0, 50.0]])
    assert gospa(truth, np.vstack((truth, [[9.0, 9.0]]))).distance == math.sqrt(200.0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"truth": [[0.0, 0.0, 0.0]], "estimates": []}, "truth has shape"),
        ({"truth": [], "estimates": [1.0, 2.0]}, "estimates has shape"),
        ({"truth": [[math.nan, 0.0]], "estimates": []}, "truth = .*finite"),
        ({"truth": [], "estimates": [], "cutoff": 0.0}, "cutoff = 0.0"),
        ({"truth": [], "estimates": [], "cutoff": math.inf}, "cutoff = inf"),
        ({"truth": [], "estimates": [], "order": 0.5}, "order = 0.5"),
    ],
)
def test_refuses_what_it_cannot_use(arguments, word):
    with pytest.raises(ValueError, match=word):
        gospa(**arguments)
