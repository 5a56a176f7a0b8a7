"""How particles move, against NumPy, SciPy, closed forms and a raster looked up by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from staniel.kernels.lineage import SLOTS
from staniel.kernels.motion import CONTROLS, STRAIGHT, learn, predict, spread
from staniel.kernels.particles import draws_of, settle

NO_RASTER = np.zeros((0, 0), np.uint8), np.zeros(3)


class Clouds:
    """Arrays of some tracks, and the kernel's long call."""

    def __init__(self, state, *, habits=(2.0, 0.0, 0.0, 0.0), keys=None):
        self.state = np.array(state, np.float32, order="C")
        count, _, n = self.state.shape
        self.count, self.n = count, n
        self.weights = np.full((count, n), 1.0 / n, np.float32)
        self.logs = np.full((count, n), -np.log(n), np.float32)
        self.origins = np.zeros((count, 2))
        self.keys = np.arange(1, count + 1, dtype=np.uint64) if keys is None else keys
        self.habits = np.tile(np.array(habits, float), (count, 1))
        self.past = np.zeros((count, SLOTS, 2, n), np.float32)
        self.ancestors = np.zeros((count, SLOTS, n), np.int32)
        self.copied = np.zeros((count, SLOTS), np.bool_)
        self.depth = np.zeros(count, np.int64)
        self.rests = np.zeros((count, 4, 4))
        self.steps, self.head = 0, 0

    def predict(self, dt=1.0, motion=(50.0, 0.0, 0.0, 0.0), kind=CONTROLS, q=1.0, raster=NO_RASTER):
        self.steps += 1
        moments = predict(
            self.state, self.weights, self.logs, self.origins, self.keys, self.habits, self.past,
            self.copied, self.depth, self.head, self.count, self.steps, draws_of(self.n), dt, kind,
            np.array(motion), self.rests, q, *raster,
        )  # fmt: skip
        self.head += dt > 0.0
        return moments

    def settle(self, whole):
        return settle(
            self.state, self.weights, self.logs, self.origins, self.keys, self.ancestors,
            self.copied, self.head, self.count, self.steps, draws_of(self.n), 0.0, 0, 0.0,
            self.rests, whole,
        )  # fmt: skip


def eastbound(n, speed=2.0, **kwargs):
    state = np.zeros((1, 4, n), np.float32)
    state[0, 2] = speed
    return Clouds(state, **kwargs)


# ---------------------------------------------------------------- random controls


def test_the_course_and_the_speed_walk_as_far_as_asked_and_no_faster_than_the_bound():
    clouds = eastbound(20_000, habits=(10.0, 0.0, 0.1, 0.2))
    for _ in range(5):
        clouds.predict(motion=(4.0, 0.1, 0.0, 0.0))
    _, y, vx, vy = clouds.state[0]
    assert np.hypot(vx, vy).max() <= 4.0 + 1e-4
    assert np.hypot(vx, vy).std() == pytest.approx(0.2 * math.sqrt(5.0), rel=0.03)
    assert np.arctan2(vy, vx).std() == pytest.approx(0.1 * math.sqrt(5.0), rel=0.03)
    assert abs(y.mean()) < 0.02


@given(
    st.floats(0.0, 30.0),
    st.floats(0.01, 3.0),
    st.floats(0.0, 10.0),
    st.floats(1.0, 40.0),
    st.integers(0, 9),
)
@settings(max_examples=40, deadline=None)
def test_no_particle_is_faster_than_the_bounds(fastest, dt, kick, bound, seed):
    g = np.random.default_rng(seed)
    state = np.zeros((1, 4, 101), np.float32)
    state[0, 2:] = g.normal(0.0, 20.0, (2, 101))
    state[0, 2:, :3] = 0.0
    clouds = Clouds(state, habits=(fastest, 0.1, 0.3, kick))
    clouds.predict(dt, motion=(bound, 0.1, 0.2, 0.1))
    speed = np.hypot(*clouds.state[0, 2:])
    assert np.isfinite(clouds.state).all()
    assert speed.max() <= min(bound, max(1.5 * fastest + 2.0, 8.0)) * (1.0 + 1e-5)


def test_a_straight_mover_stays_straight_on_average():
    """The second half draws the opposite of the first: the mean is exact, not only unbiased."""
    clouds = eastbound(1000, habits=(10.0, 0.0, 0.0, 0.1))
    for _ in range(8):
        clouds.predict(motion=(50.0, 0.3, 0.0, 0.0))
    np.testing.assert_allclose(clouds.state[0].mean(axis=1), [16.0, 0.0, 2.0, 0.0], atol=2e-4)


@pytest.mark.parametrize("n", [64, 65])
def test_the_halves_are_mirror_images(n):
    clouds = eastbound(n, habits=(10.0, 0.0, 0.3, 0.1))
    clouds.predict(motion=(50.0, 0.0, 0.0, 0.0))
    _, y, vx, vy = clouds.state[0]
    half = (n + 1) // 2
    np.testing.assert_allclose(y[half:] * vx[: n - half], -y[: n - half] * vx[half:], atol=1e-2)
    course = np.arctan2(vy, vx)
    np.testing.assert_allclose(course[half:], -course[: n - half], atol=1e-6)
    np.testing.assert_allclose(np.hypot(vx, vy)[half:] + np.hypot(vx, vy)[: n - half], 4.0, 1e-5)
    assert np.unique(course).size > 0.9 * n


def test_fresh_courses_are_uniform_and_as_frequent_as_asked():
    clouds = eastbound(20_000, habits=(10.0, 0.0, 0.0, 0.0))
    clouds.predict(motion=(4.0, 0.0, 0.2, 0.1))
    course, speed = np.arctan2(*clouds.state[0, :1:-1]), np.hypot(*clouds.state[0, 2:])
    turned, restarted = np.abs(course) > 1e-4, np.abs(speed - 2.0) > 1e-3
    assert turned.mean() == pytest.approx(1.0 - np.exp(-0.2), abs=1e-3)
    assert not (turned & restarted).any()
    assert restarted.mean() == pytest.approx(np.exp(-0.2) - np.exp(-0.3), abs=1e-3)
    assert kstest(course[turned], "uniform", args=(-np.pi, 2.0 * np.pi)).pvalue > 0.01
    assert kstest(speed[restarted], "uniform", args=(0.0, 4.0)).pvalue > 0.01


def test_who_drives_off_may_do_so_on_any_course():
    clouds = eastbound(20_000, 0.01, habits=(0.0, 0.0, 0.0, 0.0))
    clouds.predict(motion=(25.0, 0.0, 0.0, 0.5))
    course, speed = np.arctan2(*clouds.state[0, :1:-1]), np.hypot(*clouds.state[0, 2:])
    gone = speed > 0.02
    assert gone.mean() == pytest.approx((1.0 - np.exp(-0.5)) * (1.0 - 0.02 / 8.0), abs=2e-3)
    assert kstest(course[gone], "uniform", args=(-np.pi, 2.0 * np.pi)).pvalue > 0.01
    assert kstest(speed[gone], "uniform", args=(0.02, 8.0)).pvalue > 0.01


def test_no_particle_turns_more_often_than_another():
    """Over many steps each of them has its share of fresh courses."""
    clouds = eastbound(200, habits=(10.0, 0.0, 0.0, 0.0))
    turns = np.zeros(200)
    for _ in range(400):
        before = np.arctan2(*clouds.state[0, :1:-1])
        clouds.predict(motion=(4.0, 0.0, 0.2, 0.0))
        turns += np.abs(np.arctan2(*clouds.state[0, :1:-1]) - before) > 1e-4
    share = 1.0 - np.exp(-0.2)
    assert turns.mean() == pytest.approx(400 * share, rel=0.02)
    assert np.abs(turns - 400 * share).max() < 5.0 * math.sqrt(400 * share * (1.0 - share))


def test_a_learned_turn_is_a_circle():
    clouds = eastbound(64, 5.0, habits=(5.0, 0.1, 0.0, 0.0))
    for _ in range(100):
        clouds.predict(0.1)
    radius = 5.0 / 0.1
    exact = [radius * math.sin(1.0), radius * (1 - math.cos(1.0)), 5 * math.cos(1), 5 * math.sin(1)]
    np.testing.assert_allclose(clouds.state[0].T, np.tile(exact, (64, 1)), atol=2e-3)


def test_draws_of_a_track_do_not_depend_on_the_others():
    state = np.random.default_rng(0).normal(0.0, 2.0, (3, 4, 500))
    habits, motion = (5.0, 0.0, 0.1, 0.2), (4.0, 0.1, 0.04, 0.02)
    many, one = Clouds(state, habits=habits), Clouds(state[2:], habits=habits)
    one.keys = many.keys[2:].copy()
    for _ in range(3):
        many.predict(motion=motion)
        one.predict(motion=motion)
    np.testing.assert_array_equal(many.state[2], one.state[0])
    assert np.unique(many.state[:, 0] - state[:, 0]).size > 1400


def test_nothing_moves_when_time_stands_still():
    for kind in (CONTROLS, STRAIGHT):
        clouds = Clouds(np.random.default_rng(0).normal(size=(2, 4, 100)))
        before = clouds.state.copy()
        clouds.predict(0.0, motion=(4.0, 1.0, 1.0, 1.0), kind=kind)
        np.testing.assert_array_equal(clouds.state, before)
        assert not clouds.depth.any()


@pytest.mark.parametrize(("n", "stride"), [(50, 1), (124, 1), (403, 3), (1000, 8), (9001, 8)])
def test_spread_is_that_of_every_eighth_particle_or_of_enough(n, stride):
    g = np.random.default_rng(1)
    state = g.normal(3.0, 5.0, (4, n)).astype(np.float32)
    weights = g.random(n).astype(np.float32)
    mean, cov = np.empty(4), np.empty((4, 4))
    spread(state, weights, mean, cov)
    own, w = state[:, ::stride].astype(float), weights[::stride].astype(float)
    np.testing.assert_allclose(mean, own @ w / w.sum(), rtol=1e-6)
    np.testing.assert_allclose(cov, np.cov(own, aweights=w, ddof=0), rtol=1e-6)
    weights[::stride] = 0.0
    spread(state, weights, mean, cov)
    assert not mean.any()
    assert not cov.any()


# ---------------------------------------------------------------- straight on


def white_acceleration(dt, q):
    F = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    Q = q * q * np.kron([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]], np.eye(2))
    return F, Q


def test_what_all_particles_share_grows_by_the_closed_form():
    g = np.random.default_rng(2)
    clouds = Clouds(np.zeros((2, 4, 64)))
    root = g.normal(size=(2, 2))
    clouds.rests[1, 2:, 2:] = root @ root.T
    before = clouds.rests.copy()
    clouds.predict(1.7, kind=STRAIGHT, q=0.8)
    F, Q = white_acceleration(1.7, 0.8)
    np.testing.assert_allclose(clouds.rests, F @ before @ F.T + Q, atol=1e-12)


def test_particles_and_what_they_share_have_the_exact_covariance_after_steps_of_any_length():
    n = 100_000
    g = np.random.default_rng(3)
    P = np.diag([4.0, 1.0, 0.5, 2.0])
    P[0, 2] = P[2, 0] = 0.8
    state = g.multivariate_normal([1.0, 2.0, 3.0, -1.0], P, n).T
    clouds = Clouds(state[None])
    m, P = state.mean(axis=1), np.cov(state)
    for dt in (1.0, 0.25, 2.0, 0.0, 1.5):
        F, Q = white_acceleration(dt, 0.7)
        m, P = F @ m, F @ P @ F.T + Q
        clouds.predict(dt, kind=STRAIGHT, q=0.7)
        row = clouds.settle(whole=False)[0]
        particles = clouds.state[0].astype(float)
        both = np.cov(particles) + clouds.rests[0]
        np.testing.assert_allclose(particles.mean(axis=1), m, atol=0.03)
        np.testing.assert_allclose(both, P, atol=0.015 * P.max())
        np.testing.assert_allclose(row[4:8].reshape(2, 2), P[:2, :2], atol=0.015 * P.max())


# ---------------------------------------------------------------- streets


def built(raster, x, y):
    blocked, (west, south, per_metre) = raster
    column, row = np.floor((x - west) * per_metre), np.floor((y - south) * per_metre)
    inside = (row >= 0) & (row < blocked.shape[0]) & (column >= 0) & (column < blocked.shape[1])
    row, column = np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)
    return inside & (blocked[row, column] != 0)


@given(
    st.integers(0, 10_000),
    st.floats(0.0, 1.0),
    st.floats(0.1, 5.0),
    st.floats(0.2, 3.0),
    st.sampled_from([CONTROLS, STRAIGHT]),
)
@settings(max_examples=150, deadline=None)
def test_nobody_drives_from_free_ground_into_a_building(seed, density, dt, per_metre, kind):
    """And who stays inside loses weight, nobody else."""
    g = np.random.default_rng(seed)
    blocked = (g.random((12, 17)) < density).astype(np.uint8)
    raster = blocked, np.array([-3.0, 5.0, per_metre])
    n = 200
    state = np.empty((1, 4, n), np.float32)
    state[0, :2] = g.uniform(-5.0, 25.0, (2, n)) / per_metre
    state[0, 2:] = g.normal(0.0, 6.0, (2, n))
    clouds = Clouds(state, habits=(10.0, 0.1, 0.3, 0.5))
    clouds.origins[0] = -3.0, 5.0
    level = clouds.logs.copy()
    before = built(raster, *(clouds.origins[0][:, None] + clouds.state[0, :2]))
    speed = np.hypot(*clouds.state[0, 2:])
    clouds.predict(dt, motion=(20.0, 0.3, 0.1, 0.1), kind=kind, raster=raster)
    after = built(raster, *(clouds.origins[0][:, None] + clouds.state[0, :2]))
    assert not (after & ~before).any()
    np.testing.assert_array_equal(
        clouds.logs, level + np.where(before & after, np.float32(math.log(0.3)), np.float32(0.0))
    )
    if kind == STRAIGHT:
        np.testing.assert_allclose(np.hypot(*clouds.state[0, 2:]), speed, rtol=1e-5)


def test_at_a_wall_half_turn_to_each_side_and_in_a_blind_alley_they_turn_round():
    """60 degrees are the least turn that keeps them out of the wall 2 m ahead."""
    blocked = np.zeros((40, 40), np.uint8)
    blocked[20:] = 1
    raster = blocked, np.array([0.0, 0.0, 1.0])
    state = np.zeros((1, 4, 100), np.float32)
    state[0, 3] = 3.0
    clouds = Clouds(state)
    clouds.origins[0] = 20.0, 18.0
    clouds.predict(kind=STRAIGHT, raster=raster)
    aside, on = 3.0 * math.sin(math.radians(60.0)), 1.5
    np.testing.assert_allclose(
        np.unique(clouds.state[0], axis=1).T,
        [[-aside, on, -aside, on], [aside, on, aside, on]],
        atol=1e-6,
    )
    assert (clouds.state[0, 2] > 0.0).sum() == 50
    blocked[:, :18] = blocked[:, 22:] = 1
    clouds = Clouds(state)
    clouds.origins[0] = 20.0, 18.0
    clouds.predict(kind=STRAIGHT, raster=raster)
    assert np.unique(clouds.state[0], axis=1).T.tolist() == [[0.0, 0.0, 0.0, -3.0]]


# ---------------------------------------------------------------- learning

LEAST = np.array([0.05, 0.05])


def learned(velocities, seen=None, variance=0.0, memory=10.0, dt=1.0):
    """Habits after each of a row of velocities."""
    habits, spans = np.array([[0.0, 0.0, 0.15, 0.1]]), np.zeros((1, 6))
    spans[0, 1:3] = velocities[0]
    spans[0, 4:] = 0.15**2, 0.1**2
    out = []
    for k, velocity in enumerate(velocities[1:]):
        sure = np.array([seen is None or seen[k]])
        cov = variance * np.eye(4)[None]
        learn(habits, spans, np.array([velocity], float), cov, sure, 1, dt, LEAST, memory)
        out.append(habits[0].copy())
    return np.array(out)


def course_to_velocity(course, speed=5.0):
    return np.column_stack([speed * np.cos(course), speed * np.sin(course)])


@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_a_circle_is_learned(rate):
    habits = learned(course_to_velocity(rate * np.arange(60)))
    assert habits[-1, 1] == pytest.approx(rate, rel=0.02)
    assert abs(habits[0, 1]) < 0.01
    assert (np.diff(np.abs(habits[:, 1])) > -1e-6).all()


def test_a_straight_drive_trusts_no_turn():
    g = np.random.default_rng(4)
    noise = 0.15
    rates = []
    for _ in range(20):
        habits = learned(course_to_velocity(g.normal(0.0, noise, 60)))
        rates += np.abs(habits[20:, 1]).tolist()
    assert np.median(rates) < 1e-3
    assert max(rates) < 0.1 * noise


def test_a_turn_is_forgotten_unseen_and_after_it_has_ended():
    circle = 0.3 * np.arange(60)
    hidden = np.r_[np.ones(59, bool), np.zeros(40, bool)]
    unseen = learned(course_to_velocity(np.r_[circle, np.full(40, circle[-1])]), seen=hidden)
    assert abs(unseen[-1, 1]) < 0.01
    ended = learned(course_to_velocity(np.r_[circle, np.full(40, circle[-1])]))
    assert abs(ended[-1, 1]) < 0.01


@pytest.mark.parametrize("dt", [0.5, 1.0])
def test_the_noises_of_random_walks_are_learned(dt):
    g = np.random.default_rng(5)
    steps = 4000
    course = np.cumsum(g.normal(0.0, 0.2 * math.sqrt(dt), steps))
    speed = np.abs(20.0 + np.cumsum(g.normal(0.0, 0.3 * math.sqrt(dt), steps)))
    habits = learned(course_to_velocity(course, np.maximum(speed, 1.0)), memory=200.0, dt=dt)
    late = habits[steps // 4 :]
    assert math.sqrt((late[:, 2] ** 2).mean()) == pytest.approx(0.2, rel=0.1)
    assert math.sqrt((late[:, 3] ** 2).mean()) == pytest.approx(0.3, rel=0.1)
    assert abs(late[:, 1]).max() < 0.02


def test_what_the_estimates_do_not_know_is_no_motion():
    """Changes of the mean velocity that its own variance explains leave the least noises."""
    g = np.random.default_rng(6)
    velocities = g.normal([5.0, 0.0], 0.8, (200, 2))
    unaware, aware = learned(velocities), learned(velocities, variance=2.5 * 0.8**2)
    assert aware[60:, 2].mean() < 0.5 * unaware[60:, 2].mean()
    assert aware[60:, 3].mean() < 0.5 * unaware[60:, 3].mean()
    assert (aware[:, 2:] >= LEAST).all()


def test_the_fastest_is_kept_for_about_a_minute_and_nothing_else_without_memory():
    speeds = np.r_[20.0, np.full(120, 2.0)]
    habits = learned(course_to_velocity(0.3 * np.arange(121), speeds), memory=0.0)
    assert habits[0, 0] == pytest.approx(2.0)
    habits = learned(course_to_velocity(0.3 * np.arange(122), np.r_[2.0, speeds]), memory=0.0)
    assert habits[0, 0] == pytest.approx(20.0)
    assert habits[60, 0] == pytest.approx(2.0 + 18.0 / math.e, rel=0.02)
    np.testing.assert_array_equal(habits[:, 1:], np.tile([0.0, 0.15, 0.1], (121, 1)))
