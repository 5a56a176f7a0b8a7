import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.cooperation import Area, SearchMap, priority_at
from staniel.cooperation.interest import sight_radius
from staniel.cooperation.search import LOOK_EVERY, NEVER, PATIENCE, STALE
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Heartbeat

AIRFRAME, CAMERA, CELL = Airframe(), Camera(), 20.0


@pytest.fixture(scope="module")
def city():
    return City.generate(size=(400.0, 300.0), density=0.4, seed=3)


def beat(time, pose, goal, *, sender=1, role="search", health="healthy"):
    return Heartbeat(
        sender, 1, time, pose=pose, role=role, goal=goal, target=None, target_position=None,
        cost=math.inf, health=health,
    )  # fmt: skip


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


def test_what_is_overdue(city):
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    assert search.overdue(30.0, 45.0) == 0.0  # nobody could have looked for so long
    assert search.overdue(50.0, 45.0) == 1.0
    assert search.overdue(50.0, 0.0) == 0.0
    search.look(50.0, level(200.0, 150.0))
    streets = search.ages[~np.isnan(search.ages)]
    for time in (60.0, 94.0, 96.0):
        share = (streets < time - 45.0).mean()
        assert search.overdue(time, 45.0) == pytest.approx(share)
    assert 0.0 < search.overdue(60.0, 45.0) < 1.0


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 400), st.floats(0, 300), st.floats(-3.1, 3.1), st.floats(-0.6, 0.6))
def test_a_look_marks_what_the_camera_sees_and_nothing_else(x, y, heading, bank):
    city = City.generate(size=(400.0, 300.0), density=0.4, seed=3)
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    pose = level(x, y, heading, bank)
    search.look(5.0, pose)
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
    search.look(0.0, level(100, 100))
    search.look(LOOK_EVERY / 2, level(300, 200))
    assert np.nanmax(search.ages) == 0.0
    search.look(LOOK_EVERY, level(300, 200))
    assert np.nanmax(search.ages) == LOOK_EVERY


def test_a_leg_is_kept_until_its_goal_was_seen_or_passed_or_patience_ends(city):
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    search.look(0.0, level(50, 50))
    first = search.leg(0.0, level(50, 50))
    assert search.leg(5.0, level(60, 50)) == first
    search.look(10.0, level(*first[1]))
    second = search.leg(10.0, level(*first[1]))
    assert second[1] != first[1]
    assert second[0] == first[1]
    beyond = level(*(2.1 * np.array(second[1]) - 1.1 * np.array(second[0])))
    assert search.leg(12.0, beyond)[0] == (beyond.x, beyond.y)
    third = search.leg(12.0, beyond)
    back = level(*beyond[:2])
    assert search.leg(12.0 + PATIENCE - 1.0, back) == third
    search.leg(12.0 + PATIENCE, level(0, 0))
    assert search.leg(12.0 + PATIENCE, level(0, 0))[0] == (0.0, 0.0)


def test_another_aircrafts_goal_is_left_to_it(city):
    pose = level(200, 150)
    _, goal = SearchMap(city, AIRFRAME, CAMERA, cell=CELL).leg(0.0, pose)
    shared = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    shared.hear([beat(0.0, pose, goal)])
    assert math.dist(goal, shared.leg(0.0, pose)[1]) > 100.0


def goal_beside(x, time=0.0, **words):
    """Goal of one over the middle of open ground; another faces it from `x`, heard of at 0 s.

    The other one flies so high that it sees nothing from there.
    """
    search = SearchMap(City.open((1000.0, 200.0)), AIRFRAME, CAMERA, cell=CELL)
    heading = math.pi if x > 500.0 else 0.0
    above = level(x, 100, heading)._replace(z=300.0)
    search.hear([beat(0.0, above, (x, 100.0), **words)])
    search.look(time, level(500, 100))
    return search.leg(time, level(500, 100))[1]


def test_each_takes_the_side_that_it_is_nearer_to():
    """The heading asks it to go east, where another one may be searching."""
    assert goal_beside(700, role="pursue")[0] > 500.0
    assert goal_beside(700)[0] < 500.0
    assert goal_beside(300)[0] > 500.0


def test_who_was_not_heard_of_for_long_or_is_blind_has_no_part():
    assert goal_beside(700, STALE - 20.0)[0] < 500.0
    assert goal_beside(700, STALE)[0] > 500.0
    assert goal_beside(700, health="blind")[0] > 500.0


def test_where_others_are_counts_as_looked_at_but_is_not_told_on(city):
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    silent = search.pack(4.0)
    search.hear([beat(3.0, level(100, 100), (0, 0), health="blind")])
    assert np.nanmax(search.ages) == NEVER
    search.hear([beat(3.5, level(100, 100), (0, 0))])
    assert np.nanmax(search.ages) == 3.5
    search.hear([beat(2.0, level(300, 200), (0, 0))])  # overtaken by a later one
    assert np.nanmin(search.ages[search.ages > NEVER]) == 3.5
    assert search.pack(4.0) == silent


def test_areas_draw_the_search():
    city = City.open((600.0, 600.0))
    pose = level(300, 300)
    corner = Area(center=(560.0, 40.0), radius=80.0, priority=5.0)
    plain = SearchMap(city, AIRFRAME, CAMERA, cell=CELL).leg(0.0, pose)[1]
    drawn = SearchMap(city, AIRFRAME, CAMERA, cell=CELL, areas=[corner]).leg(0.0, pose)[1]
    assert priority_at([corner], plain) == 1.0
    assert priority_at([corner], drawn) == 5.0
    shunned = Area(center=plain, radius=100.0, priority=0.1)
    other = SearchMap(city, AIRFRAME, CAMERA, cell=CELL, areas=[shunned]).leg(0.0, pose)[1]
    assert priority_at([shunned], other) == 1.0


def test_lost_targets_draw_the_search_and_are_asked_for_only_with_a_new_goal():
    asked = []

    def lost():
        asked.append(True)
        random = np.random.default_rng(1)
        return [(random.normal((500.0, 60.0), 15.0, (200, 2)), np.full(200, 1.0 / 200.0))]

    search = SearchMap(City.open((600.0, 600.0)), AIRFRAME, CAMERA, cell=CELL)
    pose = level(300, 300, 2.0)
    _, goal = search.leg(0.0, pose, lost)
    half = 0.5 * sight_radius(AIRFRAME, CAMERA) + 60.0
    assert max(abs(goal[0] - 500.0), abs(goal[1] - 60.0)) < half
    search.leg(1.0, pose, lost)
    assert len(asked) == 1


def test_a_search_sees_every_street_of_the_city_within_minutes(city):
    """One aircraft that flies its legs at constant speed leaves no cell unseen."""
    search = SearchMap(city, AIRFRAME, CAMERA, cell=CELL)
    x, y, heading = 10.0, 10.0, 0.5
    for k in range(240):
        pose = level(x, y, heading)
        search.look(float(k), pose)
        _, (gx, gy) = search.leg(float(k), pose)
        away = math.remainder(math.atan2(gy - y, gx - x) - heading, math.tau)
        heading += max(-0.45, min(0.45, away))
        x, y = x + 15.0 * math.cos(heading), y + 15.0 * math.sin(heading)
    assert np.nanmin(search.ages) > NEVER


def test_a_city_without_streets_sends_the_aircraft_to_its_middle():
    full = City.from_outlines([shapely.box(0, 0, 100, 100)], [10.0], (100.0, 100.0))
    search = SearchMap(full, AIRFRAME, CAMERA, cell=CELL)
    assert search.leg(0.0, level(0, 0))[1] == (50.0, 50.0)
