"""Recorded tracks: what the reader takes and refuses, and that vehicles go where they were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from staniel.angles import wrap_array
from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.errors import ScenarioError
from staniel.world.config import Traffic
from staniel.world.replay import MARGIN, Replayed, read_tracks

ATHENS = Path(__file__).parents[3] / "shared/data/trajectories/pneuma_athens_sample.csv"


def table(tmp_path, text):
    file = tmp_path / "tracks.csv"
    file.write_text(text, encoding="utf-8")
    return file


def replayed(file, city, ticks, **traffic):
    drivers = Replayed(city, Traffic(kind="replay", replay=str(file), **traffic), Clock())
    vehicles, memory = drivers.begin()
    path = [vehicles[None]]
    for tick in range(ticks):
        steps, memory = drivers.drive(vehicles, memory, tick)
        vehicles = steps[-1].copy()
        path.append(steps)
    return np.concatenate(path)


def test_vehicles_pass_where_they_were_and_stand_before_and_after(tmp_path):
    """A drives east at 3 m/s from 2 s to 12 s; B's one row is a place."""
    rows = [f"A,{t:g},{10 + 3 * (t - 2):g},20\n" for t in np.arange(2.0, 12.1, 0.5)]
    file = table(tmp_path, "id,time,x,y\nB,0,50,60\n" + "".join(rows))
    path = replayed(file, City.open((100.0, 100.0)), 15)
    time = np.arange(151) * 0.1
    b, a = path[:, 0], path[:, 1]
    np.testing.assert_allclose(b, np.tile([50.0, 60.0, 0.0, 0.0], (151, 1)))
    np.testing.assert_allclose(a[:, 0], 10 + 3 * np.clip(time - 2, 0, 10), atol=1e-9)
    np.testing.assert_allclose(a[:, 1:3], [[20.0, 0.0]] * 151, atol=1e-9)
    moving = (time > 2.05) & (time < 11.95)
    np.testing.assert_allclose(a[moving, 3], 3.0, atol=1e-9)
    np.testing.assert_array_equal(a[time > 12.05, 3], 0.0)


def test_between_knots_the_way_is_scipys_cubic(tmp_path):
    rng = np.random.default_rng(0)
    time = np.arange(20.0)
    place = 500.0 + np.cumsum(rng.normal(3, 2, (20, 2)), axis=0)
    rows = [
        f"7,{t!r},{x!r},{y!r}\n" for t, (x, y) in zip(time.tolist(), place.tolist(), strict=True)
    ]
    path = replayed(table(tmp_path, "id,time,x,y\n" + "".join(rows)), City.open((1e3, 1e3)), 19)
    at, rates = np.arange(191) * 0.1, []
    for axis in (0, 1):
        cubic = CubicHermiteSpline(time, place[:, axis], np.gradient(place[:, axis], time))
        np.testing.assert_allclose(path[:, 0, axis], cubic(at), atol=1e-9)
        rates.append(cubic.derivative()(at[1:-1]))
    np.testing.assert_allclose(path[1:-1, 0, 3], np.hypot(*rates), atol=1e-6)


def test_athens_is_driven_again():
    """The sample: recorded places are met, and speeds are those of the places."""
    if not ATHENS.is_file():
        pytest.skip("no shared/data/trajectories")
    tracks, degrees = read_tracks(ATHENS)
    assert degrees
    assert len(tracks) == 6
    assert sum(map(len, tracks.values())) == 33_082
    city = City.open((2000.0, 2000.0))
    path = replayed(ATHENS, city, 560)
    assert np.isfinite(path).all()
    assert path[..., :2].min() > MARGIN - 1.0
    corner = np.min([rows[:, 1:].min(axis=0) for rows in tracks.values()], axis=0)
    scale = np.array([111_320.0 * np.cos(np.radians(corner[1])), 111_132.0])
    begin = min(rows[0, 0] for rows in tracks.values())
    for i, rows in enumerate(tracks.values()):
        time = rows[:, 0] - begin
        place = (rows[:, 1:] - corner) * scale + MARGIN
        inside = np.arange(len(path)) * 0.1
        inside = inside[(inside >= time[0]) & (inside <= time[-1])]
        there = np.column_stack([np.interp(inside, time, place[:, k]) for k in (0, 1)])
        ours = path[np.round(inside * 10).astype(int), i, :2]
        apart = np.hypot(*(ours - there).T)
        assert apart.max() < 2.5  # where the recorder jumps back at 30 m/s
        assert np.percentile(apart, 95) < 0.4
        assert np.median(apart) < 0.15  # the file is in steps of 0.1 m
        # As fast as the places are apart, not as the recorded spikes; mostly as a car can drive.
        speed = path[np.round(inside * 10).astype(int), i, 3][1:-1]
        covered = np.hypot(*(place[5:] - place[:-5]).T) / (time[5:] - time[:-5])
        assert speed.max() < 1.05 * covered.max()
        change = np.abs(np.diff(speed))
        assert np.percentile(change, 95) < 0.5
        turned = np.abs(wrap_array(np.diff(path[:, i, 2])))[path[:-1, i, 3] > 2.0]
        assert np.percentile(turned, 99) < 0.2


def test_places_in_degrees_go_where_the_city_says(tmp_path):
    from staniel.city.features import Origin

    file = table(tmp_path, "id,frame,lon,lat,v\na,0,25.001,60.001,9\na,1,25.0011,60.001,9\n")
    city = replace(City.open((500.0, 500.0)), origin=Origin("wgs84", 25.0, 60.0))
    path = replayed(file, city, 1)
    np.testing.assert_allclose(path[0, 0, :2], [55.66, 111.132], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: got columns '', expected id, time"),
        ("id,x,y\n1,2,3\n", "line 1: .* expected id, time"),
        ("id,time,x,y\n", "expected recorded places, got none"),
        ("id,time,x,y\n1,0,2\n", "line 2: got 3 values, expected at least 4"),
        ("id,time,x,y\n1,0,2,north\n", "line 2: got 'north', expected a number"),
        ("id,time,x,y\n1,0,2,nan\n", "line 2: got 'nan'"),
        ("id,time,lon,lat\n1,0,200,2\n", "line 2: got '200', expected a number from -180 to 180"),
        ("id,time,x,y\n1,0,2,3\n\n1,0,2,4\n", "line 4: got time 0 s of id '1', expected a later"),
        ("id,time,x,y\n1,0,2,3\n1,1,2000,4\n", "track '1' covers .* inside the city's 100 m"),
    ],
)
def test_tables_that_cannot_be_used_are_refused(tmp_path, text, message):
    with pytest.raises(ScenarioError, match=message):
        replayed(table(tmp_path, text), City.open((100.0, 100.0)), 1)


def test_no_table_at_all_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="cannot be read"):
        read_tracks(tmp_path / "missing.csv")
    picture = tmp_path / "tracks.csv"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\x00\xff\xfe" * 100)
    with pytest.raises(ScenarioError, match=r"not a CSV table|expected id"):
        read_tracks(picture)


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "replay"},
        {"replay": "a.csv"},
        {"speed_range": (5.0, 1.0)},
        {"kind": "fly"},
        {"lane_offset": -1.0},
    ],
)
def test_traffic_that_does_not_fit_together_is_refused(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        Traffic(**change)
