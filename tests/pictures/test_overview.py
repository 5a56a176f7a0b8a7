"""The overview picture, opened again."""

import subprocess
import sys

import matplotlib.colors
import numpy as np
import pytest
from PIL import Image

from staniel.errors import OutputError
from staniel.pictures import draw_overview, style
from staniel.recording import scene


@pytest.fixture(scope="module")
def picture(record, tmp_path_factory):
    path = tmp_path_factory.mktemp("overview") / "overview.png"
    draw_overview(record, path)
    with Image.open(path) as image:
        assert image.format == "PNG"
        return image.convert("RGB")


def test_it_is_a_page_of_a_readable_size(picture):
    assert 1200 <= picture.width <= 1700
    assert 900 <= picture.height <= 1300


def test_every_colour_is_on_the_map_and_in_the_legend(picture, count_color):
    legend = picture.crop((1130, 0, picture.width, 500))
    for identity in range(4):
        assert count_color(legend, style.of_aircraft(identity)) > 20
        assert count_color(picture, style.of_aircraft(identity)) > 100
    assert count_color(legend, style.VEHICLE) > 50
    assert count_color(legend, style.TRACK) > 10
    assert count_color(picture, style.TRACK) > count_color(legend, style.TRACK)


def test_buildings_are_grey_and_streets_are_not(picture, record, count_color):
    assert count_color(picture, style.GROUND) > 100_000
    pixels = np.asarray(picture).astype(int)
    low, high = np.array(style.ROOF_HIGH).min(), np.array(style.ROOF_LOW).max()
    grey = (
        (np.ptp(pixels, axis=2) <= 10) & (pixels.min(axis=2) >= low) & (pixels.max(axis=2) <= high)
    )
    shown = grey.sum() / (1040.0 * 1040.0)
    assert shown == pytest.approx(record.city.density, abs=0.12)


def test_a_bare_record_is_drawn(bare_record, tmp_path, count_color):
    draw_overview(bare_record, tmp_path / "bare.png")
    with Image.open(tmp_path / "bare.png") as image:
        assert count_color(image, style.of_aircraft(0)) > 50


def test_the_same_record_draws_the_same_bytes(bare_record, tmp_path):
    for name in ("a.png", "b.png"):
        draw_overview(bare_record, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_place_that_cannot_be_written_is_refused(bare_record, tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        draw_overview(bare_record, tmp_path / "missing" / "overview.png")


def test_awards_are_the_messages_that_name_a_winner(record):
    rows = style.awards(record)
    assert len(rows) > 0
    assert set(rows["kind"]) == {"award"}
    assert (rows["winner"] >= 0).all()


def test_track_lines_hold_each_estimate_once_and_never_jump(record):
    lines = list(style.track_lines(record))
    places = {(row["id"], row["time"]) for row in record.tracks}
    assert sum(map(len, lines)) == len(places)
    assert all(np.hypot(*np.diff(line, axis=0).T).max(initial=0.0) <= 40.0 for line in lines)


def test_team_colours_differ_and_are_those_of_the_scene():
    assert len(set(style.TEAM)) == len(style.TEAM)
    assert np.allclose(np.array(style.TEAM) / 255.0, scene._TEAM_COLORS, atol=0.005)
    assert style.of_aircraft(len(style.TEAM)) == style.of_aircraft(0)
    lightness = [matplotlib.colors.rgb_to_hsv(np.array(c) / 255.0)[2] for c in style.TEAM]
    assert min(lightness) > 0.4


def test_importing_the_room_loads_no_matplotlib():
    script = "import sys, staniel.pictures; sys.exit('matplotlib' in sys.modules)"
    environment = {"PYTHONPATH": ":".join(filter(None, sys.path))}
    assert (
        subprocess.run([sys.executable, "-c", script], env=environment, check=False).returncode == 0
    )
