"""Cities from pictures and grids: outlines equal the union of the dark cells, and bad files."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from staniel.city import City, load_city
from staniel.city.image import otsu_threshold
from staniel.errors import CityError

MAPS = Path(__file__).resolve().parents[2] / "../shared/data/maps"
ROOFS = (10.0, 40.0)


def shared(name):
    path = MAPS / name
    if not path.exists():
        pytest.skip(f"shared data absent: {name}")
    return path


def union_of_cells(building, cell):
    """Shapely's union of one box a building cell; `building` has the north row first."""
    j, i = np.nonzero(building[::-1])
    return shapely.unary_union(
        shapely.box(i * cell, j * cell, (i + 1) * cell, (j + 1) * cell).tolist()
    )


def save(path, grey, mode="L"):
    Image.fromarray(np.asarray(grey, dtype=np.uint8)).convert(mode).save(path)
    return path


def assert_follows_cells(city, building, cell):
    assert city.size == (building.shape[1] * cell, building.shape[0] * cell)
    assert shapely.is_valid(np.array(city.outlines, dtype=object)).all()
    assert shapely.is_ccw([outline.exterior for outline in city.outlines]).all()
    exact = union_of_cells(building, cell)
    assert shapely.unary_union(list(city.outlines)).symmetric_difference(exact).area == 0.0
    assert city.density * city.size[0] * city.size[1] == pytest.approx(exact.area, rel=1e-12)
    # Its own door finds nothing to refuse, and no corner to straighten.
    again = City.from_outlines(city.outlines, city.heights, city.size)
    assert all(a.equals_exact(b) for a, b in zip(again.outlines, city.outlines, strict=True))
    assert len(again.walls.pieces) == len(city.walls.pieces)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_small_pictures_follow_their_pixels(tmp_path_factory, data):
    rows, columns = data.draw(st.integers(1, 7)), data.draw(st.integers(1, 7))
    cells = data.draw(
        st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns).filter(
            lambda cells: not all(cells)
        )
    )
    building = np.array(cells).reshape(rows, columns)
    path = save(tmp_path_factory.mktemp("city") / "city.png", np.where(building, 0, 255), "1")
    assert_follows_cells(City.from_image(path, cell=2.0, heights=ROOFS), building, 2.0)


def test_first_row_is_the_north_edge(tmp_path):
    path = save(tmp_path / "city.png", [[0, 255], [255, 255], [255, 255]])
    city = City.from_image(path, cell=10.0, heights=(5.0, 5.0))
    assert city.size == (20.0, 30.0)
    assert city.inside([[5, 25], [5, 5], [15, 25]]).tolist() == [True, False, False]
    assert city.heights.tolist() == [5.0]


def test_diagonal_neighbours_are_two_buildings_and_a_pinched_court_two_holes(tmp_path):
    pair = City.from_image(
        save(tmp_path / "pair.png", [[0, 255], [255, 0]]), cell=1.0, heights=ROOFS
    )
    assert len(pair.outlines) == 2
    grey = np.zeros((6, 6))
    grey[2, 2] = grey[3, 3] = 255
    grey[5, 5] = 255
    court = City.from_image(save(tmp_path / "court.png", grey), cell=1.0, heights=ROOFS)
    assert len(court.outlines) == 1
    assert len(court.outlines[0].interiors) == 2
    assert court.outlines[0].is_valid


def test_heights_are_drawn_once_for_a_seed(tmp_path):
    path = save(tmp_path / "city.png", [[0, 255, 0], [255, 255, 255]])
    first, again, other = (
        City.from_image(path, cell=1.0, heights=ROOFS, seed=seed).heights for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert ((first >= 10.0) & (first <= 40.0)).all()


@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB", "RGBA", "LA", "CMYK", "I", "F", "I;16"])
def test_any_mode_reads_the_same(tmp_path, mode):
    grey = np.full((9, 12), 230, dtype=np.uint8)
    grey[2:5, 3:9] = 20
    image = Image.fromarray(grey)
    if mode == "I;16":
        image = Image.fromarray(grey.astype(np.uint16) * 257)
    else:
        image = image.convert(mode, dither=Image.Dither.NONE)
    path = tmp_path / ("city.tif" if mode in ("F", "CMYK", "I") else "city.png")
    image.save(path)
    assert_follows_cells(City.from_image(path, cell=1.0, heights=ROOFS), grey < 128, 1.0)


def test_transparent_is_free(tmp_path):
    layers = np.zeros((4, 4, 4), dtype=np.uint8)
    layers[1, 1, 3] = 255
    Image.fromarray(layers).save(tmp_path / "city.png")
    city = City.from_image(tmp_path / "city.png", cell=1.0, heights=ROOFS)
    assert [outline.bounds for outline in city.outlines] == [(1.0, 2.0, 2.0, 3.0)]


def test_threshold(tmp_path):
    path = save(tmp_path / "city.png", [[10, 100, 200, 250]])
    areas = {
        level: City.from_image(path, cell=1.0, heights=ROOFS, threshold=level).density
        for level in (5, 10, 150, 220)
    }
    assert areas == {5: 0.0, 10: 0.25, 150: 0.5, 220: 0.75}
    for level in (-1.0, 255.0, float("nan"), "dark"):
        with pytest.raises(CityError, match="threshold: expected a grey level"):
            City.from_image(path, cell=1.0, heights=ROOFS, threshold=level)


def test_otsu_maximises_the_variance_between_classes():
    rng = np.random.default_rng(0)
    grey = np.concatenate([rng.normal(60, 15, 3000), rng.normal(170, 25, 2000)]).clip(0, 255)
    grey = grey.astype(np.uint8)

    def within(level):
        dark, light = grey[grey <= level], grey[grey > level]
        return len(dark) * dark.var() + len(light) * light.var()

    levels = range(int(grey.min()), int(grey.max()))
    best = min(within(level) for level in levels)
    assert within(otsu_threshold(grey)) == pytest.approx(best, rel=1e-9)


def test_white_picture_is_open_ground(tmp_path):
    path = save(tmp_path / "city.png", np.full((3, 3), 255))
    assert City.from_image(path, cell=1.0, heights=ROOFS).outlines == ()


def png_header_only(width, height):
    def chunk(name, body):
        return (
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        )

    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def test_bad_pictures_are_refused_with_the_file_and_the_reason(tmp_path):
    whole = save(tmp_path / "whole.png", np.random.default_rng(0).integers(0, 255, (80, 80)))
    cases = {
        "black.png": (None, "expected some free space, got 3 x 2 building cells"),
        "text.png": (b"this is a text file\n", "expected a picture that can be read"),
        "empty.png": (b"", "expected a picture that can be read"),
        "cut.png": (whole.read_bytes()[:2000], "expected a picture that can be read"),
        "cut_header.png": (whole.read_bytes()[:20], "expected a picture that can be read"),
        "large.png": (png_header_only(4001, 4000), "at most 16000000 pixels, got 4001 x 4000"),
        "huge.png": (png_header_only(20_000, 20_000), "at most 16000000 pixels, got many more"),
        "bomb.png": (png_header_only(60_000, 60_000), "at most 16000000 pixels, got many more"),
        "wide.png": (png_header_only(12_000, 12_000), "at most 16000000 pixels, got 12000 x 12000"),
    }
    for name, (content, reason) in cases.items():
        path = tmp_path / name
        if content is None:
            save(path, np.zeros((2, 3)))
        else:
            path.write_bytes(content)
        with pytest.raises(CityError, match=reason) as caught:
            City.from_image(path, cell=1.0, heights=ROOFS)
        assert str(path) in str(caught.value)
    with pytest.raises(CityError, match=r"none\.png: expected a picture, found no such file"):
        City.from_image(tmp_path / "none.png", cell=1.0, heights=ROOFS)
    with pytest.raises(CityError, match="found no such file"):
        City.from_image(tmp_path, cell=1.0, heights=ROOFS)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("cell", 0.0, "cell: expected a number of metres greater than 0, got 0.0"),
        ("cell", -2, "cell: expected"),
        ("cell", float("nan"), "cell: expected"),
        ("cell", float("inf"), "cell: expected"),
        ("cell", "3", "cell: expected"),
        ("cell", True, "cell: expected"),
        ("heights", (0.0, 5.0), "heights: expected two numbers 0 < lowest <= tallest"),
        ("heights", (9.0, 5.0), "heights: expected"),
        ("heights", (1.0, float("inf")), "heights: expected"),
        ("heights", 5.0, "heights: expected"),
        ("heights", (1.0, 2.0, 3.0), "heights: expected"),
        ("seed", -1, "seed: expected an integer of at least 0, got -1"),
        ("seed", 1.5, "seed: expected"),
    ],
)
def test_bad_values_are_refused(tmp_path, name, value, message):
    picture = save(tmp_path / "city.png", [[0, 255]])
    grid = tmp_path / "city.map"
    grid.write_text("type octile\nheight 1\nwidth 2\nmap\n@.\n")
    values = {"cell": 1.0, "heights": ROOFS, "seed": 0, name: value}
    for path in (picture, grid):
        with pytest.raises(CityError, match=message):
            load_city(path, **values)


def test_grid_reads_every_terrain_and_line_end(tmp_path):
    path = tmp_path / "city.map"
    path.write_bytes(b"type octile\r\nheight 2\r\nwidth 4\r\nmap\r\n@.OT\r\nGWS@\r\n\r\n")
    city = City.from_grid(path, cell=3.0, heights=ROOFS)
    building = np.array([[1, 0, 1, 1], [0, 1, 0, 1]], dtype=bool)
    assert_follows_cells(city, building, 3.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: expected 'type octile', got 'the end of the file'"),
        ("type tile\n", "line 1: expected 'type octile', got 'type tile'"),
        ("type octile\nheight x\n", "line 2: expected 'height N', got 'height x'"),
        ("type octile\nheight 0\n", "line 2: expected a height of at least 1"),
        ("type octile\nheight -3\n", "line 2: expected 'height N'"),
        ("type octile\nwidth 2\nheight 2\n", "line 2: expected 'height N', got 'width 2'"),
        ("type octile\nheight 2\nwidth 2\nmop\n", "line 4: expected 'map', got 'mop'"),
        ("type octile\nheight 5000\nwidth 5000\nmap\n", "line 3: expected at most 16000000 cells"),
        ("type octile\nheight 2\nwidth 2\nmap\n..\n.\n", "line 6: expected 2 cells .*, got 1"),
        ("type octile\nheight 2\nwidth 2\nmap\n...\n", "line 5: expected 2 cells .*, got 3"),
        ("type octile\nheight 2\nwidth 2\nmap\n..\n", "line 5: expected 2 rows .*, got 1"),
        ("type octile\nheight 1\nwidth 2\nmap\n..\n..\n", "line 6: expected 1 rows .*, got 2"),
        ("type octile\nheight 1\nwidth 2\nmap\n.x\n", "line 5: .* got 'x' in column 2"),
        ("type octile\nheight 1\nwidth 2\nmap\n@@\n", "expected some free space"),
        ("\x89PNG\r\n", "line 1: expected 'type octile'"),
    ],
)
def test_bad_grids_are_refused_with_the_line(tmp_path, text, message):
    path = tmp_path / "city.map"
    path.write_text(text, encoding="latin-1", newline="")
    with pytest.raises(CityError, match=message) as caught:
        City.from_grid(path, cell=1.0, heights=ROOFS)
    assert str(path) in str(caught.value)


def test_load_city_refuses_what_it_cannot_read(tmp_path):
    with pytest.raises(CityError, match=r"city\.txt: expected a Moving AI .map grid or a picture"):
        load_city(tmp_path / "city.txt", cell=1.0, heights=ROOFS)
    for name in ("city.map", "city.png"):
        with pytest.raises(CityError, match=f"{name}: expected .*, found no such file"):
            load_city(tmp_path / name, cell=1.0, heights=ROOFS)


def test_noise_is_refused(tmp_path):
    noise = np.random.default_rng(0).integers(0, 2, (1500, 1500)) * 255
    with pytest.raises(CityError, match=r"too noisy for a map"):
        City.from_image(save(tmp_path / "noise.png", noise), cell=1.0, heights=ROOFS)


def test_boston_grid_follows_its_cells():
    path = shared("Boston_0_256.map")
    rows = path.read_text().splitlines()[4:]
    building = np.array([[c == "@" for c in row] for row in rows])
    assert_follows_cells(load_city(path, cell=3.0, heights=ROOFS), building, 3.0)


@pytest.mark.parametrize("corner", [(0, 0), (400, 300), (800, 824)])
def test_crops_of_milan_follow_their_pixels(tmp_path, corner):
    grey = np.asarray(Image.open(shared("Milan_0_1024.png")).convert("L"))
    crop = grey[corner[0] : corner[0] + 200, corner[1] : corner[1] + 200]
    path = save(tmp_path / "crop.png", crop, "1")
    assert_follows_cells(City.from_image(path, cell=1.0, heights=ROOFS), crop == 0, 1.0)


def test_milan_picture_and_grid_are_one_city():
    picture = load_city(shared("Milan_0_1024.png"), cell=1.0, heights=ROOFS)
    grid = load_city(shared("Milan_0_1024.map"), cell=1.0, heights=ROOFS)
    assert picture.to_dict() == grid.to_dict()
    assert picture.density == pytest.approx(0.24, abs=0.005)
    city = City.from_dict(picture.to_dict())
    points = np.random.default_rng(0).uniform(0, 1024, (5000, 2))
    grey = np.asarray(Image.open(shared("Milan_0_1024.png")).convert("L"))[::-1]
    dark = grey[points[:, 1].astype(int), points[:, 0].astype(int)] == 0
    assert np.array_equal(city.inside(points), dark)
