"""The birth kernels against brute force on a full grid and against NumPy's least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.kernels.births import fit, follow, propose

R = (2.25, 0.0, 2.25)


def seen(*places, time=0.0, covariance=R):
    """Sightings as the kernels take them: in ascending order of time, then of x."""
    return np.array(sorted((time, *place, *covariance) for place in places), float).reshape(-1, 6)


def test_one_sighting_is_proposed_where_it_is():
    g = np.random.default_rng(0)
    for x, y in g.uniform(-1e6, 1e6, (50, 2)):
        (place,) = propose(seen((x, y)), 2.0, 3)
        assert np.hypot(place[1] - x, place[2] - y) < 0.1
        np.testing.assert_allclose(place[3:], R)


def test_sharp_sightings_between_the_nodes_are_not_lost():
    (place,) = propose(seen((1.0, 3.0), covariance=(1e-4, 0.0, 1e-4)), 2.0, 3)
    assert np.hypot(place[1] - 1.0, place[2] - 3.0) < 0.6


@pytest.mark.parametrize("seed", range(10))
def test_local_maxima_of_the_whole_grid(seed):
    """The windows find the same peaks as the whole area, laid out as one grid."""
    g = np.random.default_rng(seed)
    spots = g.uniform(0.0, 60.0, (8, 2))
    spacing, reach = 2.0, 2
    nodes = spacing * np.arange(-10, 45)
    xx, yy = np.meshgrid(nodes, nodes, indexing="ij")
    own = 2.25 + 0.25 * spacing**2
    weight = sum(np.exp(-0.5 * ((xx - x) ** 2 + (yy - y) ** 2) / own) for x, y in spots)
    peaks = []
    for i in range(reach, len(nodes) - reach):
        for j in range(reach, len(nodes) - reach):
            window = weight[i - reach : i + reach + 1, j - reach : j + reach + 1]
            if weight[i, j] == window.max() and weight[i, j] > 0.3:
                centroid = [
                    (window * xx[i - reach : i + reach + 1, j - reach : j + reach + 1]).sum(),
                    (window * yy[i - reach : i + reach + 1, j - reach : j + reach + 1]).sum(),
                ]
                peaks.append(np.array(centroid) / window.sum())
    places = propose(seen(*spots), spacing, reach)
    assert len(places) == len(peaks)
    for peak in peaks:
        assert np.hypot(*(places[:, 1:3] - peak).T).min() < 0.05


def test_times_are_kept_apart_and_near_sightings_become_one():
    both = np.vstack([seen((0.0, 0.0), time=1.0), seen((0.5, 0.0), time=2.0)])
    assert propose(both, 2.0, 3)[:, 0].tolist() == [1.0, 2.0]
    (place,) = propose(seen((0.0, 0.0), (0.5, 0.0)), 2.0, 3)
    np.testing.assert_allclose(place[1:3], [0.25, 0.0], atol=0.2)
    np.testing.assert_allclose(place[3:], [1.125, 0.0, 1.125])


def walk(places_of_step, confirmations=3, max_speed=4.0):
    """Candidates after some steps, each with a list of places."""
    candidates = np.zeros((0, 2 + 6 * confirmations))
    for k, places in enumerate(places_of_step):
        proposed = propose(seen(*places, time=float(k)), 2.0, 3)
        candidates = follow(candidates, proposed, max_speed, 3.0)
    return candidates


def test_three_hits_confirm_with_one_miss_allowed():
    assert walk([[(0, 0)], [(2, 0)], [(4, 0)]])[:, 0].tolist() == [3.0]
    assert walk([[(0, 0)], [], [(4, 0)], [(6, 0)]])[:, 0].tolist() == [3.0]
    assert walk([[(0, 0)], [], [], [(6, 0)]])[:, 0].tolist() == [1.0]


def test_out_of_reach_is_another_candidate():
    assert sorted(walk([[(0, 0)], [(30, 0)], [(0, 30)]])[:, 0].tolist()) == [1.0, 1.0, 1.0]


def test_a_second_look_at_the_same_time_refines_and_does_not_count():
    first = propose(seen((0.0, 0.0)), 2.0, 3)
    candidates = follow(np.zeros((0, 20)), first, 4.0, 3.0)
    again = follow(candidates, propose(seen((1.0, 0.0)), 2.0, 3), 4.0, 3.0)
    assert again[:, 0].tolist() == [1.0]
    assert again[0, 3] == pytest.approx(0.5, abs=0.1)
    assert again[0, 5] == pytest.approx(1.125)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.integers(0, 1000))
@settings(max_examples=50, deadline=None)
def test_fit_is_least_squares(vx, vy, seed):
    """With a flat prior, the same as NumPy's weighted normal equations; on a line, exact."""
    g = np.random.default_rng(seed)
    times, variances = np.array([1.0, 2.0, 4.0]), g.uniform(1.0, 4.0, 3)
    xs, ys = 50.0 + vx * times + g.normal(0, 1, 3), -20.0 + vy * times
    candidate = np.zeros(20)
    candidate[0] = 3
    candidate[2:] = [
        v for t, x, y, r in zip(times, xs, ys, variances, strict=True) for v in (t, x, y, r, 0.0, r)
    ]
    place = fit(candidate, 4.5, 1e6)
    A, W = np.column_stack([np.ones(3), times - 4.5]), np.diag(1.0 / variances)
    covariance = np.linalg.inv(A.T @ W @ A)
    np.testing.assert_allclose(place[0, :2], covariance @ A.T @ W @ xs, atol=1e-6)
    np.testing.assert_allclose(place[1, :2], [-20.0 + 4.5 * vy, vy], atol=1e-6)
    np.testing.assert_allclose(place[0, 2:5], covariance[[0, 0, 1], [0, 1, 1]], rtol=1e-5)
    residual = xs - A @ (covariance @ A.T @ W @ xs)
    np.testing.assert_allclose(place[0, 5], residual @ W @ residual, atol=1e-6)
    np.testing.assert_allclose(place[1, 5], 0.0, atol=1e-6)


def test_the_prior_bounds_the_velocity_of_hits_at_one_time():
    candidate = np.zeros(20)
    candidate[0] = 3
    candidate[2:] = [v for x in (0.0, 1.0, 2.0) for v in (5.0, x, 0.0, *R)]
    place = fit(candidate, 5.0, 2.0)
    np.testing.assert_allclose(place[0], [1.0, 0.0, 0.75, 0.0, 4.0, 2.0 / 2.25])
