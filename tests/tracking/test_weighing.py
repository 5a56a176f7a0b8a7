"""What sightings make of particles, against SciPy, a grid, and the Kalman update by NumPy."""

import math

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from staniel.kernels.lineage import SLOTS
from staniel.kernels.weighing import _draw_together, correct

NOW, FLOOR = 10.0, 1e-12
R = np.array([[2.0, 0.7], [0.7, 1.0]])
AT = (1.0, -0.5)


class Cloud:
    """One track of `n` particles about a place of the map, the last slot of its past included."""

    def __init__(self, samples, weights=None, rest=None, origin=(100.0, -50.0), slot=NOW - 2.0):
        """`samples` are (n, 4), or (n, 6) with the places at the time `slot`."""
        n = len(samples)
        self.state = np.ascontiguousarray(samples[:, :4].T[None], np.float32)
        weights = np.full(n, 1.0 / n) if weights is None else weights
        self.weights = (weights / weights.sum()).astype(np.float32)[None]
        self.logs = np.log(self.weights)
        self.origin = np.array(origin)
        self.past = np.zeros((1, SLOTS, 2, n), np.float32)
        self.times, self.depth = np.zeros(SLOTS), np.zeros(1, np.int64)
        if samples.shape[1] == 6:
            self.past[0, 0] = samples[:, 4:].T
            self.times[0], self.depth[0] = slot, 1
        self.rests = np.zeros((1, 4, 4)) if rest is None else rest[None].copy()

    def moments(self, logs=None):
        """Weighted mean and covariance of the particles and what they share, in float64."""
        weights = np.exp(self.logs[0].astype(float) if logs is None else logs)
        state, weights = self.state[0].astype(float), weights / weights.sum()
        return state @ weights, np.cov(state, aweights=weights, ddof=0) + self.rests[0]

    def meet(self, places, *, width=0.0, floor=FLOOR, looks=None, shares=None, ages=None, cov=R):
        m = len(places)
        ages = np.zeros(m) if ages is None else ages
        sightings = np.array(
            [
                [NOW - age, *(self.origin + place), cov[0, 0], cov[0, 1], cov[1, 1]]
                for place, age in zip(np.asarray(places, float), ages, strict=True)
            ]
        )
        looks = np.arange(m) if looks is None else np.array(looks)
        shares = np.ones(m) if shares is None else np.array(shares, float)
        pairs = np.column_stack([np.zeros(m, np.int64), np.arange(m)])
        state, weights = self.state[0].astype(float), self.weights[0].astype(float)
        mean, spread = state @ weights, np.cov(state, aweights=weights, ddof=0)
        hits = np.full(1, -1)
        correct(
            self.state, self.weights, self.logs, self.origin[None], self.past,
            np.zeros((1, SLOTS, self.weights.size), np.int32), np.zeros((1, SLOTS), np.bool_),
            self.times, self.depth, 1 if self.depth[0] else 0, pairs, shares, looks, sightings, NOW,
            width, floor, mean[None], spread[None], self.rests, hits,
        )  # fmt: skip
        return int(hits[0])


def gaussian(n, mean, cov, seed=0):
    """Samples whose mean and covariance are the given ones, to rounding."""
    raw = np.random.default_rng(seed).normal(size=(n, len(mean)))
    raw -= raw.mean(axis=0)
    raw = raw @ np.linalg.inv(np.linalg.cholesky(np.cov(raw.T, ddof=0))).T
    return mean + raw @ np.linalg.cholesky(cov).T


def uneven(n=1000, seed=1):
    g = np.random.default_rng(seed)
    return Cloud(g.normal(0.0, 2.0, (n, 4)), np.exp(g.normal(size=n)))


# ---------------------------------------------------------------- points: Bayes' rule


def test_weights_equal_the_gaussian_likelihood():
    cloud = uneven()
    before, state = cloud.logs[0].astype(float), cloud.state.copy()
    assert cloud.meet([AT], floor=1e-30) == 1
    expected = before + multivariate_normal(AT, R).logpdf(state[0, :2].T)
    ours = cloud.logs[0] - logsumexp(cloud.logs[0])
    expected -= logsumexp(expected)
    sure = expected > -40.0
    np.testing.assert_allclose(ours[sure], expected[sure], atol=3e-4)
    np.testing.assert_array_equal(cloud.state, state)
    assert not cloud.rests.any()


def test_several_looks_multiply_and_the_floor_bounds():
    cloud, places, floor = uneven(), [AT, (-0.5, 1.0), (30.0, 30.0)], 1e-3
    before = cloud.logs[0].astype(float)
    assert cloud.meet(places, floor=floor) == 3
    density = [multivariate_normal(z, R).pdf(cloud.state[0, :2].T) + floor for z in places]
    np.testing.assert_allclose(cloud.logs[0], before + np.log(density).sum(axis=0), atol=3e-4)


def test_a_mixture_of_shares_is_the_mixture_of_likelihoods():
    """Of one look, whatever the width; a share of nothing is nothing; another look multiplies."""
    places, shares, looks = [AT, (3.0, 1.0), (0.0, 0.0), (2.0, 2.0)], [0.7, 0.2, 0.0, 1.0], [
        0, 0, 0, 1,
    ]  # fmt: skip
    cloud = uneven()
    before, floor = cloud.logs[0].astype(float), 1e-4
    assert cloud.meet(places, shares=shares, looks=looks, floor=floor) == 2
    a, b, _, c = (multivariate_normal(z, R).pdf(cloud.state[0, :2].T) for z in places)
    expected = before + np.log(floor + 0.7 * a + 0.2 * b) + np.log(floor + c)
    np.testing.assert_allclose(cloud.logs[0], expected, atol=3e-4)


def test_a_mixture_moves_no_particle_beyond_drawing_together():
    samples = gaussian(4000, np.zeros(4), np.diag([4.0, 4.0, 1.0, 1.0]))
    mixed, drawn = Cloud(samples), Cloud(samples)
    mixed.meet([AT, (3.0, 1.0)], shares=[0.5, 0.5], looks=[0, 0], width=0.5)
    _draw_together(drawn.state[0], np.zeros(4), 0.25)
    np.testing.assert_allclose(mixed.state, drawn.state, atol=1e-5)
    np.testing.assert_allclose(mixed.rests[0], 0.25 * np.cov(samples.T, ddof=0), atol=1e-4)


def test_a_track_with_shares_of_nothing_is_left_alone():
    cloud = uneven()
    logs, state = cloud.logs.copy(), cloud.state.copy()
    assert cloud.meet([AT, AT], shares=[0.0, 0.0], width=0.5) == 0
    np.testing.assert_array_equal(cloud.logs, logs)
    np.testing.assert_array_equal(cloud.state, state)


def test_posterior_of_a_cloud_with_two_heads_against_a_grid():
    """Not Gaussian at all: two far clouds of one track, seen at one of them."""
    g = np.random.default_rng(3)
    head = np.where(g.random(200_000) < 0.5, -4.0, 4.0)
    cloud = Cloud(
        np.column_stack([head + g.normal(size=head.size), *g.normal(size=(3, head.size))])
    )
    cloud.meet([(3.0, 0.5)], floor=1e-9)
    axis = np.linspace(-10.0, 10.0, 401)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    heads = [multivariate_normal((x, 0.0), np.eye(2)).pdf(points) for x in (-4.0, 4.0)]
    posterior = sum(heads) * (multivariate_normal((3.0, 0.5), R).pdf(points) + 1e-9)
    posterior /= posterior.sum()
    mean = posterior @ points
    covariance = (points - mean).T @ ((points - mean) * posterior[:, None])
    ours, cov = cloud.moments()
    np.testing.assert_allclose(ours[:2], mean, atol=0.015)
    np.testing.assert_allclose(cov[:2, :2], covariance, atol=0.02)


# ---------------------------------------------------------------- little Gaussians: Kalman

PRIOR = np.array(
    [
        [4.0, 1.0, 1.5, 0.2, 3.0, 0.5],
        [1.0, 3.0, 0.1, 1.0, 0.7, 2.0],
        [1.5, 0.1, 2.0, 0.3, -0.5, 0.0],
        [0.2, 1.0, 0.3, 1.5, 0.1, -0.4],
        [3.0, 0.7, -0.5, 0.1, 5.0, 0.6],
        [0.5, 2.0, 0.0, -0.4, 0.6, 4.0],
    ]
)
"""Of x, y, vx, vy now and x, y at an earlier time; any joint Gaussian will do."""
MEAN = np.array([1.0, 2.0, 3.0, -1.0, -4.0, 5.0])
N = 200_000


def kalman(m, P, updates):
    """Update by NumPy with (place, observation matrix) pairs."""
    for z, H in updates:
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        m, P = m + K @ (z - H @ m), (np.eye(len(m)) - K @ H) @ P
    return m, P


def agrees(cloud, m, P):
    ours, cov = cloud.moments()
    np.testing.assert_allclose(ours, m[:4], atol=0.02)
    np.testing.assert_allclose(cov, P[:4, :4], atol=0.03)


@pytest.mark.parametrize("width", [0.0, 0.3, 0.7, 0.95])
def test_prompt_sightings_are_the_kalman_update(width):
    """One, then several looks; without and with something that all particles share."""
    H = np.eye(2, 4)
    rest = np.diag([0.5, 0.3, 0.2, 0.4])
    rest[0, 2] = rest[2, 0] = 0.2
    m, P = MEAN[:4], PRIOR[:4, :4]
    for places in ([(2.0, 0.5)], [(2.0, 0.5), (0.0, 2.5), (1.0, 1.0)]):
        for shared in (0.0, 1.0) if width > 0.0 else (0.0,):
            cloud = Cloud(gaussian(N, m, P), rest=shared * rest)
            cloud.meet(places, width=width)
            agrees(cloud, *kalman(m, P + shared * rest, [(np.array(z), H) for z in places]))


@pytest.mark.parametrize("width", [0.0, 0.5, 0.95])
def test_late_sightings_are_the_kalman_update_of_the_past_and_the_present(width):
    """Whatever path led the particles from there to here."""
    late, prompt = np.eye(2, 6, 4), np.eye(2, 6)
    cloud = Cloud(gaussian(N, MEAN, PRIOR))
    cloud.meet([(-3.0, 4.0)], ages=[2.0], width=width)
    agrees(cloud, *kalman(MEAN, PRIOR, [(np.array([-3.0, 4.0]), late)]))
    cloud = Cloud(gaussian(N, MEAN, PRIOR))
    cloud.meet([(-3.0, 4.0), (2.0, 0.5), (-5.0, 4.5)], ages=[2.0, 0.0, 2.0], width=width)
    places = [np.array(z) for z in ((-3.0, 4.0), (2.0, 0.5), (-5.0, 4.5))]
    agrees(cloud, *kalman(MEAN, PRIOR, zip(places, (late, prompt, late), strict=True)))


@pytest.mark.parametrize("width", [0.0, 0.5, 0.95])
def test_between_two_slots_the_place_is_between(width):
    between = 0.5 * (np.eye(2, 6) + np.eye(2, 6, 4))
    cloud = Cloud(gaussian(N, MEAN, PRIOR))
    cloud.meet([(-1.0, 3.0)], ages=[1.0], width=width)
    agrees(cloud, *kalman(MEAN, PRIOR, [(np.array([-1.0, 3.0]), between)]))


@pytest.mark.parametrize("width", [0.0, 0.5, 0.95])
def test_a_late_sighting_of_a_straight_mover_is_the_kalman_update(width):
    back = np.hstack([np.eye(2), -3.0 * np.eye(2)])
    m, P = MEAN[:4], PRIOR[:4, :4]
    z = back @ m + [1.5, -1.0]
    cloud = Cloud(gaussian(N, m, P))
    cloud.meet([z], ages=[3.0], width=width)
    agrees(cloud, *kalman(m, P, [(z, back)]))


@pytest.mark.parametrize("square", [0.0, 0.25, 0.9])
def test_drawing_together_and_widening_leave_mean_and_covariance(square):
    g = np.random.default_rng(5)
    planes = g.multivariate_normal(MEAN, PRIOR, 5000).T.astype(np.float32)
    mean, cov = planes.mean(axis=1), np.cov(planes, ddof=0)
    _draw_together(planes, mean.astype(float), square)
    np.testing.assert_allclose(planes.mean(axis=1), mean, atol=1e-4)
    np.testing.assert_allclose(np.cov(planes, ddof=0) + square * cov, cov, atol=2e-4)


def test_a_particle_is_never_wider_than_the_noise_of_what_is_seen():
    cloud = Cloud(gaussian(N, np.zeros(4), np.diag([400.0, 400.0, 1.0, 1.0])))
    cloud.meet([AT, (30.0, 30.0)], shares=[0.5, 0.5], looks=[0, 0], width=0.9)
    assert np.trace(cloud.rests[0, :2, :2]) == pytest.approx(np.trace(R), rel=1e-3)


def test_a_particle_far_away_stays_where_the_sighting_is_rather_a_false_alarm():
    """Beyond the distance at which the likelihood falls below the floor; weight by the floor."""
    samples = gaussian(2000, np.zeros(4), np.diag([4.0, 4.0, 1.0, 1.0]))
    samples[:20, 0] += 60.0
    cloud, floor = Cloud(samples), 1e-6
    before, drawn = cloud.logs[0].copy(), cloud.state[0].copy()
    weights = cloud.weights[0].astype(float)
    spread = np.cov(drawn.astype(float), aweights=weights, ddof=0)
    square = min(0.09, np.trace(R) / np.trace(spread[:2, :2]))
    _draw_together(drawn, drawn.astype(float) @ weights, square)
    cloud.meet([AT], width=0.3, floor=floor)
    np.testing.assert_allclose(cloud.state[0][:, :20], drawn[:, :20], atol=1e-4)
    np.testing.assert_allclose(cloud.logs[0, :20], before[:20] + math.log(floor), atol=1e-3)
    density = multivariate_normal(AT, R + square * spread[:2, :2]).pdf(drawn[:2].T)
    moved = np.abs(cloud.state[0][:2] - drawn[:2]).max(axis=0) > 1e-4
    assert moved[density > 2.0 * floor].mean() > 0.99
    assert not moved[density < 0.5 * floor].any()


@pytest.mark.parametrize(("width", "rel"), [(0.0, 0.05), (0.5, 0.15)])
@pytest.mark.parametrize("z", [(0.0, 0.0), (4.0, 0.0), (7.0, 0.0)])
@pytest.mark.parametrize(("share", "floor"), [(1.0, 1e-5), (0.02, 1e-3), (0.3, 1e-2)])
def test_a_sighting_that_may_be_false_is_believed_by_its_odds(width, rel, z, share, floor):
    """The mean and covariance of the mixture of both; little Gaussians shrink a bit too much."""
    m, P = np.zeros(4), np.diag([9.0, 9.0, 1.0, 1.0])
    likely = share * multivariate_normal(np.zeros(2), P[:2, :2] + R).pdf(z)
    belief = likely / (likely + floor)
    seen, after = kalman(m, P, [(np.array(z), np.eye(2, 4))])
    mean = belief * seen
    cov = belief * (after + np.outer(seen, seen)) + (1.0 - belief) * P - np.outer(mean, mean)
    cloud = Cloud(gaussian(N, m, P))
    cloud.meet([z], shares=[share], floor=floor, width=width)
    ours, own = cloud.moments()
    np.testing.assert_allclose(ours, mean, atol=0.15 if width else 0.08)
    np.testing.assert_allclose(np.diag(own), np.diag(cov), rtol=rel)
