"""What an agent knows of dangers: regions for good, carriers fused, widened, forgotten, told."""

import math
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from staniel.datatypes.belief import TrackEstimate, TrackId
from staniel.datatypes.risk import CarriedThreat, RiskConfig, RiskRegion
from staniel.datatypes.threats import NO_THREATS, Carrier, Threats
from staniel.errors import StanielError
from staniel.guidance import NO_DANGERS, Dangers, KnownDangers
from staniel.guidance.carriers import FORGET
from staniel.guidance.dangers import MOST_REGIONS, RETELL
from staniel.world import Hazards

BAN = RiskRegion(kind="no-fly", polygon=((0, 0), (100, 0), (100, 100)), briefed=False)
SOFT = RiskRegion(kind="threat", center=(60.0, 40.0), radius=50.0, rate=0.5, ceiling=100.0)
MORE = RiskRegion(kind="threat", center=(90.0, 40.0), radius=50.0, rate=2.0, floor=20.0)


def carrier(time, x, y=0.0, reporter=0, sigma=5.0, radius=60.0, rate=0.5):
    return Carrier(time, (x, y), sigma**2 * np.eye(2), radius, rate, reporter=reporter)


def heard(*carriers):
    return [Threats(carriers=(one,)) for one in carriers]


def track(x, y=0.0, existence=1.0, sigma=3.0):
    return TrackEstimate(
        TrackId(0.0, 0, 1), 0.0, np.array([x, y]), np.zeros(2), sigma**2 * np.eye(2), existence, 0.0
    )


def places_of(known, time):
    return known.at(time).carriers[:, :2]


# What is asked of them


def test_rates_and_bans_agree_with_the_exposure_of_flying_there():
    """A short way flown at each place, by what counts a flight's true exposure."""
    known = KnownDangers((BAN, SOFT, MORE)).at(0.0)
    places = np.random.default_rng(1).uniform((-20, -20, 0), (160, 120, 120), (400, 3))
    path = np.zeros((2, len(places), 6))
    path[0, :, :3] = path[1, :, :3] = places
    flown = Hazards(RiskConfig(regions=(BAN, SOFT, MORE))).exposure(path, np.zeros((2, 0, 4)), 1.0)
    np.testing.assert_allclose(known.rate(places), flown.risk, atol=1e-12)
    assert np.array_equal(known.forbidden(places), flown.no_fly > 0.0)
    assert set(known.rate(places).tolist()) == {0.0, 0.5, 2.0, 2.5}
    assert 0 < known.forbidden(places).sum() < 400
    assert known.no_fly == (BAN,)


def test_the_rate_of_a_carrier_is_its_expectation():
    known = KnownDangers()
    known.step(5.0, told=heard(carrier(5.0, 10.0, rate=2.0)))
    places = [[10.0, 0.0, 20.0], [65.0, 0.0, 20.0], [200.0, 0.0, 20.0], [10.0, 0.0, 60.1]]
    disc = math.sqrt(60.0**2 - 20.0**2)
    edge = 2.0 * stats.ncx2.cdf((disc / 5.0) ** 2, 2, (55.0 / 5.0) ** 2)
    assert known.at(5.0).rate(places) == pytest.approx([2.0, edge, 0.0, 0.0], abs=1e-5)
    # Later it may be elsewhere: 50 m or so after 12 s, at 4 m/s.
    sigma = math.sqrt(25.0 + 0.5 * 48.0**2)
    later = 2.0 * stats.ncx2.cdf((disc / sigma) ** 2, 2, 0.0)
    assert known.at(17.0).rate(places[:1]) == pytest.approx([later], abs=1e-5)


def test_nothing_known_costs_and_says_nothing():
    known = KnownDangers()
    assert known.step(0.0) is NO_THREATS
    assert known.at(0.0) is NO_DANGERS
    assert not NO_DANGERS
    assert NO_DANGERS.rate([[0.0, 0.0, 0.0]]).tolist() == [0.0]
    assert NO_DANGERS.forbidden([[0.0, 0.0, 0.0]]).tolist() == [False]
    assert NO_DANGERS.rate(np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize("places", [[0.0, 0.0, 0.0], [[0.0, 0.0]], [[0.0, math.nan, 0.0]]])
def test_places_that_are_none_are_refused(places):
    dangers = Dangers((BAN,))
    for ask in (dangers.rate, dangers.forbidden):
        with pytest.raises(ValueError, match=r"places: expected finite numbers \(n, 3\)"):
            ask(places)


# Regions


def test_regions_are_kept_for_good_and_once():
    known = KnownDangers((SOFT,))
    for time in range(3):
        known.step(float(time), Threats((BAN,)), [Threats((BAN, MORE)), Threats((SOFT,))])
    known.step(10_000.0)
    assert known.regions == known.at(10_000.0).regions == (SOFT, BAN, MORE)
    assert known.at(0.0).rate([[60.0, 40.0, 50.0]]).tolist() == [2.5]


def test_made_up_regions_do_not_fill_the_memory():
    known = KnownDangers([SOFT])
    for k in range(3):
        centers = [(10.0 * j, float(k)) for j in range(600)]
        told = tuple(SOFT.model_copy(update={"center": center}) for center in centers)
        known.step(float(k), told=[Threats(regions=told)])
    assert len(known.regions) == 1 + MOST_REGIONS
    assert known.regions[0] == SOFT


def test_a_region_is_told_again_and_again_by_who_noticed_it_and_by_nobody_else():
    finder, hearer = KnownDangers(), KnownDangers()
    said = {}
    for time in range(31):
        seen = Threats((BAN,)) if time < 3 else NO_THREATS
        news = finder.step(float(time), seen)
        said[time] = news.regions
        assert hearer.step(float(time), told=[news]) == NO_THREATS
    assert [time for time, regions in said.items() if regions == (BAN,)] == [0, 10, 20, 30]
    assert RETELL == 10.0
    assert hearer.regions == (BAN,)


# Carriers


def test_carriers_are_told_when_noticed_and_only_then():
    known, seen = KnownDangers(), Threats(carriers=(carrier(0.0, 0.0), carrier(0.0, 300.0)))
    assert known.step(0.0, seen) == seen
    assert known.step(1.0) == NO_THREATS
    assert known.step(2.0, told=[seen]) == NO_THREATS


def test_what_is_noticed_in_one_place_is_fused_as_the_exact_posterior_says():
    """Three aircraft at one instant: the product of Gaussians, weights one over the variances."""
    sigmas, xs = np.array([5.0, 10.0, 2.0]), np.array([0.0, 12.0, 3.0])
    looks = [
        carrier(0.0, x, reporter=k, sigma=s)
        for k, (x, s) in enumerate(zip(xs, sigmas, strict=True))
    ]
    wanted = np.average(xs, weights=sigmas**-2.0)
    for order in permutations(looks):
        known = KnownDangers()
        known.step(0.0, told=heard(*order))
        ((x, y, xx, xy, yy, radius, rate),) = known.at(0.0).carriers
        assert (x, y) == pytest.approx((wanted, 0.0))
        variance = 1.0 / np.sum(sigmas**-2.0)
        assert (xx, xy, yy, radius, rate) == pytest.approx((variance, 0.0, variance, 60.0, 0.5))


@settings(max_examples=60, deadline=None)
@given(st.permutations(range(8)), st.lists(st.integers(0, 7), max_size=8))
def test_copies_and_order_within_a_step_change_nothing(order, copies):
    rng = np.random.default_rng(4)
    looks = [carrier(float(k % 3), *rng.uniform(0, 120, 2), reporter=k % 4) for k in range(8)]
    plain, mixed = KnownDangers(), KnownDangers()
    plain.step(3.0, told=heard(*looks))
    mixed.step(3.0, told=heard(*[looks[k] for k in [*order, *copies]]))
    mixed.step(4.0, told=heard(*[looks[k] for k in copies]))
    plain.step(4.0)
    assert np.array_equal(plain.at(4.0).carriers, mixed.at(4.0).carriers)


def test_a_look_finds_as_many_carriers_as_it_has():
    """Two vehicles 4 m apart, noise 5 m: one look of both is two, and so is the next one."""
    known = KnownDangers()
    for time in range(5):
        pair = (carrier(float(time), 0.0), carrier(float(time), 4.0))
        known.step(float(time), Threats(carriers=pair))
        assert len(known.at(float(time)).carriers) == 2
    np.testing.assert_allclose(np.sort(places_of(known, 4.0)[:, 0]), [0.0, 4.0], atol=1e-9)


def test_a_driving_carrier_stays_one_and_its_covariance_is_honest():
    errors, counts = [], []
    for run in range(60):
        rng, known = np.random.default_rng(run), KnownDangers(speed=4.0)
        course = rng.uniform(-math.pi, math.pi)
        way = 2.0 * np.array([math.cos(course), math.sin(course)])
        for time in range(20):
            seen = carrier(float(time), *rng.normal(time * way, 10.0), sigma=10.0)
            known.step(float(time), Threats(carriers=(seen,)))
        rows = known.at(19.0).carriers
        counts.append(len(rows))
        covariance = np.array([[rows[0, 2], rows[0, 3]], [rows[0, 3], rows[0, 4]]])
        off = rows[0, :2] - 19.0 * way
        errors.append(off @ np.linalg.solve(covariance, off))
        assert rows[0, 2] < 0.5 * 10.0**2
    assert counts == [1] * 60
    # Squared error in its own covariance, two degrees of freedom: as told, or a little less sure.
    assert 1.0 < np.mean(errors) < 4.0


def test_what_is_too_far_to_have_been_driven_is_another():
    sigma = math.sqrt(25.0 + 25.0)
    for x, count in ((4.0 * 10.0 + 4.2 * sigma, 1), (4.0 * 10.0 + 4.4 * sigma, 2)):
        known = KnownDangers(speed=4.0)
        known.step(0.0, told=heard(carrier(0.0, 0.0)))
        known.step(10.0, told=heard(carrier(10.0, x)))
        assert len(known.at(10.0).carriers) == count


def test_late_news_does_not_overrule_newer():
    known = KnownDangers()
    known.step(5.0, told=heard(carrier(5.0, 0.0)))
    before = known.at(5.0).carriers
    known.step(6.0, told=heard(carrier(2.0, 8.0)))
    assert np.array_equal(known.at(5.0).carriers, before)
    # Of a carrier of which nothing newer is known it is news.
    known.step(7.0, told=heard(carrier(3.0, 500.0)))
    assert len(known.at(7.0).carriers) == 2


def test_a_carrier_is_forgotten_after_a_minute():
    known = KnownDangers()
    known.step(0.0, told=heard(carrier(0.0, 0.0)))
    known.step(FORGET)
    assert len(known.at(FORGET).carriers) == 1
    known.step(FORGET + 1.0)
    assert known.at(FORGET + 1.0) is NO_DANGERS
    known.step(FORGET + 2.0, told=heard(carrier(1.0, 0.0)))
    assert known.at(FORGET + 2.0) is NO_DANGERS


def test_a_carrier_from_the_future_is_refused_and_nothing_changes():
    known = KnownDangers()
    with pytest.raises(StanielError, match=r"carriers\[1\].time = 3: expected 2, the step's, or"):
        known.step(2.0, told=[Threats((BAN,), (carrier(2.0, 0.0),)), *heard(carrier(3.0, 0.0))])
    assert known.at(2.0) is NO_DANGERS


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((0.0, (0.0,), np.eye(2), 1.0, 1.0), r"Carrier.position has shape \(1,\): expected \(2,\)"),
        ((0.0, (0.0, math.inf), np.eye(2), 1.0, 1.0), "Carrier.position = .*: expected finite"),
        ((0.0, (0.0, 0.0), -np.eye(2), 1.0, 1.0), "Carrier.covariance = .*positive definite"),
        ((math.nan, (0.0, 0.0), np.eye(2), 1.0, 1.0), "Carrier.time = nan: expected a finite"),
        ((0.0, (0.0, 0.0), np.eye(2), 0.0, 1.0), "Carrier.radius = 0.0: expected metres greater"),
        ((0.0, (0.0, 0.0), np.eye(2), 1.0, -1.0), "Carrier.rate = -1.0: expected at least 0"),
    ],
)
def test_carriers_that_cannot_be_are_refused(values, text):
    with pytest.raises(ValueError, match=text):
        Carrier(*values)


# Briefed that vehicles carry a threat


def test_briefed_of_carriers_every_track_is_suspect():
    carried, tracks = CarriedThreat(radius=60.0, rate=0.5, briefed=True), [track(0.0), track(400.0)]
    places = [[0.0, 0.0, 20.0], [400.0, 0.0, 20.0], [200.0, 0.0, 20.0]]
    assert KnownDangers(carried=carried).at(0.0, tracks).rate(places) == pytest.approx(
        [0.5, 0.5, 0]
    )
    assert KnownDangers().at(0.0, tracks) is NO_DANGERS
    unsure = [track(0.0, existence=0.3)]
    assert KnownDangers(carried=carried).at(0.0, unsure).rate(places)[0] == pytest.approx(0.15)


def test_a_carrier_that_is_tracked_counts_once():
    carried = CarriedThreat(radius=60.0, rate=0.5, briefed=True)
    known, place = KnownDangers(carried=carried), [[0.0, 0.0, 20.0]]
    known.step(0.0, told=heard(carrier(0.0, 6.0), carrier(0.0, 300.0)))
    assert len(known.at(0.0, [track(0.0)]).carriers) == 2
    assert known.at(0.0, [track(0.0)]).rate(place) == pytest.approx([0.5])
    assert len(known.at(0.0, [track(150.0)]).carriers) == 3


def test_a_briefing_never_says_who_carries():
    carried = CarriedThreat(radius=60.0, rate=0.5, vehicles=(1, 2), briefed=True)
    assert carried.briefing == CarriedThreat(radius=60.0, rate=0.5, briefed=True)
    assert carried.model_copy(update={"briefed": False}).briefing is None
    assert CarriedThreat(radius=60.0, briefed=True).briefing is None  # its rate is 0
