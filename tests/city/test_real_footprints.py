"""Two real districts: load, hide exactly what shapely and fractions say, and can be flown over."""

import time
import warnings
from pathlib import Path

import numpy as np
import pytest
import shapely
from test_sight import exactly_blocked, shapely_visible

from staniel import flight
from staniel.city import City, CityWarning, RoadNetwork
from staniel.errors import ScenarioError
from staniel.scenario import build_city, load_scenario

FOOTPRINTS = Path(__file__).resolve().parents[2] / "../shared/data/footprints"
HELSINKI, SUZHOU = "helsinki_centre_buildings", "suzhou_old_town_buildings"
ROADS = "helsinki_centre_roads"
both = pytest.mark.parametrize("name", [HELSINKI, SUZHOU])


def file(name):
    path = FOOTPRINTS / f"{name}.geojson"
    if not path.exists():
        pytest.skip(f"shared data absent: {path.name}")
    return path


@pytest.fixture(scope="module")
def city_of():
    known = {}

    def load(name):
        if name not in known:
            path = file(name)
            with pytest.warns(CityWarning, match=r"geojson: mended \d+ overlapping"):
                known[name] = City.from_geojson(path, heights=(10.0, 40.0))
        return known[name]

    return load


def part(city, a, b):
    """The buildings whose box the ray's box meets, as a city's oracle wants them."""
    bounds = shapely.bounds(np.array(city.outlines, dtype=object))
    low, high = np.minimum(a, b)[:2], np.maximum(a, b)[:2]
    near = (bounds[:, :2] <= high).all(axis=1) & (bounds[:, 2:] >= low).all(axis=1)
    return [(city.outlines[k], city.heights[k]) for k in np.flatnonzero(near)]


class Near:
    """Only what an oracle looks at."""

    def __init__(self, buildings):
        self.outlines, self.heights = [b[0] for b in buildings], np.array([b[1] for b in buildings])


@pytest.mark.parametrize(
    ("name", "buildings", "tallest", "drawn"),
    [(HELSINKI, 440, 70.0, 0.6), (SUZHOU, 3000, 84.0, 0.0)],
)
def test_what_is_loaded(city_of, name, buildings, tallest, drawn):
    city = city_of(name)
    assert len(city.outlines) >= buildings
    assert city.tallest == tallest
    assert city.origin.frame == "wgs84"
    assert 500.0 < min(city.size) < max(city.size) < 3000.0
    assert city.repairs.heights_drawn == pytest.approx(drawn * len(city.outlines), rel=0.15, abs=1)
    figures = city.statistics(altitude=120.0)
    assert 0.2 < figures.density < 0.4
    assert figures.height_ratio == pytest.approx(120.0 / figures.mean_roof)
    # Its own door, and a record's copy, take it.
    again = City.from_dict(city.to_dict())
    assert len(again.walls.pieces) == len(city.walls.pieces)


@both
def test_loading_is_quick(name):
    path = file(name)
    taken = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CityWarning)
        for _ in range(3):
            start = time.process_time()
            City.from_geojson(path, heights=(10.0, 40.0))
            taken.append(time.process_time() - start)
    assert min(taken) < (1.5 if name == SUZHOU else 1.0)


@both
def test_export_and_back(city_of, name, tmp_path):
    city = city_of(name)
    city.to_geojson(tmp_path / "out.geojson")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CityWarning)  # neighbours may share a rounding
        again = City.from_geojson(
            tmp_path / "out.geojson",
            heights=(1.0, 1.0),
            origin=(city.origin.x, city.origin.y),
            size=city.size,
        )
    assert len(again.outlines) == len(city.outlines)
    assert again.heights.tolist() == city.heights.tolist()
    areas = [[outline.area for outline in each.outlines] for each in (city, again)]
    assert areas[1] == pytest.approx(areas[0], abs=1e-3)
    courts = [[len(outline.interiors) for outline in each.outlines] for each in (city, again)]
    assert courts[0] == courts[1]
    assert sum(courts[0]) >= (60 if name == HELSINKI else 0)


@both
def test_random_pairs_agree_with_shapely(city_of, name):
    city = city_of(name)
    rng = np.random.default_rng(7)
    size = np.array(city.size)
    a, b = rng.uniform(0.0, 1.0, (2, 400, 3))
    a[:, :2] *= size
    # From next door to across the district, from the ground, from roofs, and from aloft.
    b[:, :2] = a[:, :2] + rng.normal(size=(400, 2)) * rng.choice([20.0, 100.0, 500.0], (400, 1))
    a[:, 2] *= rng.choice([0.0, 20.0, 60.0, 120.0], 400)
    b[:, 2] *= rng.choice([0.0, 5.0, 30.0], 400)
    got = city.visible_pairs(a, b)
    slow = [shapely_visible(Near(part(city, p, q)), p, q) for p, q in zip(a, b, strict=True)]
    assert 0.1 < got.mean() < 0.9
    assert got.tolist() == slow


@both
def test_grazing_rays_agree_with_exact_fractions(city_of, name):
    """Corners on eighths of a metre, roofs on whole ones: rays between corners, and along walls."""
    city = city_of(name)
    kept, roofs = [], []
    for outline, height in zip(city.outlines, city.heights, strict=True):
        rings = [
            np.round(np.array(r.coords) * 8) / 8 for r in (outline.exterior, *outline.interiors)
        ]
        near = shapely.box(*(np.array(city.size) / 2 - 130), *(np.array(city.size) / 2 + 130))
        if not near.contains(outline):
            continue
        rounded = shapely.Polygon(rings[0], rings[1:])
        if rounded.is_valid and not any(k.intersection(rounded).area > 0.0 for k in kept):
            kept.append(rounded)
            roofs.append(float(max(1, round(height))))
    crop = City.from_outlines(kept, roofs, city.size)
    rng = np.random.default_rng(3)
    corners = np.concatenate([shapely.get_coordinates(outline) for outline in crop.outlines])
    n = 250
    a, b = np.empty((2, n, 3))
    a[:, :2], b[:, :2] = corners[rng.integers(len(corners), size=(2, n))]
    step = rng.integers(1, 4, n)
    start = rng.integers(len(corners) - 4, size=n)
    walls = rng.random(n) < 0.6  # along a wall, or from a corner to one of its neighbours
    a[walls, :2], b[walls, :2] = corners[start[walls]], corners[start[walls] + step[walls]]
    b[::3, :2] += (b - a)[::3, :2]  # beyond the corner
    a[:, 2], b[:, 2] = rng.choice([0.0, 3.0, *roofs[:4]], (2, n))
    got = crop.visible_pairs(a, b)
    slow = [
        not any(exactly_blocked(outline, int(h), p, q) for outline, h in part(crop, p, q))
        for p, q in zip(a, b, strict=True)
    ]
    assert 0.05 < got.mean() < 0.95
    assert got.tolist() == slow
    assert crop.visible_pairs(b, a).tolist() == slow


def test_roads_of_helsinki_lead_round_its_houses(city_of):
    city = city_of(HELSINKI)
    roads = RoadNetwork.from_geojson(file(ROADS), city=city)
    clear = roads.clear_of(city)
    assert 10_000.0 < clear.lengths.sum() < roads.lengths.sum()
    built = shapely.STRtree(np.array(city.outlines, dtype=object))
    lines = shapely.linestrings(clear.nodes[clear.edges])
    which, building = built.query(lines, predicate="intersects")
    inside = shapely.length(
        shapely.intersection(lines[which], np.array(city.outlines, dtype=object)[building])
    )
    assert inside.max(initial=0.0) < 1e-6
    assert clear.nodes.min() >= 0.0
    assert (clear.nodes <= city.size).all()


@both
def test_a_team_flies_over_it_for_a_minute(tmp_path, name):
    changes = {
        "city": {"source": "geojson", "file": str(file(name))},
        "aircraft": {"count": 2, "altitude": 120.0},
        "vehicles": {"count": 4},
        "minutes": 1.0,
    }
    scenario = load_scenario("downtown", **changes)
    with pytest.warns(CityWarning):
        run = flight.fly(scenario, out=tmp_path / "run")
    assert run.metrics["duration"] == 60.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert flight.replay(tmp_path / "run").metrics["duration"] == 60.0


def test_a_scenario_names_footprints_and_roads(tmp_path):
    buildings, roads = file(HELSINKI), file(ROADS)
    text = f'[city]\nsource = "geojson"\nfile = "{buildings}"\nroads = "{roads}"\nframe = "wgs84"\n'
    (tmp_path / "helsinki.toml").write_text(text)
    scenario = load_scenario(tmp_path / "helsinki.toml")
    with pytest.warns(CityWarning):
        city = build_city(scenario.city, 3)
    assert len(city.roads.edges) > 2000
    other = load_scenario(tmp_path / "helsinki.toml", city={"source": "geojson", "file": "b.json"})
    assert other.city.roads is None
    with pytest.raises(ScenarioError, match=r"city\.file = .*b\.json'?: no such file"):
        build_city(other.city, 3)
    lost = load_scenario(tmp_path / "helsinki.toml", city={"roads": str(tmp_path / "none.json")})
    with pytest.raises(ScenarioError, match=r"city\.roads = .*: no such file, expected a GeoJSON"):
        build_city(lost.city, 3)
    with pytest.raises(ScenarioError, match=r'city.cell does not belong to source = "geojson"'):
        load_scenario(tmp_path / "helsinki.toml", city={"cell": 3.0})
