"""The threat sensor: range in space, chance, noise, sight, keys, and what it does not tell."""

import math

import numpy as np
import pytest
import shapely
from scipy import stats

from staniel.city import City
from staniel.datatypes.belief import Percept, Pose, Sighting
from staniel.datatypes.risk import RiskConfig, RiskRegion
from staniel.datatypes.threats import Threats
from staniel.datatypes.truth import DRIFT_X, DRIFT_Y, FLYING, Truth, nominal
from staniel.errors import ScenarioError
from staniel.scenario import dump_scenario, load_scenario
from staniel.world import ThreatSensors, impair
from staniel.world.faults import taken

OPEN = City.open((1000.0, 1000.0))
EVERYBODY = (0.0, 0.0, 80.0)


def truth_of(places, vehicles=(), tick=3, condition=None):
    aircraft, ground = np.zeros((len(places), 6)), np.zeros((len(vehicles), 4))
    aircraft[:, :3] = places
    if len(vehicles):
        ground[:, :2] = vehicles
    return Truth(
        tick, float(tick), aircraft, ground, np.zeros((len(vehicles), 3)), aircraft[None],
        ground[None], nominal(len(places)) if condition is None else condition,
    )  # fmt: skip


def sense(truth, *regions, city=OPEN, seed=1, carried=None, **sensor):
    risk = RiskConfig(
        regions=regions, carried=carried or {}, sensor={"range": 100.0, "noise": 5.0, **sensor}
    )
    percepts = [Percept(truth.time, Pose(*row), ()) for row in truth.aircraft.tolist()]
    return ThreatSensors(city, risk, np.random.SeedSequence(seed)).sense(truth, percepts)


def disc(x=0.0, y=0.0, radius=30.0, **more):
    return RiskRegion(
        **{"kind": "no-fly", "center": (x, y), "radius": radius, "briefed": False, **more}
    )


CARRIED = {"radius": 60.0, "rate": 0.5}


@pytest.mark.parametrize(
    ("place", "noticed"),
    [
        ((129.9, 0.0, 15.0), True),
        ((130.1, 0.0, 15.0), False),
        ((0.0, 0.0, 119.9), True),  # above the ceiling by 99.9 m
        ((0.0, 0.0, 120.1), False),
        ((90.0, 0.0, 99.9), True),  # 60 m beside and 79.9 m above: 99.92 m
        ((90.0, 0.0, 100.1), False),
        ((5.0, 5.0, 15.0), True),  # inside
    ],
)
def test_a_region_is_noticed_by_the_distance_to_its_volume(place, noticed):
    region = disc(floor=10.0, ceiling=20.0)
    (percept,), (origin,) = sense(truth_of([place]), region)
    assert percept.threats == Threats((region,) if noticed else ())
    assert origin == ((0,) if noticed else ())


def test_a_threat_and_a_ban_are_noticed_and_what_was_briefed_is_not():
    threat = disc(kind="threat", rate=2.0)
    told, ban = disc(10.0, briefed=True), disc(20.0)
    (percept,), (origin,) = sense(truth_of([EVERYBODY]), threat, told, ban)
    assert percept.threats.regions == (threat, ban)
    assert origin == (0, 2)  # numbers in the scenario


def test_a_carrier_is_noticed_by_its_slant_range_and_told_as_it_was_measured():
    near, far = math.sqrt(100.0**2 - 80.0**2) - 0.1, math.sqrt(100.0**2 - 80.0**2) + 0.1
    (percept,), (origin,) = sense(truth_of([EVERYBODY], [(near, 0), (0, far)]), carried=CARRIED)
    (carrier,) = percept.threats.carriers
    assert origin == (0,)
    assert (carrier.time, carrier.radius, carrier.rate, carrier.reporter) == (3.0, 60.0, 0.5, 0)
    assert carrier.covariance.tolist() == [[25.0, 0.0], [0.0, 25.0]]
    assert 0.0 < math.dist(carrier.position, (near, 0.0)) < 25.0
    with pytest.raises(ValueError, match="read-only"):
        carrier.covariance[0, 0] = 1.0


def test_only_vehicles_that_carry_are_noticed_and_only_where_there_is_a_rate():
    truth = truth_of([EVERYBODY], [(0, 0), (10, 0), (20, 0)])
    _, (origin,) = sense(truth, carried={**CARRIED, "vehicles": (2, 0)})
    assert sorted(origin) == [0, 2]
    assert sense(truth, carried={**CARRIED, "rate": 0.0})[1] == [()]
    assert sense(truth, carried={**CARRIED, "radius": 0.0})[1] == [()]


def test_the_noise_is_what_the_covariance_says():
    vehicles = [(float(k % 20), float(k // 20)) for k in range(400)]
    percepts, origins = sense(truth_of([EVERYBODY] * 10, vehicles), carried=CARRIED, noise=7.0)
    errors = np.array(
        [
            carrier.position - vehicles[vehicle]
            for percept, origin in zip(percepts, origins, strict=True)
            for carrier, vehicle in zip(percept.threats.carriers, origin, strict=True)
        ]
    )
    assert errors.shape == (4000, 2)
    for axis in errors.T:
        assert stats.kstest(axis / 7.0, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(errors.T)[0, 1]) < 4.0 / math.sqrt(4000)


def test_the_order_of_carriers_says_nothing_of_who_they_are():
    vehicles = [(20.0, 0.0), (-20.0, 0.0), (0.0, 0.0)]
    (percept,), (origin,) = sense(truth_of([EVERYBODY], vehicles), carried=CARRIED, noise=0.1)
    assert origin == (1, 2, 0)
    xs = [carrier.position[0] for carrier in percept.threats.carriers]
    assert xs == sorted(xs)


def test_the_chance_is_that_of_each_step_and_danger():
    regions = [disc(float(k)) for k in range(20)]
    vehicles = [(float(k), 0.0) for k in range(20)]
    seen = []
    for tick in range(50):
        truth = truth_of([EVERYBODY] * 2, vehicles, tick)
        percepts, _ = sense(truth, *regions, carried=CARRIED, probability=0.3)
        seen += [len(p.threats.regions) + len(p.threats.carriers) for p in percepts]
    assert stats.binomtest(sum(seen), 2 * 50 * 40, 0.3).pvalue > 1e-3
    # Independent: the counts of the steps vary as those of a binomial law do.
    assert np.var(seen) == pytest.approx(40 * 0.3 * 0.7, rel=0.5)


def test_another_aircraft_vehicle_or_region_changes_nobodys_draws():
    regions, vehicles = [disc(float(k)) for k in range(8)], [(float(k), 9.0) for k in range(8)]
    lucky = {"carried": CARRIED, "probability": 0.5}
    few, _ = sense(truth_of([EVERYBODY], vehicles), *regions, **lucky)
    more, origins = sense(
        truth_of([EVERYBODY] * 3, [*vehicles, (50.0, 0.0)]), *regions, disc(40.0), **lucky
    )
    assert 0 < len(few[0].threats.regions) < 8
    assert set(few[0].threats.regions) == set(more[0].threats.regions) - {disc(40.0)}
    assert set(few[0].threats.carriers) == {
        carrier
        for carrier, vehicle in zip(
            more[0].threats.carriers, origins[0][len(more[0].threats.regions) :], strict=True
        )
        if vehicle < 8
    }
    assert more[1].threats != more[2].threats  # each has its own luck
    # A danger that was briefed leaves the draws of those after it as they were.
    told = [regions[0].model_copy(update={"briefed": True}), *regions[1:]]
    again, _ = sense(truth_of([EVERYBODY], vehicles), *told, **lucky)
    assert set(again[0].threats.regions) == set(few[0].threats.regions) - {regions[0]}


def test_buildings_hide_what_is_behind_them_only_where_sight_is_needed():
    wall = City.from_outlines([shapely.box(40, 0, 60, 100)], [50.0], (200.0, 100.0))
    # From 60 m high and 50 m before the wall, the ground is hidden for 250 m behind its edge.
    places = [(0.0, 50.0, 60.0), (100.0, 50.0, 60.0)]
    low, high = (
        disc(90.0, 50.0, 5.0, ceiling=1.0), disc(90.0, 50.0, 5.0, floor=59.0, ceiling=60.0),
    )  # fmt: skip
    truth = truth_of(places, [(80.0, 50.0)])
    scene = {"city": wall, "carried": CARRIED, "range": 150.0}
    _, origins = sense(truth, low, high, **scene)
    assert origins == [(0, 1, 0), (0, 1, 0)]
    _, origins = sense(truth, low, high, needs_sight=True, **scene)
    assert origins == [(1,), (0, 1, 0)]


def test_what_does_not_fly_notices_nothing():
    condition = nominal(2)
    condition[1, FLYING] = 0.0
    truth = truth_of([EVERYBODY] * 2, [(0, 0)], condition=condition)
    _, origins = sense(truth, disc(), carried=CARRIED)
    assert origins == [(0, 0), ()]


def test_a_drifting_navigation_shifts_carriers_with_the_sightings_and_no_region():
    condition = nominal(1)
    condition[0, [DRIFT_X, DRIFT_Y]] = (30.0, -7.0)
    truth = truth_of([EVERYBODY], [(10, 0)], condition=condition)
    percepts, _ = sense(truth, disc(), carried=CARRIED)
    seen = Sighting(3.0, percepts[0].threats.carriers[0].position, np.eye(2))
    (((sighting, _),),) = taken([[(seen, 0)]], truth)
    (shifted,) = impair(percepts, truth)
    assert shifted.threats.regions == (disc(),)
    moved = shifted.threats.carriers[0].position
    np.testing.assert_allclose(moved - percepts[0].threats.carriers[0].position, (30.0, -7.0))
    assert np.array_equal(moved, sighting.position)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"risk.sensor.range": -1.0}, "risk.sensor.range = -1.0: expected at least 0 (slant range"),
        ({"risk.sensor.range": 1e6}, "risk.sensor.range = 1000000.0: expected at most 100000"),
        ({"risk.sensor.noise": 0.0}, "risk.sensor.noise = 0.0: expected greater than 0"),
        ({"risk.sensor.probability": 0.0}, "sensor.probability = 0.0: expected greater than 0"),
        ({"risk.sensor.probability": 1.5}, "sensor.probability = 1.5: expected at most 1"),
        ({"risk.sensor.needs_sight": "far"}, 'risk.sensor.needs_sight = "far": expected true or'),
        ({"risk.sensor.reach": 5.0}, "risk.sensor.reach: unknown key, expected one of: needs_sig"),
        ({"risk.carried.briefed": 7}, "risk.carried.briefed = 7: "),
    ],
)
def test_bad_sensors_are_refused_by_name(changes, text):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("village", **changes)
    assert text in str(caught.value)


def test_a_sensor_is_written_and_read_back(tmp_path):
    scenario = load_scenario(
        "village",
        **{
            "risk.sensor": {"range": 250.0, "noise": 3.0, "probability": 0.4, "needs_sight": True},
            "risk.carried": {"radius": 80.0, "rate": 0.1, "briefed": True},
        },
    )
    file = tmp_path / "sensed.toml"
    file.write_text(dump_scenario(scenario, "1.0"), encoding="utf-8")
    assert load_scenario(file) == scenario
