"""Fillets against shapely: tangent to both legs, as long as is said, and shrunk to fit."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from staniel.guidance.fillets import fillet, fillet_radii, filleted_length, route_length

angles = st.floats(-math.pi, math.pi)


def corner(turn, along, before=200.0, after=200.0, at=(37.0, -12.0)):
    """Three waypoints with a turn between the legs."""
    middle = np.array(at)
    start = middle - before * np.array([math.cos(along), math.sin(along)])
    end = middle + after * np.array([math.cos(along + turn), math.sin(along + turn)])
    return np.array([start, middle, end])


@settings(deadline=None)
@given(turn=st.floats(0.02, 3.0), left=st.booleans(), along=angles, radius=st.floats(5.0, 150.0))
def test_a_fillet_is_tangent_to_both_legs(turn, left, along, radius):
    reach = radius * math.tan(0.5 * turn)
    points = corner(turn if left else -turn, along, reach + 50.0, reach + 20.0)
    arc = fillet(*points, radius)
    legs = [shapely.LineString(points[:2]), shapely.LineString(points[1:])]
    center = shapely.Point(arc.center)
    scale = 1e-9 * (reach + radius + 100.0)
    for leg, touch in zip(legs, (arc.entry, arc.exit), strict=True):
        assert leg.distance(center) == pytest.approx(radius, abs=scale)
        assert leg.distance(shapely.Point(touch)) == pytest.approx(0.0, abs=scale)
        assert math.dist(touch, arc.center) == pytest.approx(radius, abs=scale)
    assert arc.turn == (1 if left else -1)
    assert arc.sweep == pytest.approx(turn)
    # The legs lie on the side to which the arc turns: it cuts the corner, not the way round.
    middle = points[1]
    nearest = math.dist(arc.center, middle) - radius
    assert nearest == pytest.approx(radius / math.sin(0.5 * (math.pi - turn)) - radius, abs=scale)


@pytest.mark.parametrize("turn", [0.0, 1e-9, math.pi, -math.pi + 1e-9])
def test_legs_in_line_and_reversals_have_no_fillet(turn):
    assert fillet(*corner(turn, 0.4), 30.0) is None


def drawn(points, radii):
    """The route with its corners rounded, as a polyline."""
    pieces, last = [], points[0]
    for i, radius in enumerate(radii):
        if radius == 0.0:
            pieces.append(np.array([last, points[i + 1]]))
            last = points[i + 1]
            continue
        arc = fillet(*points[i : i + 3], radius)
        first = math.atan2(arc.entry[1] - arc.center[1], arc.entry[0] - arc.center[0])
        steps = first + arc.turn * np.linspace(0.0, arc.sweep, 2000)
        ring = arc.center + arc.radius * np.column_stack([np.cos(steps), np.sin(steps)])
        pieces.extend([np.array([last, arc.entry]), ring])
        last = np.array(arc.exit)
    return shapely.LineString(np.vstack([*pieces, [last, points[-1]]]))


routes = st.integers(0, 2**32 - 1).map(
    lambda seed: np.cumsum(
        np.random.default_rng(seed).normal(
            0.0, 150.0, (np.random.default_rng(seed).integers(3, 9), 2)
        ),
        axis=0,
    )
)


@settings(max_examples=100, deadline=None)
@given(points=routes, radius=st.floats(30.0, 120.0), least=st.floats(5.0, 30.0))
def test_radii_fit_their_legs_and_the_length_is_that_of_the_drawing(points, radius, least):
    assume(np.hypot(*np.diff(points, axis=0).T).min() > 1.0)
    radii = fillet_radii(points, radius, least)
    assert (((radii >= least - 1e-9) & (radii <= radius + 1e-9)) | (radii == 0.0)).all()
    legs = np.diff(points, axis=0)
    lengths = np.hypot(*legs.T)
    cosine = np.clip((legs[:-1] * legs[1:]).sum(axis=1) / lengths[:-1] / lengths[1:], -1.0, 1.0)
    reach = np.concatenate([[0.0], radii * np.tan(0.5 * np.arccos(cosine)), [0.0]])
    assert (reach[:-1] + reach[1:] <= lengths * (1.0 + 1e-9)).all()
    # Whoever is below what was wanted shares a leg that is full.
    full = reach[:-1] + reach[1:] >= lengths * (1.0 - 1e-9)
    for i in np.flatnonzero((radii > 0.0) & (radii < radius - 1e-9)):
        neighbours = reach[max(i, 0) : i + 3]
        assert full[i] or full[i + 1] or (neighbours > 0.0).sum() > 1
    line = drawn(points, radii)
    assert filleted_length(points, radii) == pytest.approx(line.length, rel=1e-6)
    assert route_length(points) == pytest.approx(shapely.LineString(points).length)
    assert filleted_length(points, radii) <= route_length(points) + 1e-9


def test_two_corners_share_a_short_leg_and_then_one_gives_way():
    route = [[0.0, 0.0], [300.0, 0.0], [300.0, 60.0], [0.0, 60.0]]
    np.testing.assert_allclose(fillet_radii(route, 25.0, 20.0), [25.0, 25.0])
    np.testing.assert_allclose(fillet_radii(route, 50.0, 20.0), [30.0, 30.0])
    np.testing.assert_allclose(fillet_radii(route, 50.0, 30.0), [30.0, 30.0])
    np.testing.assert_allclose(fillet_radii(route, 50.0, 31.0), [0.0, 50.0])
    np.testing.assert_allclose(fillet_radii(route, 80.0, 61.0), [0.0, 0.0])


def test_the_sharper_of_two_corners_gives_way():
    points = [[0.0, 0.0], [300.0, 0.0], [300.0, 60.0], [500.0, 160.0]]
    radii = fillet_radii(points, 80.0, 60.0)
    assert radii[0] == 0.0
    assert radii[1] == pytest.approx(80.0)


def test_a_reversal_and_a_straight_on_are_flown_over_and_cost_nothing():
    points = [[0.0, 0.0], [100.0, 0.0], [200.0, 0.0], [50.0, 0.0], [50.0, 200.0]]
    radii = fillet_radii(points, 40.0, 30.0)
    np.testing.assert_allclose(radii, [0.0, 0.0, 40.0])
    saved = 40.0 * (2.0 - math.pi / 2.0)
    assert filleted_length(points, radii) == pytest.approx(route_length(points) - saved)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.0, 0.0]], "got 1, expected at least 2"),
        (
            [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]],
            r"waypoints\[1\] and waypoints\[2\] coin",
        ),
        ([[0.0, 0.0], [1.0, math.nan]], r"waypoints\[1\] = \[1.0, nan\]: expected finite"),
        ([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]], r"shape \(2, 3\)"),
        ([], "shape"),
    ],
)
def test_routes_that_are_none_are_refused(points, message):
    for of in (route_length, lambda route: fillet_radii(route, 40.0, 30.0)):
        with pytest.raises(ValueError, match=message):
            of(points)


@pytest.mark.parametrize(
    ("radius", "least", "message"),
    [
        (0.0, 1.0, "radius = 0.0"),
        (-3.0, 1.0, "radius = -3.0"),
        (math.nan, 1.0, "radius = nan"),
        (10.0, 0.0, "min_radius = 0.0"),
        (10.0, 11.0, "radius = 10 m: expected at least min_radius = 11 m"),
    ],
)
def test_radii_that_are_none_are_refused(radius, least, message):
    with pytest.raises(ValueError, match=message):
        fillet_radii([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]], radius, least)


def test_a_length_needs_a_radius_for_every_inner_waypoint():
    route = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]]
    for radii in ([], [1.0, 2.0], [-1.0], [math.nan]):
        with pytest.raises(ValueError, match=r"radii = .*expected 1"):
            filleted_length(route, radii)
