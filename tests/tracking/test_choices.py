"""Every choice that the configuration offers: nothing that is seen or missed breaks a tracker."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.datatypes.belief import Sighting
from staniel.tracking import Tracker, TrackingConfig

DYNAMICS = ("random-controls", "learned", "constant-velocity")
RULES = ("nearest", "likeliest", "soft")
SCHEMES = ("systematic", "stratified", "multinomial", "residual")

configs = st.builds(
    TrackingConfig,
    particles=st.sampled_from([50, 51, 100]),
    confirmations=st.just(2),
    dynamics=st.sampled_from(DYNAMICS),
    association=st.sampled_from(RULES),
    resampling=st.sampled_from(SCHEMES),
    filter=st.sampled_from(["sir", "sis"]),
    kernel=st.sampled_from([0.0, 0.5, 0.99]),
    resample_below=st.sampled_from([0.0, 0.35, 1.0]),
    roughening=st.sampled_from([0.0, 0.15, 1.0]),
    unseen_limit=st.sampled_from([2, 17]),
    newcomers=st.sampled_from([1e-9, 1e-5]),
)
HOUSES = [shapely.box(10.0, 10.0, 40.0, 40.0), shapely.box(60.0, 10.0, 90.0, 90.0)]
CHART = City.from_outlines(HOUSES, [20.0, 20.0], (100.0, 100.0))

spot = st.tuples(
    st.floats(0.0, 100.0),
    st.floats(0.0, 100.0),
    st.floats(-5.0, 2.0),
    st.floats(0.0, 6.0),
    st.integers(0, 2),
)
view = st.one_of(
    st.none(),
    st.builds(
        lambda x, y, p, age: (shapely.box(x, y, x + 40.0, y + 40.0), p, age),
        st.floats(0.0, 60.0), st.floats(0.0, 60.0), st.floats(0.0, 0.99), st.floats(0.0, 6.0),
    ),
)  # fmt: skip
one_step = st.tuples(st.sampled_from([0.0, 0.3, 1.0, 4.0]), st.lists(spot, max_size=4), view)


@given(configs, st.lists(one_step, max_size=12), st.booleans())
@settings(max_examples=150, deadline=None)
def test_whatever_is_seen_or_missed_the_estimates_stay_sound(config, steps, charted):
    tracker, now, known = Tracker(config, rng=0, chart=CHART if charted else None), 0.0, set()
    for dt, spots, seen in steps:
        now += dt
        sightings = [
            Sighting(now - age, [x, y], 10.0**power * np.eye(2), reporter=r)
            for x, y, power, age, r in spots
        ]
        looks = None if seen is None else [(None, seen[0], seen[1], now - seen[2])]
        tracks = tracker.step(now, sightings, looks)
        names = [track.id for track in tracks]
        assert len(set(names)) == len(names)
        assert set(tracker.returned) <= set(names) & known
        # Who is lost may be found again in the same step.
        assert {track.id for track in tracker.lost} & set(names) <= set(tracker.returned)
        known |= set(names)
        for track in tracks:
            assert np.isfinite([*track.position, *track.velocity]).all()
            assert np.linalg.eigvalsh(track.covariance).min() >= -1e-4 * np.trace(track.covariance)
            assert 0.0 <= track.existence <= 1.0
            weights, particles = tracker.weights(track.id), tracker.particles(track.id)
            assert weights.sum() == pytest.approx(1.0, abs=1e-4)
            assert np.isfinite(particles).all()


@pytest.mark.parametrize("dynamics", DYNAMICS)
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("kernel", [0.0, 0.5])
def test_every_choice_follows_a_target_and_a_neighbour(dynamics, rule, kernel):
    """Two 15 m apart that drive in parallel and wander a little, each missed now and then."""
    errors = []
    for seed in range(4):
        g = np.random.default_rng(seed)
        config = TrackingConfig(dynamics=dynamics, association=rule, kernel=kernel)
        tracker = Tracker(config, rng=seed)
        for k in range(40):
            places = [np.array([6.0 * k, y + 2.0 * math.sin(0.2 * k)]) for y in (0.0, 15.0)]
            tracks = tracker.step(
                k,
                [
                    Sighting(float(k), p + g.normal(0.0, 1.5, 2), 2.25 * np.eye(2), reporter=0)
                    for p in places
                    if g.random() < 0.9
                ],
            )
            if k > 20:
                assert len(tracks) == 2
                errors += [min(math.dist(t.position, p) for t in tracks) ** 2 for p in places]
    assert math.sqrt(np.mean(errors)) < 2.0
