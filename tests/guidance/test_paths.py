"""Paths: joined legs, heights along them, Dubins words, and what is refused."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.angles import wrap
from staniel.datatypes.equipment import Airframe
from staniel.guidance import dubins_path, waypoint_path
from staniel.guidance.fillets import fillet_radii, filleted_length, route_length
from staniel.guidance.paths import Arc, Straight
from staniel.kernels.dubins import shortest_length

AIRFRAME = Airframe()


def courses(leg):
    """Course at the beginning and at the end of a leg."""
    if isinstance(leg, Straight):
        (x0, y0), (x1, y1) = leg.start, leg.end
        return (math.atan2(y1 - y0, x1 - x0),) * 2
    first = leg.bearing + leg.turn * 0.5 * math.pi
    return first, first + leg.turn * leg.sweep


def assert_joined(path, *, smooth):
    """Each leg begins where the one before ends, and where it is smooth with that one's course."""
    for before, after in zip(path.legs[:-1], path.legs[1:], strict=True):
        assert math.dist(before.at(before.length), after.at(0.0)) < 1e-6
        if smooth:
            assert abs(wrap(courses(before)[1] - courses(after)[0])) < 1e-6
    assert path.stations[0] == 0.0
    np.testing.assert_allclose(np.diff(path.stations), [leg.length for leg in path.legs])
    line = shapely.LineString(path.places(0.5)[:, :2])
    assert line.length == pytest.approx(path.length, rel=1e-4)


routes = st.integers(0, 2**32 - 1).map(
    lambda seed: np.cumsum(np.random.default_rng(seed).normal(0.0, 200.0, (6, 2)), axis=0)
)


@settings(max_examples=60, deadline=None)
@given(points=routes, radius=st.floats(33.0, 120.0))
def test_a_path_of_waypoints_is_joined_and_as_long_as_the_formula_says(points, radius):
    over = waypoint_path(points, AIRFRAME)
    assert_joined(over, smooth=False)
    assert over.length == pytest.approx(route_length(points))
    path = waypoint_path(points, AIRFRAME, radius=radius)
    radii = fillet_radii(points, radius, AIRFRAME.min_turn_radius)
    assert_joined(path, smooth=bool((radii > 0.0).all()))
    assert path.length == pytest.approx(filleted_length(points, radii))
    arcs = [leg for leg in path.legs if isinstance(leg, Arc)]
    np.testing.assert_allclose([arc.radius for arc in arcs], radii[radii > 0.0])
    np.testing.assert_allclose(path.end, points[-1], atol=1e-6)


poses = st.tuples(st.floats(-300, 300), st.floats(-300, 300), st.floats(-math.pi, math.pi))


@settings(max_examples=100, deadline=None)
@given(st.lists(poses, min_size=2, max_size=5), st.floats(33.0, 120.0))
def test_a_dubins_path_is_smooth_meets_its_poses_and_is_shortest(rows, radius):
    places = np.array(rows)
    if (np.hypot(*np.diff(places[:, :2], axis=0).T) < 1.0).any():
        return
    path = dubins_path(places, AIRFRAME, radius=radius)
    assert_joined(path, smooth=True)
    expected = [shortest_length(*before, *after, radius) for before, after in pairwise(rows)]
    assert path.length == pytest.approx(sum(expected), abs=1e-4)
    ways = np.concatenate([[0.0], np.cumsum(expected)])
    stations = np.array(path.stations)
    for way, pose in zip(ways, rows, strict=True):
        i = int(np.argmin(np.abs(stations - way)))
        assert stations[i] == pytest.approx(way, abs=1e-3)
        leg = path.legs[min(i, len(path.legs) - 1)]
        begins = i < len(path.legs)
        assert math.dist(leg.at(0.0 if begins else leg.length), pose[:2]) < 1e-3
        assert abs(wrap(courses(leg)[0 if begins else 1] - pose[2])) < 1e-4
    assert all(leg.radius == radius for leg in path.legs if isinstance(leg, Arc))


def test_heights_are_the_lines_own_on_straight_legs_and_go_on_through_corners():
    points = [[0.0, 0.0, 80.0], [400.0, 0.0, 110.0], [400.0, 300.0, 90.0]]
    path = waypoint_path(points, AIRFRAME, radius=60.0)
    assert path.height(100.0) == pytest.approx(80.0 + 100.0 * 30.0 / 400.0)
    assert path.height(path.length - 100.0) == pytest.approx(90.0 + 100.0 * 20.0 / 300.0)
    up = path.places(1.0)[:, 2]
    assert np.abs(np.diff(up)).max() < 0.08
    assert (path.height(-5.0), path.height(1e6)) == (80.0, 90.0)
    flat = waypoint_path([[0.0, 0.0], [400.0, 0.0]], AIRFRAME)
    assert set(flat.heights) == {AIRFRAME.altitude}


@pytest.mark.parametrize(
    ("points", "settings", "message"),
    [
        ([[0.0, 0.0]], {}, "got 1, expected at least 2"),
        ([[0.0, 0.0], [0.0, 0.0]], {}, r"waypoints\[0\] and waypoints\[1\] coincide"),
        ([[0.0, 0.0, 80.0], [0.0, 0.0, 90.0]], {}, "coincide"),
        ([[0.0, 0.0], [math.nan, 0.0]], {}, "expected finite"),
        ([0.0, 0.0], {}, r"shape \(2,\): expected \(n, 2\) or \(n, 3\)"),
        ([[0.0, 0.0, math.nan], [90.0, 0.0, 80.0]], {}, "heights of waypoints"),
        ([[0.0, 0.0, -1.0], [90.0, 0.0, 80.0]], {}, "heights of waypoints"),
        ([[0.0, 0.0, 80.0], [90.0, 0.0, 110.0]], {}, "climbs 5 m/s .* at most max_climb = 3"),
        ([[0.0, 0.0], [90.0, 0.0]], {"radius": 10.0}, "radius = 10 m"),
        ([[0.0, 0.0], [90.0, 0.0]], {"radius": 0.0}, "radius = 0.0"),
        ([[0.0, 0.0], [90.0, 0.0]], {"radius": -40.0}, "radius = -40.0"),
        ([[0.0, 0.0], [90.0, 0.0]], {"radius": math.nan}, "radius = nan"),
        ([[0.0, 0.0], [90.0, 0.0]], {"min_radius": 10.0}, "at least 32.8 m, the tightest turn"),
    ],
)
def test_waypoints_that_make_no_path_are_refused(points, settings, message):
    with pytest.raises(ValueError, match=message):
        waypoint_path(points, AIRFRAME, **settings)


@pytest.mark.parametrize(
    ("rows", "radius", "message"),
    [
        ([[0.0, 0.0, 0.0]], None, r"shape \(1, 3\)"),
        ([[0.0, 0.0], [1.0, 1.0]], None, r"shape \(2, 2\): expected \(n, 3\)"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], None, r"poses\[0\] and poses\[1\] coincide"),
        ([[0.0, 0.0, 0.0], [0.0, math.inf, 0.0]], None, "expected finite"),
        ([[0.0, 0.0, 0.0], [90.0, 0.0, 0.0]], 20.0, "at least 32.8 m"),
        ([[0.0, 0.0, 0.0], [90.0, 0.0, 0.0]], math.nan, "radius = nan"),
    ],
)
def test_poses_that_make_no_path_are_refused(rows, radius, message):
    with pytest.raises(ValueError, match=message):
        dubins_path(rows, AIRFRAME, radius=radius)


@pytest.mark.parametrize("spacing", [0.0, -1.0, math.nan])
def test_a_spacing_that_is_none_is_refused(spacing):
    with pytest.raises(ValueError, match="spacing"):
        waypoint_path([[0.0, 0.0], [90.0, 0.0]], AIRFRAME).places(spacing)
