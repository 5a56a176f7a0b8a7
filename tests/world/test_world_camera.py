"""Detections against counting, the noise against Monte Carlo, sight against shapely prisms."""

import math

import numpy as np
import pytest
import shapely
from scipy import stats

from staniel.city import City
from staniel.datatypes.equipment import Camera
from staniel.datatypes.truth import Truth
from staniel.world import Cameras

ALTITUDE = 80.0
FIELD = City.open((1000.0, 1000.0))


def truth_of(aircraft, vehicles, tick=0):
    aircraft = np.atleast_2d(np.asarray(aircraft, dtype=float))
    vehicles = np.asarray(vehicles, dtype=float).reshape(-1, 2)
    rows = np.zeros((len(vehicles), 4))
    rows[:, :2] = vehicles
    memory = np.zeros((len(vehicles), 3))
    return Truth(tick, float(tick), aircraft, rows, memory, aircraft[None], rows[None])


def cameras(city=FIELD, seed=1, **changes):
    return Cameras(city, Camera(**changes), ALTITUDE, np.random.SeedSequence(seed))


def looks(camera, aircraft, vehicles, ticks):
    """All sightings and origins of the first aircraft over many ticks."""
    sightings, origins = [], []
    for tick in range(ticks):
        percepts, sources = camera.sense(truth_of(aircraft, vehicles, tick))
        sightings.extend(percepts[0].sightings)
        origins.extend(sources[0])
    return sightings, np.array(origins)


LEVEL = [500.0, 500.0, ALTITUDE, 0.4, 0.0, 15.0]


def test_straight_below_the_noise_is_the_cameras_own():
    camera = cameras(clutter=0.0, detection_probability=1.0, target_height=0.0)
    sightings, _ = looks(camera, LEVEL, [[500.0, 500.0]], 4000)
    error = np.array([s.position for s in sightings]) - 500.0
    assert len(error) == 4000
    np.testing.assert_allclose(np.cov(error.T), 2.25 * np.eye(2), atol=0.2)
    assert stats.kstest(error[:, 0] / 1.5, "norm").pvalue > 0.01


@pytest.mark.parametrize("ray", [(100.0, 0.0), (0.0, 90.0), (-60.0, 70.0)])
def test_noise_follows_the_looks_geometry(ray):
    """A small angular error, thrown through a pinhole onto the ground."""
    camera = cameras(clutter=0.0, detection_probability=1.0)
    place = np.array([500.0, 500.0]) + ray
    sightings, _ = looks(camera, LEVEL, [place], 4000)
    measured = np.array([s.position for s in sightings])
    rng = np.random.default_rng(0)
    line = np.array([*ray, -ALTITUDE])
    unit = line / np.linalg.norm(line)
    across = np.cross(unit, [0, 0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(across, unit)
    delta = 1.5 / ALTITUDE * rng.standard_normal((400_000, 2))
    rays = unit + delta[:, :1] * across + delta[:, 1:] * up
    thrown = np.array([500.0, 500.0]) + rays[:, :2] * (-ALTITUDE / rays[:, 2:])
    expected = np.cov(thrown.T)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(np.cov(measured.T) / scale, expected / scale, atol=0.1)
    assert np.hypot(*(measured.mean(axis=0) - place)) < 0.2


def test_the_reported_covariance_is_honest():
    """Normalised estimation error squared of all sightings together: 2 on average, or nearly."""
    rng = np.random.default_rng(2)
    camera = cameras(clutter=0.0)
    vehicles = 500.0 + rng.uniform(-120, 120, (40, 2))
    squares = []
    for tick in range(150):
        pose = [500.0, 500.0, ALTITUDE, rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), 15.0]
        percepts, origins = camera.sense(truth_of(pose, vehicles, tick))
        for sighting, origin in zip(percepts[0].sightings, origins[0], strict=True):
            error = sighting.position - vehicles[origin]
            squares.append(error @ np.linalg.solve(sighting.covariance, error))
    assert len(squares) > 2000
    assert 1.9 < np.mean(squares) < 2.15


def test_covariance_is_that_of_the_measured_place():
    """Computed again from the sighting and its pose alone."""
    camera = cameras(clutter=2.0)
    sightings, _ = looks(camera, LEVEL, [[560.0, 420.0], [470.0, 520.0]], 50)
    for s in sightings:
        flat = s.position - [s.pose.x, s.pose.y]
        bearing = math.atan2(flat[1], flat[0])
        slant = math.hypot(*flat, s.pose.z)
        delta = 1.5 / ALTITUDE
        turn = np.array(
            [[math.cos(bearing), -math.sin(bearing)], [math.sin(bearing), math.cos(bearing)]]
        )
        sigma = np.diag([(slant**2 / s.pose.z * delta) ** 2, (slant * delta) ** 2])
        np.testing.assert_allclose(s.covariance, turn @ sigma @ turn.T, rtol=1e-9, atol=1e-12)


def test_detection_probability_and_clutter_rate():
    ticks = 3000
    camera = cameras(clutter=0.3, detection_probability=0.8)
    _, origins = looks(camera, LEVEL, [[510.0, 490.0], [450.0, 530.0]], ticks)
    for vehicle in (0, 1):
        found = int((origins == vehicle).sum())
        assert stats.binomtest(found, ticks, 0.8).pvalue > 0.01
    alarms = int((origins == -1).sum())
    assert abs(alarms - 0.3 * ticks) < 3.0 * math.sqrt(0.3 * ticks)


def test_false_alarms_are_uniform_over_the_footprint():
    """A disc, seen level: squared distance from its centre and bearing are uniform."""
    camera = cameras(clutter=5.0, half_aperture_deg=40.0, target_height=0.0)
    sightings, _ = looks(camera, LEVEL, [], 600)
    off = np.array([s.position for s in sightings]) - 500.0
    share = (off**2).sum(axis=1) / (ALTITUDE * math.tan(math.radians(40.0))) ** 2
    assert share.max() <= 1.0 + 1e-9
    assert stats.kstest(share, "uniform").pvalue > 0.01
    bearing = np.arctan2(off[:, 1], off[:, 0]) / (2 * math.pi) + 0.5
    assert stats.kstest(bearing, "uniform").pvalue > 0.01


@pytest.mark.parametrize("bank_deg", [35.0, -20.0])
def test_false_alarms_fill_a_banked_footprint(bank_deg):
    """Their mean is the centroid of the clipped footprint, found by brute force."""
    pose = [500.0, 500.0, ALTITUDE, 0.9, math.radians(bank_deg), 15.0]
    camera = cameras(clutter=20.0, target_height=0.0)
    sightings, _ = looks(camera, pose, [], 200)
    places = np.array([s.position for s in sightings])
    axis = np.arange(-250.0, 250.0, 1.0) + 0.5
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    b, h = pose[4], pose[3]
    look = np.array([math.sin(h) * math.sin(b), -math.cos(h) * math.sin(b), -math.cos(b)])
    rays = np.column_stack([grid, np.full(len(grid), -ALTITUDE)])
    slant = np.linalg.norm(rays, axis=1)
    seen = grid[(rays @ look / slant >= 0.5) & (slant <= 250.0)]
    np.testing.assert_allclose(places.mean(axis=0) - 500.0, seen.mean(axis=0), atol=6.0)
    np.testing.assert_allclose(np.cov(places.T), np.cov(seen.T), rtol=0.12, atol=150.0)
    assert len(sightings) == pytest.approx(4000, abs=200)


def test_nothing_is_detected_through_a_building():
    """Neither a vehicle nor a false alarm: the segment below the roof against shapely outlines."""
    city = City.generate(size=(300.0, 300.0), seed=9)
    rng = np.random.default_rng(3)
    camera = cameras(city, clutter=3.0)
    streets = rng.uniform(2, 298, (4000, 2))
    streets = streets[~city.inside(streets)][:60]
    hits = 0
    for tick in range(60):
        pose = [*rng.uniform(0, 300, 2), 80.0, rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), 15.0]
        percepts, origins = camera.sense(truth_of(pose, streets, tick))
        for sighting, origin in zip(percepts[0].sightings, origins[0], strict=True):
            place = streets[origin] if origin >= 0 else sighting.position
            assert not hidden(city, pose[:3], [*place, 1.0])
            assert origin >= 0 or ((place >= 0.0) & (place <= 300.0)).all()
            hits += 1
    assert hits > 300


def hidden(city, a, b):
    a, b = np.asarray(a), np.asarray(b)
    for outline, roof in zip(city.outlines, city.heights, strict=True):
        low = a + max((a[2] - roof) / (a[2] - b[2]), 0.0) * (b - a)
        if shapely.LineString([low[:2], b[:2]]).intersection(outline).length > 1e-6:
            return True
    return False


def test_false_alarms_outside_the_city_are_dropped():
    camera = cameras(City.open((100.0, 100.0)), clutter=20.0)
    sightings, _ = looks(camera, [0.0, 0.0, 80.0, 0.0, 0.0, 15.0], [], 50)
    places = np.array([s.position for s in sightings])
    assert ((places >= 0.0) & (places <= 100.0)).all()
    assert 150 < len(places) < 350  # about a quarter of 1000 alarms, less the far parts


def test_order_tells_nothing():
    camera = cameras(clutter=0.0, detection_probability=1.0)
    vehicles = [[500.0, 500.0], [510.0, 500.0], [520.0, 500.0]]
    orders = [camera.sense(truth_of(LEVEL, vehicles, tick))[1][0] for tick in range(1200)]
    counts = np.unique(orders, axis=0, return_counts=True)[1]
    assert len(counts) == 6
    assert stats.chisquare(counts).pvalue > 0.01


def test_sensing_is_a_function_of_the_truth():
    truth = truth_of([LEVEL, LEVEL], [[520.0, 500.0]], 5)
    camera = cameras(clutter=2.0)
    camera.sense(truth_of(LEVEL, [], 4))
    assert camera.sense(truth) == cameras(clutter=2.0).sense(truth)
    first, second = camera.sense(truth)[0]
    assert first.sightings != second.sightings


def test_another_aircraft_or_vehicle_changes_no_other_draw():
    vehicles = [[520.0, 500.0], [480.0, 510.0]]
    camera = cameras(clutter=1.0)
    for tick in range(40):
        alone, sources = camera.sense(truth_of(LEVEL, vehicles, tick))
        team, _ = camera.sense(truth_of([LEVEL, LEVEL], vehicles, tick))
        assert team[0] == alone[0]
        more, origins = camera.sense(truth_of(LEVEL, [*vehicles, [500.0, 480.0]], tick))
        kept = {
            (o, s.position.tobytes())
            for s, o in zip(more[0].sightings, origins[0], strict=True)
            if o != 2
        }
        before = zip(alone[0].sightings, sources[0], strict=True)
        assert kept == {(o, s.position.tobytes()) for s, o in before}


def test_percepts_carry_pose_time_and_reporter():
    percepts, _ = cameras(clutter=0.0, detection_probability=1.0).sense(
        truth_of([LEVEL, LEVEL], [[500.0, 500.0]], 3)
    )
    assert [p.sightings[0].reporter for p in percepts] == [0, 1]
    assert percepts[1].pose == tuple(LEVEL)
    assert percepts[1].sightings[0].pose == percepts[1].pose
    assert percepts[0].time == percepts[0].sightings[0].time == 3.0


def test_a_camera_above_its_range_sees_nothing():
    high = [500.0, 500.0, 300.0, 0.0, 0.0, 15.0]
    assert looks(cameras(clutter=50.0), high, [[500.0, 500.0]], 5)[0] == []
