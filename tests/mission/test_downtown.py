"""The default mission over many seeds, and the real maps: what the project promises of them."""

import statistics
from pathlib import Path

import pytest

import staniel
from amounts import amount

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "maps"


SEEDS = amount(4, full=10)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    out = tmp_path_factory.mktemp("downtown")
    return [staniel.fly("downtown", seed=seed, out=out / str(seed)) for seed in range(SEEDS)]


def test_the_default_is_the_promised_mission():
    scenario = staniel.load_scenario("downtown")
    team, camera, city = scenario.aircraft, scenario.camera, scenario.city
    assert (city.size, city.density, city.heights) == ((600.0, 600.0), 0.42, (10.0, 40.0))
    assert (scenario.vehicles.count, scenario.vehicles.speed, team.count) == (4, 2.0, 4)
    assert (team.speed, team.altitude) == (15.0, 80.0)
    assert (team.max_bank_deg, team.max_roll_rate_deg) == (35.0, 60.0)
    assert (camera.half_aperture_deg, camera.range, camera.noise) == (60.0, 250.0, 1.5)
    assert (camera.detection_probability, camera.target_height) == (0.9, 1.0)
    assert camera.clutter > 0.0
    assert (scenario.minutes, scenario.clock.decision_step) == (10.0, 1.0)
    assert (scenario.clock.dynamics_step, scenario.tracking.particles) == (0.1, 1000)
    assert (scenario.chart, scenario.guidance.pursuit) == ("known", "lookahead")


def test_all_vehicles_are_found_in_every_seed(runs):
    for run in runs:
        assert len(run.metrics["targets"]) == 4
        assert all(target["found_at"] is not None for target in run.metrics["targets"])


def test_the_median_tracked_fraction_is_high(runs):
    tracked = [t["tracked_fraction"] for run in runs for t in run.metrics["targets"]]
    assert len(tracked) == 4 * SEEDS
    assert statistics.median(tracked) >= 0.6


def test_targets_are_shared_out_and_nobody_flies_into_a_wall(runs):
    for run in runs:
        assert run.metrics["team"]["auctions"] >= 4
        assert all(a["building_strikes"] == 0 for a in run.metrics["aircraft"])
        pursuing = {
            (row["agent"], row["target"]) for row in run.record.decisions if row["role"] == "pursue"
        }
        assert len({agent for agent, _ in pursuing}) == 4


def test_messages_are_really_lost(runs):
    for run in runs:
        team = run.metrics["team"]
        assert 0.7 < team["messages_delivered"] / team["messages_possible"] < 0.99


def test_no_sighting_of_a_vehicle_that_the_city_hides(runs):
    """Every recorded detection of a vehicle, held against the city's own door at that instant."""
    for run in runs[:3]:
        record = run.record
        height = record.scenario["camera"]["target_height"]
        rows = record.sightings[record.sightings["origin"] >= 0]
        assert len(rows) > 500
        step = (rows["time"] / record.times[1]).round().astype(int)
        observers = record.aircraft[step, rows["reporter"], :3]
        points = record.vehicles[step, rows["origin"], :2]
        targets = [[x, y, height] for x, y in points]
        # Poses are recorded to a millimetre: a ray along a wall may fall on its other side.
        assert record.city.visible_pairs(observers, targets).mean() > 0.998


@pytest.mark.parametrize("name", ["Boston_0_256.map", "Milan_0_1024.png"])
def test_real_maps_fly(name, tmp_path):
    file = SHARED / name
    if not file.exists():
        pytest.skip(f"shared data absent: {file.name}")
    source = "grid" if file.suffix == ".map" else "image"
    scenario = staniel.load_scenario(
        "downtown", city={"source": source, "file": str(file), "cell": 3.0}
    )
    run = staniel.fly(scenario, out=tmp_path / "run", movie=True)
    assert run.metrics["complete"]
    assert any(target["found_at"] is not None for target in run.metrics["targets"])
    assert {path.name for path in run.folder.iterdir()} == {
        "metrics.json",
        "mission.gif",
        "mission.mcap",
        "overview.png",
        "scenario.toml",
    }


def test_it_is_fast(runs, tmp_path):
    """A guard against slips, far below what `make bench` measures on a quiet machine."""
    chasing = [
        staniel.fly(
            staniel.load_scenario("downtown", seed=seed, guidance={"pursuit": "carrot"}),
            out=tmp_path / str(seed),
        )
        for seed in range(3)
    ]
    for flown, least in ((runs, 40.0), (chasing, 100.0)):
        assert statistics.median(run.metrics["real_time_factor"] for run in flown) > least
