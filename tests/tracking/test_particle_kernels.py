"""How clouds are launched and settled, against NumPy and SciPy."""

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import kstest

from staniel.kernels.lineage import SLOTS
from staniel.kernels.particles import draws_of, settle, spawn
from staniel.kernels.resampling import SCHEMES

HEAD = 3


class Clouds:
    """Unevenly weighted clouds at (100 k, 0); log weights not normalised."""

    def __init__(self, count=3, n=1000, seed=0, scatter=1.0, offset=0.0):
        g = np.random.default_rng(seed)
        self.count, self.n = count, n
        self.mixing = g.normal(size=(4, 4)) + 2.0 * np.eye(4)
        self.state = np.ascontiguousarray(self.mixing @ g.normal(size=(count, 4, n)), np.float32)
        self.logs = (scatter * g.normal(size=(count, n)) + offset).astype(np.float32)
        self.weights = np.full((count, n), np.nan, np.float32)
        self.origins = np.column_stack([100.0 * np.arange(count), np.zeros(count)])
        self.keys = np.arange(1, count + 1, dtype=np.uint64)
        self.ancestors = np.zeros((count, SLOTS, n), np.int32)
        self.copied = np.zeros((count, SLOTS), np.bool_)
        self.rests = np.zeros((count, 4, 4))

    def settle(self, threshold=0.0, scheme=0, roughening=0.0, whole=True, step=1):
        return settle(
            self.state, self.weights, self.logs, self.origins, self.keys, self.ancestors,
            self.copied, HEAD, self.count, step, draws_of(self.n), threshold, scheme, roughening,
            self.rests, whole,
        )  # fmt: skip

    def moments(self, k, weights=None):
        """Weighted mean and covariance of all four planes, in float64."""
        w = self.weights[k].astype(float) if weights is None else weights
        state, w = self.state[k].astype(float), w / w.sum()
        return state @ w, np.cov(state, aweights=w, ddof=0)


@pytest.mark.parametrize("offset", [0.0, -500.0, 300.0])
def test_estimates_are_the_weighted_moments_and_the_evidence_is_the_weights_sum(offset):
    clouds = Clouds(n=1003, offset=offset)
    logs, state = clouds.logs.astype(float), clouds.state.copy()
    rows = clouds.settle()
    for k, row in enumerate(rows):
        weights = np.exp(logs[k] - logsumexp(logs[k]))
        mean, cov = clouds.moments(k, weights)
        np.testing.assert_allclose(row[:2], mean[:2] + clouds.origins[k], atol=2e-4)
        np.testing.assert_allclose(row[2:4], mean[2:], atol=2e-4)
        np.testing.assert_allclose(row[4:8].reshape(2, 2), cov[:2, :2], rtol=1e-4, atol=1e-4)
        assert row[8] == pytest.approx(1.0 / (weights**2).sum(), rel=1e-4)
        assert row[9] == pytest.approx(logsumexp(logs[k]), abs=1e-5 + 1e-6 * abs(offset))
        np.testing.assert_allclose(clouds.weights[k], weights, rtol=1e-3)
        np.testing.assert_allclose(clouds.logs[k], np.log(weights), atol=1e-4 + 2e-7 * abs(offset))
    np.testing.assert_array_equal(clouds.state, state)
    assert not clouds.copied.any()


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_few_effective_particles_cause_resampling_and_many_do_not(scheme):
    clouds = Clouds()
    clouds.logs[1] = -3.0
    before, logs = clouds.state.copy(), clouds.logs.astype(float)
    rows = clouds.settle(threshold=0.9, scheme=scheme)
    assert clouds.copied[:, HEAD].tolist() == [True, False, True]
    assert clouds.copied.sum() == 2
    np.testing.assert_array_equal(clouds.state[1], before[1])
    assert rows[1, 8] == pytest.approx(1000.0, rel=1e-4)
    for k in (0, 2):
        chosen = clouds.ancestors[k, HEAD]
        np.testing.assert_array_equal(clouds.state[k], before[k][:, chosen])
        np.testing.assert_allclose(clouds.weights[k], 1e-3)
        np.testing.assert_allclose(clouds.logs[k], np.log(1e-3), rtol=1e-6)
        weights = np.exp(logs[k] - logsumexp(logs[k]))
        offspring = np.bincount(chosen, minlength=1000)
        assert np.corrcoef(offspring, weights)[0, 1] > 0.7
        mean, _ = clouds.moments(k)
        np.testing.assert_allclose(mean[:2] + clouds.origins[k], rows[k, :2], atol=0.3)


def test_resampling_keeps_mean_and_covariance_and_roughening_widens_as_asked():
    clouds = Clouds(count=1, n=100_000)
    mean, cov = clouds.moments(0, np.exp(clouds.logs[0].astype(float)))
    clouds.settle(threshold=1.0, roughening=0.3)
    ours, wider = clouds.moments(0)
    scale = np.trace(cov)
    np.testing.assert_allclose(ours, mean, atol=0.01 * np.sqrt(scale))
    np.testing.assert_allclose(wider, cov * (1.0 + 0.3**2), atol=0.01 * scale)
    assert np.unique(clouds.state[0, 0]).size > 0.9 * clouds.n
    assert not clouds.rests.any()


def some_rest(seed=4):
    root = np.random.default_rng(seed).normal(size=(4, 4))
    return root @ root.T


@pytest.mark.parametrize("threshold", [0.0, 1.0])
@pytest.mark.parametrize("whole", [True, False])
def test_particles_and_what_they_share_keep_mean_and_covariance(threshold, whole):
    """Whole, the particles have all of it; not whole, they still share the rest of the velocity."""
    clouds = Clouds(count=1, n=100_000)
    clouds.rests[0] = rest = some_rest()
    mean, cov = clouds.moments(0, np.exp(clouds.logs[0].astype(float)))
    row = clouds.settle(threshold=threshold, roughening=0.3, whole=whole)[0]
    ours, after = clouds.moments(0)
    np.testing.assert_allclose(ours, mean, atol=0.03)
    np.testing.assert_allclose(after + clouds.rests[0], cov + rest, atol=0.01 * np.trace(cov))
    np.testing.assert_allclose(row[4:8].reshape(2, 2), (cov + rest)[:2, :2], rtol=1e-4)
    left = np.zeros((4, 4))
    if not whole:
        left[2:, 2:] = rest[2:, 2:] - rest[2:, :2] @ np.linalg.solve(rest[:2, :2], rest[:2, 2:])
    np.testing.assert_allclose(clouds.rests[0], left, atol=1e-9)


def test_what_is_shared_of_the_velocity_alone_outlives_a_resampling():
    """As in a second step at one time, of a straight mover whose places have been drawn."""
    clouds = Clouds(count=1, n=50_000)
    clouds.rests[0, 2:, 2:] = some_rest()[2:, 2:]
    mean, cov = clouds.moments(0, np.exp(clouds.logs[0].astype(float)))
    expected = cov + clouds.rests[0]
    clouds.settle(threshold=1.0, roughening=0.1, whole=False)
    ours, after = clouds.moments(0)
    np.testing.assert_allclose(ours, mean, atol=0.05)
    np.testing.assert_allclose(after + clouds.rests[0], expected, atol=0.02 * np.trace(expected))


def test_shared_covariance_without_full_rank_makes_no_noise_of_its_own():
    clouds = Clouds(count=1, n=64)
    clouds.rests[0, 0, 0] = clouds.rests[0, 2, 2] = clouds.rests[0, 0, 2] = 1.0
    clouds.rests[0, 2, 0] = 1.0
    before = clouds.state.copy()
    clouds.settle()
    moved = clouds.state[0] - before[0]
    np.testing.assert_allclose(moved[0], moved[2], atol=1e-5)
    assert moved[0].std() > 0.5
    assert not moved[[1, 3]].any()


def test_the_second_half_draws_the_opposite_of_the_first():
    for n in (64, 65):
        clouds = Clouds(count=1, n=n)
        clouds.rests[0] = some_rest()
        before = clouds.state.copy()
        clouds.settle()
        moved = clouds.state[0] - before[0]
        half = (n + 1) // 2
        np.testing.assert_allclose(moved[:, half:], -moved[:, : n - half], atol=1e-5)


def test_draws_of_a_track_do_not_depend_on_the_others():
    many, one = Clouds(3), Clouds(3)
    one.count = 1
    for name in ("state", "logs", "weights", "origins", "keys", "ancestors", "copied", "rests"):
        setattr(one, name, np.ascontiguousarray(getattr(one, name)[2:]))
    rows = many.settle(threshold=1.0, roughening=0.2, scheme=SCHEMES["multinomial"])
    np.testing.assert_array_equal(
        one.settle(threshold=1.0, roughening=0.2, scheme=SCHEMES["multinomial"])[0], rows[2]
    )
    np.testing.assert_array_equal(many.state[2], one.state[0])


# ---------------------------------------------------------------- births


def spawned(place, fastest=100.0, n=50_000, key=5):
    state = np.empty((4, n), np.float32)
    weights, logs = np.empty(n, np.float32), np.empty(n, np.float32)
    spawn(state, weights, logs, np.uint64(key), np.array(place), fastest)
    return state, weights, logs


def test_spawn_has_the_moments_asked_for():
    state, weights, logs = spawned([[1.0, 2.0, 2.0, 0.9, 1.0], [-1.0, 0.0, 1.0, 0.4, 0.5]])
    np.testing.assert_allclose(state.mean(axis=1), [1.0, -1.0, 2.0, 0.0], atol=0.03)
    np.testing.assert_allclose(np.cov(state[[0, 2]]), [[2.0, 0.9], [0.9, 1.0]], atol=0.05)
    np.testing.assert_allclose(np.cov(state[[1, 3]]), [[1.0, 0.4], [0.4, 0.5]], atol=0.05)
    np.testing.assert_allclose(np.corrcoef(state)[[0, 0, 1, 2], [1, 3, 2, 3]], 0.0, atol=0.02)
    assert kstest(state[1], "norm", args=(-1.0, 1.0)).pvalue > 0.01
    np.testing.assert_allclose(weights.sum(), 1.0, rtol=1e-3)
    np.testing.assert_allclose(np.exp(logs), weights, rtol=1e-5)


def test_spawn_keeps_the_speed_bound_and_the_courses():
    place = [[1.0, 2.0, 2.0, 0.9, 1.0], [-1.0, 0.0, 1.0, 0.4, 0.5]]
    free, slow = spawned(place)[0], spawned(place, fastest=2.0)[0]
    speed = np.hypot(slow[2], slow[3])
    assert speed.max() <= 2.0 + 1e-5
    np.testing.assert_array_equal(slow[:2], free[:2])
    np.testing.assert_allclose(slow[3] * free[2], slow[2] * free[3], atol=1e-4)
    np.testing.assert_allclose(speed, np.minimum(np.hypot(free[2], free[3]), 2.0), atol=1e-5)


def test_spawn_of_two_keys_differs_and_of_one_key_does_not():
    place = [[0.0, 0.0, 1.0, 0.0, 1.0]] * 2
    np.testing.assert_array_equal(spawned(place)[0], spawned(place)[0])
    assert abs(np.corrcoef(spawned(place)[0][0], spawned(place, key=6)[0][0])[0, 1]) < 0.02
