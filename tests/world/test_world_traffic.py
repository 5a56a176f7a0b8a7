"""Vehicles against a shapely oracle of free space, against one another, and as travellers."""

import numpy as np
import pytest
import shapely

from staniel.angles import wrap_array
from staniel.city import City
from staniel.errors import CityError, ScenarioError, StanielError
from staniel.kernels.neighbours import neighbours
from staniel.kernels.streets import streets
from staniel.kernels.traffic import drive
from staniel.world.config import Traffic
from staniel.world.traffic import begin, habits

KEYS = np.random.SeedSequence(7).generate_state(2, np.uint64)


def driven(city, traffic, ticks, dt=0.1, substeps=10, keys=KEYS):
    vehicles, memory = begin(city, traffic, keys[0])
    speeds = np.full(traffic.count, traffic.speed)
    path = [vehicles[None]]
    for tick in range(ticks):
        steps, memory = drive(
            city.walls, vehicles, memory, habits(traffic), speeds, keys[1], tick, dt, substeps
        )
        vehicles = steps[-1].copy()
        path.append(steps)
    return np.concatenate(path)


def assert_free(city, path, radius):
    """No disc overlaps a building, leaves the city, or overlaps another disc: none at any time."""
    built = shapely.union_all(city.outlines)
    shapely.prepare(built)
    points = shapely.points(path[:, :, 0].ravel(), path[:, :, 1].ravel())
    assert (shapely.distance(built, points) >= radius - 1e-9).all()
    for axis in (0, 1):
        assert (path[:, :, axis] >= radius).all()
        assert (path[:, :, axis] <= city.size[axis] - radius).all()
    for at in path:
        tree = shapely.STRtree(shapely.points(at[:, :2]))
        near = tree.query(
            shapely.points(at[:, :2]), predicate="dwithin", distance=2 * radius - 1e-9
        )
        assert (near[0] == near[1]).all()


@pytest.fixture(scope="module")
def city():
    return City.generate(seed=3)


def test_four_vehicles_stay_free_cover_ground_and_turn(city):
    path = driven(city, Traffic(), 600)
    assert_free(city, path, 1.0)
    way = np.hypot(np.diff(path[:, :, 0], axis=0), np.diff(path[:, :, 1], axis=0))
    assert (way <= 0.2 + 1e-9).all()
    assert (way.sum(axis=0) > 0.9 * 1200.0).all()
    for i in range(4):
        cells = {(int(x // 10), int(y // 10)) for x, y in path[:, i, :2]}
        assert len(cells) > 60  # of at most about 130 in 1200 m
        headings = path[::50, i, 2]
        quadrants = np.unique(np.round(headings / (np.pi / 2)) % 4)
        assert len(quadrants) == 4  # in ten minutes everyone drives every way


@pytest.mark.parametrize(("speed", "dt"), [(14.0, 0.1), (40.0, 0.2)])
def test_fast_vehicles_stay_free_and_do_not_jump_through_walls(city, speed, dt):
    path = driven(city, Traffic(speed=speed), 200, dt=dt, substeps=5)
    assert_free(city, path, 1.0)
    built = shapely.union_all(city.outlines)
    for i in range(4):
        assert shapely.LineString(path[:, i, :2]).intersection(built).length < 1e-6
    way = np.hypot(np.diff(path[:, :, 0], axis=0), np.diff(path[:, :, 1], axis=0))
    assert way.sum(axis=0).min() > 0.3 * speed * dt * len(way)


def test_forty_vehicles_in_a_small_city_never_overlap():
    city = City.generate(size=(250.0, 250.0), density=0.35, seed=2)
    path = driven(city, Traffic(count=40), 150)
    assert_free(city, path, 1.0)
    way = np.hypot(np.diff(path[:, :, 0], axis=0), np.diff(path[:, :, 1], axis=0))
    assert way.sum() > 0.6 * 40 * 300.0  # and the traffic flows


def test_a_lane_narrower_than_the_feelers_is_survived():
    """Both feelers always blocked along it: the vehicle rotates, and stays where it may be."""
    walls = [shapely.box(0, 0, 100, 46.5), shapely.box(0, 53.5, 100, 100)]
    city = City.from_outlines(walls, [10.0, 10.0], (100.0, 100.0))
    path = driven(city, Traffic(count=3, feeler_angle_deg=80.0), 60)
    assert_free(city, path, 1.0)


def test_wheels_roll_as_in_eq_4_1():
    """Each step goes along the heading half way through its turn, as far as the wheels' mean."""
    city = City.open((1000.0, 1000.0))
    path = driven(city, Traffic(count=1), 30)[:, 0]
    turned = wrap_array(np.diff(path[:, 2]))
    way = np.hypot(*np.diff(path[:, :2], axis=0).T)
    direction = np.arctan2(np.diff(path[:, 1]), np.diff(path[:, 0]))
    moving = way > 0
    np.testing.assert_allclose(
        np.cos(direction - path[:-1, 2] - 0.5 * turned)[moving], 1.0, atol=1e-12
    )
    np.testing.assert_allclose(way[moving], 0.2, rtol=1e-9)
    # Straight on, on the 10 m arc of a drift, or at 60 deg/s away from the edge.
    arcs = np.unique(np.abs(turned[moving]).round(9))
    assert set(arcs) <= {0.0, 0.02, round(np.pi / 30.0, 9)}
    assert {0.0, 0.02} <= set(arcs)


def test_another_vehicle_changes_nobody_elses_way():
    """In the open, far apart: the first four drive as if the fifth were not there."""
    city = City.open((3000.0, 3000.0))
    four = driven(city, Traffic(count=4), 60)
    five = driven(city, Traffic(count=5), 60)
    np.testing.assert_array_equal(four, five[:, :4])


def test_neighbours_are_found_however_they_lie():
    """Many vehicles against one call per pair distance: the grid misses nobody near."""
    rng = np.random.default_rng(0)
    for shape in ((300.0, 300.0), (900.0, 1e-9), (1e-9, 900.0), (5000.0, 5000.0)):
        vehicles = np.column_stack([rng.uniform(0, 1, (150, 2)) * shape, np.zeros((150, 2))])
        first, near = neighbours(vehicles, 20.0)
        apart = np.hypot(*(vehicles[:, None, :2] - vehicles[None, :, :2]).T).T
        for i in range(150):
            expected = set(np.flatnonzero(apart[i] < 20.0)) - {i}
            assert set(near[first[i] : first[i + 1]]) == expected


def test_vehicles_begin_apart_and_off_the_walls(city):
    vehicles, _ = begin(city, Traffic(count=30), KEYS[0])
    points = shapely.points(vehicles[:, :2])
    assert (shapely.distance(shapely.union_all(city.outlines), points) >= 3.0 - 1e-9).all()
    apart = shapely.distance(points[:, None], points[None, :]) + 99.0 * np.eye(30)
    assert apart.min() >= 3.0
    assert (vehicles[:, 3] == 0.0).all()


def test_vehicles_begin_outside_closed_courtyards():
    court = shapely.box(20, 20, 180, 180) - shapely.box(40, 40, 160, 160)
    city = City.from_outlines([court], [10.0], (200.0, 400.0))
    vehicles, _ = begin(city, Traffic(count=40), KEYS[0])
    inside = shapely.contains_xy(shapely.box(40, 40, 160, 160), vehicles[:, 0], vehicles[:, 1])
    assert not inside.any()
    assert len(np.unique(vehicles[:, 1] > 200.0)) == 2  # round the block and north of it


def test_streets_are_the_largest_connected_part():
    wall = shapely.box(0, 40, 100, 45)
    city = City.from_outlines([wall], [10.0], (100.0, 100.0))
    street = streets(city.walls, 1.0, 1.0)
    assert not street[:45].any()
    assert street[47:98].sum() > 4500


def test_parked_vehicles_stay():
    path = driven(City.open((100.0, 100.0)), Traffic(speed=0.0), 10)
    np.testing.assert_array_equal(path[-1], path[0])


def test_no_vehicles_are_legal():
    path = driven(City.open((100.0, 100.0)), Traffic(count=0), 2)
    assert path.shape == (21, 0, 4)


def test_a_vehicle_without_a_place_is_refused():
    with pytest.raises(
        ScenarioError, match=r"vehicle \d+ cannot be placed: no free place of radius 1"
    ):
        begin(City.open((20.0, 20.0)), Traffic(count=50), KEYS[0])


def test_a_city_without_free_space_is_refused():
    full = City.from_outlines([shapely.box(0, 0, 50, 50)], [10.0], (50.0, 50.0))
    with pytest.raises(CityError, match="no free space"):
        begin(full, Traffic(count=0), KEYS[0])


@pytest.mark.parametrize(
    "change", [{"count": -1}, {"count": 10_001}, {"radius": 0.0}, {"speed": -1.0}, {"wheels": 4}]
)
def test_traffic_out_of_bounds_is_refused(change):
    with pytest.raises(ValueError, match=next(iter(change))) as error:
        Traffic(**change)
    assert not isinstance(error.value, StanielError)  # the scenario's door words it
