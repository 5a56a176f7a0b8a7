"""The packaged scenarios are what they say."""

import pytest

from staniel.errors import CityError, ScenarioError
from staniel.scenario import Scenario, build_city, load_scenario, preset_names


def test_downtown_is_the_stated_mission():
    downtown = load_scenario("downtown")
    city, team, camera = downtown.city, downtown.aircraft, downtown.camera
    assert (city.source, city.size, city.density, city.heights) == (
        "generate",
        (600.0, 600.0),
        0.42,
        (10.0, 40.0),
    )
    assert (downtown.vehicles.count, downtown.vehicles.speed) == (4, 2.0)
    assert (team.count, team.speed, team.altitude) == (4, 15.0, 80.0)
    assert (team.max_bank_deg, team.max_roll_rate_deg) == (35.0, 60.0)
    assert (camera.half_aperture_deg, camera.range, camera.noise) == (60.0, 250.0, 1.5)
    assert (camera.detection_probability, camera.target_height) == (0.9, 1.0)
    assert 0.0 < camera.clutter <= 0.2
    assert (downtown.minutes, downtown.clock.decision_step) == (10.0, 1.0)
    assert downtown.clock.dynamics_step == 0.1
    assert downtown.tracking.particles == 1000
    assert (downtown.chart, downtown.guidance.pursuit) == ("known", "lookahead")


def test_the_defaults_of_the_model_are_downtown():
    default = Scenario(name="downtown", description=load_scenario("downtown").description)
    assert load_scenario("downtown") == default


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_loads_under_its_name_and_has_a_city(name):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    city = build_city(scenario.city, scenario.seed)
    assert city.size == scenario.city.size
    assert abs(city.density - scenario.city.density) <= 0.011


@pytest.mark.parametrize("seed", range(10))
def test_every_seed_of_downtown_has_its_city(seed):
    city = build_city(load_scenario("downtown").city, seed)
    assert abs(city.density - 0.42) <= 0.01
    assert 10.0 <= city.heights.min() <= city.tallest <= 40.0


def test_what_the_generator_refuses_is_named_by_its_key():
    source = load_scenario("village", **{"city.block": (80.0, 90.0), "city.density": 0.75}).city
    with pytest.raises(CityError, match=r"^city\.(density|block|size): expected"):
        build_city(source, 0)


def test_the_city_follows_the_seed_unless_it_has_its_own():
    village = load_scenario("village")
    first, again, other = (build_city(village.city, seed) for seed in (1, 1, 2))
    assert first.to_dict() == again.to_dict() != other.to_dict()
    fixed = load_scenario("village", **{"city.seed": 1}).city
    assert build_city(fixed, 2).to_dict() == first.to_dict()


def test_a_grid_is_read_at_its_scale(tmp_path):
    path = tmp_path / "a.map"
    path.write_text("type octile\nheight 3\nwidth 4\nmap\n....\n.@@.\n....\n")
    changes = {"source": "grid", "file": str(path), "cell": 2.5}
    city = build_city(load_scenario("village", city=changes).city, 0)
    assert city.size == (10.0, 7.5)
    assert city.density == pytest.approx(2 / 12)


@pytest.mark.parametrize("source", ["grid", "image"])
def test_a_missing_map_is_named_with_its_field(source):
    changes = {"source": source, "file": "/nonexistent/x.png", "cell": 1.0}
    with pytest.raises(ScenarioError, match=r"city\.file = '/nonexistent/x.png': no such file"):
        build_city(load_scenario("village", city=changes).city, 0)


def test_a_map_without_free_space_is_refused(tmp_path):
    path = tmp_path / "full.map"
    path.write_text("type octile\nheight 2\nwidth 2\nmap\n@@\n@@\n")
    changes = {"source": "grid", "file": str(path), "cell": 1.0}
    with pytest.raises(CityError, match=r"full\.map"):
        build_city(load_scenario("village", city=changes).city, 0)
