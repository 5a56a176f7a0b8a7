"""The movie, opened again frame by frame."""

import itertools

import numpy as np
import pytest
from PIL import Image, ImageSequence

from staniel.errors import OutputError
from staniel.pictures import draw_movie, style
from staniel.pictures.canvas import Canvas


def frames_of(path):
    with Image.open(path) as image:
        assert image.format == "GIF"
        return [frame.convert("RGB") for frame in ImageSequence.Iterator(image)]


@pytest.fixture(scope="module")
def frames(record, tmp_path_factory):
    path = tmp_path_factory.mktemp("movie") / "mission.gif"
    steps = []
    draw_movie(record, path, seconds_per_frame=3.0, on_progress=lambda *step: steps.append(step))
    assert steps == [(k, 20) for k in range(1, 21)]
    return frames_of(path)


def test_it_has_a_frame_every_so_many_seconds_of_one_size(frames):
    assert len(frames) == 20
    assert {frame.size for frame in frames} == {(660, frames[0].height)}
    assert 700 <= frames[0].height <= 760


def test_every_colour_is_on_the_map_and_in_the_legend(frames, count_color):
    near = frames[-1]
    legend = near.crop((0, 675, near.width, near.height))
    # The palette is shared by all frames: its colours are near those asked for, not the same.
    pixels = np.asarray(legend).reshape(-1, 3).astype(int)
    for color in (*style.TEAM[:4], style.VEHICLE, style.TRACK):
        distance = np.abs(pixels - np.array(color)).max(axis=1)
        assert (distance <= 25).sum() > 5, color
    assert count_color(near, style.GROUND) > 1000


def test_consecutive_frames_differ(frames):
    for before, after in itertools.pairwise(frames):
        changed = (np.asarray(before) != np.asarray(after)).any(axis=2).mean()
        assert 0.001 < changed < 0.9


def test_a_frame_shows_an_aircraft_where_it_is(record):
    canvas = Canvas(record)
    picture = np.asarray(canvas.draw(30)).astype(int)
    scale = 640.0 / 300.0
    for identity in range(4):
        x, y, _, heading = record.aircraft[30, identity, :4]
        # The triangle's tip is ahead of its middle, and its corners are behind.
        column, row = (
            10 + x * scale + 2 * np.cos(heading),
            32 + (300 - y) * scale - 2 * np.sin(heading),
        )
        if 15 < column < 645 and 40 < row < 665:
            color = picture[round(row), round(column)]
            assert np.abs(color - np.array(style.of_aircraft(identity))).max() < 40


def test_the_camera_shades_the_ground_below(record):
    picture = np.asarray(Canvas(record).draw(30)).astype(int)[40:660, 20:640]
    tinted = np.ptp(picture, axis=2) > 12
    assert tinted.mean() > 0.2


def test_without_a_step_there_are_at_most_180_frames(make_record, tmp_path, monkeypatch):
    from staniel.city import City
    from staniel.pictures import movie

    monkeypatch.setattr(movie, "_FRAMES", 7)
    record = make_record(City.open((300.0, 300.0)), ticks=20)
    draw_movie(record, tmp_path / "few.gif")
    assert len(frames_of(tmp_path / "few.gif")) == 7
    assert movie._ticks(record.times, None)[-1] == 19


def test_a_bare_record_is_drawn(bare_record, tmp_path):
    draw_movie(bare_record, tmp_path / "bare.gif")
    frames = frames_of(tmp_path / "bare.gif")
    assert len(frames) == 3
    assert frames[0].size[0] == 660
    assert frames[0].size[1] < 300


def test_a_record_of_one_tick_is_one_picture(make_record, tmp_path):
    from staniel.city import City

    record = make_record(City.open((100.0, 300.0)), ticks=1)
    draw_movie(record, tmp_path / "one.gif", seconds_per_frame=2.0)
    assert len(frames_of(tmp_path / "one.gif")) == 1


def test_the_same_record_draws_the_same_bytes(bare_record, tmp_path):
    for name in ("a.gif", "b.gif"):
        draw_movie(bare_record, tmp_path / name)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_what_cannot_be_is_refused(bare_record, tmp_path):
    with pytest.raises(ValueError, match="seconds_per_frame = 0"):
        draw_movie(bare_record, tmp_path / "x.gif", seconds_per_frame=0.0)
    with pytest.raises(OutputError, match="cannot be written"):
        draw_movie(bare_record, tmp_path / "missing" / "x.gif")
    assert list(tmp_path.iterdir()) == []
