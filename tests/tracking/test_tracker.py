"""The tracker at its door, on simulated sightings."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.datatypes.belief import Sighting, TrackId
from staniel.errors import StanielError
from staniel.tracking import Tracker, TrackingConfig

SIGMA = 1.5
R = SIGMA**2 * np.eye(2)


def see(time, place, reporter=0, covariance=R):
    return Sighting(float(time), np.asarray(place, float), covariance, reporter=reporter)


def noisy(g, time, place, reporter=0):
    return see(time, np.asarray(place) + g.normal(0.0, SIGMA, 2), reporter)


def drive(tracker, steps, place_of, seed=0, first=0):
    """Feed one noisy sighting a step of a target at place_of(k); returns all estimates."""
    g = np.random.default_rng(seed)
    return [tracker.step(k, [noisy(g, k, place_of(k))]) for k in range(first, first + steps)]


def straight(k):
    return np.array([2.0 * k, 10.0])


def wander(seed, steps):
    """A vehicle at 2 m/s: straight for 10 to 40 s, then a turn of about 90 degrees in 2 s."""
    g = np.random.default_rng(seed)
    place, course, left, rate, out = np.zeros(2), 0.0, 20.0, 0.0, []
    for i in range(10 * steps):
        if left <= 0.0:
            turning = rate == 0.0
            left = 2.0 if turning else g.uniform(10.0, 40.0)
            rate = g.choice([-1.0, 1.0]) * g.uniform(0.6, 0.9) if turning else 0.0
        course += 0.1 * rate
        left -= 0.1
        place = place + 0.2 * np.array([math.cos(course), math.sin(course)])
        if i % 10 == 9:
            out.append(place)
    return np.array(out)


def bytes_of(estimates):
    return [
        (t.id, t.time, t.existence, t.last_seen, t.position.tobytes(), t.velocity.tobytes())
        for t in estimates
    ]


# ---------------------------------------------------------------- births and deletions


def test_three_consistent_hits_start_exactly_one_track():
    tracker = Tracker(rng=1, founder=7)
    history = drive(tracker, 30, straight)
    assert [len(tracks) for tracks in history] == [0, 0] + [1] * 28
    assert history[-1][0].id == TrackId(2.0, 7, 1)
    assert str(history[-1][0].id) == "7-1"


def test_clutter_alone_starts_almost_nothing():
    g = np.random.default_rng(5)
    tracker = Tracker(rng=5)
    born = set()
    for k in range(600):
        clutter = [see(k, g.uniform(0.0, 600.0, 2)) for _ in range(g.poisson(0.4))]
        born |= {track.id for track in tracker.step(k, clutter)}
    assert len(born) <= 1


def test_deleted_after_the_unseen_limit_with_the_last_known_place():
    tracker = Tracker(rng=1)
    last = drive(tracker, 20, straight)[-1][0]
    for k in range(20, 36):
        (track,) = tracker.step(k, [])
        assert tracker.lost == []
        assert track.last_seen == 19.0
    assert tracker.step(36, []) == []
    (lost,) = tracker.lost
    assert lost.id == last.id
    assert lost.time == 19.0
    np.testing.assert_array_equal(lost.position, last.position)
    assert tracker.step(37, []) == []
    assert tracker.lost == []


def test_deleted_when_dispersed():
    tracker = Tracker(TrackingConfig(dispersion_limit=3.0), rng=1)
    drive(tracker, 10, straight)
    steps = 0
    while tracker.estimates:
        tracker.step(10 + steps, [])
        steps += 1
    assert 1 < steps < 10
    assert len(tracker.lost) == 1


def test_existence_falls_unseen_and_recovers():
    tracker = Tracker(rng=1)
    drive(tracker, 20, straight)
    values = [tracker.step(k, [])[0].existence for k in range(20, 33)]
    assert all(a > b for a, b in itertools.pairwise(values))
    # Bayes' rule by hand: each miss multiplies the odds by 1 - P_D P_V.
    odds = 999.0 * (1.0 - 0.9 * 0.3) ** 13
    assert values[-1] == pytest.approx(odds / (1.0 + odds), rel=1e-6)
    (track,) = tracker.step(33, [see(33, straight(33))])
    assert track.existence > values[-1]


# ---------------------------------------------------------------- accuracy


def test_a_wandering_target_with_misses_and_gaps():
    squares, errors_after_gap, names, reacquired = [], [], set(), 0
    for seed in range(10):
        g = np.random.default_rng(100 + seed)
        truth = wander(seed, 600)
        tracker = Tracker(rng=seed)
        hidden = np.zeros(600, bool)
        for start in range(40, 560, 60):
            hidden[start : start + 10] = True
        for k in range(600):
            seen = not hidden[k] and g.random() < 0.9
            tracks = tracker.step(k, [noisy(g, k, truth[k])] if seen else [])
            if k < 5:
                continue
            names |= {(seed, track.id) for track in tracks}
            errors = [np.hypot(*(track.position - truth[k])) for track in tracks]
            if k > 10 and not hidden[k - 3 : k + 1].any():
                squares.append(min(errors) ** 2)
            if hidden[k] and (k + 1) % 60 == 50:
                errors_after_gap.append(min(errors))
            reacquired += k % 60 == 53 and min(errors) < 5.0
    assert math.sqrt(np.mean(squares)) < SIGMA * math.sqrt(2.0) * 0.85
    assert np.median(errors_after_gap) < 10.0
    assert reacquired >= 84
    assert len(names) <= 12


def kalman(sightings, q, start_mean, start_covariance):
    """Exact filter of constant velocity with diffusing position."""
    F = np.kron([[1.0, 1.0], [0.0, 1.0]], np.eye(2))
    Q = np.diag([q, q, 0.0, 0.0])
    H = np.eye(2, 4)
    m, P = start_mean, start_covariance
    for z in sightings:
        m, P = F @ m, F @ P @ F.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        m, P = m + K @ (z - H @ m), (np.eye(4) - K @ H) @ P
        yield m, P


def test_linear_gaussian_case_against_a_kalman_filter():
    """With only diffusion the motion is linear: the mean is the exact one within its error."""
    config = TrackingConfig(
        particles=50_000, max_speed=100.0, turn_noise=0.0, speed_noise=0.0, diffusion=0.7,
        turn_rate=0.0, restart_rate=0.0, roughening=0.0, clutter_density=1e-12, gate=20.0,
    )  # fmt: skip
    g = np.random.default_rng(0)
    tracker = Tracker(config, rng=0)
    for k in range(3):
        tracker.step(k, [see(k, straight(k))])
    (name,) = [track.id for track in tracker.estimates]
    cloud = tracker.particles(name)
    zs = [straight(k) + g.normal(0.0, SIGMA, 2) for k in range(3, 15)]
    exact = kalman(zs, 0.49, cloud.mean(axis=0), np.cov(cloud.T))
    for k, (z, (m, P)) in enumerate(zip(zs, exact, strict=True), start=3):
        (track,) = tracker.step(k, [see(k, z)])
        np.testing.assert_allclose(track.position, m[:2], atol=0.06)
        np.testing.assert_allclose(track.velocity, m[2:], atol=0.06)
        np.testing.assert_allclose(track.covariance, P[:2, :2], atol=0.08)


def test_crossing_targets_keep_their_identities():
    kept = 0
    for seed in range(20):
        g = np.random.default_rng(seed)
        tracker = Tracker(rng=seed)
        for k in range(60):
            a, b = np.array([2.0 * k, 0.0]), np.array([60.0, 2.0 * k - 60.0])
            sightings = [noisy(g, k, p) for p in (a, b) if g.random() < 0.9]
            tracks = tracker.step(k, sightings)
            if k == 8:
                names = [min(tracks, key=lambda t: math.dist(t.position, p)).id for p in (a, b)]
        places = {track.id: track.position for track in tracks}
        kept += all(
            name in places and math.dist(places[name], p) < 6.0
            for name, p in zip(names, (a, b), strict=True)
        )
    assert kept >= 15


def test_false_alarms_beside_a_target_do_not_destroy_its_track():
    g = np.random.default_rng(2)
    tracker = Tracker(rng=2)
    drive(tracker, 10, straight)
    for k in range(10, 40):
        alarm = straight(k) + 5.0 * np.array([math.cos(k), math.sin(k)])
        sightings = [noisy(g, k, straight(k))] if k % 3 else []
        tracks = tracker.step(k, [*sightings, see(k, alarm)] if k % 2 else sightings)
    assert math.dist(tracks[0].position, straight(39)) < 4.0
    assert len(tracks) == 1


# ---------------------------------------------------------------- late, repeated, several


def test_late_sightings_help_and_too_late_ones_do_nothing():
    late, dead = Tracker(rng=4), Tracker(rng=4)
    drive(late, 15, straight)
    drive(dead, 15, straight)
    g = np.random.default_rng(9)
    for k in range(15, 30):
        dead.step(k, [])
        late.step(k, [noisy(g, k - 1, straight(k - 1), reporter=3)])
    assert late.estimates[0].last_seen == 28.0
    assert math.dist(late.estimates[0].position, straight(29)) < 3.0
    before = bytes_of(late.step(30, [see(24, straight(24), reporter=5)]))
    other = Tracker(rng=4)
    drive(other, 15, straight)
    g = np.random.default_rng(9)
    for k in range(15, 30):
        other.step(k, [noisy(g, k - 1, straight(k - 1), reporter=3)])
    assert bytes_of(other.step(30, [])) == before


def test_copies_and_order_do_not_matter():
    g = np.random.default_rng(1)
    plain, repeated = Tracker(rng=4), Tracker(rng=4)
    old = []
    for k in range(20):
        fresh = [noisy(g, k, straight(k), reporter) for reporter in range(3)]
        one = plain.step(k, fresh)
        two = repeated.step(k, [*old, *reversed(fresh), *fresh])
        assert bytes_of(one) == bytes_of(two)
        old = fresh


def test_looks_of_several_reporters_sharpen():
    spreads = []
    for reporters in (1, 4):
        g = np.random.default_rng(1)
        tracker = Tracker(rng=4)
        for k in range(30):
            tracks = tracker.step(k, [noisy(g, k, straight(k), r) for r in range(reporters)])
        assert len(tracks) == 1
        spreads.append(np.trace(tracks[0].covariance))
    assert spreads[1] < 0.6 * spreads[0]


def test_doubles_merge_into_the_older_name():
    tracker = Tracker(TrackingConfig(birth_distance=0.0), rng=3)
    for k in range(6):
        a, b = np.array([2.0 * k, 12.0]), np.array([2.0 * k, 0.0])
        names = [t.id for t in tracker.step(k, [see(k, a), see(k, b)])]
    assert len(names) == 2
    merged = []
    for k in range(6, 40):
        gap = max(0.0, 12.0 - 0.5 * (k - 6))
        sides = [np.array([2.0 * k, gap]), np.array([2.0 * k, 0.0])]
        tracks = tracker.step(k, [see(k, side, r) for r, side in enumerate(sides)])
        merged += tracker.merged
    assert [t.id for t in tracks] == [min(names)]
    assert merged == [(max(names), min(names))]


def test_two_targets_side_by_side_in_one_look_stay_two():
    g = np.random.default_rng(0)
    tracker = Tracker(rng=0)
    for k in range(60):
        gap = max(2.5, 20.0 - k)
        places = [np.array([2.0 * k, 0.0]), np.array([2.0 * k, gap])]
        tracks = tracker.step(k, [see(k, p + g.normal(0.0, 0.5, 2)) for p in places])
    assert len(tracks) == 2


# ---------------------------------------------------------------- names, particles, randomness


def test_who_owns_a_sighting_in_whatever_order_they_come():
    tracker, g = Tracker(rng=5), np.random.default_rng(3)
    places = [np.array([100.0 * i, 50.0]) for i in range(4)]
    for k in range(8):
        sightings = [noisy(g, k, place, reporter=r) for place in places for r in range(2)]
        sightings = [sightings[i] for i in g.permutation(len(sightings))]
        tracks = tracker.step(k, sightings)
    assert len(tracks) == 4
    for sighting in sightings:
        nearest = min(tracks, key=lambda track: math.dist(track.position, sighting.position))
        assert tracker.owner_of(sighting) == nearest.id
    assert tracker.owner_of(see(k, [0.0, 900.0])) is None
    tracker.rename(nearest.id, TrackId(-1.0, 9, 9))
    assert tracker.owner_of(sightings[-1]) == TrackId(-1.0, 9, 9)


def test_rename():
    tracker = Tracker(rng=1)
    for k in range(5):
        tracker.step(k, [see(k, straight(k)), see(k, straight(k) + 100.0)])
    a, b = (track.id for track in tracker.estimates)
    new = TrackId(0.5, 9, 4)
    tracker.rename(a, new)
    assert [t.id for t in tracker.estimates] == [new, b]
    with pytest.raises(StanielError, match="another live track"):
        tracker.rename(b, new)
    with pytest.raises(StanielError, match="no live track"):
        tracker.rename(a, TrackId(0.0, 1, 1))
    tracker.rename(b, b)
    for k in range(5, 30):
        tracker.step(k, [])
        if tracker.lost:
            assert [t.id for t in tracker.lost] == [new, b]


def test_particles_and_weights_are_where_the_estimate_is():
    tracker = Tracker(rng=1)
    far = np.array([500_000.0, 4_600_000.0])
    drive(tracker, 10, lambda k: far + straight(k))
    (track,) = tracker.estimates
    cloud, weights = tracker.particles(track.id), tracker.weights(track.id)
    assert cloud.shape == (1000, 4)
    assert weights.sum() == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(weights @ cloud[:, :2], track.position, atol=0.7)
    assert math.dist(track.position, far + straight(9)) < 4.0


def test_same_seed_same_bytes():
    histories = []
    for rng in (3, 3, 4, np.random.default_rng(8), np.random.default_rng(8)):
        tracker = Tracker(rng=rng)
        histories.append([bytes_of(tracks) for tracks in drive(tracker, 30, straight)])
    assert histories[0] == histories[1] != histories[2]
    assert histories[3] == histories[4]


def test_more_tracks_than_the_first_arrays_hold():
    g = np.random.default_rng(0)
    places = np.array([[100.0 * i, 100.0 * j] for i in range(5) for j in range(4)])
    tracker = Tracker(TrackingConfig(particles=100), rng=0)
    for k in range(12):
        tracks = tracker.step(k, [noisy(g, k, p) for p in places])
    assert len(tracks) == 20
    error = [min(math.dist(t.position, p) for t in tracks) for p in places]
    assert max(error) < 5.0


# ---------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("time", "sightings"),
    [
        (3.0, []),
        (math.nan, []),
        (math.inf, []),
        (10.0, [see(12.0, [0.0, 0.0])]),
        (10.0, [see(10.0, [1e200, 0.0])]),
        (10.0, [see(10.0, [0.0, 0.0], covariance=1e20 * np.eye(2))]),
    ],
)
def test_a_rejected_call_changes_nothing(time, sightings):
    tried, plain = Tracker(rng=1), Tracker(rng=1)
    for tracker in (tried, plain):
        drive(tracker, 10, straight)
    before = bytes_of(tried.estimates)
    with pytest.raises(ValueError, match="expected"):
        tried.step(time, [see(9.5, [20.0, 10.0]), *sightings] if sightings else [])
    assert bytes_of(tried.estimates) == before
    good = [see(10, straight(10))]
    assert bytes_of(tried.step(10, good)) == bytes_of(plain.step(10, good))


def test_time_may_stand_still():
    tracker = Tracker(rng=1)
    drive(tracker, 10, straight)
    for _ in range(40):
        tracks = tracker.step(9, [])
    assert len(tracks) == 1


def test_thousands_of_sightings_at_once():
    g = np.random.default_rng(0)
    tracker = Tracker(TrackingConfig(particles=200), rng=0)
    drive(tracker, 5, straight)
    crowd = [see(5, p) for p in g.uniform(-2000.0, 2000.0, (3000, 2))]
    tracks = tracker.step(5, [*crowd, see(5, straight(5))])
    assert len(tracks) == 1
    assert np.isfinite(tracks[0].position).all()


@given(
    st.lists(
        st.lists(
            st.tuples(
                st.floats(-50.0, 50.0),
                st.floats(-50.0, 50.0),
                st.floats(-5.0, 2.0),
                st.integers(0, 2),
            ),
            max_size=4,
        ),
        max_size=12,
    )
)
@settings(max_examples=60, deadline=None)
def test_whatever_is_seen_the_estimates_stay_sound(steps):
    tracker = Tracker(TrackingConfig(particles=64, confirmations=2), rng=0)
    for k, places in enumerate(steps):
        sightings = [see(k - r, [x, y], r, 10.0**power * np.eye(2)) for x, y, power, r in places]
        for track in tracker.step(k, sightings):
            assert np.isfinite([*track.position, *track.velocity]).all()
            assert np.linalg.eigvalsh(track.covariance).min() >= -1e-5
            assert 0.0 <= track.existence <= 1.0
            assert np.isfinite(tracker.weights(track.id)).all()
