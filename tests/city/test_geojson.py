"""Buildings from GeoJSON: what is read, what is mended and counted, what is refused."""

import json
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City, CityWarning, load_city
from staniel.city.disjoint import made_disjoint, sound_outlines
from staniel.city.features import Origin
from staniel.errors import CityError, OutputError

ROOFS = (10.0, 40.0)
HOUSE = [[0, 0], [40, 0], [40, 20], [0, 20], [0, 0]]
COURT = [[10, 5], [10, 15], [30, 15], [30, 5], [10, 5]]


def polygon(*rings, **properties):
    geometry = {"type": "Polygon", "coordinates": list(rings)}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def moved(ring, east, north=0.0):
    return [[x + east, y + north] for x, y in ring]


def write(path, *features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": list(features)}))
    return path


def read(tmp_path, *features, **options):
    return City.from_geojson(
        write(tmp_path / "city.geojson", *features), **{"heights": ROOFS, **options}
    )


def mended(tmp_path, *features, **options):
    with pytest.warns(CityWarning, match=r"city\.geojson: mended \d") as caught:
        city = read(tmp_path, *features, **options)
    assert len(caught) == 1
    assert "\n" not in str(caught[0].message)
    return city, city.repairs


def area(city):
    return math.fsum(outline.area for outline in city.outlines)


def test_metres_with_a_court_and_a_margin(tmp_path):
    city = read(tmp_path, polygon(HOUSE, COURT, height=12.5))
    assert city.size == (60.0, 40.0)
    assert city.origin == Origin("metres", -10.0, -10.0)
    assert city.heights.tolist() == [12.5]
    expected = shapely.Polygon(moved(HOUSE, 10, 10), [moved(COURT, 10, 10)])
    assert city.outlines[0].equals(expected)
    assert city.inside([[15, 15], [30, 20]]).tolist() == [True, False]
    assert city.repairs.mended == 0
    assert City.open((9.0, 9.0)).repairs.mended == 0


def test_degrees_land_where_the_formula_puts_them(tmp_path):
    lon, lat = 24.95, 60.17
    step = [[0, 0], [0.001, 0], [0.001, 0.0005], [0, 0.0005], [0, 0]]
    city = read(tmp_path, polygon([[lon + x, lat + y] for x, y in step]))
    assert city.origin.frame == "wgs84"
    # Against the ellipsoid's radii: one part in five hundred.
    e2 = 0.00669438
    root = math.sqrt(1 - e2 * math.sin(math.radians(lat)) ** 2)
    east = math.radians(0.001) * 6378137.0 / root * math.cos(math.radians(lat))
    north = math.radians(0.0005) * 6378137.0 * (1 - e2) / root**3
    west, south, right, top = city.outlines[0].bounds
    assert (west, south) == pytest.approx((10.0, 10.0), abs=1e-4)
    assert right - west == pytest.approx(0.001 * 111320 * math.cos(math.radians(lat)), rel=1e-5)
    assert top - south == pytest.approx(0.0005 * 111132, rel=1e-9)
    assert (right - west, top - south) == pytest.approx((east, north), rel=4e-3)
    local = np.array([[3.0, 700.0]])
    assert city.origin.to_local(city.origin.to_file(local)) == pytest.approx(local, abs=1e-7)


@pytest.mark.parametrize("frame", ["auto", "metres", "wgs84"])
def test_the_frame_is_decided_by_the_range_or_given(tmp_path, frame):
    assert read(tmp_path, polygon(HOUSE), frame="metres").origin.frame == "metres"
    tenth = [[x / 1e5, y / 1e5] for x, y in HOUSE]
    city = read(tmp_path, polygon(tenth)) if frame == "auto" else None
    if city is not None:
        assert city.origin.frame == "wgs84"
        assert city.size == pytest.approx((20 + 44.528, 20 + 22.2264), abs=0.01)
    elif frame == "metres":
        with (
            pytest.raises(CityError, match=r"of at least 1 m2, got none, .* taken as metres"),
        ):
            read(tmp_path, polygon(tenth), frame=frame)
    else:
        with pytest.raises(CityError, match=r"geojson: expected longitude and latitude"):
            read(tmp_path, polygon(moved(HOUSE, 180)), frame=frame)


@pytest.mark.parametrize(
    ("properties", "roof", "bad"),
    [
        ({"height": 12}, 12.0, 0),
        ({"height": "12"}, 12.0, 0),
        ({"height": " 12.5 m "}, 12.5, 0),
        ({"height": "12,5 metres"}, 12.5, 0),
        ({"height": 9.5, "levels": 2}, 9.5, 0),
        ({"levels": 3.5}, 10.5, 0),
        ({"building:levels": "4"}, 12.0, 0),
        ({"Floor": 2}, 6.0, 0),
        ({"height": None, "levels": "", "Floor": 5}, 15.0, 0),
        ({"height": -5, "levels": 4}, 12.0, 1),
        ({"height": "tall", "levels": 4}, 12.0, 1),
        ({"height": True, "levels": 4}, 12.0, 1),
        ({"height": [3], "levels": 4}, 12.0, 1),
        ({"height": 1e9, "levels": 4}, 12.0, 1),
        ({"height": float("nan"), "levels": 4}, 12.0, 1),
        ({"height": "1" * 5000, "levels": 4}, 12.0, 1),
        ({"height": 10**400, "levels": 4}, 12.0, 1),
        ({"height": 0, "levels": "two", "Floor": 1}, 3.0, 1),
        ({"height": -5}, None, 1),
        ({"height": "tall"}, None, 1),
        ({}, None, 0),
    ],
    ids=lambda value: str(value)[:30],
)
def test_heights_fall_to_the_next_rule(tmp_path, properties, roof, bad):
    features = [polygon(moved(HOUSE, 100)), polygon(HOUSE, **properties)]
    if bad:
        city, repairs = mended(tmp_path, *features, seed=3)
        assert repairs.bad_heights == 1
    else:
        city = read(tmp_path, *features, seed=3)
    drawn = np.random.default_rng(3).uniform(*ROOFS, 2)
    assert city.heights.tolist() == [drawn[0], drawn[1] if roof is None else roof]
    assert city.repairs.heights_drawn == 1 + (roof is None)
    assert city.repairs.mended == bad


def test_shapes_of_every_kind_of_file(tmp_path):
    two = {"type": "MultiPolygon", "coordinates": [[HOUSE], [moved(HOUSE, 100), moved(COURT, 100)]]}
    point = {"type": "Point", "coordinates": [5, 5]}
    nested = {"type": "GeometryCollection", "geometries": [point, two]}
    feature = {"type": "Feature", "geometry": nested}
    nowhere = {"type": "Feature", "geometry": None, "properties": None}
    tall = [[x, y, 3.0] if k else [x, y] for k, (x, y) in enumerate(HOUSE)]
    for data in (
        two,
        nested,
        feature,
        {"type": "FeatureCollection", "features": [nowhere, feature]},
        {"type": "MultiPolygon", "coordinates": [[tall], *two["coordinates"][1:]]},
    ):
        path = tmp_path / "city.json"
        path.write_text(json.dumps(data))
        city = load_city(path, heights=ROOFS)
        assert area(city) == pytest.approx(800 + 600)
        assert len(set(city.heights)) == 1  # one feature, one roof


BOW = [[0, 0], [20, 20], [20, 0], [0, 20], [0, 0]]
NAN = float("nan")


@pytest.mark.parametrize(
    ("bad", "counted", "left"),
    [
        ([BOW], {"self_intersecting": 1}, 200.0),
        ([[*HOUSE[:4], [0, 10], [-30, 10], [0, 10], [0, 0]]], {"self_intersecting": 1}, 800.0),
        ([HOUSE, [[30, 5], [50, 5], [50, 15], [30, 15], [30, 5]]], {"self_intersecting": 1}, 700.0),
        ([HOUSE[:4]], {"unclosed": 1}, 800.0),
        ([HOUSE, COURT[:4]], {"unclosed": 1}, 600.0),
        ([[*HOUSE[:2], [NAN, 3.0], *HOUSE[2:]]], {"not_finite": 1}, 0.0),
        ([HOUSE, [*COURT[:2], [3.0, float("inf")], *COURT[2:]]], {"not_finite": 1}, 0.0),
        ([], {"empty": 1}, 0.0),
        ([[]], {"empty": 1}, 0.0),
        ([[[0, 0], [9, 9], [0, 0]]], {"empty": 1}, 0.0),
        ([[[0, 0], [9, 9], [18, 18], [0, 0]]], {"empty": 1}, 0.0),
        ([HOUSE, []], {"empty": 1}, 800.0),
        ([[[0, 0], [0.9, 0], [0.9, 1], [0, 1], [0, 0]]], {"tiny": 1}, 0.0),
        ([HOUSE, [[5, 5], [5, 5.9], [5.9, 5.9], [5.9, 5], [5, 5]]], {"tiny": 1}, 800.0),
        ([moved(HOUSE, 180)], {"overlapping": 1}, 400.0),
        ([moved(HOUSE, 200)], {"overlapping": 1}, 0.0),
    ],
    ids=str,
)
def test_bad_outlines_are_mended_and_counted(tmp_path, bad, counted, left):
    good = polygon(moved(HOUSE, 200), height=30)
    city, repairs = mended(tmp_path, good, polygon(*bad, height=20))
    assert {k: n for k, n in vars(repairs).items() if n} == counted
    assert area(city) == pytest.approx(800 + left)
    assert city.heights[0] == 30.0
    # Its own door takes it.
    City.from_outlines(city.outlines, city.heights, city.size)


def test_of_two_that_overlap_the_taller_keeps_the_ground(tmp_path):
    low, tall = polygon(HOUSE, height=10), polygon(moved(HOUSE, 10, -5), height=20)
    for features in ((low, tall), (tall, low)):
        city, repairs = mended(tmp_path, *features)
        assert repairs.overlapping == 1
        assert area(city) == pytest.approx(800 + 800 - 30 * 15)
        tower = city.heights.tolist().index(20.0)
        assert city.outlines[tower].area == pytest.approx(800)


corner = st.tuples(st.integers(1, 25), st.integers(1, 25))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(corner, corner, corner, st.integers(1, 4)), min_size=2, max_size=12))
def test_cutting_keeps_the_bodies(triangles):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("staniel.city.disjoint.LEAST_AREA", 1e-6)
        check_bodies(triangles)


def check_bodies(triangles):
    shapes = [(shapely.Polygon(t[:3]), float(t[3])) for t in triangles]
    shapes = [(shape, roof) for shape, roof in shapes if shape.area >= 1.0]
    if not shapes:
        return
    outlines, roofs = np.array([s for s, _ in shapes]), np.array([r for _, r in shapes])
    pieces, source, cut = made_disjoint(outlines, roofs)
    pieces, which, _ = sound_outlines(pieces)
    source = source[which]
    # Twice through the door: what it straightens, it takes again.
    city = City.from_outlines(pieces, roofs[source], (26.0, 26.0))
    City.from_outlines(city.outlines, city.heights, city.size)
    pieces = np.array(pieces, dtype=object)
    for roof in set(roofs.tolist()):
        before = shapely.union_all(outlines[roofs >= roof])
        after = shapely.union_all(pieces[roofs[source] >= roof])
        # All that is lost: pieces under 1 m² (set to next to nothing here), and a millimetre.
        assert before.symmetric_difference(after).area < 0.01 * before.length
    crossing = any(
        a.intersection(b).area > 1e-6 for k, a in enumerate(outlines) for b in outlines[:k]
    )
    assert (cut > 0) == crossing


def test_a_given_rectangle_cuts(tmp_path):
    features = [polygon(moved(HOUSE, 100 * k), height=5) for k in range(3)]
    city, repairs = mended(tmp_path, *features, origin=(20.0, 0.0), size=(100.0, 15.0))
    assert repairs.outside == 3
    assert city.size == (100.0, 15.0)
    assert sorted(outline.bounds for outline in city.outlines) == [(0, 0, 20, 15), (80, 0, 100, 15)]
    tilted = [polygon([[-10, 3], [30, 17], [31, 90.3], [-5.1, 60]], height=5)]
    city, repairs = mended(tmp_path, *tilted, origin=(0.1, 0.2), size=(17.3, 33.3))
    City.from_outlines(city.outlines, city.heights, city.size)
    whole = read(tmp_path, *features, size=(500.0, 100.0))
    assert (whole.size, whole.repairs.mended) == ((500.0, 100.0), 0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "got no JSON"),
        ("this is a text file", "got no JSON"),
        ('{"type": "FeatureCollection", "features": [', "got no JSON"),
        ("\xff\xfe", "got no JSON"),
        ("[" * 100_000, "nested too deeply"),
        ("9" * 5000, "got no JSON"),
        ("[1, 2]", "without a GeoJSON type"),
        ("{}", "without a GeoJSON type"),
        ('{"type": ["Polygon"]}', "without a GeoJSON type"),
        ('{"type": "Topology"}', "without a GeoJSON type"),
        ('{"type": "FeatureCollection"}', "collection without features"),
        ('{"type": "FeatureCollection", "features": []}', "as Polygons, got no features"),
        ('{"type": "FeatureCollection", "features": [3]}', "feature 1: expected a GeoJSON feature"),
        ('{"type": "Polygon"}', "feature 1: expected coordinates as a list"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [1]]]}', "feature 1: expected positions"),
        ('{"type": "Polygon", "coordinates": [[["a", "b"]]]}', "feature 1: expected positions"),
        ('{"type": "Polygon", "coordinates": [[[null, 1]]]}', "feature 1: expected positions"),
        ('{"type": "Polygon", "coordinates": [[[[1, 2]]]]}', "feature 1: expected positions"),
        ('{"type": "Polygon", "coordinates": [5]}', "feature 1: expected positions"),
        ('{"type": "Polygon", "coordinates": [{"a": 1}]}', "feature 1: expected positions"),
        ('{"type": "MultiPolygon", "coordinates": [5]}', "feature 1: expected a polygon as a list"),
        ('{"type": "Point", "coordinates": [1, 2]}', "as Polygons, got Point"),
    ],
    ids=lambda text: text[:40],
)
def test_what_is_no_map_is_refused(tmp_path, text, message):
    path = tmp_path / "city.geojson"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(CityError, match=message) as caught:
        City.from_geojson(path, heights=ROOFS)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ({"type": "Feature", "geometry": 3}, "feature 2: expected a geometry"),
        ({"type": "Feature", "geometry": {}}, "feature 2: .* geometry, got the type 'None'"),
        ({"type": "Feature", "geometry": {"type": "Blob"}}, "feature 2: .* got the type 'Blob'"),
        ({"type": "Point", "coordinates": [1, 2]}, "feature 2: expected a GeoJSON feature"),
        (polygon(HOUSE) | {"properties": []}, "feature 2: expected properties"),
        (polygon(moved(HOUSE, 1e6)), "size: expected .* at most 100000"),
        (polygon([[1e300, 0], [0, 1e300], [9, 9]]), "size: expected"),
        (
            polygon(np.random.default_rng(0).uniform(0, 99, (3000, 2)).tolist()),
            "feature 2: .* does not cross itself, or has at most 2,000 corners",
        ),
    ],
    ids=lambda value: str(value)[:40],
)
def test_the_bad_feature_is_named(tmp_path, second, message):
    with pytest.raises(CityError, match=message) as caught:
        read(tmp_path, polygon(HOUSE), second)
    assert str(tmp_path / "city.geojson") in str(caught.value)


def test_points_only_missing_files_and_deep_collections(tmp_path):
    points = [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [k, 2]}} for k in range(3)
    ]
    with pytest.raises(CityError, match=r"expected buildings as Polygons, got Point$"):
        read(tmp_path, *points)
    for path in (tmp_path / "none.geojson", tmp_path):
        with pytest.raises(CityError, match="found no such file"):
            City.from_geojson(path, heights=ROOFS)
    deep = {"type": "Point", "coordinates": [0, 0]}
    for _ in range(20):
        deep = {"type": "GeometryCollection", "geometries": [deep]}
    with pytest.raises(CityError, match=r"feature 1: .* not nested deeply"):
        read(tmp_path, {"type": "Feature", "geometry": deep})


@pytest.mark.parametrize(
    ("limit", "value", "message"),
    [
        ("features.MOST_BYTES", 100, "at most 100 bytes"),
        ("features.MOST_FEATURES", 1, "at most 1 features, got 2"),
        ("geojson.MOST_POSITIONS", 9, "feature 2: expected at most 9 positions"),
        ("disjoint._MOST_PAIRS", 0, "expected buildings that mostly lie apart"),
    ],
)
def test_a_file_is_bounded(tmp_path, monkeypatch, limit, value, message):
    monkeypatch.setattr(f"staniel.city.{limit}", value)
    with pytest.raises(CityError, match=message):
        read(tmp_path, polygon(HOUSE), polygon(moved(HOUSE, 5)))


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"heights": (5.0, 2.0)}, "heights: expected"),
        ({"seed": -1}, "seed: expected"),
        ({"frame": "mars"}, 'frame: expected "auto", "wgs84" or "metres", got \'mars\''),
        ({"origin": (1.0,)}, "origin: expected two numbers in metres"),
        ({"origin": (1.0, NAN)}, "origin: expected"),
        ({"size": (0.0, 4.0)}, "size: expected"),
    ],
)
def test_bad_options_are_refused(tmp_path, option, message):
    with pytest.raises(CityError, match=message):
        read(tmp_path, polygon(HOUSE), **option)


@pytest.mark.parametrize("frame", ["metres", "wgs84", None])
def test_export_and_back(tmp_path, frame):
    if frame is None:
        city = City.generate(size=(200.0, 150.0), block=(25.0, 45.0), density=0.3, seed=1)
    else:
        scale = 1e-5 if frame == "wgs84" else 1.0
        rings = [[[x * scale, y * scale] for x, y in ring] for ring in (HOUSE, COURT)]
        city = read(tmp_path, polygon(*rings, height=7.25), polygon(moved(rings[0], 50 * scale)))
    out = tmp_path / "out.geojson"
    city.to_geojson(out)
    place = city.origin or Origin("metres", 0.0, 0.0)
    again = City.from_geojson(out, heights=ROOFS, origin=(place.x, place.y), size=city.size)
    assert again.origin == place
    assert again.heights.tolist() == city.heights.tolist()
    assert (again.repairs.mended, again.repairs.heights_drawn) == (0, 0)
    for before, after in zip(city.outlines, again.outlines, strict=True):
        assert after.area == pytest.approx(before.area, rel=1e-7)
        assert len(after.interiors) == len(before.interiors)
        assert after.equals_exact(before, 1e-7)
    with pytest.raises(OutputError, match="expected a file that can be written"):
        city.to_geojson(tmp_path)


def test_the_record_keeps_the_origin(tmp_path):
    city = read(tmp_path, polygon(HOUSE, height=3))
    data = json.loads(json.dumps(city.to_dict()))
    again = City.from_dict(data)
    assert again.origin == city.origin
    assert again.to_dict() == data
    with pytest.raises(CityError, match="city: expected a mapping"):
        City.from_dict({**data, "origin": {"frame": "mars", "x": 1, "y": 2}})
    assert "origin" not in City.open((3.0, 3.0)).to_dict()


def test_statistics():
    houses = [shapely.box(10 * k, 0, 10 * k + 5, k + 1) for k in range(9)]
    roofs = np.array([3.0, 9, 6, 12, 30, 15, 3, 21, 18])
    city = City.from_outlines(houses, roofs, (100.0, 50.0))
    figures = city.statistics(altitude=60.0)
    areas = 5.0 * np.arange(1, 10)
    assert (figures.buildings, figures.lowest, figures.tallest) == (9, 3.0, 30.0)
    assert figures.density == city.density == pytest.approx(225 / 5000)
    assert (figures.mean, figures.median) == (pytest.approx(13.0), 12.0)
    assert figures.deciles == pytest.approx(np.percentile(roofs, range(10, 100, 10)))
    assert figures.mean_roof == pytest.approx(areas @ roofs / areas.sum())
    assert figures.height_ratio == pytest.approx(60.0 / figures.mean_roof)
    assert city.statistics().height_ratio is None
    nothing = City.open((9.0, 9.0)).statistics(50.0)
    assert (nothing.buildings, nothing.tallest, nothing.height_ratio) == (0, 0.0, None)
    for altitude in (0.0, -3.0, NAN, float("inf"), "high"):
        with pytest.raises(CityError, match="altitude: expected metres greater than 0"):
            city.statistics(altitude)


def test_load_city_takes_no_cell_for_footprints(tmp_path):
    path = write(tmp_path / "city.GeoJSON", polygon(HOUSE))
    assert len(load_city(path, heights=ROOFS).outlines) == 1
    with pytest.raises(CityError, match=r"expected no cell, GeoJSON has its own scale, got 3\.0"):
        load_city(path, cell=3.0, heights=ROOFS)
    with pytest.raises(CityError, match="cell: expected a number of metres"):
        load_city(tmp_path / "city.png", heights=ROOFS)
