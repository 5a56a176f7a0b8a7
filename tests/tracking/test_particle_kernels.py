"""The particle kernels against NumPy, SciPy and brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.special import logsumexp
from scipy.stats import kstest, multivariate_normal

from staniel.kernels.association import associate
from staniel.kernels.particles import exp32, predict, resample, settle, spawn, total_of

N = 1000


def cloud(count, n=N, seed=0, spread=2.0):
    """Clouds at (100 k, 0), unevenly weighted."""
    g = np.random.default_rng(seed)
    state = g.normal(0.0, spread, (count, 4, n)).astype(np.float32)
    raw = g.normal(0.0, 1.0, (count, n))
    logs = (raw - logsumexp(raw, axis=1, keepdims=True)).astype(np.float32)
    origins = np.column_stack([100.0 * np.arange(count), np.zeros(count)])
    return state, np.exp(logs), logs, origins


def moments_of(state, weights):
    """Weighted mean and position covariance, by NumPy in float64."""
    rows = []
    for s, w in zip(state.astype(float), weights.astype(float), strict=True):
        w = w / w.sum()
        c = np.cov(s[:2], aweights=w, ddof=0)
        rows.append([*(s @ w), *c.ravel()])
    return np.array(rows)


def keys(count):
    return np.arange(1, count + 1, dtype=np.uint64)


def give(state, weights, logs, origins, sightings, looks=None, now=0.0, **limits):
    chosen = {"gate": 4.0, "least": 1e-9, "floor": 1e-12, "near": 0.0, "width": 0.0} | limits
    table = np.array(sightings, float).reshape(-1, 6)
    looks = np.arange(len(table)) if looks is None else np.array(looks)
    moments = moments_of(state, weights)
    return associate(
        state, weights, logs, origins, moments, table, looks, now, np.array([*chosen.values()])
    )


@given(hnp.arrays(np.float32, 64, elements=st.floats(-80.0, 0.0, width=32)))
@settings(max_examples=50, deadline=None)
def test_exponential(x):
    ours = np.array([exp32(v) for v in x])
    np.testing.assert_allclose(ours, np.exp(x.astype(float)), rtol=4e-7)


@given(st.integers(1, 300), st.integers(0, 9))
@settings(max_examples=40, deadline=None)
def test_total_of_any_length(n, seed):
    values = np.random.default_rng(seed).normal(size=n).astype(np.float32)
    lanes = np.empty(64, np.float32)
    assert total_of(values, lanes) == pytest.approx(values.astype(float).sum(), abs=1e-4)


weights_strategy = hnp.arrays(
    np.float32,
    st.integers(1, 200),
    elements=st.one_of(st.just(0.0), st.floats(2.0**-20, 1.0, width=32)),
).filter(lambda w: w.sum() > 0.0)


@given(weights_strategy, st.floats(0.0, 1.0, exclude_max=True))
@settings(max_examples=100, deadline=None)
def test_systematic_offspring(weights, start):
    """Each gets floor or ceil of N w offspring, and none without weight, the last one included."""
    ancestors = np.empty(len(weights), np.int32)
    resample(weights, start, ancestors)
    offspring = np.bincount(ancestors, minlength=len(weights))
    expected = len(weights) * weights.astype(float) / weights.astype(float).sum()
    assert offspring.sum() == len(weights)
    assert (offspring[weights == 0.0] == 0).all()
    assert (np.abs(offspring - expected) < 1.0 + 1e-6).all()


def test_empty_last_particles_stay_without_offspring():
    weights = np.array([0.3, 0.7, 0.0, 0.0], np.float32)
    ancestors = np.empty(4, np.int32)
    for start in (0.0, 0.5, np.nextafter(1.0, 0.0)):
        resample(weights, start, ancestors)
        assert ancestors.max() == 1


def test_resampling_is_unbiased():
    g = np.random.default_rng(3)
    weights = g.random(50).astype(np.float32) ** 3
    ancestors = np.empty(50, np.int32)
    offspring = np.zeros(50)
    for _ in range(4000):
        resample(weights, g.random(), ancestors)
        offspring += np.bincount(ancestors, minlength=50)
    np.testing.assert_allclose(offspring / 4000, 50 * weights / weights.sum(), atol=0.04)


def test_weights_equal_the_gaussian_likelihood():
    """One sighting, no floor, no width: log weights against scipy's density and logsumexp."""
    state, weights, logs, origins = cloud(1)
    covariance = np.array([[2.0, 0.7], [0.7, 1.0]])
    z = np.array([1.0, -0.5])
    before = logs.astype(float)[0]
    owner, score = give(state, weights, logs, origins, [0.0, *z, 2.0, 0.7, 1.0], floor=1e-30)
    density = multivariate_normal(z, covariance).logpdf(state[0, :2].T)
    assert owner[0] == 0
    assert score[0] == pytest.approx(logsumexp(before + density), abs=1e-4)
    settle(state, weights, logs, origins, keys(1), 1, 1, 0.0, 0.0)
    expected = before + density - logsumexp(before + density)
    sure = expected > -40.0
    np.testing.assert_allclose(logs[0][sure], expected[sure], atol=3e-4)
    np.testing.assert_allclose(weights[0], np.exp(expected), rtol=3e-4, atol=1e-9)


def test_several_looks_multiply_and_the_floor_bounds():
    state, weights, logs, origins = cloud(1)
    before, floor = logs.astype(float)[0], 1e-3
    zs = [[0.0, 1.0, 0.0, 2.0, 0.0, 2.0], [0.0, -0.5, 1.0, 1.0, 0.3, 2.0]]
    give(state, weights, logs, origins, zs, looks=[0, 1], floor=floor)
    expected = before.copy()
    for _, x, y, xx, xy, yy in zs:
        density = multivariate_normal([x, y], [[xx, xy], [xy, yy]]).pdf(state[0, :2].T)
        expected += np.log(density + floor)
    settle(state, weights, logs, origins, keys(1), 1, 1, 0.0, 0.0)
    np.testing.assert_allclose(weights[0], np.exp(expected - logsumexp(expected)), rtol=1e-3)


def test_posterior_against_a_grid():
    """Mean and covariance of the weighed cloud against Bayes' rule on a fine grid."""
    n = 200_000
    g = np.random.default_rng(1)
    state = np.zeros((1, 4, n), np.float32)
    state[0, :2] = g.multivariate_normal([1.0, 2.0], [[4.0, 1.5], [1.5, 3.0]], n).T
    logs = np.full((1, n), -np.log(n), np.float32)
    weights = np.exp(logs)
    z, r = [2.0, 0.5], [[2.25, -0.5], [-0.5, 1.0]]
    give(state, weights, logs, np.zeros((1, 2)), [0.0, *z, 2.25, -0.5, 1.0], floor=1e-9)
    row = settle(state, weights, logs, np.zeros((1, 2)), keys(1), 1, 1, 0.0, 0.0)[0]
    axis = np.linspace(-10.0, 12.0, 441)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    prior = multivariate_normal([1.0, 2.0], [[4.0, 1.5], [1.5, 3.0]]).pdf(points)
    posterior = prior * (multivariate_normal(z, r).pdf(points) + 1e-9)
    posterior /= posterior.sum()
    mean = posterior @ points
    covariance = (points - mean).T @ ((points - mean) * posterior[:, None])
    np.testing.assert_allclose(row[:2], mean, atol=0.02)
    np.testing.assert_allclose(row[4:8].reshape(2, 2), covariance, atol=0.03)


def test_late_sighting_meets_the_past():
    """A sighting of age a weighs a straight mover as a prompt one weighed it then."""
    state, weights, logs, origins = cloud(1)
    past = state.copy()
    past[:, :2] -= 2.0 * state[:, 2:]
    late, prompt = logs.copy(), logs.copy()
    give(state, weights, late, origins, [3.0, 0.5, 0.5, 2.0, 0.0, 2.0], now=5.0)
    give(past, weights, prompt, origins, [3.0, 0.5, 0.5, 2.0, 0.0, 2.0], now=3.0)
    np.testing.assert_allclose(late, prompt, atol=2e-4)


def brute_force(state, logs, origins, sightings, looks, gate, least):
    """The same rule by scipy and repeated search of the whole table."""
    m, count = len(sightings), len(state)
    table = np.full((m, count), -np.inf)
    means = moments_of(state, np.exp(logs))
    for j, (_, x, y, xx, xy, yy) in enumerate(sightings):
        r = np.array([[xx, xy], [xy, yy]])
        for k in range(count):
            d = np.array([x, y]) - origins[k] - means[k, :2]
            if d @ np.linalg.solve(r + means[k, 4:8].reshape(2, 2), d) > gate**2:
                continue
            density = multivariate_normal(np.array([x, y]) - origins[k], r)
            score = logsumexp(logs[k].astype(float) + density.logpdf(state[k, :2].T))
            table[j, k] = score if score > np.log(least) else -np.inf
    owner = np.full(m, -1)
    while np.isfinite(table).any():
        j, k = np.unravel_index(table.argmax(), table.shape)
        owner[j] = k
        table[j] = -np.inf
        table[[i for i in range(m) if looks[i] == looks[j]], k] = -np.inf
    return owner


@pytest.mark.parametrize("seed", range(12))
def test_association_by_brute_force(seed):
    g = np.random.default_rng(seed)
    state, weights, logs, origins = cloud(4, n=200, seed=seed)
    origins[:, 0] = g.uniform(0.0, 15.0, 4)
    m = 12
    sightings = np.zeros((m, 6))
    sightings[:, 1] = g.uniform(-10.0, 25.0, m)
    sightings[:, 2] = g.uniform(-5.0, 5.0, m)
    sightings[:, 3:] = [2.0, 0.5, 1.5]
    looks = g.integers(0, 3, m)
    expected = brute_force(state, logs, origins, sightings, looks, 3.0, 1e-5)
    owner, _ = give(state, weights, logs, origins, sightings, looks=looks, gate=3.0, least=1e-5)
    np.testing.assert_array_equal(owner, expected)
    assert (owner >= 0).sum() > 2


def test_free_sighting_on_a_track_starts_no_other():
    state, weights, logs, origins = cloud(1, spread=0.5)
    sightings = [[0.0, 0.1, 0.0, 1.0, 0.0, 1.0], [0.0, 3.0, 0.0, 1.0, 0.0, 1.0]]
    owner, _ = give(state, weights, logs, origins, sightings, looks=[0, 0], near=6.0)
    assert owner.tolist() == [0, -2]
    sightings[1][1] = 60.0
    owner, _ = give(state, weights, logs, origins, sightings, looks=[0, 0], near=6.0)
    assert owner.tolist() == [0, -1]


def test_settle_estimates_and_resamples():
    state, weights, logs, origins = cloud(3)
    logs[1] = np.log(1.0 / N)
    expected = moments_of(state, np.exp(logs))
    effective = 1.0 / np.sum(np.exp(2.0 * logs.astype(float)), axis=1)
    before = state.copy()
    rows = settle(state, weights, logs, origins, keys(3), 3, 1, 0.9, 0.0)
    expected[:, :2] += origins
    np.testing.assert_allclose(rows[:, :8], expected, atol=1e-3)
    np.testing.assert_allclose(rows[:, 8], effective, rtol=1e-3)
    np.testing.assert_array_equal(state[1], before[1])
    resampled = moments_of(state, weights)
    np.testing.assert_allclose(resampled[:, :2] + origins, expected[:, :2], atol=0.15)
    assert np.unique(state[0, 0]).size < N
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-5)


def test_random_controls_keep_the_speed_bound_and_the_mean_of_a_straight_mover():
    n = 20_000
    state = np.zeros((1, 4, n), np.float32)
    state[0, 2] = 2.0
    weights = np.full((1, n), 1.0 / n, np.float32)
    motion = np.array([4.0, 0.1, 0.2, 0.1, 0.0, 0.0])
    for step in range(5):
        moments = predict(state, weights, keys(1), 1, step, 1.0, motion)
    speed = np.hypot(state[0, 2], state[0, 3])
    assert speed.max() <= 4.0 + 1e-4
    assert speed.std() == pytest.approx(0.2 * np.sqrt(5.0), rel=0.03)
    assert np.arctan2(state[0, 3], state[0, 2]).std() == pytest.approx(0.1 * np.sqrt(5.0), rel=0.03)
    assert moments[0, 0] == pytest.approx(10.0, abs=0.2)
    assert moments[0, 1] == pytest.approx(0.0, abs=0.05)


def test_fresh_courses_are_uniform_and_as_frequent_as_asked():
    n = 20_000
    state = np.zeros((1, 4, n), np.float32)
    state[0, 2] = 2.0
    weights = np.full((1, n), 1.0 / n, np.float32)
    predict(state, weights, keys(1), 1, 1, 1.0, np.array([4.0, 0.0, 0.0, 0.0, 0.2, 0.1]))
    course = np.arctan2(state[0, 3], state[0, 2])
    speed = np.hypot(state[0, 2], state[0, 3])
    turned, restarted = (np.abs(course) > 1e-4), np.abs(speed - 2.0) > 1e-3
    assert turned.mean() == pytest.approx(1.0 - np.exp(-0.3), abs=1e-3)
    assert restarted.mean() == pytest.approx(np.exp(-0.2) - np.exp(-0.3), abs=1e-3)
    assert kstest(course[turned], "uniform", args=(-np.pi, 2.0 * np.pi)).pvalue > 0.01
    assert kstest(speed[restarted], "uniform", args=(0.0, 4.0)).pvalue > 0.01


def test_draws_of_a_track_do_not_depend_on_the_others():
    motion = np.array([4.0, 0.1, 0.2, 0.1, 0.04, 0.02])
    many, weights, _, _ = cloud(3)
    one = many[2:].copy()
    predict(many, weights, keys(3), 3, 7, 1.0, motion)
    predict(one, weights[2:].copy(), keys(3)[2:], 1, 7, 1.0, motion)
    np.testing.assert_array_equal(many[2], one[0])


def test_spawn_has_the_moments_asked_for():
    n = 50_000
    state = np.empty((4, n), np.float32)
    weights, logs = np.empty(n, np.float32), np.empty(n, np.float32)
    place = np.array([[1.0, 2.0, 2.0, 0.9, 1.0], [-1.0, 0.0, 1.0, 0.4, 0.5]])
    spawn(state, weights, logs, np.uint64(5), place, 100.0)
    np.testing.assert_allclose(state.mean(axis=1), [1.0, -1.0, 2.0, 0.0], atol=0.03)
    np.testing.assert_allclose(np.cov(state[[0, 2]]), [[2.0, 0.9], [0.9, 1.0]], atol=0.05)
    np.testing.assert_allclose(np.cov(state[[1, 3]]), [[1.0, 0.4], [0.4, 0.5]], atol=0.05)
    spawn(state, weights, logs, np.uint64(5), place, 2.0)
    assert np.hypot(state[2], state[3]).max() <= 2.0 + 1e-5
