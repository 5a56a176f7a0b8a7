"""The whole tracker against an exact Kalman filter, and late sightings against prompt ones."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from staniel.datatypes.belief import Sighting
from staniel.tracking import Tracker, TrackingConfig

SIGMA, NOISE = 1.5, 0.5
R = SIGMA**2 * np.eye(2)
RUNS = 60


def constant_velocity(**changes):
    """No false alarms and no gate to speak of: the exact filter knows of neither."""
    given = {"dynamics": "constant-velocity", "acceleration_noise": NOISE, "max_speed": 100.0}
    return TrackingConfig(**given | {"clutter_density": 1e-12, "gate": 20.0} | changes)


def motion_over(dt):
    F = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    return F, NOISE**2 * np.kron([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]], np.eye(2))


def drive(g, times):
    """States under white acceleration, straight until the third, when the track is born."""
    states = [np.array([0.0, 0.0, 8.0, 0.0])]
    for dt in np.diff(times):
        F, Q = motion_over(dt)
        kick = g.multivariate_normal(np.zeros(4), Q) if len(states) >= 3 else np.zeros(4)
        states.append(F @ states[-1] + kick)
    return np.array(states)


def see(time, place, reporter=0):
    return Sighting(float(time), place, R, reporter=reporter)


def born_of(times, places):
    """Least squares of the first three sightings, with a weak prior on the velocity."""
    A = np.column_stack([np.ones(3), times[:3] - times[2]])
    P = np.linalg.inv(A.T @ A / SIGMA**2 + np.diag([0.0, 1.0 / 50.0**2]))
    return (P @ A.T @ places[:3] / SIGMA**2).ravel(), np.kron(P, np.eye(2))


def against_kalman(seed, times, looks, **changes):
    """Per step: differences of the means, both covariances, squared errors over covariance."""
    g = np.random.default_rng(seed)
    states = drive(g, times)
    tracker = Tracker(constant_velocity(**changes), rng=seed)
    places = states[:, :2] + g.normal(0.0, SIGMA, (len(times), 2))
    for time, place in zip(times[:3], places[:3], strict=True):
        tracker.step(time, [see(time, place)])
    m, P = born_of(times, places)
    H, rows = np.eye(2, 4), []
    for k in range(3, len(times)):
        F, Q = motion_over(times[k] - times[k - 1])
        m, P = F @ m, F @ P @ F.T + Q
        seen = [places[k], *(states[k, :2] + g.normal(0.0, SIGMA, (3, 2)))][: looks[k % len(looks)]]
        for z in seen:
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            m, P = m + K @ (z - H @ m), (np.eye(4) - K @ H) @ P
        (track,) = tracker.step(times[k], [see(times[k], z, r) for r, z in enumerate(seen)])
        error = states[k, :2] - track.position
        nees = error @ np.linalg.solve(track.covariance, error)
        scale = np.sqrt(np.diag(P))
        off = (np.r_[track.position, track.velocity] - m) / scale
        rows.append([*off, np.trace(track.covariance) / np.trace(P[:2, :2]), nees])
    return np.array(rows)


@pytest.mark.parametrize(
    ("kernel", "particles", "most"), [(0.0, 5000, 0.06), (0.5, 1000, 0.08), (0.9, 5000, 0.06)]
)
def test_means_and_covariances_are_those_of_a_kalman_filter(kernel, particles, most):
    """Off by hundredths of a standard deviation, which is the particles' own noise."""
    rows = np.array(
        [
            against_kalman(seed, np.arange(30.0), [1], kernel=kernel, particles=particles)
            for seed in range(RUNS)
        ]
    )[:, 5:]
    assert math.sqrt((rows[:, :, :4] ** 2).mean()) < most
    assert abs(rows[:, :, :4].mean(axis=(0, 1))).max() < 0.015
    assert rows[:, :, 4].mean() == pytest.approx(1.0, abs=0.03)


def test_errors_are_as_great_as_the_covariance_says():
    """Steps of any length, none to four looks in each: the squared errors' means are chi-square."""
    times = np.r_[0.0, 1.0, 2.0, 2.0 + np.cumsum(np.tile([1.0, 0.5, 2.0, 0.25], 6))]
    rows = np.array([against_kalman(seed, times, [1, 4, 0, 2]) for seed in range(RUNS)])
    low, high = chi2.ppf([0.025, 0.975], 2 * RUNS) / RUNS
    for step in (8, 15, -1):
        assert low < rows[:, step, 5].mean() < high
    assert low < rows[:, :, 5].mean() < high
    assert math.sqrt((rows[:, 5:, :4] ** 2).mean()) < 0.12


# ---------------------------------------------------------------- late sightings


class StraightBack(Tracker):
    """Forgets the paths of its particles: late sightings meet them straight back."""

    def step(self, time, sightings, coverage=None):
        self._bank.depth[:] = 0
        return super().step(time, sightings, coverage)


def delayed(g, steps, share):
    """When each sighting arrives: some late, by up to 5 s, all by the end."""
    return [
        min(k + int(g.integers(1, 6)), steps - 1) if k > 7 and g.random() < share else k
        for k in range(steps)
    ]


def arrivals(arrival, k, places):
    return [see(j, places[j]) for j, when in enumerate(arrival) if when == k]


def test_out_of_sequence_ends_where_in_sequence_ends():
    """Half of the sightings up to 5 s late; ignoring them ends 0.4 standard deviations away."""
    off, wider = {"own paths": [], "straight back": [], "ignored": []}, []
    steps = 30
    for seed in range(40):
        g = np.random.default_rng(seed)
        places = drive(g, np.arange(steps))[:, :2] + g.normal(0.0, SIGMA, (steps, 2))
        arrival = delayed(g, steps, 0.5)
        ordered = Tracker(constant_velocity(), rng=seed)
        for k in range(steps):
            ordered.step(k, [see(k, places[k])])
        (exact,) = ordered.estimates
        kinds = {"own paths": Tracker, "straight back": StraightBack, "ignored": Tracker}
        for name, kind in kinds.items():
            tracker = kind(constant_velocity(), rng=seed)
            for k in range(steps):
                come = arrivals(arrival, k, places)
                come = [z for z in come if z.time == k] if name == "ignored" else come
                tracker.step(k, come)
            (track,) = tracker.estimates
            deviation = math.sqrt(exact.covariance[0, 0])
            off[name] += ((track.position - exact.position) / deviation).tolist()
            if name == "own paths":
                wider.append(np.trace(track.covariance) / np.trace(exact.covariance))
    scale = {name: math.sqrt(np.mean(np.square(values))) for name, values in off.items()}
    assert scale["own paths"] < 0.14
    assert scale["own paths"] < scale["straight back"] < 0.5 * scale["ignored"]
    assert np.mean(wider) == pytest.approx(1.0, abs=0.06)


def weave(steps):
    """At 8 m/s: 5 s straight, 5 s in a turn of 0.4 rad/s, and so on."""
    place, course, places = np.zeros(2), 0.0, []
    for i in range(20 * steps):
        if i % 20 == 0:
            places.append(place)
        course += 0.4 / 20.0 * (i % 200 > 100)
        place = place + 8.0 / 20.0 * np.array([math.cos(course), math.sin(course)])
    return np.array(places)


def test_of_a_turning_target_the_own_paths_are_worth_more_than_straight_back():
    """With learned motion and half of the sightings late; measured 13 m against 23 m."""
    truth, steps = weave(50), 50
    errors, names = {}, {}
    for kind in (Tracker, StraightBack):
        squares, known = [], 0
        for seed in range(20):
            g = np.random.default_rng(seed)
            places, arrival = truth + g.normal(0.0, SIGMA, (steps, 2)), delayed(g, steps, 0.5)
            tracker, seen = kind(rng=seed), set()
            for k in range(steps):
                tracks = tracker.step(k, arrivals(arrival, k, places))
                seen |= {track.id for track in tracks}
                if k > 9:
                    gaps = [math.dist(track.position, truth[k]) for track in tracks]
                    squares.append(min(gaps, default=60.0) ** 2)
            known += len(seen)
        errors[kind], names[kind] = math.sqrt(np.mean(squares)), known
    assert errors[Tracker] < 0.75 * errors[StraightBack]
    assert names[Tracker] < 0.75 * names[StraightBack]
