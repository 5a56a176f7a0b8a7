"""Road followers over long runs: nobody jams, nobody touches anybody, and the limits are kept."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from staniel.angles import wrap_array
from staniel.city import City, RoadNetwork
from staniel.datatypes.clock import Clock
from staniel.world.config import Traffic
from staniel.world.roads import RoadFollowers, arcs_of
from staniel.world.traffic import Wanderers, speeds

FOOTPRINTS = Path(__file__).parents[3] / "shared" / "data" / "footprints"
SUBSTEPS = 10


def key_of(seed):
    return np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]


@pytest.fixture(scope="module")
def helsinki():
    files = [FOOTPRINTS / f"helsinki_centre_{kind}.geojson" for kind in ("buildings", "roads")]
    if not all(file.is_file() for file in files):
        pytest.skip("no shared/data/footprints")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # repairs are counted elsewhere
        return City.from_geojson(files[0], heights=(10.0, 20.0), roads=files[1])


def driven(city, traffic, seconds, seed=7):
    """(steps, n, 4) all vehicles after each dynamics step, the start first."""
    drivers = RoadFollowers(city, traffic, Clock(), key_of(seed))
    vehicles, memory = drivers.begin()
    path = np.empty((seconds * SUBSTEPS + 1, *vehicles.shape))
    path[0] = vehicles
    for tick in range(seconds):
        steps, memory = drivers.drive(path[tick * SUBSTEPS], memory, tick)
        path[tick * SUBSTEPS + 1 : (tick + 1) * SUBSTEPS + 1] = steps
    return path


def nearest_two(at):
    """Distance of the two nearest of (n, 2) places: all pairs, sorted by their east."""
    at = at[np.argsort(at[:, 0])]
    least = np.inf
    for k in range(1, len(at)):
        apart = at[k:] - at[:-k]
        if apart[:, 0].min() > least:
            return least
        least = min(least, np.hypot(apart[:, 0], apart[:, 1]).min())
    return least


def assert_apart(city, path, radius):
    """No disc overlaps another or a building at any dynamics step."""
    assert min(nearest_two(at[:, :2]) for at in path) >= 2.0 * radius - 1e-9
    tree = shapely.STRtree(city.outlines)
    points = shapely.points(path[..., 0].ravel(), path[..., 1].ravel())
    hits = tree.query(points, predicate="dwithin", distance=radius - 1e-9)
    assert hits.shape[1] == 0


def moved(path, seconds):
    """Way of each vehicle in the last seconds [m]."""
    step = np.diff(path[-seconds * SUBSTEPS - 1 :, :, :2], axis=0)
    return np.hypot(step[..., 0], step[..., 1]).sum(axis=0)


def test_a_hundred_drive_through_helsinki_for_ten_minutes(helsinki):
    path = driven(helsinki, Traffic(kind="roads", count=100, speed_range=(4.0, 14.0)), 600)
    assert (moved(path, 60) > 5.0).mean() >= 0.98
    assert moved(path, 600).mean() > 600.0 * 4.5
    assert_apart(helsinki, path, 1.0)
    change = np.diff(path[..., 3], axis=0)
    assert change.max() <= 0.2 + 1e-9
    assert (change < -0.2 - 1e-9).mean() < 2e-4  # dead stops before a touch
    assert (path[..., 3] <= 14.0).all()
    # A fillet at the turn rate, or a bend so slight that it has none.
    turned = np.abs(wrap_array(np.diff(path[..., 2], axis=0)))
    assert turned.max() <= 0.2 + np.radians(60.0) * 0.1
    assert (turned > np.radians(60.0) * 0.1 + 1e-6).mean() < 0.01


def test_four_hundred_still_move_after_ten_minutes(helsinki):
    path = driven(helsinki, Traffic(kind="roads", count=400, speed_range=(4.0, 14.0)), 600)
    assert (moved(path, 60) > 5.0).mean() >= 0.9
    assert min(nearest_two(at[:, :2]) for at in path[::3]) >= 2.0 - 1e-9


def crossroads(arms):
    """Roads from a ring into one junction, where it would be blocked by who cannot leave it."""
    far, turn = 120.0, 2.0 * np.pi / arms
    angles = turn * np.arange(arms)
    ring = 150.0 + far * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    nodes = np.concatenate([[[150.0, 150.0]], ring])
    edges = [[0, k + 1] for k in range(arms)]
    edges += [[k + 1, (k + 1) % arms + 1] for k in range(arms)]
    city = City.open((300.0, 300.0))
    both = np.ones(len(edges), dtype=np.bool_)
    return replace(city, roads=RoadNetwork(nodes, np.array(edges), both))


@pytest.mark.parametrize(("arms", "count"), [(4, 40), (5, 40)])
def test_nobody_stands_in_a_junction(arms, count):
    path = driven(crossroads(arms), Traffic(kind="roads", count=count, speed=8.0), 300)
    assert min(nearest_two(at[:, :2]) for at in path) >= 2.0 - 1e-9
    assert (moved(path, 120) > 5.0).all()
    inside = np.hypot(path[..., 0] - 150.0, path[..., 1] - 150.0) < 2.5
    assert inside.any(axis=0).sum() > 0.9 * count
    # Of two in it one would wait for the other; from a standstill one is through in a few seconds.
    longest, now = 0, np.zeros(count, dtype=np.int64)
    for at in inside:
        now = np.where(at, now + 1, 0)
        longest = max(longest, now.max())
    assert longest <= 6 * SUBSTEPS


def test_lanes_that_come_together_are_contested_by_one_another():
    """By the distance of straight lanes, of arcs that do not follow one another."""
    rng = np.random.default_rng(4)
    nodes = rng.uniform(20.0, 280.0, (14, 2))
    edges = np.array([[k, (k + 1) % 14] for k in range(14)])
    network = RoadNetwork(nodes, edges, np.zeros(14, dtype=np.bool_))
    traffic = Traffic(kind="roads", lane_offset=0.0)
    roads = arcs_of(network, traffic, City.open((300.0, 300.0)).walls)
    lanes = [shapely.LineString(nodes[edge]) for edge in edges]
    crossings = 0
    for a in range(14):
        for b in range(14):
            if a == b or set(edges[a]) & set(edges[b]):
                continue
            near = lanes[a].intersection(lanes[b].buffer(2.0))
            stretches = range(roads.stretch[a], roads.stretch[a + 1])
            rivals = {
                int(rival)
                for s in stretches
                for rival in roads.rivals[roads.first_rival[s] : roads.first_rival[s + 1]]
            }
            met = rivals & set(range(roads.stretch[b], roads.stretch[b + 1]))
            assert bool(met) >= (not near.is_empty)
            if near.is_empty:
                assert not met or lanes[a].distance(lanes[b]) < 3.0
                continue
            crossings += 1
            # All of it is in the stretches, which count backward from the arc's end.
            covered = shapely.union_all(
                [
                    shapely.LineString(
                        [
                            lanes[a].interpolate(lanes[a].length - min(max(way, 0.0), 1e3))
                            for way in (min(roads.contested[s, 0], lanes[a].length), low)
                        ]
                    )
                    for s in stretches
                    for low in [max(roads.contested[s, 1], 0.0)]
                ]
            )
            assert near.difference(covered.buffer(1e-3)).length < 1e-6
    assert crossings >= 10


def test_speeds_are_drawn_for_any_key():
    traffic = Traffic(count=3, speed_range=(4.0, 14.0))
    drawn = np.array([speeds(traffic, key_of(seed)) for seed in range(40)])
    assert drawn.min() >= 4.0
    assert drawn.max() <= 14.0
    assert len(np.unique(drawn)) == 120


def test_wanderers_neither_touch_nor_come_to_a_halt():
    city = City.generate(seed=3)
    traffic = Traffic(count=40, speed_range=(1.0, 25.0))
    drivers = Wanderers(city, traffic, Clock(), key_of(1), key_of(2))
    vehicles, memory = drivers.begin()
    path = [vehicles[None]]
    for tick in range(400):
        steps, memory = drivers.drive(path[-1][-1], memory, tick)
        path.append(steps)
    path = np.concatenate(path)
    assert_apart(city, path, 1.0)
    assert (moved(path, 60) > 5.0).mean() > 0.95
    for axis in (0, 1):
        assert (path[..., axis] >= 1.0).all()
        assert (path[..., axis] <= city.size[axis] - 1.0).all()
