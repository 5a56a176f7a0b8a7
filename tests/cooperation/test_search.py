import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.cooperation import SearchMap
from staniel.cooperation.search import LOOK_EVERY, NEVER, PATIENCE
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera

AIRFRAME, CAMERA, CELL = Airframe(), Camera(), 20.0


@pytest.fixture(scope="module")
def city():
    return City.generate(size=(400.0, 300.0), density=0.4, seed=3)


def level(x, y, heading=0.0, bank=0.0):
    return Pose(x, y, 80.0, heading, bank, 15.0)


def test_cells_are_the_streets(city):
    ages = SearchMap(city, AIRFRAME, CAMERA, cell=CELL).ages
    assert ages.shape == (15, 20)
    built = shapely.union_all(city.outlines)
    for row in range(15):
        for column in range(20):
            box = shapely.box(CELL * column, CELL * row, CELL * (column + 1), CELL * (row + 1))
            if built.covers(box):
                assert math.isnan(ages[row, column])
            if not built.intersects(box):
                assert ages[row, column] == NEVER


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 400), st.floats(0, 300), st.floats(-3.1, 3.1), st.floats(-0.6, 0.6))
def test_a_look_marks_what_the_camera_sees_and_nothing_else(x, y, heading, bank):
    city = City.generate(size=(400.0, 300.0), density=0.4, seed=3)
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    pose = level(x, y, heading, bank)
    search.look(5.0, [pose])
    marked = search.ages == 5.0
    # The slow way: explicit rotation, shapely-proved line of sight, for each cell's own point.
    places = search._places
    axis = np.array(
        [
            math.sin(bank) * math.sin(heading),
            -math.sin(bank) * math.cos(heading),
            -math.cos(bank),
        ]
    )
    for row, column in np.ndindex(marked.shape):
        place = places[row, column]
        if np.isnan(place[0]):
            assert not marked[row, column]
            continue
        ray = place - np.array(pose[:3])
        angle = math.acos(np.clip(ray @ axis / np.linalg.norm(ray), -1, 1))
        if abs(angle - CAMERA.half_aperture) < 1e-6:
            continue
        covered = angle < CAMERA.half_aperture and np.linalg.norm(ray) <= CAMERA.range
        free = bool(city.visible([pose[:3]], [place])[0, 0])
        assert marked[row, column] == (covered and free)


def test_looks_are_entered_at_intervals(city):
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    search.look(0.0, [level(100, 100)])
    search.look(LOOK_EVERY / 2, [level(300, 200)])
    assert np.nanmax(search.ages) == 0.0
    search.look(LOOK_EVERY, [level(300, 200)])
    assert np.nanmax(search.ages) == LOOK_EVERY


def test_a_leg_is_kept_until_its_goal_was_seen_or_patience_ends(city):
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    search.look(0.0, [level(50, 50)])
    first = search.leg(0.0, level(50, 50), [])
    assert search.leg(5.0, level(125, 50), []) == first
    search.look(10.0, [level(*first[1])])
    second = search.leg(10.0, level(*first[1]), [])
    assert second[1] != first[1]
    assert second[0] == first[1]
    assert search.leg(10.0 + PATIENCE, level(0, 0), [])[0] == (0.0, 0.0)


def test_another_aircrafts_goal_is_left_to_it(city):
    alone = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    _, goal = alone.leg(0.0, level(200, 150), [])
    shared = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    _, other = shared.leg(0.0, level(200, 150), [goal])
    assert math.dist(goal, other) > 100.0


def test_a_search_sees_every_street_of_the_city_within_minutes(city):
    """One aircraft that flies its legs at constant speed leaves no cell unseen."""
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    x, y, heading = 10.0, 10.0, 0.5
    for k in range(240):
        pose = level(x, y, heading)
        search.look(float(k), [pose])
        _, (gx, gy) = search.leg(float(k), pose, [])
        away = math.remainder(math.atan2(gy - y, gx - x) - heading, math.tau)
        heading += max(-0.45, min(0.45, away))
        x, y = x + 15.0 * math.cos(heading), y + 15.0 * math.sin(heading)
    assert np.nanmin(search.ages) > NEVER


def test_a_city_without_streets_sends_the_aircraft_to_its_middle():
    full = City.from_outlines([shapely.box(0, 0, 100, 100)], [10.0], (100.0, 100.0))
    search = SearchMap(full, AIRFRAME, CAMERA, cell=CELL)
    assert search.leg(0.0, level(0, 0), [])[1] == (50.0, 50.0)
