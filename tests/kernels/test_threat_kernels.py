"""Threat kernels: nearest points and insides against shapely, chances against scipy, draws."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from staniel.datatypes.risk import RiskRegion, region_arrays
from staniel.kernels.threats import inside_regions, nearest_points, reach_chances, sensor_draws

KEY = np.uint64(12345)


def star(spokes, reverse=False):
    """A star-shaped polygon, hardly ever convex."""
    turns = np.linspace(0.0, 2.0 * math.pi, len(spokes), endpoint=False)
    corners = tuple(
        (40.0 * r * math.cos(a), 40.0 * r * math.sin(a)) for r, a in zip(spokes, turns, strict=True)
    )
    return corners[::-1] if reverse else corners


coordinate = st.floats(-90.0, 90.0).map(lambda v: round(v, 2))


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.floats(0.2, 1.0), min_size=3, max_size=12),
    st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=1, max_size=6),
    st.booleans(),
    st.sampled_from([(0.0, None), (0.0, 30.0), (20.0, 50.0), (-40.0, None)]),
)
def test_polygons_are_as_near_as_shapely_says(spokes, places, reverse, heights):
    floor, ceiling = heights
    corners = star(spokes, reverse)
    region = RiskRegion(kind="no-fly", polygon=corners, floor=floor, ceiling=ceiling)
    arrays, shape = region_arrays([region]), shapely.Polygon(corners)
    points = nearest_points(np.array(places), arrays, 1000.0)[:, 0]
    inside = inside_regions(np.array(places), arrays)[:, 0]
    for place, point, held in zip(places, points.tolist(), inside.tolist(), strict=True):
        x, y, z = place
        flat = shapely.distance(shape, shapely.Point(x, y))
        up = max(floor - z, 0.0, z - (math.inf if ceiling is None else ceiling))
        assert math.dist(place, point) == pytest.approx(math.hypot(flat, up), abs=1e-9)
        assert shapely.distance(shape, shapely.Point(point[:2])) < 1e-9
        assert floor <= point[2] <= (math.inf if ceiling is None else ceiling)
        if shapely.distance(shape.boundary, shapely.Point(x, y)) > 1e-9:
            assert held == (flat == 0.0 and up == 0.0)


def test_discs_are_as_near_as_pythagoras_says():
    rng = np.random.default_rng(1)
    places = rng.uniform(-100.0, 100.0, (200, 3))
    disc = RiskRegion(
        kind="threat", rate=1.0, center=(10.0, -5.0), radius=30.0, floor=20, ceiling=50
    )
    points = nearest_points(places, region_arrays([disc]), 1000.0)[:, 0]
    flat = np.maximum(np.hypot(places[:, 0] - 10.0, places[:, 1] + 5.0) - 30.0, 0.0)
    up = np.maximum(np.maximum(20.0 - places[:, 2], places[:, 2] - 50.0), 0.0)
    distances = np.linalg.norm(points - places, axis=1)
    np.testing.assert_allclose(distances, np.hypot(flat, up), atol=1e-9)
    held = inside_regions(places, region_arrays([disc]))[:, 0]
    assert np.array_equal(held, np.hypot(flat, up) == 0.0)
    assert held.any()


def test_what_is_out_of_reach_has_no_point():
    regions = [
        RiskRegion(kind="no-fly", center=(0.0, 0.0), radius=30.0, ceiling=20.0),
        RiskRegion(kind="no-fly", polygon=((0, 0), (10, 0), (0, 10))),
    ]
    arrays = region_arrays(regions)
    place = np.array([[130.0, 0.0, 20.0], [10.0, 10.0, 20.0]])
    near = ~np.isnan(nearest_points(place, arrays, 100.0)[:, :, 0])
    assert near.tolist() == [[True, False], [True, True]]
    near = ~np.isnan(nearest_points(place, arrays, 99.9)[:, :, 0])
    assert near.tolist() == [[False, False], [True, True]]
    # In reach of the triangle's box, but not of the triangle: its long side is 7.07 m away.
    near = ~np.isnan(nearest_points(place, arrays, 7.0)[:, :, 0])
    assert near.tolist() == [[False, False], [True, False]]


@pytest.mark.parametrize("sigma", [0.5, 5.0, 40.0, 300.0])
def test_round_uncertainty_is_the_noncentral_chi_square(sigma):
    """Isotropic: squared distance over the variance is noncentral chi-square, two degrees."""
    radius, z = 100.0, 60.0
    disc = math.sqrt(radius**2 - z**2)
    xs = np.concatenate((np.linspace(0.0, 200.0, 41), disc + sigma * np.linspace(-3.0, 3.0, 13)))
    places = np.column_stack((xs * 0.6, xs * 0.8, np.full(len(xs), z)))
    carrier = np.array([[0.0, 0.0, sigma**2, 0.0, sigma**2, radius]])
    wanted = stats.ncx2.cdf((disc / sigma) ** 2, 2, (xs / sigma) ** 2)
    np.testing.assert_allclose(reach_chances(places, carrier)[:, 0], wanted, atol=1e-6)


@pytest.mark.parametrize(("wide", "narrow", "turn"), [(60.0, 5.0, 0.4), (30.0, 0.2, 2.0)])
def test_long_uncertainty_is_the_integral_of_its_density(wide, narrow, turn):
    cosine, sine = math.cos(turn), math.sin(turn)
    rotation = np.array([[cosine, -sine], [sine, cosine]])
    covariance = rotation @ np.diag([wide**2, narrow**2]) @ rotation.T
    carrier = [[7.0, -3.0, covariance[0, 0], covariance[0, 1], covariance[1, 1], 50.0]]
    rng = np.random.default_rng(2)
    places = np.column_stack((rng.uniform(-90.0, 90.0, (12, 2)), rng.uniform(0.0, 49.0, 12)))
    found = reach_chances(places, np.array(carrier))[:, 0]
    assert found.min() < 0.01
    assert found.max() > 0.3
    for place, chance in zip(places, found, strict=True):
        disc = math.sqrt(50.0**2 - place[2] ** 2)
        x, y = rotation.T @ (np.array([7.0, -3.0]) - place[:2])

        def strip(u, x=x, y=y, disc=disc):
            """Density at u along the wide axis, times the mass across it."""
            rim = math.sqrt(max(disc**2 - u**2, 0.0))
            mass = stats.norm.cdf((rim - y) / narrow) - stats.norm.cdf((-rim - y) / narrow)
            return stats.norm.pdf(u, x, wide) * mass

        cuts = np.linspace(-disc, disc, 42)[1:-1]
        wanted, _ = integrate.quad(strip, -disc, disc, points=cuts, limit=400, epsabs=1e-10)
        assert chance == pytest.approx(wanted, abs=2e-6)


def test_a_place_beside_the_rim_is_resolved_however_sharp_the_uncertainty():
    """Where a coarse sum over the whole disc would be off by 1e-3: a sharp place on the rim."""
    rng = np.random.default_rng(3)
    angles, off = rng.uniform(-math.pi, math.pi, 200), rng.normal(0.0, 0.4, 200)
    carriers = np.zeros((200, 6))
    carriers[:, 0], carriers[:, 1] = (44.0 + off) * np.cos(angles), (44.0 + off) * np.sin(angles)
    carriers[:, 2:] = (0.4**2, 0.0, 0.4**2, 44.0)
    # Not quite round, or the axes would not be fixed; the law of the round one is as near.
    carriers[:, 4] += 1e-8
    wanted = stats.ncx2.cdf((44.0 / 0.4) ** 2, 2, ((44.0 + off) / 0.4) ** 2)
    found = reach_chances(np.zeros((1, 3)), carriers)[0]
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_above_the_ball_nothing_is_reached_and_a_known_place_is_a_step():
    carrier = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 50.0]])
    places = np.array([[0.0, 0.0, 50.0], [0.0, 0.0, 60.0], [29.9, 0.0, 40.0], [30.1, 0.0, 40.0]])
    assert reach_chances(places, carrier)[:, 0].tolist() == [0.0, 0.0, 1.0, 0.0]


def test_draws_follow_their_laws_and_are_independent():
    who, what = (index.ravel() for index in np.indices((200, 100)))
    draws = sensor_draws(KEY, 7, who, what)
    assert stats.kstest(draws[:, 0], "uniform").pvalue > 1e-3
    assert stats.kstest(draws[:, 1], "norm").pvalue > 1e-3
    assert stats.kstest(draws[:, 2], "norm").pvalue > 1e-3
    later = sensor_draws(KEY, 8, who, what)
    columns = np.column_stack((draws, later, np.roll(draws, 1, axis=0)))
    apart = np.corrcoef(columns.T) - np.eye(9)
    assert np.abs(apart).max() < 4.5 / math.sqrt(len(who))


def test_a_draw_is_named_by_aircraft_tick_and_danger_alone():
    who, what = np.array([3, 0, 5]), np.array([2, 2, 9])
    whole = sensor_draws(KEY, 4, who, what)
    for k in range(3):
        assert np.array_equal(sensor_draws(KEY, 4, who[k : k + 1], what[k : k + 1])[0], whole[k])
