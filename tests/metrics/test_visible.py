"""Visibility, gaps and fractions: against a slow oracle, and by hand."""

import math

import numpy as np
import pytest
import shapely
from handmade import block_city, fly_east, hover, make_record, parked, sighting
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.kernels import visibility
from staniel.kernels.footprint import BODY
from staniel.kernels.visibility import seen_by
from staniel.metrics import compute_metrics
from staniel.metrics.visible import gaps, sample_step, whole_seconds

HOUSES = [
    shapely.box(100, 100, 160, 180),
    shapely.box(200, 60, 260, 150),
    shapely.box(90, 210, 250, 240),
]
ROOFS = [40.0, 25.0, 32.0]


def counted(walls, aircraft, *looked):
    """By cameras in the belly, which do not care where a gimbal would look."""
    return seen_by(walls, aircraft, *looked, BODY, np.full((*aircraft.shape[:2], 2), np.nan))


def oracle(aircraft, vehicle, height, half_aperture, reach):
    """One look: the axis from rotation matrices, the buildings cut out of the ray by shapely."""
    x, y, z, heading, bank, _ = aircraft
    about_up = np.array(
        [
            [math.cos(heading), -math.sin(heading), 0],
            [math.sin(heading), math.cos(heading), 0],
            [0, 0, 1],
        ]
    )
    about_forward = np.array(
        [[1, 0, 0], [0, math.cos(-bank), -math.sin(-bank)], [0, math.sin(-bank), math.cos(-bank)]]
    )
    axis = about_up @ about_forward @ np.array([0.0, 0.0, -1.0])
    ray = np.array([vehicle[0] - x, vehicle[1] - y, height - z])
    slant = np.linalg.norm(ray)
    if slant > reach or math.acos(np.clip(ray @ axis / slant, -1, 1)) > half_aperture:
        return False
    ground = shapely.LineString([(x, y), (vehicle[0], vehicle[1])])
    for house, roof in zip(HOUSES, ROOFS, strict=True):
        under = shapely.intersection(ground, house)
        if under.is_empty:
            continue
        # z falls along the ray, so it is lowest at the far end of what lies over the house.
        far = max(math.dist((x, y), corner) for corner in shapely.get_coordinates(under))
        if z + ray[2] * far / ground.length < roof:
            return False
    return True


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_equals_a_look_by_hand_at_every_sample(seed):
    random = np.random.default_rng(seed)
    city = City.from_outlines(HOUSES, ROOFS, (360.0, 300.0))
    aircraft = random.uniform(
        [-40, -40, 20, -math.pi, -0.6, 12], [400, 340, 110, math.pi, 0.6, 18], (5, 3, 6)
    )
    vehicles = random.uniform([0, 0, -math.pi, 0], [360, 300, math.pi, 3], (5, 4, 4))
    # Nobody starts inside a house: what is seen from there has a test of its own, at the city.
    starts = aircraft.reshape(-1, 6)
    for house, roof in zip(HOUSES, ROOFS, strict=True):
        inside = shapely.contains_xy(house, starts[:, 0], starts[:, 1])
        assume(not (inside & (starts[:, 2] < roof)).any())
    counts = counted(city.walls, aircraft, vehicles, 1.0, math.radians(55.0), 180.0)
    for t in range(5):
        for k in range(4):
            looks = [oracle(a, vehicles[t, k], 1.0, math.radians(55.0), 180.0) for a in aircraft[t]]
            assert counts[t, k] == sum(looks)


def test_counts_aircraft_and_takes_none():
    city = City.open((500.0, 500.0))
    above = np.tile([100.0, 100.0, 80.0, 0.0, 0.0, 15.0], (2, 3, 1))
    vehicle = np.tile([100.0, 100.0, 0.0, 0.0], (2, 1, 1))
    assert counted(city.walls, above, vehicle, 1.0, 1.0, 250.0).tolist() == [[3], [3]]
    assert counted(city.walls, above[:, :0], vehicle, 1.0, 1.0, 250.0).tolist() == [[0], [0]]
    assert counted(city.walls, above, vehicle[:, :0], 1.0, 1.0, 250.0).shape == (2, 0)
    visibility.warm()


def disc(z=80.0):
    """Radius of the level camera's disc on the vehicles' height."""
    return (z - 1.0) * math.tan(math.radians(60.0))


def test_fraction_and_gap_of_a_fly_past():
    # 15 m/s past a parked vehicle 100 m ahead; it is seen from -disc to +disc, disc = 136.8 m.
    record = make_record(
        seconds=20,
        aircraft=[fly_east(400.0, 500.0)],
        vehicles=[parked(500.0, 500.0)],
        sightings=[sighting(3.0, 0), sighting(4.0, 0), sighting(1.0, -1)],
    )
    metrics = compute_metrics(record)
    target = metrics["targets"][0]
    assert metrics["team"]["visible_fraction"] == target["visible_fraction"]
    last = (100.0 + disc()) / 15.0  # 15.787 s: the last visible samples are 15 s and 15.6 s
    assert 15.6 < last < 15.8
    assert target["first_detection"] == target["detection_latency"] == 3.0
    assert target["visible_fraction"] == pytest.approx(13 / 18, abs=1e-6)
    assert target["visible_fraction_fine"] == pytest.approx(64 / 86, abs=1e-6)
    assert target["longest_gap"] == target["mean_gap"] == pytest.approx(22 * 0.2)


def test_a_house_hides_and_range_ends():
    # The house stands between x 480 and 520; from 80 m over x = 440 one looks into its shadow.
    sees = make_record(
        seconds=2,
        aircraft=[hover(440.0, 500.0)],
        vehicles=[parked(475.0, 500.0), parked(525.0, 500.0), parked(440.0, 500.0 + disc() + 0.5)],
        sightings=[sighting(0.0, 0), sighting(0.0, 1), sighting(0.0, 2)],
        city=block_city(),
    )
    metrics = compute_metrics(sees)
    assert [t["visible_fraction"] for t in metrics["targets"]] == [1.0, 0.0, 0.0]
    assert metrics["team"]["visible_fraction"] == pytest.approx(1 / 3, abs=1e-6)
    low = {**sees.scenario, "camera": {**sees.scenario["camera"], "range": 80.0}}
    object.__setattr__(sees, "scenario", low)
    assert compute_metrics(sees)["targets"][0]["visible_fraction"] == 0.0  # slant 86.4 m


def test_one_second_sampling_misses_what_happens_in_between():
    # The aircraft rocks between the whole seconds, and its footprint leaves the vehicle.
    def rocking(t):
        return (500.0, 500.0, 80.0, 0.0, 0.0 if abs(t - round(t)) < 0.3 else 1.3, 15.0)

    record = make_record(
        seconds=4,
        aircraft=[rocking],
        vehicles=[parked(500.0, 500.0)],
        sightings=[sighting(0.0, 0)],
    )
    target = compute_metrics(record)["targets"][0]
    assert target["visible_fraction"] == 1.0
    assert target["visible_fraction_fine"] == pytest.approx(13 / 21, abs=1e-6)
    assert target["longest_gap"] == target["mean_gap"] == pytest.approx(0.4)


@given(st.lists(st.booleans(), max_size=40))
def test_gaps_are_the_runs_of_false(visible):
    expected, run = [], 0
    for seen in [*visible, True]:
        if seen and run:
            expected.append(run * 0.5)
        run = 0 if seen else run + 1
    assert gaps(np.array(visible, dtype=bool), 0.5) == expected


def test_whole_seconds_are_found_whatever_the_step():
    fifths = 0.2 * np.arange(16)
    assert fifths[whole_seconds(fifths)].tolist() == pytest.approx([0.0, 1.0, 2.0, 3.0])
    late = 0.2 * np.arange(1, 11)  # starts at 0.2, which then stands for second 0
    assert late[whole_seconds(late)].tolist() == pytest.approx([0.2, 1.0, 2.0])
    summed = np.cumsum(np.full(100, 0.1))  # 0.9999999999999999 is a whole second too
    assert summed[whole_seconds(summed)].tolist() == pytest.approx([0.1, *range(1, 11)])
    assert sample_step(fifths) == pytest.approx(0.2)
    assert sample_step(fifths[:1]) == 0.0
