"""Pairs of tracks and sightings inside the gates, against a search of all pairs."""

import time

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from staniel.kernels.gating import gated

GATE, NEAR = 4.0, 6.0


def covariances_of(g, count, sizes):
    roots = g.normal(size=(count, 4, 4)) * sizes[:, None, None]
    return roots @ roots.transpose(0, 2, 1)


def by_brute_force(means, covariances, origins, sightings, now):
    """Squared Mahalanobis distance, score and distance of every pair."""
    shape = len(means), len(sightings)
    square, score, distance = np.empty(shape), np.empty(shape), np.empty(shape)
    for k in range(shape[0]):
        for j, (t, x, y, xx, xy, yy) in enumerate(sightings):
            expected = origins[k] + means[k, :2] - (now - t) * means[k, 2:]
            off = np.array([x, y]) - expected
            cov = covariances[k, :2, :2] + np.array([[xx, xy], [xy, yy]])
            square[k, j] = off @ np.linalg.solve(cov, off)
            score[k, j] = multivariate_normal(np.zeros(2), cov, allow_singular=True).logpdf(off)
            distance[k, j] = np.hypot(*off)
    return square, score, distance


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(0, 12),
    m=st.integers(0, 15),
    area=st.sampled_from([0.0, 1.0, 30.0, 300.0, 1e5]),
    spread=st.sampled_from([0.01, 1.0, 10.0, 1000.0]),
    noise=st.sampled_from([1e-3, 1.5, 200.0]),
    age=st.sampled_from([0.0, 1.0, 5.0]),
)
@settings(max_examples=250, deadline=None)
def test_the_same_pairs_as_by_brute_force(seed, count, m, area, spread, noise, age):
    g = np.random.default_rng(seed)
    now = 100.0
    means = g.normal(0.0, 1.0, (count, 4)) * [3.0, 3.0, 10.0, 10.0]
    covariances = covariances_of(g, count, spread * g.random(count))
    origins = g.uniform(-area, area, (count, 2))
    sightings = np.zeros((m, 6))
    sightings[:, 0] = now - g.choice([0.0, age, age * 0.5], m)
    sightings[:, 1:3] = g.uniform(-area, area, (m, 2))
    own = covariances_of(g, m, noise * (0.1 + g.random(m)))
    sightings[:, 3:] = np.stack([own[:, 0, 0], own[:, 0, 1], own[:, 1, 1]], axis=1)
    pairs, scores, nearest = gated(means, covariances, origins, sightings, now, GATE, NEAR)
    square, score, distance = by_brute_force(means, covariances, origins, sightings, now)

    found = set(map(tuple, pairs.tolist()))
    assert len(found) == len(pairs) == len(scores)
    assert (np.diff(pairs[:, 0]) >= 0).all()
    # Rounding decides what lies on the gate's edge.
    surely = set(zip(*np.nonzero(square < GATE**2 - 1e-6), strict=True))
    maybe = set(zip(*np.nonzero(square < GATE**2 + 1e-6), strict=True))
    assert surely <= found <= maybe
    np.testing.assert_allclose(scores, [score[k, j] for k, j in pairs], rtol=1e-6, atol=1e-6)
    if count:
        exact = distance.min(axis=0)
        near = exact < NEAR - 1e-9
        np.testing.assert_allclose(nearest[near], exact[near], atol=1e-9)
        assert (nearest[~near] >= NEAR - 1e-6).all()
    else:
        assert np.isinf(nearest).all()


def test_all_at_one_place():
    means, covariances = np.zeros((20, 4)), np.tile(np.eye(4), (20, 1, 1))
    sightings = np.tile([0.0, 1e5, -1e5, 1.0, 0.0, 1.0], (30, 1))
    origins = np.tile([1e5, -1e5], (20, 1))
    pairs, scores, nearest = gated(means, covariances, origins, sightings, 0.0, GATE, NEAR)
    assert sorted(map(tuple, pairs.tolist())) == [(k, j) for k in range(20) for j in range(30)]
    np.testing.assert_allclose(scores, -np.log(2.0 * np.pi * 2.0))
    assert not nearest.any()


def test_a_lonely_sighting_at_the_end_of_the_world():
    """The grid stays small however far apart the sightings lie."""
    far = np.array([[0.0, 1e9, -1e9, 1e-6, 0.0, 1e-6], [0.0, -1e9, 1e9, 1e-6, 0.0, 1e-6]])
    one = np.eye(4)[None]
    pairs, _, _ = gated(np.zeros((1, 4)), one, np.array([[1e9, -1e9]]), far, 0.0, GATE, NEAR)
    assert pairs.tolist() == [[0, 0]]
    pairs, _, _ = gated(np.zeros((1, 4)), one, np.zeros((1, 2)), far[:1], 0.0, GATE, NEAR)
    assert pairs.shape == (0, 2)


def test_the_cost_grows_with_the_tracks_and_not_with_their_square():
    """At constant density ten times the tracks have ten times the pairs and cost; 100 by pairs."""
    costs, found = [], []
    for count in (400, 4000):
        g = np.random.default_rng(0)
        origins = g.uniform(0.0, 40.0 * np.sqrt(count), (count, 2))
        sightings = np.zeros((count, 6))
        sightings[:, 1:3] = origins + g.normal(0.0, 1.5, (count, 2))
        sightings[:, [3, 5]] = 2.25
        means, covariances = np.zeros((count, 4)), np.tile(np.eye(4), (count, 1, 1))
        spent = []
        for _ in range(7):
            start = time.perf_counter()
            pairs, _, _ = gated(means, covariances, origins, sightings, 0.0, GATE, NEAR)
            spent.append(time.perf_counter() - start)
        costs.append(min(spent))
        found.append(len(pairs))
    assert 8.0 < found[1] / found[0] < 12.0
    assert costs[1] / costs[0] < 40.0
