"""Point in polygon against shapely, exact fractions at the boundary, and a tiling."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.kernels.polygon import in_polygon, inside_polygon, warm

whole = st.integers(-6, 6)


def exact(polygon, x, y):
    """Even-odd just east, and by far less north, of an integer point: in exact arithmetic.

    Of all lines through two integer points of the square none but those through (x, y) comes so
    near to it: the step leaves those on the wanted side.
    """
    x, y = Fraction(x) + Fraction(1, 10**6), Fraction(y) + Fraction(1, 10**12)
    odd = False
    for (x0, y0), (x1, y1) in pairwise([polygon[-1], *polygon]):
        if (y0 < y) != (y1 < y):
            odd ^= x < x0 + Fraction(x1 - x0) * (y - y0) / (y1 - y0)
    return odd


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 40), st.booleans())
def test_agrees_with_shapely_on_star_shaped_polygons(seed, k, clockwise):
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0.0, 2.0 * math.pi, k))
    corners = rng.uniform(5.0, 100.0, (k, 1)) * np.column_stack([np.cos(turn), np.sin(turn)])
    if clockwise:
        corners = np.ascontiguousarray(corners[::-1])
    polygon = shapely.Polygon(corners)
    points = rng.uniform(-110.0, 110.0, (400, 2))
    clear = shapely.distance(polygon.exterior, shapely.points(points)) > 1e-9
    if not polygon.is_valid:  # the centre outside of it, and two corners at almost one angle
        return
    expected = shapely.contains_xy(polygon, points[:, 0], points[:, 1])
    assert np.array_equal(inside_polygon(corners, points)[clear], expected[clear])


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(whole, whole), min_size=3, max_size=9), st.data())
def test_grazing_points_follow_the_rule_exactly(polygon, data):
    """Corners, edges, level edges, edges that run back on themselves, crossings: all integers."""
    points = data.draw(st.lists(st.tuples(whole, whole), min_size=10, max_size=10)) + polygon
    got = inside_polygon(np.array(polygon, dtype=float), np.array(points, dtype=float))
    assert got.tolist() == [exact(polygon, x, y) for x, y in points]


@pytest.mark.parametrize(
    ("point", "held"),
    [
        pytest.param((0, 1), True, id="west side"),
        pytest.param((1, 0), True, id="south side"),
        pytest.param((2, 1), False, id="east side"),
        pytest.param((1, 2), False, id="north side"),
        pytest.param((0, 0), True, id="south-west corner"),
        pytest.param((2, 0), False, id="south-east corner"),
        pytest.param((0, 2), False, id="north-west corner"),
        pytest.param((1, 1), True, id="middle"),
    ],
)
def test_named_points_of_a_square(point, held):
    for corners in ([(0, 0), (2, 0), (2, 2), (0, 2)], [(0, 2), (2, 2), (2, 0), (0, 0)]):
        assert in_polygon(np.array(corners, dtype=float), float(point[0]), float(point[1])) == held


def test_of_polygons_that_tile_exactly_one_holds_each_point():
    """Delaunay triangles, asked at their corners and on their edges, where rounding decides."""
    rng = np.random.default_rng(3)
    nodes = np.vstack([rng.uniform(0.0, 10.0, (40, 2)), rng.integers(0, 11, (40, 2))])
    triangles = shapely.get_parts(shapely.delaunay_triangles(shapely.MultiPoint(nodes)))
    hull = shapely.union_all(triangles)
    tiles = [shapely.get_coordinates(t)[:-1].copy() for t in triangles]
    ends = np.vstack([np.roll(t, 1, axis=0) + u * (t - np.roll(t, 1, axis=0)) for t in tiles
                      for u in (0.25, 0.5, rng.uniform())])  # fmt: skip
    points = np.vstack([nodes, ends])
    points = points[shapely.distance(hull.exterior, shapely.points(points)) > 1e-9]
    holders = np.sum([inside_polygon(tile, points) for tile in tiles], axis=0)
    assert len(points) > 500
    assert (holders == 1).all()


def test_a_polygon_without_area_holds_nothing():
    points = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]])
    for k in range(3):
        assert not inside_polygon(np.zeros((k, 2)), points).any()
    assert not inside_polygon(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]), points).any()
    assert inside_polygon(np.ones((3, 2)), np.zeros((0, 2))).shape == (0,)


def test_warms_up():
    warm()
