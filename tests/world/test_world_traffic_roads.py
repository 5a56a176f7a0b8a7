"""Road followers against shapely's free space, against one another, and against the road rules."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from staniel.angles import wrap_array
from staniel.city import City, RoadNetwork
from staniel.datatypes.clock import Clock
from staniel.errors import ScenarioError
from staniel.world.config import Traffic
from staniel.world.roads import RoadFollowers, arcs_of

KEY = np.random.SeedSequence(7).generate_state(1, np.uint64)[0]
FOOTPRINTS = Path(__file__).parents[3] / "shared" / "data" / "footprints"


def grid(blocks=4, side=60.0, margin=30.0, both=True):
    """Streets between square blocks of houses, 12 m wide from wall to wall."""
    lines = np.arange(blocks + 1) * side + margin
    size = 2 * margin + blocks * side
    nodes = np.array([[x, y] for x in lines for y in lines])
    n = blocks + 1
    index = np.arange(n * n).reshape(n, n)
    edges = np.concatenate(
        [
            np.stack([index[:-1].ravel(), index[1:].ravel()], axis=1),
            np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=1),
        ]
    )
    houses = [
        shapely.box(x + 6, y + 6, x + side - 6, y + side - 6)
        for x in lines[:-1]
        for y in lines[:-1]
    ]
    city = City.from_outlines(houses, [10.0] * len(houses), (size, size))
    return replace(city, roads=RoadNetwork(nodes, edges, np.full(len(edges), both)))


def driven(city, traffic, ticks, clock=None):
    drivers = RoadFollowers(city, traffic, clock or Clock(), KEY)
    vehicles, memory = drivers.begin()
    path = [vehicles[None]]
    for tick in range(ticks):
        steps, memory = drivers.drive(vehicles, memory, tick)
        vehicles = steps[-1].copy()
        path.append(steps)
    return np.concatenate(path)


def assert_free(city, path, radius):
    """No disc overlaps a building, leaves the city, or overlaps another disc: none at any time."""
    tree = shapely.STRtree(city.outlines)
    points = shapely.points(path[:, :, 0].ravel(), path[:, :, 1].ravel())
    hits = tree.query(points, predicate="dwithin", distance=radius - 1e-9)
    assert hits.shape[1] == 0
    for axis in (0, 1):
        assert (path[:, :, axis] >= radius).all()
        assert (path[:, :, axis] <= city.size[axis] - radius).all()
    for at in path:
        places = shapely.points(at[:, :2])
        near = shapely.STRtree(places).query(
            places, predicate="dwithin", distance=2 * radius - 1e-9
        )
        assert (near[0] == near[1]).all()


def way(path):
    return np.hypot(np.diff(path[:, :, 0], axis=0), np.diff(path[:, :, 1], axis=0))


@pytest.mark.parametrize(
    ("count", "speed", "both"), [(40, 8.0, True), (15, 25.0, True), (150, 8.0, True)]
)
def test_followers_stay_free_and_the_traffic_flows(count, speed, both):
    city = grid(both=both)
    path = driven(city, Traffic(kind="roads", count=count, speed=speed), 120)
    assert_free(city, path, 1.0)
    step = way(path)
    assert (step <= speed * 0.1 + 2e-3).all()
    assert step[-600:].sum(axis=0).min() > 5.0  # nobody is stuck for good
    if count < 100:
        assert step.sum(axis=0).mean() > 120.0 * 3.5


def test_speed_changes_within_the_limit_and_motion_is_along_the_heading():
    path = driven(grid(), Traffic(kind="roads", count=1, speed_range=(14.0, 14.0)), 300)[:, 0]
    change = np.diff(path[:, 3])
    assert np.abs(change[path[1:, 3] > 0.0]).max() <= 0.2 + 1e-9
    step = np.diff(path[:, :2], axis=0)
    length = np.hypot(*step.T)
    np.testing.assert_allclose(length, 0.1 * path[1:, 3], atol=2.5e-2)
    turned = wrap_array(np.diff(path[:, 2]))
    assert np.abs(turned).max() <= np.radians(60.0) * 0.1 + 1e-6
    moving = length > 0.05
    aside = np.sin(np.arctan2(step[:, 1], step[:, 0]) - path[:-1, 2] - 0.5 * turned)
    assert np.abs(aside[moving]).max() < 0.05
    assert len(np.unique(np.round(path[::20, 2] / (np.pi / 2)) % 4)) == 4
    assert path[:, 3].max() > 10.0


def test_they_keep_right():
    """Half-way between junctions everyone is as far to the right as the scenario says."""
    path = driven(grid(), Traffic(kind="roads", count=10, speed=8.0), 100).reshape(-1, 4)
    along = np.abs(np.cos(path[:, 2])) > 0.999  # eastward or westward
    middle = along & (np.abs((path[:, 0] - 60.0) % 60.0 - 0.0) < 10.0)
    side = (path[middle, 1] - 30.0 + 30.0) % 60.0 - 30.0
    np.testing.assert_allclose(side, -1.5 * np.cos(path[middle, 2]), atol=0.05)
    assert middle.sum() > 100


def test_one_way_roads_are_driven_one_way():
    ring = np.array([[20.0, 20.0], [80.0, 20.0], [80.0, 80.0], [20.0, 80.0]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    city = replace(
        City.open((100.0, 100.0)), roads=RoadNetwork(ring, edges, np.zeros(4, dtype=bool))
    )
    path = driven(city, Traffic(kind="roads", count=5, speed=5.0), 100)
    assert_free(city, path, 1.0)
    bearing = np.unwrap(np.arctan2(path[..., 1] - 50.0, path[..., 0] - 50.0), axis=0)
    assert (np.diff(bearing, axis=0) >= -1e-3).all()
    assert (bearing[-1] - bearing[0] > 2 * np.pi).all()


def test_stops_are_as_long_and_as_often_as_asked():
    traffic = Traffic(kind="roads", count=4, speed=5.0, stop_interval=20.0, stop_duration=10.0)
    path = driven(grid(), traffic, 600)
    standing = (path[..., 3] == 0.0).mean()
    assert 0.2 < standing < 0.5  # 10 s of every 30, and some before junctions


def test_each_vehicle_has_its_own_speed_and_draws():
    """Far apart in a wide grid: the first three drive as if the fourth were not there."""
    nodes = np.array([[x, y] for x in (500.0, 5500.0) for y in (500.0, 5500.0)])
    edges = np.array([[0, 1], [1, 3], [3, 2], [2, 0]])
    city = replace(
        City.open((6000.0, 6000.0)), roads=RoadNetwork(nodes, edges, np.ones(4, dtype=bool))
    )
    settings = {"kind": "roads", "speed_range": (5.0, 15.0)}
    three = driven(city, Traffic(count=3, **settings), 40)
    four = driven(city, Traffic(count=4, **settings), 40)
    np.testing.assert_array_equal(three, four[:, :3])
    top = four[..., 3].max(axis=0)
    assert (top >= 5.0).all()
    assert (top <= 15.0).all()
    assert np.ptp(top) > 0.5


def test_arcs_lead_back_and_slow_down_in_time():
    nodes = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0]])
    network = RoadNetwork(nodes, np.array([[0, 1], [1, 2]]), np.array([True, True]))
    traffic = Traffic(max_acceleration=2.0, lane_offset=0.0)
    roads = arcs_of(network, traffic, City.open((200.0, 200.0)).walls)
    forth = roads.arcs[:, 2]
    np.testing.assert_array_equal(roads.arcs[forth, 0], roads.arcs[:, 1])
    np.testing.assert_array_equal(forth[forth], np.arange(4))
    # Before a dead end one must be able to stop; before a right angle, to take its fillet.
    # The fillet takes 3 m of each leg.
    dead_end = np.sqrt(2 * 2.0 * 47.0)
    assert roads.entry[1] == pytest.approx(dead_end)
    assert roads.entry[0] == pytest.approx(np.sqrt((np.pi / 3 * 3.0) ** 2 + 2 * 2.0 * 94.0))


def test_followers_of_real_streets_stay_free():
    files = [FOOTPRINTS / f"helsinki_centre_{kind}.geojson" for kind in ("buildings", "roads")]
    if not all(file.is_file() for file in files):
        pytest.skip("no shared/data/footprints")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # repairs are counted elsewhere
        city = City.from_geojson(files[0], heights=(10.0, 20.0), roads=files[1])
    path = driven(city, Traffic(kind="roads", count=100, speed_range=(4.0, 14.0)), 60)
    assert_free(city, path[::3], 1.0)
    assert way(path).sum(axis=0).mean() > 60.0 * 2.0


def test_roads_are_asked_for_by_name():
    with pytest.raises(ScenarioError, match=r"no roads, expected city\.roads"):
        RoadFollowers(City.open((100.0, 100.0)), Traffic(kind="roads"), Clock(), KEY)


def test_roads_too_narrow_for_the_vehicles_are_refused():
    with pytest.raises(ScenarioError, match=r"none of the 40 pieces of road is wide enough"):
        RoadFollowers(grid(), Traffic(kind="roads", radius=7.0), Clock(), KEY)


def test_more_vehicles_than_fit_are_refused():
    with pytest.raises(ScenarioError, match=r"vehicle \d+ cannot be placed: no free place on"):
        RoadFollowers(grid(1), Traffic(kind="roads", count=500), Clock(), KEY).begin()
