"""How long streets wait for the next look: against a slow oracle, and by hand."""

import math

import numpy as np
import pytest
import shapely
from handmade import block_city, fly_east, hover, make_record
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City, street_cells
from staniel.datatypes.truth import CAMERA, FLYING
from staniel.errors import RecordError
from staniel.metrics import compute_metrics
from staniel.metrics.revisit import revisit_metrics
from staniel.studies.catalogue import CATALOGUE, figures

# No wall goes through a point that stands for a cell: it would be seen or not by a rounding.
HOUSES = [
    shapely.box(41, 42, 91, 111),
    shapely.box(121, 21, 171, 76),
    shapely.box(62, 131, 151, 161),
]
ROOFS = [40.0, 25.0, 32.0]
CITY = City.from_outlines(HOUSES, ROOFS, (210.0, 190.0))
WORKING = [1.0] * 8


def wander(random):
    """A level or banked aircraft that jumps about; a cone of 60° below it."""
    rows = random.uniform(
        [-40, -40, 45, -math.pi, -0.6, 12], [250, 230, 110, math.pi, 0.6, 18], (9, 6)
    )
    return lambda t: tuple(rows[int(t)])


def sees(pose, place):
    """Axis from rotation matrices, the buildings cut out of the ray by shapely."""
    x, y, z, heading, bank, _ = pose
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
    ray = np.array([place[0] - x, place[1] - y, 1.0 - z])
    slant = np.linalg.norm(ray)
    if slant > 250.0 or math.acos(np.clip(ray @ axis / slant, -1, 1)) > math.radians(60.0):
        return False
    ground = shapely.LineString([(x, y), tuple(place[:2])])
    for house, roof in zip(HOUSES, ROOFS, strict=True):
        under = shapely.intersection(ground, house)
        if not under.is_empty:
            far = max(math.dist((x, y), corner) for corner in shapely.get_coordinates(under))
            if z + ray[2] * far / ground.length < roof:
                return False
    return True


def oracle(record):
    """Every cell and instant asked by itself."""
    waits, oldest, ages, never = [], 0.0, [], 0
    cells = [p for p in street_cells(record.city, 20.0, 1.0).reshape(-1, 3) if not np.isnan(p[0])]
    works = (record.condition[:, :, CAMERA] > 0) & (record.condition[:, :, FLYING] > 0)
    for place in cells:
        last, seen = 0.0, False
        for t, time in enumerate(record.times.tolist()):
            poses = record.aircraft[t][works[t]]
            oldest = max(oldest, time - last)
            if any(sees(pose, place) for pose in poses):
                if seen and time - last > 1.5:
                    waits.append(time - last)
                last, seen = time, True
            ages.append(time - last)
        never += not seen
    return {
        "revisit_mean": sum(waits) / len(waits) if waits else None,
        "revisit_longest": oldest,
        "age_mean": sum(ages) / len(ages),
        "never_seen_share": never / len(cells),
    }


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_equals_a_look_by_hand_at_every_cell_and_instant(seed):
    random = np.random.default_rng(seed)

    def condition(t):
        rows = np.tile(WORKING, (3, 1))
        rows[1, CAMERA] = t < 4.0
        rows[2, FLYING] = t > 2.0
        return rows

    record = make_record(
        seconds=8,
        aircraft=[wander(random) for _ in range(3)],
        vehicles=[],
        city=CITY,
        condition=condition,
    )
    expected = oracle(record)
    assert revisit_metrics(record) == pytest.approx(expected)


def test_a_fly_past_is_one_look_and_the_way_back_another():
    """Over a city of one cell, which waits from the one to the other."""

    def there_and_back(t):
        return (-300.0 + 20.0 * (t if t <= 30 else 60 - t), 10.0, 80.0, 0.0, 0.0, 20.0)

    record = make_record(
        seconds=60, aircraft=[there_and_back], vehicles=[], city=City.open((20.0, 20.0))
    )
    # The point is 10 m east of the corner: seen while -126.8 < x < 146.8, so from second 9 to 22
    # on the way there, and from 60 - 22 to 60 - 9 on the way back.
    figures = revisit_metrics(record)
    assert figures["revisit_mean"] == 38.0 - 22.0
    assert figures["revisit_longest"] == 16.0
    assert figures["never_seen_share"] == 0.0
    ages = sum(range(1, 9)) + sum(range(1, 16)) + sum(range(1, 10))
    assert figures["age_mean"] == pytest.approx(ages / 61)


def test_what_nobody_ever_sees_ages_from_the_start():
    record = make_record(seconds=30, aircraft=[hover(500.0, 500.0)], vehicles=[], city=block_city())
    team = compute_metrics(record)["team"]
    assert team["revisit_mean"] is None
    assert team["revisit_longest"] == 30.0
    disc = math.pi * (79.0 * math.tan(math.radians(60.0))) ** 2
    assert 1.0 - team["never_seen_share"] < disc / 1e6


def test_the_cell_is_the_scenarios():
    record = make_record(seconds=3, aircraft=[fly_east(0.0, 50.0)], vehicles=[])
    coarse = {**record.scenario, "cooperation": {"search_cell": 1000.0}}
    object.__setattr__(record, "scenario", coarse)
    assert revisit_metrics(record)["never_seen_share"] == 1.0  # one cell, its middle far away
    object.__setattr__(record, "scenario", {**coarse, "cooperation": {"search_cell": -1.0}})
    with pytest.raises(RecordError, match="cooperation"):
        revisit_metrics(record)


def test_a_city_without_streets_has_no_figures():
    full = City.from_outlines([shapely.box(0, 0, 100, 100)], [10.0], (100.0, 100.0))
    record = make_record(seconds=3, aircraft=[hover(50.0, 50.0)], vehicles=[], city=full)
    assert set(revisit_metrics(record).values()) == {None}


def test_studies_can_show_them():
    record = make_record(seconds=3, aircraft=[hover(50.0, 50.0)], vehicles=[])
    metrics = compute_metrics(record)
    (row,) = figures(metrics)
    for name in ("revisit_mean", "revisit_longest", "age_mean", "never_seen_share"):
        assert f"team_{name}" in CATALOGUE
        assert row[f"team_{name}"] == metrics["team"][name]
