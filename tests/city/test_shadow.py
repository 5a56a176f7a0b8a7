"""Visible ground against line of sight, point by point, and against areas by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from staniel.city import City, footprint, visible_ground, visible_share
from staniel.datatypes.belief import Pose

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


def hollowed(seed):
    """A city in which every house that has room for one has a courtyard."""
    city = City.generate(size=(300.0, 260.0), seed=seed, density=0.5)
    outlines = [outline - outline.buffer(-7.0, join_style="mitre") for outline in city.outlines]
    return City.from_outlines(outlines, city.heights, city.size)


CITIES = [City.generate(size=(300.0, 260.0), seed=0), *map(hollowed, range(1, 3))]


def check(city, pose, half, reach, height, points, axis=None):
    """How many points of the footprint were seen; contained if and only if seen."""
    ground = visible_ground(city, pose, half, reach, height, axis=axis)
    assert ground.is_valid
    covered = shapely.Polygon(footprint(pose, half, reach, height=height, axis=axis).polygon)
    points = points[shapely.contains_xy(covered, points[:, 0], points[:, 1])]
    ends = np.column_stack([points, np.full(len(points), height)])
    seen = city.visible([pose[:3]], ends)[0]
    held = shapely.contains_xy(ground, points[:, 0], points[:, 1])
    wrong = np.flatnonzero(held != seen)
    edge = shapely.union_all([ground.boundary, covered.boundary])
    assert (shapely.distance(edge, shapely.points(points[wrong])) <= 1e-6).all()
    assert ground.difference(covered).area <= 1e-6
    return len(points), int(seen.sum())


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(range(3)),
    st.tuples(st.floats(-30.0, 330.0), st.floats(-30.0, 290.0), st.floats(3.0, 120.0)),
    st.floats(-math.pi, math.pi),
    st.floats(-1.3, 1.3),
    st.floats(0.1, 1.5),
    st.floats(60.0, 300.0),
    st.sampled_from([0.0, 1.0, 12.0]),
    st.integers(0, 2**32 - 1),
)
@example(0, (150.0, 130.0, 80.0), 0.4, 0.5, 1.0, 250.0, 0.0, 1)
@example(1, (150.0, 130.0, 20.0), 0.4, 0.5, 1.2, 250.0, 0.0, 2)  # among the roofs
@example(2, (-20.0, 130.0, 5.0), -1.57, -1.2, 1.4, 250.0, 1.0, 3)  # below all of them, from aside
def test_contains_what_is_seen(which, place, heading, bank, half, reach, height, random):
    pose = Pose(*place, heading, bank, 15.0)
    rng = np.random.default_rng(random)
    points = np.array(place[:2]) + rng.uniform(-reach, reach, (800, 2))
    check(CITIES[which], pose, half, reach, height, points)


def test_contains_what_is_seen_over_a_whole_city():
    """Enough points of each kind that a wrong shadow would show."""
    rng = np.random.default_rng(8)
    asked = seen = 0
    assert any(outline.interiors for city in CITIES for outline in city.outlines)
    for city in CITIES:
        for z in (6.0, 25.0, 38.0, 60.0, 90.0):
            while True:
                pose = Pose(*rng.uniform(0, 260, 2), z, rng.uniform(-3, 3), 0.3, 15.0)
                if city.visible([pose[:3]], [pose[:3]])[0, 0]:
                    break
            points = rng.uniform((-50, -50), (350, 310), (4000, 2))
            more, lit = check(city, pose, 1.3, 280.0, 0.0, points)
            asked, seen = asked + more, seen + lit
    assert asked > 20_000
    assert 0.1 * asked < seen < 0.6 * asked


N = 5
houses = st.lists(
    st.tuples(st.integers(0, N * N - 1), st.integers(1, 4)),
    max_size=N * N,
    unique_by=lambda h: h[0],
)
eyes = st.tuples(st.integers(-1, N + 1), st.integers(-1, N + 1), st.integers(1, 7))


@settings(max_examples=60, deadline=None)
@given(houses, eyes)
# Joined with floating noding, a third of these shadows was lost without a word.
@example([(7, 1), (8, 1), (9, 3), (10, 2), (18, 1), (19, 3), (24, 1)], (5, 6, 3))
def test_houses_that_touch_at_corners_and_walls(houses, eye):
    """An eye over the grid's own lines: half of the walls are seen edge on.

    The points are on none of the rays through the grid's nodes, where a slit between two houses
    that touch at a corner lets light through.
    """
    squares = [shapely.box(k % N, k // N, k % N + 1, k // N + 1) for k, _ in houses]
    city = City.from_outlines(squares, np.array([roof for _, roof in houses], dtype=float), (N, N))
    nodes = np.arange(-4, 2 * N + 5) / 2.0
    points = np.stack(np.meshgrid(nodes + 0.2371, nodes + 0.1913), axis=-1).reshape(-1, 2)
    check(city, Pose(*map(float, eye), 0.0, 0.1, 15.0), 1.5, 60.0, 0.0, points)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared maps are not here")
def test_contains_what_is_seen_over_a_benchmark_map():
    city = City.from_grid(SHARED / "maps" / "Boston_0_256.map", cell=2.0, heights=(8.0, 40.0))
    rng = np.random.default_rng(1)
    for _ in range(4):
        pose = Pose(*rng.uniform(100, 400, 2), 60.0, 0.0, 0.4, 15.0)
        points = rng.uniform(0, 512, (4000, 2))
        asked, _ = check(city, pose, 1.2, 200.0, 0.0, points)
        assert asked > 300


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared maps are not here")
@pytest.mark.filterwarnings("ignore:.*mended")
@pytest.mark.parametrize("name", ["helsinki_centre", "suzhou_old_town"])
def test_contains_what_is_seen_over_true_footprints(name):
    path = SHARED / "footprints" / f"{name}_buildings.geojson"
    city = City.from_geojson(path, heights=(6.0, 20.0))
    rng = np.random.default_rng(1)
    for z in (25.0, 60.0, 90.0):
        pose = Pose(*(rng.uniform(0.3, 0.7, 2) * city.size), z, 0.5, 0.4, 15.0)
        points = np.array(pose[:2]) + rng.uniform(-200, 200, (4000, 2))
        asked, seen = check(city, pose, 1.2, 200.0, 1.0, points)
        assert asked > 300
        assert 0 < seen < asked


def test_a_tilted_camera():
    pose = Pose(150.0, 20.0, 60.0, 1.57, 0.0, 15.0)
    points = np.random.default_rng(4).uniform((0, 0), (300, 260), (3000, 2))
    asked, seen = check(CITIES[0], pose, 0.6, 250.0, 1.0, points, axis=(0.0, 1.0, -0.6))
    assert asked > 500
    assert 0 < seen < asked


LEVEL = {"half_aperture": math.radians(80.0), "range_": 150.0}


def above(x, y, z):
    return Pose(x, y, z, 0.0, 0.0, 15.0)


def dark_area(city, pose, height=0.0, **camera):
    values = LEVEL | camera
    found = footprint(pose, values["half_aperture"], values["range_"], height=height)
    whole = shapely.Polygon(found.polygon)
    return whole.area - visible_ground(city, pose, height=height, **values).area


def test_light_enters_a_courtyard_from_above():
    """Court 10 wide behind a wing with a 20 m roof: seen from 100 m the shadow is a quarter of 20 m
    long, half of the court; seen from 30 m, three times as far as the wing, all of it."""
    block = shapely.box(10, 40, 60, 60) - shapely.box(20, 45, 30, 55)
    city = City.from_outlines([block], [20.0], (100.0, 100.0))
    court = shapely.box(20, 45, 30, 55)
    seen = visible_ground(city, above(0.0, 50.0, 100.0), 1.0, 200.0).intersection(court)
    assert seen.area == pytest.approx(50.0)
    assert seen.symmetric_difference(shapely.box(25, 45, 30, 55)).area < 1e-9
    assert visible_ground(city, above(0.0, 50.0, 30.0), 1.2, 200.0).intersection(court).area < 1e-9
    over = visible_ground(city, above(25.0, 50.0, 90.0), 1.0, 200.0)
    assert over.intersection(court).area == pytest.approx(100.0)


def test_the_shadow_of_a_house_that_the_eye_is_above():
    """Twice as high as the roof, the house hides its double: 4 x its own area."""
    city = City.from_outlines([shapely.box(40, 40, 60, 60)], [25.0], (100.0, 100.0))
    for place in ((50.0, 50.0), (45.0, 57.0), (60.0, 50.0), (40.0, 40.0)):
        assert dark_area(city, above(*place, 50.0)) == pytest.approx(4 * 400.0)


def test_the_shadow_of_a_house_beside():
    """From the west, at twice the roof's height: three walls face away and drop a shadow each."""
    city = City.from_outlines([shapely.box(40, 40, 60, 60)], [25.0], (100.0, 100.0))
    dark = shapely.union_all(
        [
            shapely.box(40, 40, 60, 60),
            shapely.Polygon([(40, 60), (60, 60), (90, 70), (50, 70)]),
            shapely.Polygon([(40, 40), (60, 40), (90, 30), (50, 30)]),
            shapely.Polygon([(60, 40), (60, 60), (90, 70), (90, 30)]),
        ]
    )
    assert dark_area(city, above(30.0, 50.0, 50.0)) == pytest.approx(dark.area)


@pytest.mark.parametrize("roof", [20.0, 20.0 + 1e-9, 1000.0])
def test_a_house_as_tall_as_the_eye_hides_all_behind_it(roof):
    """A wall 20 m wide at 10 m: a sector of a quarter of the disc, less the triangle before it."""
    city = City.from_outlines([shapely.box(60, 40, 61, 60)], [roof], (100.0, 100.0))
    pose = above(50.0, 50.0, 20.0)
    whole = shapely.Polygon(footprint(pose, LEVEL["half_aperture"], 100.0).polygon)
    hidden = shapely.Polygon([(60, 40), (60, 60), (250, 250), (250, -150)])
    dark = dark_area(city, pose, range_=100.0)
    assert dark == pytest.approx(whole.intersection(hidden).area, rel=1e-9)


def test_an_eye_in_a_house_sees_nothing_and_one_on_its_roof_does():
    city = City.from_outlines([shapely.box(40, 40, 60, 60)], [25.0], (100.0, 100.0))
    assert visible_ground(city, above(50.0, 50.0, 24.0), 1.0, 90.0).is_empty
    assert visible_ground(city, above(50.0, 50.0, 25.0), 1.0, 90.0).area == 0.0
    assert visible_ground(city, above(59.0, 50.0, 25.5), 1.5, 2000.0).area > 0.0
    assert visible_ground(city, above(40.0, 50.0, 20.0), 1.0, 90.0).area > 0.0


def test_only_what_rises_above_the_level_hides_it():
    city = City.from_outlines([shapely.box(40, 40, 60, 60)], [25.0], (100.0, 100.0))
    assert dark_area(city, above(30.0, 50.0, 50.0), height=25.0) == pytest.approx(0.0, abs=1e-6)
    # The house and its 26/25-fold from the eye, 10 m before its west wall, and what is between.
    dark = 20.8**2 + 0.4 * 0.5 * (20.0 + 20.8)
    assert dark_area(city, above(30.0, 50.0, 50.0), height=24.0) == pytest.approx(dark)


def test_without_houses_or_ground_in_view():
    city = City.open((100.0, 100.0))
    pose = above(50.0, 50.0, 50.0)
    whole = shapely.Polygon(footprint(pose, 0.5, 200.0).polygon)
    assert visible_ground(city, pose, 0.5, 200.0).equals(whole)
    assert visible_ground(city, above(50.0, 50.0, 300.0), 0.5, 200.0).is_empty
    with pytest.raises(ValueError, match="half_aperture"):
        visible_ground(city, pose, 2.0, 200.0)


def test_share_of_the_streets():
    house = shapely.box(0, 0, 50, 100)
    city = City.from_outlines([house], [9.0], (100.0, 100.0))
    assert visible_share(city, []) == 0.0
    assert visible_share(city, [shapely.box(-50, -50, 500, 500) - house]) == pytest.approx(1.0)
    pose = above(75.0, 50.0, 30.0)
    seen = visible_ground(city, pose, math.radians(30.0), 100.0, points=256)
    disc = math.pi * (30.0 * math.tan(math.radians(30.0))) ** 2
    assert visible_share(city, [seen, seen]) == pytest.approx(disc / 5000.0, rel=1e-3)
