"""The script of the following page draws its pictures, and its scenes are what they are called."""

import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


@pytest.fixture(scope="module")
def gallery():
    mpl.use("Agg")
    spec = importlib.util.spec_from_file_location("make_following", GALLERY / "make_following.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look for themselves there
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def drawn(gallery, tmp_path_factory):
    """The folder of the pictures, and the records of the missions over cities."""
    folder = tmp_path_factory.mktemp("drawn")
    short = {
        name: replace(getattr(gallery, name), minutes=0.75, shown=(15.0, 45.0))
        for name in ("STRAIGHT", "BALL", "TIGHT")
    }
    short["LONG"] = replace(gallery.LONG, keys={"minutes": 2.0}, shown=(0.0, 120.0))
    with pytest.MonkeyPatch.context() as patch:
        for name, scene in short.items():
            patch.setattr(gallery, name, scene)
        patch.setattr(gallery, "TOWNS", (gallery.SWITCH, gallery.DENSE, gallery.LONG, gallery.PAIR))
        records = gallery.draw_all(folder, seeds=1)
    return folder, records


def test_every_picture_of_the_page_is_drawn(drawn):
    folder, _ = drawn
    page = (GALLERY / "following.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"\]\((\w+\.png)\)", page))
    assert shown == {path.name for path in folder.iterdir()}
    for name in shown:
        assert (GALLERY / name).stat().st_size < 150_000
        with Image.open(GALLERY / name) as kept, Image.open(folder / name) as anew:
            assert np.ptp(np.asarray(kept.convert("L"))) > 100
            assert anew.size == kept.size


def test_a_ball_keeps_its_speed_and_stays_in_its_court(gallery):
    for ground in (gallery.BALL, gallery.TIGHT):
        west, south, width, height = ground.court
        for seed in range(20):
            way = ground.way(seed)
            assert (way >= (west, south)).all()
            assert (way <= (west + width, south + height)).all()
            speeds = np.hypot(*np.diff(way, axis=0).T) / gallery.STEP
            bounced = (np.abs(np.diff(way, 2, axis=0)) > 1e-9).any(axis=1)
            assert 3 <= bounced.sum() < 0.1 * len(way)
            assert speeds.max() <= ground.speed + 1e-9
            # Only a step that goes to a wall and back again is shorter.
            assert (np.abs(speeds - ground.speed) < 1e-9).mean() > 0.9


def test_a_vehicle_that_drives_straight_does(gallery):
    for seed in range(20):
        steps = np.diff(gallery.STRAIGHT.way(seed), axis=0)
        np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), atol=1e-9)
        assert np.hypot(*steps[0]) == pytest.approx(gallery.STEP * gallery.STRAIGHT.speed)


def test_the_vehicle_that_is_flown_after_drives_that_way(gallery):
    ball = replace(gallery.BALL, minutes=1.0)
    record = ball.fly("learned", 0)
    way = ball.way(0)[:: round(1.0 / gallery.STEP)]
    assert np.hypot(*(record.vehicles[:, 0, :2] - way).T).max() < 0.2
    assert record.scenario["tracking"]["dynamics"] == "learned"
    assert record.scenario["guidance"]["pursuit"] == "carrot"
    assert not record.city.outlines


def test_errors_are_those_of_the_nearest_track(gallery, drawn):
    _, records = drawn
    record = records["dense"]
    error, tracks = gallery.errors(record), record.tracks
    for tick in (0, 100, 200):
        rows = tracks[np.abs(tracks["time"] - record.times[tick]) < 1e-6]
        east, north = record.vehicles[tick, 0, :2]
        apart = np.hypot(rows["x"] - east, rows["y"] - north)
        assert np.isnan(error[tick]) if not len(rows) else error[tick] == pytest.approx(apart.min())


def test_the_lost_vehicle_is_circled_and_found_again(gallery, drawn):
    _, records = drawn
    record = records["switch"]
    (last, lost, again), *_ = gallery.switches(record)
    assert gallery.SWITCH.shown[0] < last < lost < again < gallery.SWITCH.shown[1]
    assert lost - last > record.scenario["tracking"]["unseen_limit"] - 2
    ticks = np.flatnonzero(gallery.roles(record) == "recover")
    assert len(ticks) >= 10
    place = gallery.last_place(record, ticks[0])
    apart = np.hypot(*(record.aircraft[ticks, 0, :2] - place).T)
    assert apart.max() < 2.0 * record.scenario["guidance"]["loiter_radius"]
    assert gallery.sighted(record)[ticks].any()


def test_the_dense_city_is_dense_and_the_long_run_long(gallery, drawn):
    _, records = drawn
    dense = records["dense"]
    built = sum(outline.area for outline in dense.city.outlines)
    assert built / np.prod(dense.city.size) == pytest.approx(0.6, abs=0.05)
    assert gallery.LONG.keys["minutes"] >= 10.0
    assert gallery.LONG.shown == (0.0, 60.0 * gallery.LONG.keys["minutes"])


def test_the_helper_circles_midway(gallery, drawn):
    _, records = drawn
    record = records["pair"]
    rows = gallery.midway(record)
    rows = rows[(rows[:, 0] >= gallery.PAIR.shown[0]) & (rows[:, 0] <= gallery.PAIR.shown[1])]
    helper = int(rows[0, 1])
    assert (rows[:, 1] == helper).all()
    assert len(rows) == 1 + gallery.PAIR.shown[1] - gallery.PAIR.shown[0]
    ticks = np.searchsorted(record.times, rows[:, 0] - 1e-6)
    holder = 1 - helper
    assert set(gallery.roles(record, holder)[ticks].tolist()) == {"pursue"}
    middle = 0.5 * (record.aircraft[ticks, holder, :2] + record.vehicles[ticks, 0, :2])
    off = np.hypot(*(rows[:, 2:] - middle).T)
    assert np.median(off) < 15.0
    apart = np.hypot(*(record.aircraft[ticks, helper, :2] - rows[:, 2:]).T)
    radius = record.scenario["guidance"]["loiter_radius"]
    assert (apart > 0.8 * radius).all()
    assert (apart < 2.0 * radius).all()
