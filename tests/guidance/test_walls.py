"""Wall lines against singular values, Monte Carlo and known buildings; weaving with one beam."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from staniel.angles import wrap
from staniel.city import City
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.equipment import Airframe, Lidar
from staniel.datatypes.lidar import LidarScan
from staniel.datatypes.truth import Truth
from staniel.guidance.walls import fit_line, fit_walls, join_scans
from staniel.guidance.weave import weave
from staniel.scenario import load_scenario
from staniel.scenario.assemble import assemble
from staniel.world import Lidars


def scan_of(city, x, y, heading, *, z=10.0, tick=1, **settings):
    state = np.array([[[x, y, z, heading, 0.0, 15.0]]])
    none = np.zeros((0, 4))
    truth = Truth(tick, float(tick), state[0], none, np.zeros((0, 3)), state, none[None])
    lidar = Lidar(**{"mount": "scanner", **settings})
    percept = Percept(truth.time, Pose(*state[0, 0].tolist()), ())
    return Lidars(city, lidar, np.random.SeedSequence(5)).sense(truth, [percept])[0].lidar


def scan_from(points, sigma=0.05, pose=(0.0, 0.0, 10.0, 0.0, 0.0, 15.0)):
    """A scan whose returns are the points, seen from the pose."""
    pose = Pose(*pose)
    off = np.asarray(points, dtype=float).reshape(-1, 2) - (pose.x, pose.y)
    angles = np.arctan2(off[:, 1], off[:, 0]) - pose.heading
    return LidarScan(0.0, pose, angles, np.hypot(*off.T), sigma)


def mahalanobis(line, rho, alpha):
    error = np.array([line.rho - rho, wrap(line.alpha - alpha)])
    return float(error @ np.linalg.solve(line.covariance, error))


def wall_of(start, end):
    """rho and alpha of the line through two points."""
    (x0, y0), (x1, y1) = start, end
    alpha = math.atan2(x1 - x0, y0 - y1)
    rho = x0 * math.cos(alpha) + y0 * math.sin(alpha)
    return (rho, alpha) if rho >= 0.0 else (-rho, wrap(alpha + math.pi))


# One line

CLOUDS = hnp.arrays(float, (12, 2), elements=st.floats(-50.0, 50.0, width=32))


@given(CLOUDS)
def test_a_line_is_that_of_the_smallest_singular_value(points):
    mean = points.mean(axis=0)
    _, sizes, rows = np.linalg.svd(points - mean)
    assume(sizes[0] > 1.0 and sizes[1] < 0.9 * sizes[0])
    line = fit_line(points, 0.1)
    normal = np.array([math.cos(line.alpha), math.sin(line.alpha)])
    assert abs(normal @ rows[1]) == pytest.approx(1.0, abs=1e-9)
    assert line.rho == pytest.approx(abs(mean @ rows[1]), abs=1e-6)
    assert line.rho >= 0.0
    along = points @ rows[0]
    assert math.dist(line.start, line.end) == pytest.approx(np.ptp(along), abs=1e-6)


def test_weights_are_those_of_copies():
    """A point of half the variance counts as much as two points."""
    rng = np.random.default_rng(1)
    points = np.column_stack((np.linspace(0, 20, 9), rng.normal(5.0, 1.0, 9)))
    spreads = np.repeat(np.eye(2)[None], 9, axis=0)
    spreads[3] /= 2.0
    weighted = fit_line(points, spreads)
    copied = fit_line(np.vstack((points, points[3])), 1.0)
    assert (weighted.rho, weighted.alpha) == pytest.approx((copied.rho, copied.alpha), abs=1e-12)


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-80.0, 80.0), st.floats(-80.0, 80.0), st.integers(0, 10_000))
def test_a_line_moves_with_its_points(turn, east, north, seed):
    """Rotation and translation: parameters, ends, and what the covariance says of the wall."""
    rng = np.random.default_rng(seed)
    points = np.column_stack((np.linspace(-15, 15, 20), np.full(20, 30.0)))
    points += 0.2 * rng.standard_normal(points.shape)
    beams = points / np.hypot(*points.T)[:, None]
    spreads = 0.04 * beams[:, :, None] * beams[:, None, :]
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    shift = np.array([east, north])
    before = fit_line(points, spreads)
    after = fit_line(points @ rotation.T + shift, rotation @ spreads @ rotation.T)
    normal = rotation @ (math.cos(before.alpha), math.sin(before.alpha))
    rho = before.rho + float(shift @ normal)
    sign = 1.0 if rho >= 0.0 else -1.0
    assume(abs(rho) > 1e-3)
    assert after.rho == pytest.approx(abs(rho), abs=1e-9)
    moved = math.atan2(normal[1], normal[0]) + (0.0 if rho >= 0.0 else math.pi)
    assert wrap(after.alpha - moved) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(after.start, rotation @ before.start + shift, atol=1e-8)
    np.testing.assert_allclose(after.end, rotation @ before.end + shift, atol=1e-8)
    # rho' = rho + shift . normal(alpha + turn), its sign turned where it is negative.
    tangent = np.array([-normal[1], normal[0]])
    jacobian = np.array([[sign, sign * float(shift @ tangent)], [0.0, 1.0]])
    expected = jacobian @ before.covariance @ jacobian.T
    np.testing.assert_allclose(after.covariance, expected, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("wall", "sigma"),
    [
        (((20.0, -15.0), (20.0, 15.0)), 0.1),
        (((10.0, 4.0), (50.0, 12.0)), 0.2),
        (((-20.0, 25.0), (30.0, 45.0)), 0.5),
    ],
)
def test_the_covariance_is_that_of_many_scans(wall, sigma):
    """2000 noisy scans from the origin, by ranges along their beams."""
    rng = np.random.default_rng(3)
    places = np.linspace(*wall, 40)
    ranges = np.hypot(*places.T)
    beams = places / ranges[:, None]
    spreads = sigma**2 * beams[:, :, None] * beams[:, None, :]
    rho, alpha = wall_of(*wall)
    noisy = ranges + sigma * rng.standard_normal((2000, 40))
    lines = [fit_line(row[:, None] * beams, spreads) for row in noisy]
    errors = np.array([(line.rho - rho, wrap(line.alpha - alpha)) for line in lines])
    predicted = fit_line(places, spreads).covariance
    scale = np.sqrt(np.outer(np.diag(predicted), np.diag(predicted)))
    np.testing.assert_allclose(np.cov(errors.T) / scale, predicted / scale, atol=0.1)
    squares = [mahalanobis(line, rho, alpha) for line in lines]
    assert np.mean(squares) == pytest.approx(2.0, abs=0.2)
    assert stats.kstest(squares, "chi2", args=(2,)).pvalue > 1e-3


@pytest.mark.parametrize(
    ("points", "covariance", "word"),
    [
        ([[0.0, 0.0]], 0.1, "points"),
        ([[1.0, 1.0], [1.0, 1.0]], 0.1, "points"),
        ([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], 0.1, "points"),
        ([[0.0, math.nan], [1.0, 1.0]], 0.1, "points"),
        ([0.0, 1.0], 0.1, "points"),
        ([[0.0, 0.0], [1.0, 1.0]], -0.1, "covariance"),
        ([[0.0, 0.0], [1.0, 1.0]], np.eye(2), "covariance"),
        ([[0.0, 0.0], [1.0, 1.0]], [np.eye(2), np.zeros((2, 2))], "covariance"),
    ],
)
def test_a_line_refuses_what_has_none(points, covariance, word):
    with pytest.raises(ValueError, match=word):
        fit_line(points, covariance)


# Whole scans

HOUSE = shapely.Polygon([(60, 40), (85, 55), (70, 80), (45, 65)])
CITY = City.from_outlines([HOUSE], [30.0], (150.0, 150.0))
SIDES = list(zip(HOUSE.exterior.coords[:-1], HOUSE.exterior.coords[1:], strict=True))


def incidence(x, y, side):
    """Smallest angle between a side and the beams from a place on its outer face; else 0."""
    (x0, y0), (x1, y1) = side
    angles = []
    for ex, ey in side:
        beam = np.array([ex - x, ey - y])
        turn = (x1 - x0) * beam[1] - (y1 - y0) * beam[0]
        angles.append(math.asin(turn / math.hypot(*beam) / math.dist(*side)))
    return max(min(angles), 0.0)


@pytest.mark.parametrize("bearing", [0.0, 0.7, 2.2, 3.0, 4.0, 5.3])
def test_a_building_is_found_within_three_sigma(bearing):
    """From all round: each side that is well seen, once, from corner to corner; and no other."""
    x, y = 65.0 + 55.0 * math.cos(bearing), 60.0 + 55.0 * math.sin(bearing)
    faces = [side for side in SIDES if incidence(x, y, side) > math.radians(20.0)]
    assert len(faces) in (1, 2)
    limit, checked, missed = stats.chi2(2).ppf(0.9973), 0, 0
    for tick in range(40):
        lines = fit_walls(scan_of(CITY, x, y, bearing + math.pi, tick=tick, aperture_deg=120.0))
        found = {}
        for line in lines:
            squares = [mahalanobis(line, *wall_of(*side)) for side in SIDES]
            found.setdefault(SIDES[int(np.argmin(squares))], []).append(line)
            checked += 1
            missed += min(squares) > limit
        for side in faces:
            (line,) = found[side]
            seen = shapely.LineString([line.start, line.end])
            assert seen.hausdorff_distance(shapely.LineString(side)) < 4.0
    assert missed <= 3  # 0.3 % are expected beyond
    assert checked >= 40


def test_corners_are_split_where_they_are():
    """Two walls at a right angle: every return goes to its own wall, but for one at the corner."""
    corner = City.from_outlines([shapely.box(50, 50, 90, 90)], [30.0], (150.0, 150.0))
    for tick in range(30):
        scan = scan_of(corner, 20.0, 30.0, math.pi / 4, tick=tick, noise=0.1)
        right, left = fit_walls(scan)
        assert (right.rho, right.alpha) == pytest.approx((50.0, math.pi / 2), abs=0.3)
        assert (left.rho, left.alpha) == pytest.approx((50.0, 0.0), abs=0.3)
        clean = scan_of(corner, 20.0, 30.0, math.pi / 4, tick=tick, noise=0.0).points()
        on_south = int((np.abs(clean[:, 1] - 50.0) < 1e-6).sum())
        assert abs(right.returns - on_south) <= 1
        assert right.returns + left.returns == len(clean)


def test_without_noise_walls_are_exact():
    lines = fit_walls(scan_of(CITY, 48.0, -5.0, 1.3, noise=0.0))
    expected = [wall_of(*side) for side in SIDES]
    assert len(lines) == 2
    for line in lines:
        assert min(math.hypot(line.rho - r, line.alpha - a) for r, a in expected) < 1e-9
        np.testing.assert_array_equal(line.covariance, np.zeros((2, 2)))


def test_houses_in_a_row_stay_apart():
    """Three fronts on one line with alleys between: three walls, the same line."""
    row = [shapely.box(x, 60, x + 25, 80) for x in (20.0, 55.0, 90.0)]
    city = City.from_outlines(row, [30.0] * 3, (140.0, 140.0))
    lines = fit_walls(scan_of(city, 67.0, 25.0, math.pi / 2, noise=0.05))
    fronts = [line for line in lines if abs(line.alpha - math.pi / 2) < 0.05]
    assert len(fronts) == 3
    assert [round(line.rho) for line in fronts] == [60, 60, 60]
    starts = [line.start[0] for line in fronts]
    assert starts == sorted(starts, reverse=True)  # from right to left


@settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-200.0, 200.0), st.floats(-200.0, 200.0))
def test_a_scan_moves_with_its_aircraft(turn, east, north):
    points = [(30.0, y) for y in np.linspace(-12.0, 11.3, 25)]
    points += [(x, 12.0) for x in np.linspace(20.0, 29.2, 10)]
    here = fit_walls(scan_from(points))
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    moved = np.array(points) @ rotation.T + (east, north)
    there = fit_walls(scan_from(moved, pose=(east, north, 10.0, turn, 0.0, 15.0)))
    assert [line.returns for line in there] == [line.returns for line in here]
    for before, after in zip(here, there, strict=True):
        np.testing.assert_allclose(after.start, rotation @ before.start + (east, north), atol=1e-7)
        np.testing.assert_allclose(after.end, rotation @ before.end + (east, north), atol=1e-7)


def surprise(line, rho, alpha):
    """Squared Mahalanobis distance of the true line, in a frame at the middle of the wall."""
    middle = 0.5 * (np.array(line.start) + line.end)
    distance, covariance = line.about(tuple(middle))
    true = rho - middle @ (math.cos(alpha), math.sin(alpha))
    error = np.array([distance - true, wrap(line.alpha - alpha)])
    return float(error @ np.linalg.solve(covariance, error))


def test_a_frame_at_the_wall_is_that_of_shifted_points():
    rng = np.random.default_rng(8)
    points = np.column_stack((np.linspace(300, 330, 20), np.linspace(500, 510, 20)))
    points += 0.1 * rng.standard_normal(points.shape)
    spreads = np.tile(0.01 * np.eye(2), (20, 1, 1))
    far, here = fit_line(points, spreads), np.array((310.0, 490.0))
    near = fit_line(points - here, spreads)
    distance, covariance = far.about(tuple(here))
    assert (distance, far.alpha) == pytest.approx((near.rho, near.alpha), abs=1e-9)
    np.testing.assert_allclose(covariance, near.covariance, rtol=1e-6)


def test_walls_of_a_whole_city_are_where_their_covariance_says():
    """Where all returns are of one wall, chi-squared; and few walls have others among theirs."""
    limit, pure, mixed = stats.chi2(2).ppf(0.9973), [], []
    for seed in (1, 2, 3):
        city = City.generate(seed=seed)
        rings = [outline.exterior.coords for outline in city.outlines]
        sides = [side for ring in rings for side in pairwise(ring)]
        tree = shapely.STRtree([shapely.LineString(side) for side in sides])
        built, rng, looks = shapely.union_all(city.outlines), np.random.default_rng(0), 0
        while looks < 50:
            x, y = rng.uniform(0.0, city.size)
            if built.distance(shapely.Point(x, y)) < 2.0:
                continue
            looks += 1
            scan = scan_of(city, x, y, rng.uniform(-3, 3), tick=looks)
            lines = fit_walls(scan)
            if not lines:
                continue
            points, clean = scan.points(), true_points(built, scan)
            for line in lines:
                normal = np.array((math.cos(line.alpha), math.sin(line.alpha)))
                along = np.array((-normal[1], normal[0]))
                low, high = sorted((np.dot(line.start, along), np.dot(line.end, along)))
                own = np.abs(points @ normal - line.rho) < 1.0
                own &= (points @ along > low - 1e-6) & (points @ along < high + 1e-6)
                walls = tree.query_nearest(shapely.points(clean[own]), all_matches=False)[1]
                wall = np.bincount(walls).argmax()
                rho, alpha = wall_of(*sides[wall])
                others = np.abs(clean[own] @ (math.cos(alpha), math.sin(alpha)) - rho) > 1e-6
                (mixed if others.any() else pure).append(surprise(line, rho, alpha))
    beyond = int((np.array(pure) > limit).sum())
    assert len(pure) > 400
    assert stats.binomtest(beyond, len(pure), 0.0027).pvalue > 1e-3
    assert stats.kstest(pure, "chi2", args=(2,)).pvalue > 1e-3
    everything = np.array(pure + mixed)
    assert (everything > limit).mean() < 0.04
    assert (np.array(mixed) > limit).mean() < 0.35


def true_points(built, scan):
    """Where each beam that returned first meets a building."""
    directions = scan.directions()[scan.returned]
    origin = np.array((scan.pose.x, scan.pose.y))
    beams = shapely.linestrings([[origin, origin + 150.0 * way] for way in directions])
    met = shapely.intersection(beams, built.boundary)
    gaps = [shapely.distance(shapely.Point(origin), places) for places in met]
    return origin + np.array(gaps)[:, None] * directions


def test_isolated_returns_are_dropped():
    wall = [(40.0, y) for y in np.linspace(-5.0, 5.0, 11)]
    strays = [(20.0, 15.0), (60.0, 40.0), (25.0, -20.0), (25.5, -20.0)]
    (line,) = fit_walls(scan_from([*wall, *strays]))
    assert line.returns == 11
    assert line.rho == pytest.approx(40.0)
    assert fit_walls(scan_from(strays)) == []
    assert fit_walls(scan_from([(20.0, 15.0)] * 9)) == []  # a pole


def test_nothing_gives_nothing():
    assert fit_walls(scan_from([])) == []
    silent = LidarScan(0.0, Pose(0, 0, 9, 0, 0, 15), [0.0, 0.1], [math.inf, math.inf], 0.1)
    assert fit_walls(silent) == []
    inside = LidarScan(0.0, Pose(0, 0, 9, 0, 0, 15), np.arange(9.0), np.zeros(9), 0.1)
    assert fit_walls(inside) == []


@pytest.mark.parametrize("settings", [{"gap": 0.0}, {"gap": math.nan}, {"fewest": 2}])
def test_fitting_refuses_settings_without_meaning(settings):
    with pytest.raises(ValueError, match="gap"):
        fit_walls(scan_from([]), **settings)


# One beam on a weaving aircraft


def alone_in_the_open(state):
    """The world's own flight: one aircraft, no vehicles, no buildings."""
    changes = {"aircraft.count": 1, "vehicles.count": 0, "aircraft.altitude": state[2]}
    mission = assemble(load_scenario("downtown", **changes), City.open((1000.0, 1000.0)))
    aircraft = np.array([state])
    truth = dataclasses.replace(mission.start, aircraft=aircraft, aircraft_path=aircraft[None])
    return mission.world, truth


def test_weaving_keeps_course_and_swings_as_asked():
    """The flight model under the commands of every second, for four periods."""
    airframe, course, amplitude, period = Airframe(), 2.9, 0.35, 6.0
    world, truth = alone_in_the_open([500.0, 500.0, 80.0, course + 0.3, 0.0, 15.0])
    headings = []
    for second in range(24):
        command = weave(
            float(second),
            Pose(*truth.aircraft[0, :6].tolist()),
            airframe,
            course=course,
            amplitude=amplitude,
            period=period,
        )
        truth = world.advance(truth, [command])
        path = truth.aircraft_path
        headings.extend(wrap(h - course) for h in path[:, 0, 3].tolist())
    settled = np.array(headings[60:])
    times = 0.1 * np.arange(61, 241)
    assert np.abs(settled - amplitude * np.sin(math.tau * times / period)).max() < 0.06
    assert abs(settled.mean()) < 0.01


def test_weaving_stays_within_the_airframe():
    airframe = Airframe()
    pose = Pose(0.0, 0.0, 80.0, 1.0, 0.0, 15.0)
    command = weave(0.0, pose, airframe, course=0.0, amplitude=1.5, period=2.0)
    assert max(map(abs, command.banks)) <= airframe.max_bank
    assert (command.speed, command.altitude) == (airframe.speed, airframe.altitude)
    for wrong in ({"amplitude": 0.0}, {"amplitude": 2.0}, {"period": 0.0}, {"course": math.nan}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            weave(0.0, pose, airframe, **{"course": 0.0, "amplitude": 0.3, "period": 6.0, **wrong})


def test_a_weaving_aircraft_recovers_the_wall_ahead_with_one_beam():
    """Towards a slanted front for ten seconds, and the line is known within three sigma."""
    front = (200.0, 20.0), (220.0, 180.0)
    house = shapely.Polygon([front[0], (290.0, 20.0), (290.0, 180.0), front[1]])
    city = City.from_outlines([house], [60.0], (300.0, 200.0))
    airframe = Airframe(altitude=30.0)
    lidars = Lidars(city, Lidar(mount="rangefinder", range=120.0), np.random.SeedSequence(2))
    world, truth = alone_in_the_open([40.0, 100.0, 30.0, 0.0, 0.0, 15.0])
    scans = []
    for second in range(8):
        command = weave(
            float(second),
            Pose(*truth.aircraft[0, :6].tolist()),
            airframe,
            course=0.0,
            amplitude=math.radians(25.0),
            period=5.0,
        )
        truth = world.advance(truth, [command])
        percept = Percept(truth.time, Pose(*truth.aircraft[0, :6].tolist()), ())
        scans.append(lidars.sense(truth, [percept])[0].lidar)
    assert truth.aircraft[0, 0] < 170.0
    joined = join_scans(scans)
    assert len(joined.ranges) == 80
    np.testing.assert_allclose(
        joined.points(), np.vstack([scan.points() for scan in scans]), atol=1e-9
    )
    (line,) = fit_walls(joined)
    rho, alpha = wall_of(*front)
    assert mahalanobis(line, rho, alpha) < stats.chi2(2).ppf(0.9973)
    assert line.returns > 30
    assert math.dist(line.start, line.end) > 40.0
    assert math.sqrt(line.covariance[1, 1]) < math.radians(0.5)


def test_joining_needs_a_scan():
    with pytest.raises(ValueError, match="scans"):
        join_scans([])
