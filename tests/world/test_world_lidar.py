"""Lidar ranges against exact fractions and shapely, noise against its law, keys, the mission."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from shapely import affinity

from staniel.city import City
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.equipment import Lidar
from staniel.datatypes.lidar import LidarScan
from staniel.datatypes.truth import Truth
from staniel.errors import ScenarioError
from staniel.kernels import lidar as kernel
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble
from staniel.world import Lidars


def truth_of(path, tick=1):
    """A truth whose aircraft flew the (s, n, 6) path."""
    path = np.asarray(path, dtype=float)
    none = np.zeros((0, 4))
    return Truth(tick, float(tick), path[-1], none, np.zeros((0, 3)), path, none[None])


def measure(city, poses, tick=1, seed=1, **settings):
    """Scans of aircraft at (n, 4) x, y, z, heading."""
    states = np.zeros((1, len(poses), 6))
    states[0, :, :4] = poses
    lidar = Lidar(**{"mount": "scanner", "noise": 0.0, **settings})
    percepts = [Percept(float(tick), Pose(*row), ()) for row in states[0].tolist()]
    lidars = Lidars(city, lidar, np.random.SeedSequence(seed))
    return [p.lidar for p in lidars.sense(truth_of(states, tick), percepts)]


def beam(city, x, y, heading, z=5.0, reach=100.0):
    (scan,) = measure(city, [(x, y, z, heading)], mount="rangefinder", range=reach)
    return float(scan.ranges[0])


# Against shapely


def nearest_boundary(walls, x, y, directions, reach):
    rays = [shapely.LineString([(x, y), (x + reach * dx, y + reach * dy)]) for dx, dy in directions]
    met = shapely.intersection(rays, walls)
    return np.array(
        [
            shapely.distance(shapely.Point(x, y), hit) if not hit.is_empty else math.inf
            for hit in met
        ]
    )


@pytest.mark.parametrize("seed", range(4))
def test_first_hits_equal_those_of_shapely(seed):
    city = City.generate(size=(400.0, 300.0), density=0.35, seed=seed)
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.1, 1.1, (300, 2)) * (400.0, 300.0)  # some beside the city
    places = places[~city.inside(places)][:12]
    z, reach = 22.0, 150.0
    poses = np.column_stack((places, np.full(len(places), z), rng.uniform(-3.1, 3.1, len(places))))
    scans = measure(city, poses, range=reach, aperture_deg=355.0, step_deg=5.0)
    tall = [o for o, h in zip(city.outlines, city.heights, strict=True) if h > z]
    walls = shapely.union_all([o.boundary for o in tall])
    for (x, y, _, _), scan in zip(poses, scans, strict=True):
        assert len(scan.ranges) == 71
        expected = nearest_boundary(walls, x, y, scan.directions(), reach)
        np.testing.assert_allclose(scan.ranges, expected, rtol=0.0, atol=1e-9)
        met = scan.points()
        if len(met):
            assert shapely.distance(shapely.points(met), walls).max() < 1e-9
    assert 0.2 < np.mean([scan.returned.mean() for scan in scans]) < 1.0


# Against exact fractions, with beams through corners and along walls

FORMS = {
    "box": [(0, 0), (4, 0), (4, 4), (0, 4)],
    "diamond": [(2, 0), (4, 2), (2, 4), (0, 2)],
    "triangle": [(0, 0), (4, 0), (0, 4)],
    "notched": [(0, 0), (4, 0), (4, 4), (2, 2), (0, 4)],
    "corner": [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)],
}
RAYS = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1), (2, 1), (-1, 2)]


def form_of(name, slot):
    east, north = 4.0 * (slot % 3) + 4.0, 4.0 * (slot // 3) + 4.0
    if name == "court":
        shape = shapely.box(0, 0, 4, 4) - shapely.box(1, 1, 3, 3)
    else:
        shape = shapely.Polygon(FORMS[name])
    return affinity.translate(shape, east, north)


def exactly_inside(outline, x, y):
    odd = False
    for ring in [outline.exterior, *outline.interiors]:
        for (x0, y0), (x1, y1) in pairwise([tuple(map(Fraction, p)) for p in ring.coords]):
            cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            if cross == 0 and min(x0, x1) <= x <= max(x0, x1) and min(y0, y1) <= y <= max(y0, y1):
                return False
            if (y0 <= y) != (y1 <= y) and (cross > 0) == (y1 > y0):
                odd = not odd
    return odd


def exact_range(outlines, x, y, dx, dy):
    """Where the ray first is inside of an outline: cut at every contact, look at every interval."""
    x, y = Fraction(x), Fraction(y)
    cuts = {Fraction(0), Fraction(100)}
    for outline in outlines:
        for ring in [outline.exterior, *outline.interiors]:
            for (x0, y0), (x1, y1) in pairwise([tuple(map(Fraction, p)) for p in ring.coords]):
                turn = dx * (y1 - y0) - dy * (x1 - x0)
                if turn == 0:
                    cuts |= {
                        ((a - x) * dx + (b - y) * dy) / (dx * dx + dy * dy)
                        for a, b in ((x0, y0), (x1, y1))
                    }
                else:
                    cuts.add(((x0 - x) * (y1 - y0) - (y0 - y) * (x1 - x0)) / turn)
    for a, b in pairwise(sorted(t for t in cuts if t >= 0)):
        middle = (a + b) / 2
        if any(exactly_inside(o, x + middle * dx, y + middle * dy) for o in outlines):
            return float(a) * math.hypot(dx, dy)
    return math.inf


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.sampled_from([*FORMS, "court", "street"]), min_size=9, max_size=9),
    st.integers(0, 40),
    st.integers(0, 40),
)
def test_grazing_beams_are_exact(names, east, north):
    """Buildings that touch one another, and beams from a half-metre raster along their lines."""
    outlines = [form_of(name, slot) for slot, name in enumerate(names) if name != "street"]
    city = City.from_outlines(outlines, np.full(len(outlines), 9.0), (20.0, 20.0))
    x, y = 0.5 * east, 0.5 * north
    poses = [(x, y, 5.0, math.atan2(dy, dx)) for dx, dy in RAYS]
    scans = measure(city, poses, mount="rangefinder", range=99.0)
    for (dx, dy), scan in zip(RAYS, scans, strict=True):
        expected = exact_range(city.outlines, x, y, dx, dy)
        assert scan.ranges[0] == pytest.approx(expected, abs=2e-9), (dx, dy)


def test_a_beam_passes_what_it_only_touches():
    diamond = shapely.Polygon([(20, 10), (30, 20), (20, 30), (10, 20)])
    behind = shapely.box(40, 0, 50, 60)
    city = City.from_outlines([diamond, behind], [20.0, 20.0], (60.0, 60.0))
    assert beam(city, 0.0, 30.0, 0.0) == 40.0  # over the north corner
    assert beam(city, 0.0, 30.0 - 1e-6, 0.0) == pytest.approx(20.0, abs=1e-5)
    assert beam(city, 0.0, 20.0, 0.0) == 10.0  # head on into a corner
    assert beam(city, 10.0, 20.0, 0.0) == 0.0  # from that corner
    assert beam(city, 10.0, 20.0, math.pi) == math.inf
    assert beam(city, 40.0, 55.0, math.pi / 2) == math.inf  # along a wall
    assert beam(city, 40.0, 55.0, math.pi) == math.inf  # from the wall, away


# What counts, and how far


def test_only_roofs_above_the_aircraft_and_walls_within_range_return():
    city = City.from_outlines(
        [shapely.box(20, 0, 30, 60), shapely.box(50, 0, 60, 60)], [12.0, 30.0], (100.0, 60.0)
    )
    assert beam(city, 0.0, 30.0, 0.0, z=11.9) == 20.0
    assert beam(city, 0.0, 30.0, 0.0, z=12.0) == 50.0
    assert beam(city, 0.0, 30.0, 0.0, z=30.0) == math.inf
    assert beam(city, 0.0, 30.0, 0.0, reach=20.0) == 20.0
    assert beam(city, 0.0, 30.0, 0.0, reach=19.9) == math.inf
    assert beam(city, -500.0, 30.0, 0.0, reach=600.0) == 520.0  # from outside the city
    assert beam(city, 55.0, 30.0, 0.0, z=20.0) == 0.0  # inside a building
    assert beam(city, 25.0, 30.0, 0.0, z=20.0) == 25.0  # above one


def test_bank_does_not_tilt_the_fan():
    city = City.from_outlines([shapely.box(20, 0, 30, 60)], [12.0], (60.0, 60.0))
    state = np.array([[[0.0, 30.0, 5.0, 0.0, 0.5, 15.0]]])
    lidars = Lidars(city, Lidar(mount="rangefinder", noise=0.0), np.random.SeedSequence(1))
    (percept,) = lidars.sense(truth_of(state), [Percept(1.0, Pose(*state[0, 0]), ())])
    assert percept.lidar.ranges[0] == 20.0


def test_an_open_city_returns_nothing():
    (scan,) = measure(City.open((50.0, 50.0)), [(25.0, 25.0, 5.0, 0.0)])
    assert not scan.returned.any()
    assert scan.points().shape == (0, 2)


# Noise and keys

WALL = City.from_outlines([shapely.box(30, 0, 60, 100)], [50.0], (100.0, 100.0))


def test_noise_has_its_law_and_every_beam_its_own():
    scans = [measure(WALL, [(0.0, 50.0, 9.0, 0.0)], tick=k, noise=0.4)[0] for k in range(300)]
    (clean,) = measure(WALL, [(0.0, 50.0, 9.0, 0.0)])
    back = clean.returned
    errors = np.array([scan.ranges[back] - clean.ranges[back] for scan in scans]) / 0.4
    assert errors.shape[1] > 80
    assert stats.kstest(errors.ravel(), "norm").pvalue > 0.01
    between = np.corrcoef(errors.T) - np.eye(errors.shape[1])
    assert np.abs(between).max() < 6.0 / math.sqrt(300)
    assert np.abs(np.corrcoef(errors[:-1].ravel(), errors[1:].ravel())[0, 1]) < 0.03


def test_another_aircraft_changes_no_draw():
    first, second = (0.0, 50.0, 9.0, 0.0), (0.0, 50.0, 9.0, 0.0)
    (alone,) = measure(WALL, [first], noise=0.3)
    both = measure(WALL, [first, second], noise=0.3)
    assert both[0] == alone
    assert both[1] != alone
    assert measure(WALL, [first], noise=0.3, seed=2)[0] != alone


def test_a_range_is_never_negative():
    (scan,) = measure(WALL, [(29.99, 50.0, 9.0, 0.0)], noise=1.0)
    assert scan.ranges.min() == 0.0


# Percepts


def test_a_rangefinder_measures_all_along_its_way_where_it_holds_itself_to_be():
    """Ten instants of a turn; the navigation is off by a shift and a turn."""
    city = City.from_outlines([shapely.box(40, 0, 60, 100)], [50.0], (100.0, 100.0))
    path = np.zeros((10, 1, 6))
    path[:, 0, 0], path[:, 0, 1], path[:, 0, 2] = np.linspace(5, 15, 10), 50.0, 9.0
    path[:, 0, 3] = np.linspace(-0.3, 0.3, 10)
    lidars = Lidars(city, Lidar(mount="rangefinder", noise=0.0), np.random.SeedSequence(1))

    def sensed(pose):
        (percept,) = lidars.sense(truth_of(path), [Percept(1.0, pose, ())])
        return percept.lidar

    true = sensed(Pose(*path[-1, 0].tolist()))
    assert len(true.ranges) == 10
    np.testing.assert_allclose(true.origins, path[:, 0, :2])
    np.testing.assert_allclose(true.points()[:, 0], 40.0)
    turned, shift = 0.2, np.array([3.0, -4.0])
    off = sensed(Pose(15.0 + shift[0], 50.0 + shift[1], 9.0, 0.3 + turned, 0.0, 15.0))
    turn = np.array([[math.cos(turned), -math.sin(turned)], [math.sin(turned), math.cos(turned)]])
    around = np.array([15.0, 50.0])
    expected = (true.points() - around) @ turn.T + around + shift
    np.testing.assert_allclose(off.points(), expected, atol=1e-9)


def test_a_scan_says_where_its_returns_are():
    (scan,) = measure(WALL, [(10.0, 50.0, 9.0, 0.3)], aperture_deg=90.0, step_deg=2.0)
    assert len(scan.angles) == 45
    assert scan.angles[0] == -scan.angles[-1] == pytest.approx(-math.radians(44.0))
    np.testing.assert_allclose(scan.points()[:, 0], 30.0)


def test_the_grid_holds_every_wall():
    city = City.generate(size=(200.0, 120.0), seed=3)
    facades = kernel.Facades(*Lidars(city, Lidar(), np.random.SeedSequence(0))._facades)
    walls = {tuple(row) for row in facades.edges.tolist()}
    rings = [r for o in city.outlines for r in (o.exterior, *o.interiors)]
    assert len(walls) == sum(len(r.coords) - 1 for r in rings)
    for x0, y0, x1, y1, _ in walls:  # a step to the left of every wall is inside
        length = math.hypot(x1 - x0, y1 - y0)
        left = np.array([y0 - y1, x1 - x0]) / length * 1e-3
        assert city.inside([np.array([x0 + x1, y0 + y1]) / 2.0 + left]).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"angles": [0.0, 1.0]},
        {"ranges": [-1.0]},
        {"ranges": [math.nan]},
        {"angles": [math.inf]},
        {"sigma": -0.1},
        {"sigma": math.nan},
        {"origins": [[0.0, 0.0], [1.0, 1.0]]},
    ],
)
def test_a_scan_refuses_what_it_cannot_be(changes):
    pose = Pose(0.0, 0.0, 9.0, 0.0, 0.0, 15.0)
    values = {"time": 0.0, "pose": pose, "angles": [0.0], "ranges": [5.0], "sigma": 0.1}
    LidarScan(**values)
    with pytest.raises(ValueError, match="LidarScan"):
        LidarScan(**(values | changes))


# The mission


def fly(**changes):
    scenario = load_scenario("downtown", minutes=0.2, **changes)
    return list(assemble(scenario, build_city(scenario.city, scenario.seed)).frames())


def test_a_mission_has_no_lidar_unless_it_is_asked_for():
    assert all(p.lidar is None for frame in fly() for p in frame.percepts)


def test_a_lidar_changes_nothing_else():
    """Above all roofs it sees nothing; nobody's luck depends on it."""
    plain, scanning = fly(), fly(**{"lidar.mount": "scanner"})
    for before, after in zip(plain, scanning, strict=True):
        np.testing.assert_array_equal(before.truth.aircraft, after.truth.aircraft)
        assert [p.sightings for p in before.percepts] == [p.sightings for p in after.percepts]
        for percept in after.percepts:
            assert percept.lidar.ranges.shape == (181,)
            assert not percept.lidar.returned.any()
    assert fly(**{"lidar.mount": "rangefinder"})[3].percepts[0].lidar.ranges.shape == (10,)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("lidar.mount", "radar"),
        ("lidar.range", 0.0),
        ("lidar.aperture_deg", 361.0),
        ("lidar.step_deg", 0.01),
        ("lidar.noise", -1.0),
    ],
)
def test_scenarios_refuse_lidars_that_cannot_be(key, value):
    with pytest.raises(ScenarioError, match=key):
        load_scenario("downtown", **{key: value})
