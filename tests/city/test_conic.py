"""The ground conic against the closed cone, against right triangles, and the polygon against it."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from staniel.city import footprint
from staniel.city.conic import classify, ellipse_moments, ellipse_polygon, ground_conic, moved
from staniel.city.coverage import footprint_polygon
from staniel.datatypes.belief import Pose
from staniel.kernels.footprint import camera_axis, in_cone
from staniel.kernels.polygon import inside_polygon

FAR = 1e9  # a range that clips nothing [m]

angles = st.floats(-math.pi, math.pi)
banks_deg = st.floats(-75.0, 75.0)
halves_deg = st.floats(3.0, 87.0)
heights = st.floats(5.0, 300.0)


def pose_of(height, heading, bank_deg, place=(0.0, 0.0)):
    return Pose(*place, height, heading, math.radians(bank_deg), 15.0)


def in_footprint(pose, points, half_aperture, reach):
    """The test that every detection passes."""
    axis, cosine = camera_axis(pose.heading, pose.bank), math.cos(half_aperture)
    return np.array(
        [in_cone(x - pose.x, y - pose.y, -pose.z, *axis, cosine, reach) for x, y in points]
    )


def expected_kind(bank_deg, half_deg):
    """From the plane of symmetry: does the cone's upper edge point below, along or over level?"""
    edge = abs(bank_deg) + half_deg
    return "parabola" if edge == 90.0 else "ellipse" if edge < 90.0 else "hyperbola"


@settings(max_examples=120, deadline=None)
@given(banks_deg, halves_deg, angles, heights, st.floats(0.8, 6.0), st.integers(0, 2**32 - 1))
@example(30.0, 60.0, 0.3, 80.0, 3.0, 1)  # parabola
@example(-75.0, 15.0, 2.3, 80.0, 6.0, 2)  # parabola
@example(75.0, 60.0, -1.0, 80.0, 3.0, 3)  # hyperbola
@example(-75.0, 80.0, -3.0, 80.0, 6.0, 4)
@example(10.0, 40.0, 1.0, 80.0, 6.0, 5)  # an ellipse within range
@example(20.0, 60.0, 1.0, 80.0, 1.2, 6)  # an ellipse, clipped all round
def test_polygon_and_detection_agree(bank_deg, half_deg, heading, height, ranges, seed):
    """Inside the polygon, eroded: in the cone. Outside, by its chords' depth: not."""
    pose, half = pose_of(height, heading, bank_deg, (300.0, -70.0)), math.radians(half_deg)
    reach = ranges * height
    found = footprint(pose, half, reach, points=256)
    rng = np.random.default_rng(seed)
    points = np.array([pose.x, pose.y]) + rng.uniform(-1.05 * reach, 1.05 * reach, (600, 2))
    if len(found.polygon) == 0:
        assert not in_footprint(pose, points, half, reach).any()
        return
    low, high = found.polygon.min(axis=0), found.polygon.max(axis=0)
    points = np.vstack([points, rng.uniform(low, high, (600, 2))])
    polygon = shapely.Polygon(found.polygon)
    held = inside_polygon(found.polygon, points)
    away = shapely.distance(polygon.exterior, shapely.points(points))
    seen = in_footprint(pose, points, half, reach)
    assert seen[held & (away > 1e-6)].all()
    assert not seen[~held & (away > 0.02 * polygon.length)].any()
    # And what is seen outside is in the slim parts between chords and arcs.
    area = seen[600:].mean() * float(np.prod(high - low))
    assert area == pytest.approx(polygon.area, abs=0.1 * float(np.prod(high - low)))


@settings(max_examples=120, deadline=None)
@given(banks_deg, halves_deg, angles, heights)
def test_kind_is_what_the_cones_upper_edge_says(bank_deg, half_deg, heading, height):
    if 0.0 < abs(abs(bank_deg) + half_deg - 90.0) < 1e-6:
        return
    pose = pose_of(height, heading, bank_deg, (5e3, 8e3))
    found = footprint(pose, math.radians(half_deg), 2.0 * height)
    assert found.kind == expected_kind(bank_deg, half_deg)
    assert (found.mean is None) == (found.covariance is None) == (found.kind != "ellipse")


@pytest.mark.parametrize("half_deg", [1.0, 5.0, 15.0, 30.0, 45.0, 60.0, 72.3, 85.0, 89.0, 89.9])
@pytest.mark.parametrize("heading", [0.0, 0.7, -2.1])
def test_a_bank_of_90_degrees_less_the_aperture_is_exactly_a_parabola(half_deg, heading):
    half = math.radians(half_deg)
    for bank in (math.radians(90.0 - half_deg), 0.5 * math.pi - half, half - 0.5 * math.pi):
        pose = Pose(12.0, 700.0, 80.0, heading, bank, 15.0)
        assert footprint(pose, half, 400.0).kind == "parabola"
    for bank, kind in ((-1e-6, "ellipse"), (1e-6, "hyperbola")):
        pose = Pose(12.0, 700.0, 80.0, heading, 0.5 * math.pi - half + bank, 15.0)
        assert footprint(pose, half, 400.0).kind == kind


@settings(max_examples=100, deadline=None)
@given(banks_deg, halves_deg, angles, heights, st.floats(1.2, 8.0))
def test_the_conic_vanishes_on_the_cones_edge_and_is_positive_within(
    bank_deg, half_deg, heading, height, ranges
):
    pose, half = pose_of(height, heading, bank_deg, (300.0, -70.0)), math.radians(half_deg)
    found = footprint(pose, half, ranges * height)
    if len(found.polygon) == 0:
        return
    assert np.array_equal(found.conic, found.conic.T) or np.allclose(found.conic, found.conic.T)
    p = np.column_stack([found.polygon, np.ones(len(found.polygon))])
    size = np.einsum("ki,ij,kj->k", np.abs(p), np.abs(found.conic), np.abs(p))
    value = np.einsum("ki,ij,kj->k", p, found.conic, p)
    slant = np.hypot(np.hypot(*(found.polygon - [pose.x, pose.y]).T), height)
    on_cone = slant < ranges * height * (1.0 - 1e-9)
    assert (np.abs(value[on_cone]) <= 1e-11 * size[on_cone]).all()
    assert (value[~on_cone] >= -1e-11 * size[~on_cone]).all()
    middle = np.append(found.polygon.mean(axis=0), 1.0)
    assert middle @ found.conic @ middle > 0.0


@given(heights, halves_deg, angles)
def test_a_level_cameras_disc(height, half_deg, heading):
    """Area pi (h tan alpha)², thesis eq. 3.4 (corrected)."""
    half = math.radians(half_deg)
    found = footprint(pose_of(height, heading, 0.0, (9.0, 4.0)), half, FAR)
    assert found.kind == "ellipse"
    np.testing.assert_allclose(found.mean, [9.0, 4.0], atol=1e-9 * height)
    area = math.pi * math.sqrt(np.linalg.det(found.covariance))
    assert area == pytest.approx(math.pi * (height * math.tan(half)) ** 2, rel=1e-9)
    radius = np.hypot(*(found.polygon - [9.0, 4.0]).T)
    np.testing.assert_allclose(radius, height * math.tan(half), rtol=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.floats(-60.0, 60.0), st.floats(3.0, 80.0), angles, heights, st.integers(3, 90))
def test_the_polygon_of_an_ellipse_is_that_of_eq_4_19(bank_deg, half_deg, heading, height, n):
    if abs(bank_deg) + half_deg > 89.0:
        return
    pose, half = pose_of(height, heading, bank_deg, (40.0, 90.0)), math.radians(half_deg)
    found = footprint(pose, half, FAR, points=n)
    corners = ellipse_polygon(found.mean, found.covariance, n, start=heading)
    scale = float(np.abs(found.polygon - found.mean).max())
    np.testing.assert_allclose(corners, found.polygon, atol=1e-9 * scale)
    off = found.polygon - found.mean
    inverse = np.linalg.inv(found.covariance)
    np.testing.assert_allclose(np.einsum("ki,ij,kj->k", off, inverse, off), 1.0, rtol=1e-8)
    ring = shapely.LinearRing(corners)
    assert ring.is_ccw
    assert shapely.Polygon(corners).convex_hull.area == pytest.approx(shapely.Polygon(ring).area)


@given(st.floats(0.0, 50.0), st.floats(5.0, 35.0), heights)
def test_half_axes_from_right_triangles(bank_deg, half_deg, height):
    """Flying east in a left bank the footprint reaches from h tan(b - a) to h tan(b + a) south."""
    pose, half = pose_of(height, 0.0, bank_deg), math.radians(half_deg)
    found = footprint(pose, half, FAR)
    near, far = (height * math.tan(pose.bank + side * half) for side in (-1.0, 1.0))
    np.testing.assert_allclose(found.mean, [0.0, -0.5 * (near + far)], atol=1e-9 * height)
    assert found.covariance[1, 1] == pytest.approx((0.5 * (far - near)) ** 2, rel=1e-9)
    # Dandelin: the minor half axis b² = h² sin²a / (cos²a - sin²b).
    minor = (height * math.sin(half)) ** 2 / (math.cos(half) ** 2 - math.sin(pose.bank) ** 2)
    assert found.covariance[0, 0] == pytest.approx(minor, rel=1e-9)


@given(angles, st.floats(-70.0, 70.0), st.floats(5.0, 80.0), st.floats(0.1, 20.0))
def test_an_axis_that_is_given_makes_the_same_footprint(heading, bank_deg, half_deg, length):
    pose, half = pose_of(80.0, heading, bank_deg, (30.0, 20.0)), math.radians(half_deg)
    own = footprint(pose, half, 250.0, points=128)
    axis = length * np.array(camera_axis(heading, pose.bank))
    given_axis = footprint(pose._replace(heading=1.0, bank=0.2), half, 250.0, axis=axis, points=128)
    assert own.kind == given_axis.kind
    np.testing.assert_allclose(own.conic, given_axis.conic, atol=1e-9)
    a, b = shapely.Polygon(own.polygon), shapely.Polygon(given_axis.polygon)
    assert a.symmetric_difference(b).area <= 0.01 * a.area


def test_a_higher_level_has_the_footprint_of_a_lower_flight():
    pose = pose_of(80.0, 0.4, 20.0, (10.0, 10.0))
    raised = footprint(pose, 0.6, 200.0, height=30.0)
    lower = footprint(pose._replace(z=50.0), 0.6, 200.0)
    np.testing.assert_allclose(raised.polygon, lower.polygon)
    np.testing.assert_allclose(raised.conic, lower.conic, atol=1e-9)


@pytest.mark.parametrize(
    ("pose", "axis"),
    [
        pytest.param(pose_of(80.0, 0.0, 0.0), (0.3, 0.0, 1.0), id="looks at the sky"),
        pytest.param(pose_of(80.0, 0.0, 0.0), (1.0, 0.0, math.tan(math.radians(30.0))), id="level"),
        pytest.param(pose_of(0.0, 0.0, 0.0), None, id="on the ground"),
        pytest.param(pose_of(-3.0, 0.0, 0.0), None, id="below the ground"),
    ],
)
def test_no_ground_in_the_cone(pose, axis):
    found = footprint(pose, math.radians(30.0), 200.0, axis=axis)
    assert (found.kind, found.mean, found.covariance) == ("none", None, None)
    assert found.polygon.shape == (0, 2)


def test_ground_in_the_cone_but_not_in_range():
    found = footprint(pose_of(300.0, 0.0, 0.0), 0.5, 200.0)
    assert found.kind == "ellipse"
    assert found.polygon.shape == (0, 2)
    assert footprint_polygon(pose_of(80.0, 0.0, 0.0), 0.5, 200.0, 8, np.full(3, np.nan)).size == 0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"half_aperture": 0.0}, "half_aperture must be in"),
        ({"half_aperture": 1.58}, "half_aperture must be in"),
        ({"half_aperture": math.nan}, "half_aperture must be in"),
        ({"range_": -1.0}, "range_ must be finite and greater"),
        ({"range_": math.inf}, "range_ must be finite and greater"),
        ({"height": math.nan}, "height must be finite"),
        ({"points": 2}, "points must be at least 3"),
        ({"pose": Pose(0.0, math.nan, 1.0, 0.0, 0.0, 1.0)}, "pose must be finite"),
        ({"axis": (0.0, 0.0, 0.0)}, "axis must be 3 finite"),
        ({"axis": (0.0, 0.0)}, "axis must be 3 finite"),
        ({"axis": (0.0, math.nan, 1.0)}, "axis must be 3 finite"),
    ],
)
def test_bad_values_are_refused(changed, message):
    values = {"pose": pose_of(80.0, 0.0, 0.0), "half_aperture": 0.5, "range_": 200.0} | changed
    with pytest.raises(ValueError, match=message):
        footprint(**values)


@pytest.mark.parametrize(
    "conic",
    [
        pytest.param(np.diag([1.0, 1.0, 1.0]), id="no real point"),
        pytest.param(np.diag([1.0, 1.0, 0.0]), id="one point"),
        pytest.param(np.diag([1.0, -1.0, 0.0]), id="two lines"),
        pytest.param(np.diag([1.0, 0.0, -1.0]), id="two parallel lines"),
        pytest.param(np.diag([0.0, 0.0, 1.0]), id="nothing"),
    ],
)
def test_what_is_no_curve(conic):
    assert classify(conic) == "none"


def test_moments_of_a_turned_and_moved_ellipse():
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    shape = turn @ np.diag([9.0, 4.0]) @ turn.T
    conic = np.zeros((3, 3))
    conic[:2, :2], conic[2, 2] = -np.linalg.inv(shape), 1.0
    mean, covariance = ellipse_moments(7.0 * moved(conic, 3.0, -2.0))
    np.testing.assert_allclose(mean, [3.0, -2.0])
    np.testing.assert_allclose(covariance, shape)
    assert classify(7.0 * moved(conic, 3.0, -2.0)) == "ellipse"


def test_the_conic_is_the_cones_quadric_on_the_plane():
    """Angle to the axis by the arc cosine, at points of the plane, both sheets."""
    rng = np.random.default_rng(2)
    axis = np.array([0.48, -0.6, -0.64])
    conic = ground_conic((3.0, 4.0, 50.0), axis, 0.7, 8.0)
    points = rng.uniform(-400.0, 400.0, (500, 2))
    rays = np.column_stack([points - [3.0, 4.0], np.full(500, -42.0)])
    angle = np.arccos(rays @ axis / np.linalg.norm(rays, axis=1))
    p = np.column_stack([points, np.ones(500)])
    inside = np.einsum("ki,ij,kj->k", p, conic, p) > 0.0
    assert np.array_equal(inside, (angle < 0.7) | (angle > math.pi - 0.7))
    assert 20 < inside.sum() < 480
