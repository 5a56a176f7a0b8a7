"""Looks in vain: where nothing was seen there is probably nothing; and calls that are refused."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.datatypes.belief import Pose, Sighting
from staniel.datatypes.equipment import Camera
from staniel.errors import StanielError
from staniel.tracking import CameraView, Coverage, Tracker, TrackingConfig

R = 2.25 * np.eye(2)
WORLD, NOWHERE = shapely.box(-1e4, -1e4, 1e4, 1e4), shapely.box(5e3, 5e3, 6e3, 6e3)


def see(time, place, covariance=R, reporter=0):
    return Sighting(float(time), np.asarray(place, float), covariance, reporter=reporter)


def straight(k):
    return np.array([2.0 * k, 10.0])


def driven(steps=10, seed=1, **config):
    tracker = Tracker(TrackingConfig(**config), rng=seed)
    g = np.random.default_rng(seed)
    for k in range(steps):
        tracker.step(k, [see(k, straight(k) + g.normal(0.0, 1.5, 2))])
    assert len(tracker.estimates) == 1
    return tracker


def odds(tracker):
    (track,) = tracker.estimates
    return track.existence / (1.0 - track.existence)


def everything(tracker):
    return [
        (t.id, t.time, t.existence, t.last_seen, t.position.tobytes(), t.velocity.tobytes(),
         t.covariance.tobytes(), tracker.particles(t.id).tobytes(), tracker.weights(t.id).tobytes())
        for t in tracker.estimates
    ]  # fmt: skip


# ---------------------------------------------------------------- existence


@pytest.mark.parametrize("probability", [0.0, 0.3, 0.9])
def test_a_look_at_everything_lowers_the_odds_by_a_miss(probability):
    tracker = driven()
    before = odds(tracker)
    tracker.step(10.0, [], [Coverage(None, WORLD, probability)])
    assert odds(tracker) / before == pytest.approx(1.0 - probability, rel=1e-4)
    before = odds(tracker)
    tracker.step(11.0, [], 2 * [Coverage(None, WORLD, probability)])
    assert odds(tracker) / before == pytest.approx((1.0 - probability) ** 2, rel=1e-4)


@pytest.mark.parametrize("looks", [[], [(None, NOWHERE, 0.9)], [(None, shapely.Polygon(), 0.9)]])
def test_a_look_at_nothing_leaves_the_odds_and_the_place(looks):
    told, plain = driven(), driven()
    before = odds(told)
    told.step(10.0, [], looks)
    plain.step(10.0, [])
    assert odds(told) == pytest.approx(before, rel=1e-4)
    assert odds(plain) == pytest.approx(before * (1.0 - 0.9 * 0.3), rel=1e-4)
    np.testing.assert_array_equal(told.estimates[0].position, plain.estimates[0].position)


def test_a_track_that_was_seen_is_not_missed():
    told, plain = driven(), driven()
    told.step(10.0, [see(10, straight(10))], [(None, WORLD, 0.9)])
    plain.step(10.0, [see(10, straight(10))])
    assert everything(told) == everything(plain)


def test_the_odds_fall_by_the_share_of_the_particles_in_view():
    tracker, middle = driven(), None
    tracker.step(10.0, [])
    name = tracker.estimates[0].id
    copy = driven()
    copy.step(10.0, [])
    middle = float(tracker.estimates[0].position[0]) + 2.0
    before = odds(copy)
    copy.step(11.0, [], [(None, NOWHERE, 0.9)])
    share = copy.weights(name)[copy.particles(name)[:, 0] < middle].sum()
    tracker.step(11.0, [], [(None, shapely.box(-1e4, -1e4, middle, 1e4), 0.9)])
    assert 0.2 < share < 0.8
    assert odds(tracker) / before == pytest.approx(1.0 - 0.9 * share, rel=0.02)


# ---------------------------------------------------------------- place


def junction():
    """A street of 12 m from the south into one from west to east."""
    blocks = [(0, 0, 94, 80), (106, 0, 200, 80), (0, 92, 200, 120)]
    return City.from_outlines([shapely.box(*b) for b in blocks], [20.0] * 3, (200.0, 120.0))


def behind_the_junction(looks_at, seed, steps=10):
    """Seen until 10 m before the junction, then looked for in vain."""
    tracker = Tracker(rng=seed, chart=junction())
    g = np.random.default_rng(seed)
    for k in range(13):
        tracker.step(k, [see(k, np.array([100.0, 10.0 + 5.0 * k]) + g.normal(0.0, 1.0, 2))])
    for k in range(13, 13 + steps):
        looks = [(Pose(100.0, 60.0, 50.0, 0.0, 0.0, 20.0), looks_at, 0.9)]
        tracker.step(k, [], looks if k > 17 else None)
    (track,) = tracker.estimates
    return track.position


WEST, EAST = shapely.box(-1e3, -1e3, 99.9, 1e3), shapely.box(100.1, -1e3, 1e3, 1e3)


def test_a_look_in_vain_at_one_of_two_places_moves_the_estimate_to_the_other():
    for seed in range(5):
        nowhere = behind_the_junction(NOWHERE, seed)
        west, east = behind_the_junction(EAST, seed), behind_the_junction(WEST, seed)
        assert west[0] < min(nowhere[0], 100.0) - 8.0
        assert east[0] > max(nowhere[0], 100.0) + 8.0


@pytest.mark.parametrize("steps", [5, 10])
def test_a_polygon_and_a_callable_say_the_same(steps):
    box = behind_the_junction(WEST, 3, steps)
    np.testing.assert_array_equal(behind_the_junction(lambda p: p[:, 0] < 99.9, 3, steps), box)


def test_holes_and_parts_of_polygons_count():
    ring = shapely.Polygon(WORLD.exterior.coords, [shapely.box(-200, -200, 200, 200).exterior])
    parts = shapely.MultiPolygon([NOWHERE, shapely.box(-200, -200, 200, 200)])
    for visible, factor in ((ring, 1.0), (parts, 0.1)):
        tracker = driven()
        before = odds(tracker)
        tracker.step(10.0, [], [(None, visible, 0.9)])
        assert odds(tracker) / before == pytest.approx(factor, rel=1e-4)


def test_a_look_shows_where_the_particles_were_then():
    """At 30 m/s the place of 3 s ago is far from that of now."""
    for time, factor in ((None, 1.0), (9.0, 0.1), (10.0, 0.1), (12.0, 1.0)):
        tracker = Tracker(rng=1)
        for k in range(12):
            tracker.step(k, [see(k, [20.0 * k, 0.0])])
        before = odds(tracker)
        strip = shapely.box(160.0, -50.0, 220.0, 50.0)
        tracker.step(12.0, [], [Coverage(None, strip, 0.9, time)])
        assert odds(tracker) / before == pytest.approx(factor, rel=0.05)


def test_plain_tuples_do():
    named, plain = driven(), driven()
    pose = Pose(0.0, 0.0, 50.0, 0.0, 0.0, 20.0)
    named.step(10.0, [], [Coverage(pose, shapely.box(0, 0, 20, 50), 0.8, 9.5)])
    plain.step(10.0, [], [(pose, shapely.box(0, 0, 20, 50), 0.8, 9.5)])
    assert everything(named) == everything(plain)


# ---------------------------------------------------------------- refusals

BOX = shapely.box(0, 0, 20, 20)
BOW = shapely.Polygon([(0, 0), (10, 10), (10, 0), (0, 10)])
BAD_LOOKS = [
    ((None, BOX, 1.0), "detection_probability = 1.0: expected"),
    ((None, BOX, -0.1), "detection_probability = -0.1: expected"),
    ((None, BOX, math.nan), "detection_probability = nan: expected"),
    ((None, BOX, "0.9"), "detection_probability"),
    ((None, BOX, None), "detection_probability"),
    ((None, "west", 0.9), "visible is a str: expected"),
    ((None, None, 0.9), "visible is a NoneType: expected"),
    ((None, BOW, 0.9), "expected a valid polygon, found Self-intersection"),
    ((None, BOX), r"expected \(pose, visible polygon, detection probability\)"),
    (BOX, r"expected \(pose, visible polygon, detection probability\), got Polygon"),
    (7, r"expected \(pose, visible polygon, detection probability\), got int"),
    ((None, BOX, 0.9, 99.0), "time = 99.0: expected 10, the step's, or earlier"),
    ((None, BOX, 0.9, math.nan), "time = nan: expected"),
]


@pytest.mark.parametrize(("look", "words"), BAD_LOOKS, ids=[words for _, words in BAD_LOOKS])
def test_bad_looks_are_refused_by_number_and_field(look, words):
    tracker = driven()
    with pytest.raises(StanielError, match=r"coverage\[1\].*" + words):
        tracker.step(10.0, [], [(None, BOX, 0.5), look])


def bad_calls(now):
    """Arguments of `step` that are refused at `now`, the last step's time."""
    good, next_ = [see(now + 0.5, straight(now), reporter=4)], now + 1.0
    yield math.nan, good, None
    yield math.inf, good, None
    yield now - 0.5, [], None
    yield -1e9, [], [(None, WORLD, 0.9)]
    yield next_, [*good, see(next_ + 1.0, [0.0, 0.0])], None
    yield next_, [*good, see(next_, [1e200, 0.0])], None
    yield next_, [*good, see(next_, [0.0, 0.0], 1e20 * np.eye(2))], None
    for look, _ in BAD_LOOKS:
        bad = (None, BOX, 0.9, now + 99.0) if isinstance(look, tuple) and len(look) == 4 else look
        yield next_, good, [(None, WORLD, 0.9), bad]


KINDS = len(list(bad_calls(0.0)))


@given(
    st.lists(
        st.tuples(
            st.lists(st.integers(0, KINDS - 1), max_size=3),
            st.booleans(),
            st.sampled_from([None, WORLD, NOWHERE]),
        ),
        min_size=1,
        max_size=6,
    )
)
@settings(max_examples=60, deadline=None)
def test_after_refused_calls_a_good_one_gives_the_bytes_that_it_would_have_given(steps):
    tried, plain = (driven(8, particles=100) for _ in range(2))
    for k, (kinds, visible, looked_at) in enumerate(steps, start=8):
        for kind in kinds:
            before = everything(tried)
            with pytest.raises(StanielError, match="expected"):
                tried.step(*list(bad_calls(k - 1.0))[kind])
            assert everything(tried) == before
        sightings = [see(k, straight(k))] if visible else []
        looks = None if looked_at is None else [(None, looked_at, 0.9)]
        for tracker in (tried, plain):
            tracker.step(float(k), sightings, looks)
        assert everything(tried) == everything(plain)


# ---------------------------------------------------------------- a camera


@pytest.mark.parametrize("seed", range(4))
def test_a_camera_says_of_all_clouds_at_once_what_it_says_of_each_place(seed):
    city, rng = City.generate(size=(300.0, 300.0), seed=seed), np.random.default_rng(seed)
    trackers = [Tracker(rng=seed), Tracker(rng=seed)]
    places = rng.uniform(50.0, 250.0, (4, 2))
    for k in range(6):
        for tracker in trackers:
            tracker.step(k, [see(k, place) for place in places])
    assert len(trackers[0].estimates) >= 3
    for k in range(6, 12):
        pose = Pose(*rng.uniform(50.0, 250.0, 2), 70.0, rng.uniform(-3.0, 3.0), 0.3, 15.0)
        view = CameraView.of(city, Camera(), pose, (math.nan, math.nan))
        looks = [Coverage(pose, view, 0.9)], [Coverage(pose, lambda p, v=view: v(p), 0.9)]
        for tracker, coverage in zip(trackers, looks, strict=True):
            tracker.step(k, [see(k, places[0])], coverage)
        assert everything(trackers[0]) == everything(trackers[1])
