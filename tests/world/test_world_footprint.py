"""The camera's axis against rotation matrices, the polygon against the closed cone."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from staniel.city import City
from staniel.city.coverage import footprint_polygon
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Camera
from staniel.kernels.footprint import BODY, camera_axes, camera_axis, in_cone, look

angles = st.floats(-math.pi, math.pi)
banks = st.floats(-1.3, 1.3)


def axis_by_matrices(heading, bank):
    return Rotation.from_euler("z", heading).apply(
        Rotation.from_euler("x", -bank).apply([0.0, 0.0, -1.0])
    )


def closed_test(pose, ground, half_aperture, reach):
    """Angles by the arc cosine, no kernel."""
    rays = np.column_stack([ground - [pose.x, pose.y], np.full(len(ground), -pose.z)])
    slant = np.linalg.norm(rays, axis=1)
    cosines = rays @ axis_by_matrices(pose.heading, pose.bank) / slant
    return np.arccos(np.clip(cosines, -1.0, 1.0)), slant


@settings(deadline=None)
@given(heading=angles, bank=banks)
def test_axis_is_the_product_of_the_rotations(heading, bank):
    np.testing.assert_allclose(
        camera_axis(heading, bank), axis_by_matrices(heading, bank), atol=1e-12
    )


def axis_of(heading, bank, **camera):
    row = np.array([[0.0, 0.0, 80.0, heading, bank, 15.0]])
    return camera_axes(row, np.zeros((1, 2)), Camera(**camera).mounting)[0]


@settings(deadline=None)
@given(heading=angles, bank=banks, tilt=st.floats(-90.0, 90.0), cant=st.floats(-90.0, 90.0))
def test_every_mount_is_a_product_of_rotations(heading, bank, tilt, cant):
    """Tilted forward is a turn of -tilt about the left axis, canted left one about the forward."""
    mounted = Rotation.from_euler("x", cant, degrees=True) * Rotation.from_euler(
        "y", -tilt, degrees=True
    )
    body = Rotation.from_euler("z", heading) * Rotation.from_euler("x", -bank)
    expected = (body * mounted).apply([0.0, 0.0, -1.0])
    tilted = axis_of(heading, bank, mount="tilt", tilt_deg=tilt, cant_deg=cant)
    np.testing.assert_allclose(tilted, expected, atol=1e-12)
    np.testing.assert_allclose(axis_of(heading, bank), camera_axis(heading, bank), atol=1e-15)
    np.testing.assert_allclose(axis_of(heading, bank, mount="nadir"), [0, 0, -1], atol=1e-15)


def test_a_camera_looks_where_its_mount_says():
    """Flying north: forward is north, left is west."""
    north = 0.5 * math.pi
    x, y, _ = axis_of(north, 0.0, mount="tilt", tilt_deg=30.0)
    assert (abs(x) < 1e-12, y) == (True, pytest.approx(0.5))
    x, y, _ = axis_of(north, 0.0, mount="tilt", cant_deg=30.0)
    assert (x, abs(y) < 1e-12) == (pytest.approx(-0.5), True)
    # A cant to the left by the bank's angle brings the camera of a left turn back to the nadir.
    x, y, z = axis_of(0.3, math.radians(25.0), mount="tilt", cant_deg=25.0)
    assert (abs(x) < 1e-12, abs(y) < 1e-12, z) == (True, True, pytest.approx(-1.0))


@settings(deadline=None)
@given(
    heading=angles,
    bank=banks,
    x=st.floats(-300, 300),
    y=st.floats(-300, 300),
    limit=st.floats(0.0, 100.0),
)
def test_a_gimbal_looks_at_its_point_or_as_near_as_it_can(heading, bank, x, y, limit):
    row = np.array([[5.0, -8.0, 80.0, heading, bank, 15.0]])
    mounting = Camera(mount="gimbal", gimbal_limit_deg=limit).mounting
    axis = camera_axes(row, np.array([[x, y]]), mounting)[0]
    wish = np.array([x - 5.0, y + 8.0, -80.0])
    wish /= np.linalg.norm(wish)
    down = axis_by_matrices(heading, bank)
    apart = math.acos(np.clip(wish @ down, -1.0, 1.0))
    if apart > math.radians(limit) + 1e-7:
        # Turned from body-down towards the wish, by the limit and about their common normal.
        normal = np.cross(down, wish)
        turn = normal / np.linalg.norm(normal) * math.radians(limit)
        wish = Rotation.from_rotvec(turn).apply(down)
    np.testing.assert_allclose(axis, wish, atol=1e-6)


def test_a_gimbal_without_a_point_looks_straight_down():
    row = np.array([[5.0, -8.0, 80.0, 1.0, 0.5, 15.0]])
    mounting = Camera(mount="gimbal").mounting
    axis = camera_axes(row, np.full((1, 2), np.nan), mounting)[0]
    np.testing.assert_allclose(axis, [0.0, 0.0, -1.0])
    on_the_ground = np.array([[5.0, -8.0, 0.0, 1.0, 0.0, 0.0]])
    axis = camera_axes(on_the_ground, np.array([[5.0, -8.0]]), mounting)[0]
    np.testing.assert_allclose(axis, [0.0, 0.0, -1.0])


def test_a_camera_too_high_sees_nothing():
    row = np.array([[10.0, 10.0, height, 0.0, 0.0, 15.0] for height in (99.0, 100.0, 101.0)])
    axes = camera_axes(row, np.zeros((3, 2)), Camera(max_height=100.0).mounting)
    assert np.isnan(axes).all(axis=1).tolist() == [False, False, True]
    walls = City.open((20.0, 20.0)).walls
    seen = look(walls, row, axes, np.array([[10.0, 10.0, 0.0]]), math.radians(60.0), 500.0)
    assert seen[:, 0].tolist() == [True, True, False]


def test_angles_belong_to_the_tilt_mount():
    with pytest.raises(ValueError, match='tilt_deg does not belong to mount = "nadir"'):
        Camera(mount="nadir", tilt_deg=10.0)
    with pytest.raises(ValueError, match="cant_deg"):
        Camera(cant_deg=10.0)
    with pytest.raises(ValueError, match='expected mount = "gimbal"'):
        Camera(mount="tilt", gimbal_limit_deg=30.0)


def test_in_a_left_bank_the_camera_swings_away_from_the_turns_centre():
    """Flying east, a left turn's centre is in the north: the camera looks south."""
    x, y, z = camera_axis(0.0, math.radians(30.0))
    assert abs(x) < 1e-12
    assert y < 0.0
    assert z < 0.0


@settings(max_examples=100, deadline=None)
@given(
    heading=angles,
    bank=banks,
    half=st.floats(math.radians(1.0), math.radians(89.0)),
    height=st.floats(5.0, 200.0),
    reach=st.floats(20.0, 400.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_polygon_agrees_with_the_closed_cone(heading, bank, half, height, reach, seed):
    pose = Pose(40.0, -30.0, height, heading, bank, 15.0)
    corners = footprint_polygon(pose, half, reach, points=256)
    radius = math.sqrt(max(reach**2 - height**2, 0.0))
    rng = np.random.default_rng(seed)
    ground = np.array([40.0, -30.0]) + rng.uniform(-radius, radius, (400, 2))
    angle, slant = closed_test(pose, ground, half, reach)
    inside = (angle <= half) & (slant <= reach)
    if len(corners) == 0:
        assert height >= reach or not inside.any()
        return
    on_edge_angle, on_edge_slant = closed_test(pose, corners, half, reach)
    assert (on_edge_angle <= half + 1e-6).all()
    assert (on_edge_slant <= reach * (1 + 1e-9)).all()
    nearest = np.minimum(half - on_edge_angle, (reach - on_edge_slant) / reach)
    assert (nearest <= 1e-6).all()  # every corner on the boundary
    polygon = shapely.Polygon(corners)
    drawn = shapely.contains_xy(polygon, ground[:, 0], ground[:, 1])
    assert not (drawn & ~inside & (angle > half + 1e-6)).any()
    assert not (drawn & ~inside & (slant > reach * (1 + 1e-9))).any()
    missed = ground[inside & ~drawn]
    if len(missed):
        # What the inscribed polygon leaves out lies between a chord and its arc.
        away = shapely.distance(polygon, shapely.points(missed))
        assert (away <= 0.02 * polygon.length).all()


@settings(max_examples=60, deadline=None)
@given(heading=angles, bank=banks, half_deg=st.floats(5.0, 80.0), reach=st.floats(90.0, 400.0))
def test_polygon_is_convex_and_counter_clockwise(heading, bank, half_deg, reach):
    pose = Pose(0.0, 0.0, 80.0, heading, bank, 15.0)
    corners = footprint_polygon(pose, math.radians(half_deg), reach)
    if len(corners) == 0:
        return
    assert corners.shape == (64, 2)
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    cross = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    assert (cross >= -1e-6).all()
    assert shapely.LinearRing(corners).is_ccw


def test_level_footprint_is_the_disc_of_eq_3_4():
    """Area pi (h tan alpha)², thesis eq. 3.4 (corrected), up to the 64-gon's deficit."""
    corners = footprint_polygon(Pose(0, 0, 80.0, 1.0, 0.0, 15.0), math.radians(40.0), 250.0)
    ideal = math.pi * (80.0 * math.tan(math.radians(40.0))) ** 2
    area = shapely.Polygon(corners).area
    assert 0.998 * ideal < area < ideal


def test_no_ground_in_view_gives_no_polygon():
    assert footprint_polygon(Pose(0, 0, 300.0, 0, 0, 15.0), 1.0, 250.0).shape == (0, 2)
    assert footprint_polygon(Pose(0, 0, 80.0, 0, 1.4, 15.0), 0.1, 250.0).shape == (0, 2)


def test_closed_cone_holds_its_boundary():
    axis = camera_axis(0.7, 0.4)
    for point in footprint_polygon(Pose(0, 0, 80.0, 0.7, 0.4, 15.0), math.radians(60.0), 250.0):
        assert in_cone(point[0], point[1], -80.0, *axis, math.cos(math.radians(60.0)), 250.0)


def test_look_is_cone_and_free_line_of_sight():
    """Every pair against an angle by the arc cosine and a sampled line through shapely prisms."""
    rng = np.random.default_rng(5)
    city = City.generate(size=(300.0, 300.0), seed=4, density=0.35)
    aircraft = np.column_stack(
        [
            rng.uniform(0, 300, (12, 2)),
            np.full(12, 80.0),
            rng.uniform(-3, 3, 12),
            rng.uniform(-0.6, 0.6, 12),
            np.full(12, 15.0),
        ]
    )
    points = np.column_stack([rng.uniform(0, 300, (60, 2)), np.full(60, 1.0)])
    half, reach = math.radians(60.0), 180.0
    axes = camera_axes(aircraft, np.zeros((12, 2)), BODY)
    seen = look(city.walls, aircraft, axes, points, half, reach)
    for i, row in enumerate(aircraft):
        axis = axis_by_matrices(row[3], row[4])
        for j, point in enumerate(points):
            ray = point - row[:3]
            slant = float(np.linalg.norm(ray))
            in_view = math.acos(ray @ axis / slant) <= half and slant <= reach
            assert seen[i, j] == (in_view and not hidden(city, row[:3], point))
    assert 50 < seen.sum() < 600


def hidden(city, a, b):
    """Does the part of the segment below a roof cross the building? By clipping with shapely."""
    for outline, roof in zip(city.outlines, city.heights, strict=True):
        share = (a[2] - roof) / (a[2] - b[2])
        low = a + min(max(share, 0.0), 1.0) * (b - a)
        if shapely.LineString([low[:2], b[:2]]).intersection(outline).length > 1e-9:
            return True
    return False
