"""What draws a search: operator areas and the clouds of lost targets."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from staniel.city import City, street_cells
from staniel.cooperation import Area, CooperationConfig, priority_at
from staniel.cooperation.interest import lost_factors, priorities, sight_radius
from staniel.datatypes.equipment import Airframe, Camera
from staniel.errors import ScenarioError
from staniel.scenario import load_scenario
from staniel.scenario.write import dump_scenario

PLACE = st.tuples(st.floats(-50, 250), st.floats(-50, 250))
AREA = st.builds(Area, center=PLACE, radius=st.floats(1, 200), priority=st.floats(0.01, 100))


@settings(max_examples=30, deadline=None)
@given(st.lists(AREA, max_size=4))
def test_every_cell_has_the_priority_of_its_place(areas):
    places = street_cells(City.open((200.0, 180.0)), 40.0, 1.0)
    expected = [[priority_at(areas, tuple(place[:2])) for place in row] for row in places]
    np.testing.assert_array_equal(priorities(areas, places), expected)


def test_of_several_areas_the_highest_counts_even_below_one():
    low, lower = (Area(center=(0, 0), radius=r, priority=p) for r, p in ((10, 0.5), (20, 0.2)))
    assert [priority_at([low, lower], (x, 0.0)) for x in (5.0, 15.0, 25.0)] == [0.5, 0.2, 1.0]


@pytest.mark.parametrize(
    "wrong",
    [{"radius": 0.0}, {"priority": 0.0}, {"priority": 1e3}, {"center": (0.0, math.inf)}, {"x": 1}],
)
def test_areas_are_checked(wrong):
    with pytest.raises(ValidationError):
        Area(**{"center": (0.0, 0.0), "radius": 5.0, **wrong})


def test_areas_come_from_a_scenario_and_go_back_into_one(tmp_path):
    file = tmp_path / "areas.toml"
    text = "[[cooperation.areas]]\ncenter = [100.0, 200.0]\nradius = 50.0\npriority = 3.0\n"
    file.write_text(text)
    scenario = load_scenario(file)
    assert scenario.cooperation.areas == (Area(center=(100.0, 200.0), radius=50.0, priority=3.0),)
    again = tmp_path / "again.toml"
    again.write_text(dump_scenario(scenario, "0"))
    assert load_scenario(again) == scenario
    file.write_text(text.replace("50.0", "-50.0"))
    with pytest.raises(ScenarioError, match="radius"):
        load_scenario(file)
    with pytest.raises(ValidationError):
        CooperationConfig(areas=[Area(center=(0, 0), radius=1)] * 101)


def test_a_cell_matters_by_the_targets_that_a_look_from_it_may_show():
    random = np.random.default_rng(4)
    clouds = [(random.uniform(-30, 330, (50, 2)), random.dirichlet(np.ones(50))) for _ in range(3)]
    factors = lost_factors(clouds, (14, 15), 20.0, 110.0)
    for row, column in np.ndindex(14, 15):
        expected = 0.0
        for places, weights in clouds:
            x = np.clip(places[:, 0] // 20.0, 0, 14)
            y = np.clip(places[:, 1] // 20.0, 0, 13)
            near = (abs(x - column) <= 3) & (abs(y - row) <= 3)  # 55 m, rounded up to cells
            expected += weights[near].sum()
        assert factors[row, column] == pytest.approx(1.0 + 3.0 * expected)
    assert (lost_factors([], (2, 3), 20.0, 110.0) == np.ones((2, 3))).all()


def test_how_far_a_camera_looks_from_above():
    plain = sight_radius(Airframe(altitude=80.0), Camera(target_height=1.0))
    assert plain == pytest.approx(79.0 * math.tan(math.radians(60.0)))
    short = sight_radius(Airframe(altitude=80.0), Camera(target_height=0.0, range=100.0))
    assert short == pytest.approx(60.0)
    assert sight_radius(Airframe(altitude=300.0), Camera(range=250.0)) == 0.0
