"""Faults, endurance, launches and kinds of aircraft: when they come and what they do."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

import staniel
from staniel.city import City
from staniel.datatypes.belief import Health, Percept, Pose, Sighting
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyBanks, FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.truth import (
    CAMERA,
    CLIMB,
    CONDITION_COLUMNS,
    DRIFT_X,
    ENERGY,
    FLYING,
    LOST,
    NOMINAL,
    RADIO,
    Truth,
    nominal,
)
from staniel.errors import ScenarioError
from staniel.flight import fly
from staniel.kernels.footprint import camera_axes, look
from staniel.metrics.visible import visible_samples
from staniel.recording import read_record
from staniel.scenario import Scenario, build_city, dump_scenario, load_scenario
from staniel.scenario.assemble import assemble
from staniel.world import Faults, Launch, Traffic, World, impair
from staniel.world.faults import KINDS, Failures, taken

KEY = np.uint64(11)
LEVEL = FlyBanks((0.0,), 1.0, 15.0, 80.0)
ORBIT = FlyOrbit((300.0, 300.0), 45.0, 1, 15.0, 80.0)


def world_of(count=2, airframe=None, **sections):
    return World(
        City.open((600.0, 600.0)),
        airframe or Airframe(),
        count,
        Traffic(count=0),
        Clock(),
        np.random.SeedSequence(5),
        **sections,
    )


def flight(world, seconds, command=LEVEL):
    truths = [world.start()]
    for _ in range(seconds):
        truths.append(world.advance(truths[-1], [command] * len(truths[0].aircraft)))
    return truths


def schedule(*rows):
    return Faults(schedule=[{"time": t, "aircraft": a, "kind": k} for t, a, k in rows])


# -- faults --------------------------------------------------------------------------------------


def test_nothing_fails_by_default():
    truths = flight(world_of(), 3)
    assert NOMINAL == (1, 1, 1, 1, 0, 0, 0, 0)
    assert len(NOMINAL) == len(CONDITION_COLUMNS)
    for truth in truths:
        np.testing.assert_array_equal(truth.condition, nominal(2))


def test_scheduled_faults_come_at_their_time_and_stay():
    faults = schedule((2.0, 0, "camera"), (3.0, 1, "radio"), (1.5, 1, "navigation"))
    truths = flight(world_of(faults=faults), 6)
    conditions = np.array([truth.condition for truth in truths])
    assert conditions[:, 0, CAMERA].tolist() == [1, 1, 0, 0, 0, 0, 0]
    assert conditions[:, 1, RADIO].tolist() == [1, 1, 1, 0, 0, 0, 0]
    drift = np.hypot(*conditions[:, 1, DRIFT_X : DRIFT_X + 2].T)
    np.testing.assert_allclose(drift, [0, 0, 0.5, 1.5, 2.5, 3.5, 4.5])
    assert (conditions[:, :, FLYING] == 1.0).all()


def test_a_lost_aircraft_lies_at_its_last_place():
    truths = flight(world_of(faults=schedule((2.0, 1, "lost"))), 5)
    healthy = flight(world_of(), 5)
    at = truths[2]
    np.testing.assert_array_equal(at.aircraft[1, :2], healthy[2].aircraft[1, :2])
    assert at.condition[1].tolist() == [1, 0, 0, 0, 1, 0, 0, 0]
    for truth in truths[2:]:
        np.testing.assert_array_equal(truth.aircraft[1, [2, 4, 5]], 0.0)
        np.testing.assert_array_equal(truth.aircraft[1], at.aircraft[1])
    assert (truths[4].aircraft_path[:, 1] == at.aircraft[1]).all()
    np.testing.assert_array_equal(truths[-1].aircraft[0], healthy[-1].aircraft[0])


def test_random_faults_come_after_exponential_times_and_each_for_itself():
    faults = Faults(rate_per_hour={"camera": 2.0, "lost": 60.0})
    times = Failures(faults, 2000, KEY).times
    assert np.isinf(times[:, [KINDS.index("radio"), KINDS.index("navigation")]]).all()
    for kind, mean in (("camera", 1800.0), ("lost", 60.0)):
        found = times[:, KINDS.index(kind)]
        assert stats.kstest(found, "expon", args=(0.0, mean)).pvalue > 0.01
    np.testing.assert_array_equal(times[:50], Failures(faults, 50, KEY).times)
    drift = Failures(schedule(*((0.0, i, "navigation") for i in range(500))), 500, KEY).drift(10.0)
    angles = np.arctan2(drift[:, 1], drift[:, 0])
    assert stats.kstest(angles, "uniform", args=(-math.pi, 2 * math.pi)).pvalue > 0.01
    np.testing.assert_allclose(np.hypot(*drift.T), 10.0)


def test_a_fault_of_nobody_is_refused():
    with pytest.raises(ScenarioError, match=r"faults.schedule\[0\].aircraft = 2: expected 0 to 1"):
        world_of(faults=schedule((1.0, 2, "camera")))
    with pytest.raises(ScenarioError, match=r"faults.schedule\[0\] names aircraft 4"):
        load_scenario("downtown", faults={"schedule": [{"time": 1, "aircraft": 4, "kind": "lost"}]})
    bad = {"time": 1, "aircraft": 0, "kind": "engine"}
    with pytest.raises(ScenarioError, match=r"kind = \"engine\""):
        load_scenario("downtown", faults={"schedule": [bad]})


def test_what_is_perceived_with_a_dead_camera_and_with_a_navigation_that_is_off():
    poses = [Pose(10.0 * i, 5.0, 80.0, 0.1, 0.0, 15.0) for i in range(3)]
    percepts = [
        Percept(1.0, pose, (Sighting(1.0, (pose.x, 20.0), np.eye(2), reporter=i, pose=pose),))
        for i, pose in enumerate(poses)
    ]
    condition = nominal(3)
    condition[1, CAMERA] = 0.0
    condition[2, DRIFT_X : DRIFT_X + 2] = (3.0, -4.0)
    aircraft, none = np.array(poses), np.zeros((0, 4))
    truth = Truth(1, 1.0, aircraft, none, none, aircraft[None], none[None], condition)
    seen = impair(percepts, truth)
    assert seen[0] is percepts[0]
    assert seen[1] == dataclasses.replace(percepts[1], health=Health(camera=False))
    off = poses[2]._replace(x=23.0, y=1.0)
    assert (seen[2].pose, seen[2].sightings) == (off, percepts[2].sightings)
    looks = [[(percept.sightings[0], 7 + i)] for i, percept in enumerate(percepts)]
    first, second, third = taken(looks, truth)
    assert first is looks[0]
    assert second == []
    ((sighting, origin),) = third
    assert (sighting.pose, origin) == (off, 9)
    np.testing.assert_allclose(sighting.position, [23.0, 16.0])


# -- endurance -----------------------------------------------------------------------------------


def test_energy_lasts_as_long_as_it_says_and_then_the_aircraft_is_lost():
    truths = flight(world_of(1, Airframe(endurance_minutes=0.5)), 32)
    energy = np.array([truth.condition[0, ENERGY] for truth in truths])
    np.testing.assert_allclose(energy[:31], 1.0 - np.arange(31) / 30.0, atol=1e-12)
    lost = [truth.condition[0, LOST] for truth in truths]
    assert lost.index(1.0) in (30, 31)
    assert truths[-1].aircraft[0, 2] == 0.0


def test_a_turn_costs_the_power_of_its_load_factor():
    """A steady 45 m orbit: tan(bank) = V²/(g r), and power 1 + k tan²(bank)."""
    airframe = Airframe(endurance_minutes=60.0, turn_power=0.8)
    truths = flight(world_of(1, airframe), 80, ORBIT)
    spent = (truths[60].condition[0, ENERGY] - truths[80].condition[0, ENERGY]) * 3600.0 / 20.0
    assert spent == pytest.approx(1.0 + 0.8 * (15.0**2 / (9.80665 * 45.0)) ** 2, rel=1e-3)


# -- launch --------------------------------------------------------------------------------------


def launched(kind, seconds=60, **more):
    launch = Launch(kind=kind, places=[(100.0, 50.0), (120.0, 50.0)], heading_deg=90.0, **more)
    truths = flight(world_of(3, launch=launch), seconds, ORBIT)
    return np.array([t.aircraft for t in truths]), np.array([t.condition for t in truths])


@pytest.mark.parametrize("kind", ["hand", "catapult", "strip"])
def test_aircraft_wait_on_the_ground_and_leave_one_by_one_along_the_heading(kind):
    aircraft, condition = launched(kind, interval=7.0)
    for i, place in enumerate([(100.0, 50.0), (120.0, 50.0), (100.0, 50.0)]):
        waits = 7 * i + 1
        np.testing.assert_array_equal(aircraft[:waits, i, :3], [(*place, 0.0)] * waits)
        assert not condition[:waits, i, [CAMERA, RADIO, FLYING]].any()
        assert condition[waits:, i, [CAMERA, RADIO, FLYING]].all()
        assert (aircraft[waits:, i, 1] > 50.0)[:5].all()
        low = aircraft[:, i, 2] < 5.0
        np.testing.assert_allclose(aircraft[low, i, 0], place[0], atol=1e-9)
        np.testing.assert_allclose(aircraft[low, i, 3], math.pi / 2)
    assert (np.diff(aircraft[:, :, 2], axis=0) <= 3.0 + 1e-9).all()
    assert aircraft[-1, 0, 2] == pytest.approx(80.0, abs=0.5)
    assert (condition[:, :, LOST] == 0.0).all()


def test_a_catapult_is_faster_than_a_hand_and_a_hand_faster_than_a_strip():
    heights = [launched(kind, 10)[0][:, 0, 2] for kind in ("catapult", "hand", "strip")]
    assert heights[0][1] == pytest.approx(3.0)
    assert (heights[0][1:] > heights[1][1:]).all()
    assert (heights[1][1:] > heights[2][1:]).all()
    # On the strip it rolls until it has 11 m/s: more than 11 m/s / 1.5 m/s² = 7.3 s.
    assert not heights[2][:8].any()
    assert heights[2][10] > 0.0


def test_a_launch_without_places_is_refused():
    with pytest.raises(ScenarioError, match=r'launch\.places is empty: kind = "hand"'):
        load_scenario("downtown", launch={"kind": "hand"})


# -- kinds of aircraft ---------------------------------------------------------------------------

GROUPS = (
    {"count": 1, "aircraft": {"speed": 18.0, "altitude": 90.0}},
    {"count": 3, "aircraft": {"endurance_minutes": 5.0}},
)


def test_groups_differ_only_in_what_they_say():
    scenario = load_scenario("downtown", groups=GROUPS)
    fast, *others = scenario.airframes
    common = scenario.aircraft.model_dump(exclude={"count"})
    assert fast.model_dump() == common | {"speed": 18.0, "altitude": 90.0}
    assert len(others) == 3
    assert all(one.model_dump() == common | {"endurance_minutes": 5.0} for one in others)
    start = assemble(scenario, build_city(scenario.city, scenario.seed)).start
    assert start.aircraft[:, 5].tolist() == [18.0, 15.0, 15.0, 15.0]
    assert start.aircraft[:, 2].tolist() == [90.0, 80.0, 80.0, 80.0]
    assert load_scenario("downtown").airframes == (load_scenario("downtown").aircraft,) * 4


def test_each_kind_sees_with_its_own_camera():
    """Of every aircraft the sightings are those in a team that carries its camera throughout."""
    eyes = ({"range": 250.0}, {"mount": "nadir", "half_aperture_deg": 40.0, "noise": 3.0})
    groups = tuple({"count": 2, "camera": eye} for eye in eyes)
    mixed = load_scenario("downtown", groups=groups)
    assert [camera.mount for camera in mixed.cameras] == ["body", "body", "nadir", "nadir"]
    city = build_city(mixed.city, mixed.seed)
    truth = assemble(mixed, city).start
    seen = 0
    for tick in range(40):
        later = dataclasses.replace(truth, tick=tick, time=float(tick))
        percepts, origins = assemble(mixed, city).cameras.sense(later)
        for kind, eye in enumerate(eyes):
            team = assemble(load_scenario("downtown", camera=eye), city).cameras
            alone, sources = team.sense(later)
            for i in (2 * kind, 2 * kind + 1):
                assert percepts[i] == alone[i]
                assert origins[i] == sources[i]
                seen += len(alone[i].sightings)
    assert seen > 0


def test_visibility_is_measured_with_each_aircrafts_own_camera(tmp_path):
    """Blind all but one kind: then only what that kind covers counts as visible."""
    blind = {"half_aperture_deg": 0.01}
    groups = ({"count": 1}, {"count": 3, "camera": blind})
    mixed = fly(load_scenario("downtown", minutes=6.0, groups=groups), out=tmp_path / "a")
    record = mixed.record
    assert [camera.half_aperture_deg for camera in record.cameras] == [60.0, 0.01, 0.01, 0.01]
    height = record.cameras[0].target_height
    points = np.full((*record.fine_vehicles.shape[:2], 3), height)
    points[:, :, :2] = record.fine_vehicles[:, :, :2]
    by_hand = np.array(
        [
            look(
                record.city.walls,
                poses[:1],
                camera_axes(poses[:1], np.full((1, 2), np.nan), record.cameras[0].mounting),
                places,
                record.cameras[0].half_aperture,
                record.cameras[0].range,
            )[0]
            for poses, places in zip(record.fine_aircraft, points, strict=True)
        ]
    )
    assert np.array_equal(visible_samples(record), by_hand)
    assert 0 < by_hand.sum() < by_hand.size


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (({"count": 4, "camera": {"rnge": 3.0}},), r"groups\[0\].camera.rnge: Extra"),
        (({"count": 4, "camera": {"range": -3.0}},), r"groups\[0\].camera.range: .* greater"),
        (GROUPS[:1], "groups have 1 aircraft together, but aircraft.count = 4"),
        (({"count": 4, "aircraft": {"sped": 3.0}},), r"groups\[0\].aircraft.sped: Extra"),
        (({"count": 4, "aircraft": {"speed": -3.0}},), r"groups\[0\].aircraft.speed: .* greater"),
        (({"count": 4, "aircraft": {"speed": 99.0}},), r"groups\[0\].aircraft: .* max_speed"),
    ],
)
def test_groups_that_make_no_team_are_refused(groups, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("downtown", groups=groups)


# -- everything at once --------------------------------------------------------------------------

EVERYTHING = {
    "minutes": 1.0,
    "wind": {"speed": 5.0, "from_deg": 240.0, "gusts": True},
    "launch": {"kind": "catapult", "places": [(10.0, 10.0), (10.0, 590.0)], "interval": 3.0},
    "faults": {
        "schedule": [
            {"time": 20.0, "aircraft": 1, "kind": "camera"},
            {"time": 30.0, "aircraft": 2, "kind": "navigation"},
            {"time": 40.0, "aircraft": 3, "kind": "lost"},
        ],
        "rate_per_hour": {"radio": 20.0},
    },
    "groups": (
        {"count": 2, "aircraft": {"speed": 17.0}},
        {"count": 2, "aircraft": {"endurance_minutes": 30.0}},
    ),
}


def test_a_scenario_with_everything_is_written_and_read_back(tmp_path):
    scenario = load_scenario("downtown", **EVERYTHING)
    path = tmp_path / "all.toml"
    path.write_text(dump_scenario(scenario, "0"), encoding="utf-8")
    assert load_scenario(path) == scenario
    assert Scenario().groups == ()


def test_everything_at_once_flies_and_is_recorded_twice_the_same(tmp_path):
    scenario = load_scenario("downtown", **EVERYTHING)
    run = staniel.fly(scenario, seed=2, out=tmp_path / "a")
    again = staniel.fly(scenario, seed=2, out=tmp_path / "b")
    record = read_record(run.folder)
    assert (run.folder / "mission.mcap").read_bytes() == (
        again.folder / "mission.mcap"
    ).read_bytes()
    assert run.metrics["complete"]
    frames = list(assemble(scenario.model_copy(update={"seed": 2}), record.city).frames())
    conditions = np.array([frame.truth.condition for frame in frames])
    np.testing.assert_allclose(record.condition, conditions, atol=1e-3)
    np.testing.assert_allclose(record.wind, [f.truth.wind for f in frames], atol=1e-3)
    assert record.condition[-1, 3, LOST] == 1.0
    assert np.isfinite(record.aircraft).all()
    assert record.condition[10, 0, CLIMB] > 0.0
    lost = (record.decisions["agent"] == 3) & (record.decisions["time"] >= 40.0)
    assert set(record.decisions["role"][lost]) == {"down"}
    assert not (record.messages["sender"][record.messages["time"] >= 40.0] == 3).any()
    blind = (record.sightings["reporter"] == 1) & (record.sightings["time"] >= 20.0)
    assert not blind.any()


def test_a_calm_and_faultless_run_records_no_conditions(tmp_path):
    run = staniel.fly(load_scenario("village"), out=tmp_path / "run")
    record = read_record(run.folder)
    assert (record.condition == np.array(NOMINAL)).all()
    assert not record.wind.any()
    assert b'drift_x":0' not in (run.folder / "mission.mcap").read_bytes()
