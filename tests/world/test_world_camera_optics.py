"""The camera's options: measured rays, mounts, fading detections, merged pixels, frames, delay."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

import staniel
from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Camera
from staniel.datatypes.truth import CAMERA, DRIFT_X, Truth, nominal
from staniel.errors import ScenarioError
from staniel.kernels.camera import measure
from staniel.kernels.footprint import camera_axes
from staniel.world import Cameras

ALTITUDE = 80.0
FIELD = City.open((1000.0, 1000.0))
LEVEL = [500.0, 500.0, ALTITUDE, 0.4, 0.0, 15.0]


def truth_of(aircraft, vehicles, tick=0):
    """One instant, or a path of substeps with that axis first."""
    aircraft = np.array(aircraft, dtype=float, ndmin=3)
    places = np.array(vehicles, dtype=float, ndmin=3)
    places = places.reshape(len(places), -1, 2)
    rows = np.zeros((*places.shape[:2], 4))
    rows[:, :, :2] = places
    memory = np.zeros((rows.shape[1], 3))
    return Truth(tick, float(tick), aircraft[-1], rows[-1], memory, aircraft, rows)


def cameras(city=FIELD, seed=1, **changes):
    return Cameras(city, Camera(**changes), ALTITUDE, np.random.SeedSequence(seed), Clock())


def looks(camera, aircraft, vehicles, ticks):
    sightings, origins = [], []
    for tick in range(ticks):
        percepts, sources = camera.sense(truth_of(aircraft, vehicles, tick))
        sightings.extend(percepts[0].sightings)
        origins.extend(sources[0])
    return sightings, np.array(origins)


# Measured rays (thesis eq. 4.20)


def through_the_pixel(pose, place, tilt, error):
    """The whole mechanisation with matrices: world to camera, an error there, camera to ground."""
    mount = Rotation.from_euler("y", -tilt)
    body = Rotation.from_euler("z", pose[3]) * Rotation.from_euler("x", -pose[4])
    camera = body * mount
    ray = camera.inv().apply([place[0] - pose[0], place[1] - pose[1], -pose[2]])
    ray /= np.linalg.norm(ray)
    turned = camera.apply(Rotation.from_rotvec(camera.inv().apply(error)).apply(ray))
    return np.array(pose[:2]) + turned[:2] * (-pose[2] / turned[2])


@pytest.mark.parametrize("flat", [(0.0, 0.0), (30.0, -20.0), (-150.0, 40.0), (0.0, 200.0)])
def test_a_measured_ray_goes_through_mount_bank_and_heading(flat):
    """Equal to the back-projection with rotation matrices, whatever the camera's attitude."""
    rng = np.random.default_rng(4)
    for _ in range(30):
        pose = np.array([10.0, 20.0, 80.0, rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), 15.0])
        place = pose[:2] + flat
        up, aside = rng.normal(0.0, 0.05, 2)
        bearing = math.atan2(flat[1], flat[0])
        ray = np.array([*flat, -80.0]) / math.hypot(*flat, 80.0)
        left = np.array([-math.sin(bearing), math.cos(bearing), 0.0])
        raised = np.cross(ray, left)
        # A turn vector moves the ray by its cross product with it.
        error = np.cross(ray, up * raised + aside * left)
        found, x, y = measure(pose, *place, up, aside, 1e6)
        expected = through_the_pixel(pose, place, rng.uniform(-0.5, 0.5), error)
        assert found
        np.testing.assert_allclose([x, y], expected, rtol=1e-9, atol=1e-7)


def test_a_ray_into_the_sky_is_no_detection():
    pose = np.array([0.0, 0.0, 80.0, 0.0, 0.0, 15.0])
    elevation = math.atan2(80.0, 200.0)
    assert not measure(pose, 200.0, 0.0, elevation + 0.01, 0.0, 1e9)[0]
    assert not measure(pose, 200.0, 0.0, elevation - 0.01, 0.0, 1e3)[0]
    assert measure(pose, 200.0, 0.0, elevation - 0.1, 0.0, 1e3)[0]


@pytest.mark.parametrize("flat", [10.0, 80.0, 190.0])
def test_the_reported_covariance_is_the_linearised_ray(flat):
    """Differences of the exact mapping against the covariance that a tiny noise reports."""
    pose, tiny = np.array(LEVEL), 1e-6
    place = np.array([500.0 + 0.6 * flat, 500.0 + 0.8 * flat])
    steps = [
        np.array(measure(pose, *place, *turn, 1e6)[1:]) - measure(pose, *place, *-turn, 1e6)[1:]
        for turn in tiny * np.eye(2)
    ]
    jacobian = np.column_stack(steps) / (2.0 * tiny)
    delta = 1e-4 / ALTITUDE
    sharp = cameras(noise=1e-4, clutter=0.0, detection_probability=1.0, half_aperture_deg=80.0)
    (sighting,), _ = looks(sharp, LEVEL, [place], 1)
    np.testing.assert_allclose(sighting.covariance, delta**2 * jacobian @ jacobian.T, rtol=1e-4)


def test_errors_are_consistent_all_over_the_footprint():
    """Squared errors in units of the reported covariance: chi-square with 2 degrees of freedom."""
    rng = np.random.default_rng(6)
    camera = cameras(noise=0.3, clutter=0.0, detection_probability=1.0, mount="tilt", tilt_deg=20.0)
    vehicles = 500.0 + rng.uniform(-200, 200, (60, 2))
    rings = {near: [] for near in (0, 60, 120, 180)}
    for tick in range(150):
        pose = [500.0, 500.0, ALTITUDE, rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), 15.0]
        percepts, origins = camera.sense(truth_of(pose, vehicles, tick))
        for sighting, origin in zip(percepts[0].sightings, origins[0], strict=True):
            error = sighting.position - vehicles[origin]
            flat = math.dist(vehicles[origin], pose[:2])
            ring = max(near for near in rings if flat >= near)
            rings[ring].append(error @ np.linalg.solve(sighting.covariance, error))
    for squares in rings.values():
        count = len(squares)
        assert count > 200
        low, high = stats.chi2.ppf([0.001, 0.999], 2 * count) / count
        assert low < np.mean(squares) < high
        assert stats.kstest(squares, stats.chi2(2).cdf).pvalue > 0.001


# Mounts


def test_a_level_mount_sees_its_disc_whatever_the_bank():
    pose = [500.0, 500.0, ALTITUDE, 0.9, math.radians(35.0), 15.0]
    camera = cameras(clutter=20.0, mount="nadir", half_aperture_deg=40.0, target_height=0.0)
    off = np.array([s.position for s in looks(camera, pose, [], 100)[0]]) - 500.0
    share = (off**2).sum(axis=1) / (ALTITUDE * math.tan(math.radians(40.0))) ** 2
    assert share.max() <= 1.0 + 1e-9
    assert stats.kstest(share, "uniform").pvalue > 0.01


@pytest.mark.parametrize(("tilt", "cant"), [(35.0, 0.0), (-20.0, 30.0)])
def test_vehicles_and_false_alarms_are_in_a_tilted_footprint(tilt, cant):
    """Against the cone around an axis from rotation matrices, on a grid of the ground."""
    pose = [500.0, 500.0, ALTITUDE, 2.1, -0.3, 15.0]
    axis = np.arange(-250.0, 250.0, 9.0) + 500.0
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    mount = Rotation.from_euler("x", cant, True) * Rotation.from_euler("y", -tilt, True)
    body = Rotation.from_euler("z", pose[3]) * Rotation.from_euler("x", -pose[4])
    look = (body * mount).apply([0.0, 0.0, -1.0])
    rays = np.column_stack([grid - 500.0, np.full(len(grid), -ALTITUDE)])
    slant = np.linalg.norm(rays, axis=1)
    expected = (rays @ look / slant >= math.cos(math.radians(50.0))) & (slant <= 250.0)
    options = {"mount": "tilt", "tilt_deg": tilt, "cant_deg": cant, "half_aperture_deg": 50.0}
    exact = cameras(clutter=0.0, detection_probability=1.0, target_height=0.0, **options)
    _, origins = looks(exact, pose, grid, 1)
    assert set(origins.tolist()) == set(np.flatnonzero(expected).tolist())
    alarms = looks(cameras(clutter=30.0, target_height=0.0, **options), pose, [], 80)[0]
    places = np.array([s.position for s in alarms])
    np.testing.assert_allclose(places.mean(axis=0), grid[expected].mean(axis=0), atol=8.0)
    assert len(places) == pytest.approx(2400, abs=200)


def test_above_the_greatest_height_nothing_is_detected():
    low, high = LEVEL, [500.0, 500.0, 90.0, 0.4, 0.0, 15.0]
    camera = cameras(clutter=5.0, max_height=85.0)
    assert len(looks(camera, low, [[500.0, 500.0]], 10)[0]) > 0
    assert looks(camera, high, [[500.0, 500.0]], 10)[0] == []


# Detection probability


@pytest.mark.parametrize("flat", [0.0, 100.0, 200.0])
@pytest.mark.parametrize("exponent", [1.0, 4.0])
def test_detections_get_rarer_with_the_range(flat, exponent):
    camera = cameras(
        clutter=0.0, half_aperture_deg=80.0, detection_falloff=exponent, target_height=0.0
    )
    _, origins = looks(camera, LEVEL, [[500.0 + flat, 500.0]], 2000)
    expected = 0.9 * (1.0 - (math.hypot(flat, ALTITUDE) / 250.0) ** exponent)
    assert stats.binomtest(len(origins), 2000, expected).pvalue > 0.001


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_a_gaussian_image_is_the_footprints_own_gaussian(share):
    """Level: mean and covariance of the disc's ellipse, -1/2 on its edge (thesis fig. 4.5)."""
    radius = ALTITUDE * math.tan(math.radians(60.0))
    place = [500.0, 500.0 + share * radius]
    camera = cameras(clutter=0.0, weighting="gaussian", target_height=0.0)
    _, origins = looks(camera, LEVEL, [place], 2000)
    offset, covariance = np.array([0.0, share * radius]), radius**2 * np.eye(2)
    expected = 0.9 * math.exp(-0.5 * offset @ np.linalg.solve(covariance, offset))
    assert stats.binomtest(len(origins), 2000, expected).pvalue > 0.001


def test_a_gaussian_image_is_centred_where_a_banked_camera_looks():
    bank = math.radians(30.0)
    camera = cameras(clutter=0.0, weighting="gaussian", target_height=0.0)
    # Flying east in a left bank it looks south: there it detects with its full probability.
    pose = [500.0, 500.0, ALTITUDE, 0.0, bank, 15.0]
    places = [[500.0, 500.0 - ALTITUDE * math.tan(bank)], [500.0, 500.0]]
    _, origins = looks(camera, pose, places, 3000)
    below = 0.9 * math.exp(-0.5 * (math.tan(bank) / math.tan(math.radians(60.0))) ** 2)
    for vehicle, expected in enumerate((0.9, below)):
        assert stats.binomtest(int((origins == vehicle).sum()), 3000, expected).pvalue > 0.001


# Resolution


def test_vehicles_within_two_pixels_are_one_at_their_mean():
    """120 pixels over 120 degrees: two pixels are 2 degrees, 2.79 m straight below from 80 m."""
    options = {"clutter": 0.0, "detection_probability": 1.0, "noise": 1e-6, "target_height": 0.0}
    limit = 2.0 * ALTITUDE * math.tan(math.radians(1.0))
    for gap, count in ((0.99 * limit, 1), (1.01 * limit, 2)):
        pair = [[500.0 - 0.5 * gap, 500.0], [500.0 + 0.5 * gap, 500.0]]
        sightings, origins = looks(cameras(image_width=120, **options), LEVEL, pair, 1)
        assert len(sightings) == count
        if count == 1:
            np.testing.assert_allclose(sightings[0].position, [500.0, 500.0], atol=1e-4)
            assert origins.tolist() == [0]
        assert len(looks(cameras(**options), LEVEL, pair, 1)[0]) == 2


def test_merging_is_that_of_connected_groups():
    """Groups of rays by scipy's connected components, chains included."""
    rng = np.random.default_rng(8)
    options = {"clutter": 0.0, "detection_probability": 1.0, "noise": 1e-6, "target_height": 0.0}
    for tick in range(20):
        vehicles = 500.0 + rng.uniform(-60, 60, (50, 2))
        rays = np.column_stack([vehicles - 500.0, np.full(50, -ALTITUDE)])
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        near = np.arccos(np.clip(rays @ rays.T, -1, 1)) < 4.0 * math.radians(60.0) / 60.0
        count, label = connected_components(near)
        means = np.array([vehicles[label == k].mean(axis=0) for k in range(count)])
        camera = cameras(image_width=60, **options)
        percepts, _ = camera.sense(truth_of(LEVEL, vehicles, tick))
        places = np.array([s.position for s in percepts[0].sightings])
        assert 5 < len(places) == count < 45
        np.testing.assert_allclose(
            places[np.lexsort(places.T)], means[np.lexsort(means.T)], atol=1e-3
        )


# Frames and delay


def moving(tick, substeps=10):
    """An aircraft flying east at 15 m/s and a vehicle driving north at 2 m/s, by substeps."""
    times = tick + (np.arange(1, substeps + 1) - substeps) / substeps
    aircraft = np.tile(LEVEL, (substeps, 1, 1))
    aircraft[:, 0, 0] += 15.0 * times
    vehicles = np.tile([500.0, 480.0], (substeps, 1, 1))
    vehicles[:, 0, 1] += 2.0 * times
    return truth_of(aircraft, vehicles, tick), times


SHARP = {"clutter": 0.0, "detection_probability": 1.0, "noise": 1e-6}


def test_frames_are_taken_between_decisions_where_things_were_then():
    camera = cameras(frame_interval=0.2, **SHARP)
    for tick in (1, 2, 3):
        truth, _ = moving(tick)
        (percept,), _ = camera.sense(truth)
        seen = [s.time for s in percept.sightings]
        np.testing.assert_allclose(seen, tick + np.array([-0.8, -0.6, -0.4, -0.2, 0.0]), atol=1e-9)
        for sighting in percept.sightings:
            assert sighting.pose.x == pytest.approx(500.0 + 15.0 * sighting.time)
            assert sighting.position[1] == pytest.approx(480.0 + 2.0 * sighting.time, abs=1e-3)
        assert percept.pose.x == pytest.approx(500.0 + 15.0 * tick)


def test_a_slow_camera_looks_in_some_ticks_only():
    camera = cameras(frame_interval=1.5, **SHARP)
    times = [
        sighting.time
        for tick in range(1, 8)
        for sighting in camera.sense(moving(tick)[0])[0][0].sightings
    ]
    np.testing.assert_allclose(times, [1.5, 3.0, 4.5, 6.0], atol=1e-9)


def test_frames_have_luck_of_their_own_and_the_last_is_the_plain_look():
    """A frame a step draws as without frames; frames in between are independent of it."""
    plain = cameras(clutter=0.0, detection_probability=0.5)
    once = cameras(clutter=0.0, detection_probability=0.5, frame_interval=1.0)
    often = cameras(clutter=0.0, detection_probability=0.5, frame_interval=0.5)
    hits = np.zeros((1000, 2), dtype=int)
    for tick in range(1, 1001):
        truth, _ = moving(tick % 5)
        truth = truth_of(truth.aircraft_path, truth.vehicle_path[:, :, :2], tick)
        assert once.sense(truth) == plain.sense(truth)
        for sighting in often.sense(truth)[0][0].sightings:
            hits[tick - 1, int(sighting.time == truth.time)] += 1
    assert hits.max() == 1
    for column in hits.T:
        assert stats.binomtest(int(column.sum()), 1000, 0.5).pvalue > 0.001
    assert abs(np.corrcoef(hits.T)[0, 1]) < 0.1


@pytest.mark.parametrize(("delay", "ticks"), [(0.3, 1), (1.0, 1), (1.1, 2), (2.0, 2)])
def test_a_delay_rounds_up_to_ticks_and_keeps_the_time(delay, ticks):
    camera, prompt = cameras(delay=delay, **SHARP), cameras(**SHARP)
    earlier = []
    for tick in range(8):
        truth, _ = moving(tick)
        earlier.append(prompt.sense(truth)[0][0].sightings)
        (percept,), (origins,) = camera.sense(truth)
        assert percept.sightings == (earlier[tick - ticks] if tick >= ticks else ())
        assert len(origins) == len(percept.sightings)
        assert percept.time == tick


def test_what_a_camera_took_before_it_died_still_arrives_as_it_was_mapped_then():
    """Dead from tick 4 on, and a navigation that drifts by 1 m a tick, to the east."""
    camera, prompt = cameras(delay=2.0, **SHARP), cameras(**SHARP)
    taken, arrived = {}, {}
    for tick in range(9):
        truth, _ = moving(tick)
        for sighting in prompt.sense(truth)[0][0].sightings:
            taken[sighting.time] = sighting
        condition = nominal(1)
        condition[0, CAMERA] = tick < 4
        condition[0, DRIFT_X] = tick
        (percept,), (origins,) = camera.sense(replace(truth, condition=condition))
        assert len(origins) == len(percept.sightings)
        for sighting in percept.sightings:
            arrived[sighting.time] = sighting
            assert tick == sighting.time + 2.0
    assert sorted(taken) == [float(tick) for tick in range(9)]
    assert sorted(arrived) == [0.0, 1.0, 2.0, 3.0]
    for time, sighting in arrived.items():
        np.testing.assert_allclose(sighting.position - taken[time].position, [time, 0.0])
        assert sighting.pose.x - taken[time].pose.x == time


def test_frames_and_delay_together():
    """Each frame arrives in the first tick that is late enough for it."""
    camera = cameras(frame_interval=0.5, delay=0.5, **SHARP)
    arrivals = [
        (tick, round(sighting.time, 6))
        for tick in range(1, 5)
        for sighting in camera.sense(moving(tick)[0])[0][0].sightings
    ]
    assert arrivals == [
        (tick, time) for tick in range(1, 5) for time in (tick - 1.0, tick - 0.5) if time > 0.0
    ]


def test_another_run_finds_nothing_left_of_the_last():
    camera = cameras(delay=1.0, **SHARP)
    camera.sense(moving(4)[0])
    assert camera.sense(moving(0)[0])[0][0].sightings == ()


def test_a_frame_interval_is_a_number_of_dynamics_steps():
    with pytest.raises(ScenarioError, match=r"camera.frame_interval = 0.25 s: expected a whole"):
        cameras(frame_interval=0.25)


# Missions


@pytest.mark.parametrize(
    "camera",
    [
        {"mount": "nadir", "frame_interval": 0.5, "delay": 0.7},
        {"mount": "tilt", "tilt_deg": 25.0, "cant_deg": 10.0, "image_width": 640},
        {"mount": "gimbal", "half_aperture_deg": 35.0, "gimbal_limit_deg": 60.0},
        {"weighting": "gaussian", "detection_falloff": 6.0, "max_height": 100.0},
    ],
)
def test_a_mission_with_another_camera_finds_vehicles(camera, tmp_path):
    scenario = staniel.load_scenario("village", minutes=3.0, camera=camera)
    run = staniel.fly(scenario, out=tmp_path / "run")
    assert any(target["found_at"] is not None for target in run.metrics["targets"])
    assert run.metrics["team"]["auctions"] >= 1
    assert any(target["visible_fraction"] > 0.0 for target in run.metrics["targets"])


def test_a_gimbal_keeps_the_record_and_the_world_of_one_mind(tmp_path):
    """Every recorded detection of a vehicle lies in the cone that the record's commands tell."""
    options = {"mount": "gimbal", "half_aperture_deg": 25.0, "gimbal_limit_deg": 50.0}
    scenario = staniel.load_scenario("village", minutes=3.0, camera={"clutter": 0.0, **options})
    record = staniel.fly(scenario, out=tmp_path / "run").record
    looks = record.looks(record.times)
    assert np.isnan(looks[0]).all()
    assert np.isfinite(looks[1:]).all()
    rows = record.sightings
    assert len(rows) > 50
    swung = 0
    for row in rows:
        tick = int(np.searchsorted(record.times, row["time"] - 1e-6))
        pose, look = record.aircraft[tick, row["reporter"]], looks[tick, row["reporter"]]
        axis = camera_axes(pose[None], look[None], Camera(**options).mounting)[0]
        ray = np.array([*record.vehicles[tick, row["origin"], :2], 1.0]) - pose[:3]
        assert ray @ axis / np.linalg.norm(ray) >= math.cos(math.radians(25.0)) - 1e-3
        swung += ray[2] / np.linalg.norm(ray) > -math.cos(math.radians(25.0))
    assert swung > 0


def test_a_delay_that_the_tracker_ignores_is_refused(tmp_path):
    scenario = staniel.load_scenario("village", minutes=1.0, camera={"delay": 8.0})
    with pytest.raises(ScenarioError, match=r"camera.delay = 8 s: expected at most"):
        staniel.fly(scenario, out=tmp_path / "run")


def test_a_sighting_knows_the_pose_of_its_frame():
    truth, times = moving(1)
    (percept,), _ = cameras(frame_interval=0.1, **SHARP).sense(truth)
    for sighting, time in zip(percept.sightings, times, strict=True):
        assert sighting.pose == Pose(500.0 + 15.0 * time, *LEVEL[1:])
