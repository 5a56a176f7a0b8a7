"""Whole missions below the roofs: the long run in little, what the record says, and the doors."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

import staniel
from staniel.errors import StanielError
from staniel.recording import read_record
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
LOW = {
    "guidance.avoidance": "predictive",
    "lidar.mount": "scanner",
    "lidar.range": 140.0,
    "chart": "blank",
    "aircraft.altitude": 11.0,
    "minutes": 0.5,
    "seed": 3,
}


@pytest.fixture(scope="module")
def random_missions():
    spec = importlib.util.spec_from_file_location("random_missions", BENCHMARKS / "avoidance.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["random_missions"] = module  # its dataclass looks itself up
    spec.loader.exec_module(module)
    yield module
    del sys.modules["random_missions"]


@pytest.mark.parametrize("number", [6, 17, 33, 56, 61, 125])
def test_random_missions_below_the_roofs(random_missions, number):
    """Of the thousand of docs/avoidance.md; these went wrong while it was being built."""
    outcome = random_missions.fly(number, "predictive", 1.5)
    assert outcome.strikes == 0
    assert outcome.nearest >= random_missions.SEPARATION
    assert outcome.entries == 0
    assert outcome.stuck < 0.1


def test_the_four_groups_have_both_radios_and_both_kinds_of_heights(random_missions):
    scenarios = [random_missions.scenario_of(n, "predictive", 1.0) for n in range(4)]
    kinds = {(s.radio.loss, s.guidance.layer_spacing) for s in scenarios}
    assert kinds == {(0.0, 0.0), (0.5, 0.0), (0.0, 15.0), (0.5, 15.0)}
    for scenario in scenarios:
        tallest = build_city(scenario.city, scenario.seed).tallest
        assert scenario.aircraft.altitude == pytest.approx(0.9 * tallest)
        assert scenario.lidar.range >= 4.0 * scenario.aircraft.min_turn_radius


def test_below_the_roofs_only_who_avoids_may_fly():
    with pytest.raises(StanielError, match="tallest roof"):
        staniel.fly(load_scenario("village", **(LOW | {"guidance.avoidance": "none"})))
    blind = LOW | {"lidar.mount": "none"}
    with pytest.raises(StanielError, match="tallest roof"):
        staniel.fly(load_scenario("village", **blind))
    with pytest.raises(StanielError, match="lidar"):
        load_scenario("village", **(blind | {"guidance.avoidance": "saunders"}))


def test_they_begin_clear_of_what_they_do_not_fly_over():
    six = {"aircraft.altitude": 20.0, "aircraft.count": 6, "guidance.layer_spacing": 0.0}
    scenario = load_scenario("downtown", **(LOW | six))
    city = build_city(scenario.city, scenario.seed)
    start = assemble(scenario, city).start.aircraft
    tall = [o for o, h in zip(city.outlines, city.heights, strict=True) if h > 20.0]
    for x, y in start[:, :2]:
        away = min(outline.distance(shapely.Point(x, y)) for outline in tall)
        assert away >= scenario.aircraft.min_turn_radius
    gaps = np.linalg.norm(start[:, None, :3] - start[None, :, :3], axis=2)
    assert gaps[~np.eye(6, dtype=bool)].min() > 3.0 * scenario.aircraft.min_turn_radius


def test_layers_are_altitudes():
    scenario = load_scenario("downtown", **{"guidance.layer_spacing": 15.0})
    assert [a.altitude for a in scenario.airframes] == [80.0, 95.0, 110.0, 125.0]
    alone = [a.altitude for a in load_scenario("downtown").airframes]
    assert alone == [80.0] * 4
    avoiding = load_scenario("downtown", **{"guidance.avoidance": "predictive"})
    assert avoiding.airframes == scenario.airframes
    level = {"guidance.avoidance": "predictive", "guidance.layer_spacing": 0.0}
    assert [a.altitude for a in load_scenario("downtown", **level).airframes] == alone
    start = assemble(scenario, build_city(scenario.city, 0)).start
    assert start.aircraft[:, 2].tolist() == [80.0, 95.0, 110.0, 125.0]


def test_the_record_says_what_avoidance_did(tmp_path):
    run = staniel.fly(load_scenario("village", **LOW), out=tmp_path / "run")
    guards = run.record.decisions["guard"]
    assert set(guards) <= {"", "avoid", "loiter"}
    assert np.isin(guards, ["avoid", "loiter"]).any()
    again = read_record(tmp_path / "run" / "mission.mcap")
    assert np.array_equal(again.decisions["guard"], guards)
    assert run.metrics["aircraft"][0]["building_strikes"] == 0


def test_who_says_what_it_flies_says_more():
    """A heartbeat carries the command only where somebody avoids others by it, or it is a plan."""

    def said(avoidance, pursuit):
        guidance = {"avoidance": avoidance, "pursuit": pursuit}
        changes = {"guidance": guidance, "minutes": 0.5, "aircraft.count": 2}
        scenario = load_scenario("village", **changes)
        return [
            delivery.message
            for frame in assemble(scenario, build_city(scenario.city, 0)).frames()
            for delivery in frame.deliveries
            if delivery.message.kind == "heartbeat"
        ]

    chasing, planning = said("none", "carrot"), said("none", "lookahead")
    assert {message.role for message in chasing} >= {"search", "pursue"}
    assert all(message.command is None for message in chasing)
    assert {message.role for message in planning} >= {"search", "pursue"}
    for message in planning:
        assert (message.command is not None) == (message.role == "pursue")
    for pursuit in ("carrot", "lookahead"):
        assert all(message.command is not None for message in said("predictive", pursuit))


def test_the_reactive_rival_flies(random_missions):
    outcome = random_missions.fly(6, "saunders", 0.5)
    assert outcome.avoided > 0.0
