"""A blank chart grows from lidar while it is flown by: to the goal or not, into no building."""

import math

import numpy as np
import pytest
import shapely
from test_planning import real, tall

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.lidar import LidarScan
from staniel.errors import PlanningError
from staniel.guidance.planning import Chart, Explorer, Obstacles
from staniel.kernels.lidar import sweep
from staniel.world.lidar import build_facades

RANGE, SIGMA, STEP = 150.0, 0.1, math.radians(1.0)
CLEARANCE, RADIUS = 3.0, 25.0
ANGLES = STEP * np.arange(-180, 180.0)


class Sky:
    """The truth, which the explorer sees by its beams only."""

    def __init__(self, city, altitude):
        self.city, self.altitude, self.facades = city, altitude, build_facades(city)
        self.walls = tall(city, altitude, 0.0)
        self.fan = np.column_stack((np.cos(ANGLES + 0.5 * STEP), np.sin(ANGLES + 0.5 * STEP)))

    def scan(self, pose, tick):
        path = np.array([[[pose[0], pose[1], self.altitude, pose[2], 0.0, 15.0]]])
        key = np.uint64(7)
        ranges = sweep(
            self.facades, self.city.walls, path, self.fan, STEP, RANGE, SIGMA, key, tick
        )[0, 0]
        seat = Pose(pose[0], pose[1], self.altitude, pose[2], 0.0, 15.0)
        return LidarScan(float(tick), seat, ANGLES + 0.5 * STEP, ranges, SIGMA)

    def fly(self, explorer, pose, most=600):
        """All that is flown, (n, 2), and the outcome."""
        flown = []
        over = 0
        for tick in range(most):
            leg = explorer.step(pose, self.scan(pose, tick))
            # It goes on flying after the end, and must not meet a wall then, either.
            over += leg.outcome in ("arrived", "no path")
            if over > 15:
                return np.concatenate(flown), leg.outcome
            flown.append(leg.path.poses(0.5)[:, :2])
            assert np.hypot(*(flown[-1][0] - pose[:2])) < 1e-6
            pose = leg.path.end
        return np.concatenate(flown), "still flying"


def blank(city, altitude, margin=0.0):
    return Chart(
        Obstacles.open(city.size, altitude=altitude, clearance=CLEARANCE, margin=margin), RANGE
    )


def places(city, altitude, rng, margin=0.0):
    """A start with a free circle to its left, and a goal."""
    truth = Obstacles.from_city(city, altitude=altitude, clearance=CLEARANCE, margin=margin)
    inner = truth.distance > 2.3 * RADIUS
    start = truth.middles[inner][rng.integers(inner.sum())]
    inner = truth.distance > 1.2 * RADIUS
    return start, truth.middles[inner][rng.integers(inner.sum())]


@pytest.mark.parametrize("planner", ["astar", "dstar"])
@pytest.mark.parametrize("name", ["Boston_0_512.map", "helsinki_centre_buildings.geojson"])
def test_a_real_city_is_crossed_without_a_map(name, planner):
    city = real(name)
    altitude = 0.8 * city.tallest
    sky, rng, outcomes = Sky(city, altitude), np.random.default_rng(4), []
    for _ in range(4):
        start, goal = places(city, altitude, rng)
        chart = blank(city, altitude)
        explorer = Explorer(
            chart, tuple(goal), turn_radius=RADIUS, home=1, tolerance=10.0, planner=planner
        )
        flown, outcome = sky.fly(explorer, (*start, rng.uniform(-3.0, 3.0)))
        line = shapely.LineString(flown)
        assert shapely.distance(line, np.array(sky.walls, dtype=object)).min() > 1.0
        outcomes.append(outcome)
        # Nothing that it takes for seen and free has a building in it.
        truth = Obstacles.from_city(city, altitude=altitude + 0.01, clearance=0.01)
        seen = np.isfinite(chart.seen_free().price)
        assert seen.sum() > 500
        assert not (truth.blocked & seen).any()
    assert outcomes.count("arrived") >= 3
    assert "still flying" not in outcomes


def ringed(gap):
    ring = shapely.Point(250, 250).buffer(90.0) - shapely.Point(250, 250).buffer(80.0)
    ring -= shapely.box(250.0, 250.0 - gap, 400.0, 250.0 + gap)
    return City.from_outlines([ring], [60.0], (500.0, 500.0))


def test_a_goal_in_a_closed_ring_has_no_path_and_one_in_an_open_ring_is_reached():
    for gap, expected in ((0.0, "no path"), (55.0, "arrived")):
        sky = Sky(ringed(gap), 50.0)
        explorer = Explorer(
            blank(sky.city, 50.0), (250.0, 250.0), turn_radius=RADIUS, home=1, tolerance=10.0
        )
        flown, outcome = sky.fly(explorer, (60.0, 60.0, 0.0))
        assert outcome == expected
        assert shapely.LineString(flown).distance(sky.walls[0]) > 1.0
        assert explorer.plans > 1


def test_nothing_is_flown_that_was_not_seen():
    """Without a single scan the aircraft circles where it was told it is free."""
    chart = blank(City.open((400.0, 400.0)), 50.0)
    explorer = Explorer(chart, (380.0, 200.0), turn_radius=RADIUS, home=-1)
    pose = (200.0, 200.0, 0.0)
    for _ in range(50):
        leg = explorer.step(pose)
        assert leg.outcome in ("waiting", "no path")
        pose = leg.path.end
        assert math.dist(pose[:2], (200.0, 200.0 - RADIUS)) == pytest.approx(RADIUS)


def test_bad_settings_are_refused():
    chart = blank(City.open((400.0, 400.0)), 50.0)
    with pytest.raises(PlanningError, match=r"turn_radius = 0\.0"):
        Explorer(chart, (1.0, 1.0), turn_radius=0.0, home=1)
    with pytest.raises(PlanningError, match="stride = nan"):
        Explorer(chart, (1.0, 1.0), turn_radius=9.0, home=1, stride=math.nan)
    with pytest.raises(PlanningError, match="planner = 'luck'"):
        Explorer(chart, (1.0, 1.0), turn_radius=9.0, home=1, planner="luck")
    with pytest.raises(PlanningError, match="range = 0"):
        Chart(chart.obstacles, 0)
