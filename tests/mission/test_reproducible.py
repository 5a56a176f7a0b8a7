"""Same scenario and seed: the same bytes, twice and in another process."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest

import staniel
from staniel.scenario import build_city
from staniel.scenario.assemble import assemble

MINUTES = 2.0
FLY = """
import hashlib, sys, staniel
run = staniel.fly(staniel.load_scenario("downtown", minutes=float(sys.argv[1])), seed=5)
print(hashlib.sha256((run.folder / "mission.mcap").read_bytes()).hexdigest())
"""


def digest(seed, out):
    run = staniel.fly(staniel.load_scenario("downtown", minutes=MINUTES), seed=seed, out=out)
    return hashlib.sha256((run.folder / "mission.mcap").read_bytes()).hexdigest()


def test_the_record_is_byte_identical_twice_and_in_another_process(tmp_path):
    first, second = digest(5, tmp_path / "a"), digest(5, tmp_path / "b")
    assert first == second
    other = subprocess.run(
        [sys.executable, "-c", FLY, str(MINUTES)], capture_output=True, text=True, check=True
    )
    assert other.stdout.strip() == first
    assert digest(6, tmp_path / "c") != first


def test_a_run_flies_again_from_its_own_scenario_file(tmp_path):
    run = staniel.fly(staniel.load_scenario("village"), seed=9, out=tmp_path / "a")
    again = staniel.fly(staniel.load_scenario(run.folder / "scenario.toml"), out=tmp_path / "b")
    assert (run.folder / "mission.mcap").read_bytes() == (
        again.folder / "mission.mcap"
    ).read_bytes()


def frames(count, minutes=1.0):
    scenario = staniel.load_scenario("downtown", minutes=minutes, aircraft={"count": count})
    return list(assemble(scenario, build_city(scenario.city, scenario.seed)).frames())


def test_another_aircraft_does_not_change_the_vehicles_nor_the_first_look():
    few, more = frames(2), frames(3)
    for a, b in zip(few, more, strict=True):
        assert np.array_equal(a.truth.vehicles, b.truth.vehicles)


@pytest.mark.parametrize("chart", ["known", "blank"])
def test_both_charts_fly(chart, tmp_path):
    scenario = staniel.load_scenario("village", chart=chart)
    assert staniel.fly(scenario, out=tmp_path / chart).metrics["complete"]
