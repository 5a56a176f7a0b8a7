"""The city's doors: what they build, what they refuse, and the generator's promises."""

import json

import numpy as np
import pytest
import shapely

from staniel.city import City
from staniel.errors import CityError

SIZE = (50.0, 40.0)
RING = shapely.box(10, 10, 30, 30) - shapely.box(15, 15, 20, 20)


def test_outlines_come_out_canonical():
    clockwise = shapely.Polygon([(1, 1), (1, 5), (3, 5), (5, 5), (5, 3), (5, 1), (5, 1)])
    city = City.from_outlines([clockwise, RING], [3, 4], SIZE)
    assert all(outline.exterior.is_ccw for outline in city.outlines)
    assert [len(outline.exterior.coords) for outline in city.outlines] == [5, 5]
    assert len(city.outlines[1].interiors) == 1
    assert city.outlines[0].equals(clockwise)
    assert city.density == pytest.approx((16 + 375) / 2000)
    assert city.tallest == 4.0


def test_dict_round_trip_is_exact_and_jsonable():
    spun = shapely.affinity.rotate(RING, 30, origin=(20, 20))
    city = City.from_outlines([spun, shapely.box(40, 1, 45, 5)], [1.1, 7.0], SIZE)
    text = json.dumps(city.to_dict())
    again = City.from_dict(json.loads(text))
    assert json.dumps(again.to_dict()) == text
    assert again.outlines == city.outlines
    assert np.array_equal(again.heights, city.heights)
    assert again.size == city.size
    assert "40, 1]" in text


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"size": [1], "buildings": []},
        {"size": [9, 9], "buildings": [{}]},
        {"size": [9, 9], "buildings": [{"height": "tall", "outline": [[1, 1], [2, 1], [2, 2]]}]},
        {"size": [9, 9], "buildings": [{"height": 1, "outline": [[1, 1], [2, 1]]}]},
        {"size": [9, 9], "buildings": [3]},
        {"size": "big", "buildings": []},
        [1, 2],
        None,
    ],
)
def test_bad_dicts_are_refused(data):
    with pytest.raises(CityError, match="city: expected a mapping"):
        City.from_dict(data)


BOW = shapely.Polygon([(1, 1), (5, 5), (5, 1), (1, 5)])


@pytest.mark.parametrize(
    ("outlines", "heights", "size", "message"),
    [
        ([BOW], [3.0], SIZE, r"outlines\[0\]: expected a valid polygon, got Self-intersection"),
        ([shapely.Polygon()], [3.0], SIZE, r"outlines\[0\]: .* got an empty one"),
        ([RING, shapely.Point(1, 1)], [3, 3], SIZE, r"outlines\[1\]: .* Polygon, got Point"),
        ([RING], [3.0], (29.0, 40.0), r"outlines\[0\]: expected to lie in the city's rectangle"),
        ([shapely.box(-1, 1, 3, 3)], [3.0], SIZE, r"outlines\[0\]: expected to lie in"),
        (
            [RING, shapely.box(29, 29, 33, 33)],
            [3, 3],
            SIZE,
            r"outlines\[0\] and outlines\[1\]: .*1 m2",
        ),
        ([RING, RING], [3, 3], SIZE, "do not overlap"),
        ([RING, shapely.box(0, 0, 40, 35)], [3, 3], SIZE, "do not overlap"),
        ([RING], [0.0], SIZE, r"heights\[0\]: expected metres greater than 0, got 0.0"),
        ([RING], [float("nan")], SIZE, r"heights\[0\]: expected"),
        ([RING], [3.0, 4.0], SIZE, "heights: expected one for each of the 1 outlines"),
        ([RING], ["high"], SIZE, "heights: expected 1 numbers"),
        ([RING], [3.0], (50.0, 0.0), "size: expected two numbers greater than 0"),
        ([RING], [3.0], (50.0, float("inf")), "size: expected"),
        ([RING], [3.0], 50.0, "size: expected"),
    ],
)
def test_bad_outlines_are_refused(outlines, heights, size, message):
    with pytest.raises(CityError, match=message):
        City.from_outlines(outlines, heights, size)


def test_touching_is_not_overlapping():
    city = City.from_outlines(
        [RING, shapely.box(30, 10, 40, 30), shapely.box(15, 15, 20, 20)], [3, 3, 3], SIZE
    )
    assert city.density == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[1.0, 2.0]], r"points must have shape \(n, 3\), got \(1, 2\)"),
        ([1.0, 2.0, 3.0], r"points must have shape \(n, 3\)"),
        ([[1.0, float("nan"), 0.0]], "points must be finite, got .* in row 0"),
        ([["a", "b", "c"]], "points must be an .* array of numbers"),
    ],
)
def test_visible_names_the_bad_argument(points, message):
    city = City.open(SIZE)
    with pytest.raises(ValueError, match=message):
        city.visible([[0, 0, 1]], points)
    with pytest.raises(ValueError, match=message.replace("points", "observers")):
        city.visible(points, [[0, 0, 1]])
    with pytest.raises(ValueError, match=message.replace("points", "b")):
        city.visible_pairs([[0, 0, 1]], points)


def test_pairs_must_match_and_points_be_flat():
    city = City.open(SIZE)
    with pytest.raises(ValueError, match="a and b must have one row a pair, got 1 and 2"):
        city.visible_pairs([[0, 0, 1]], [[0, 0, 1], [1, 1, 1]])
    with pytest.raises(ValueError, match=r"points must have shape \(n, 2\)"):
        city.inside([[0, 0, 1]])


CITIES = [
    {},
    {"seed": 1},
    {"seed": 2, "density": 0.2},
    {"seed": 3, "density": 0.6},
    {"seed": 4, "density": 0.1},
    {"seed": 5, "density": 0.72},
    {"seed": 6, "density": 0.5, "size": (1200.0, 500.0), "block": (40.0, 90.0)},
    {"seed": 7, "density": 0.3, "size": (200.0, 260.0), "block": (30.0, 30.0)},
    {"seed": 8, "density": 0.78, "block": (60.0, 110.0)},
]


@pytest.mark.parametrize("arguments", CITIES, ids=str)
def test_generated_cities_keep_their_promises(arguments):
    city = City.generate(**arguments)
    width, height = city.size
    assert abs(city.density - arguments.get("density", 0.42)) <= 0.01
    assert (city.heights >= 10.0).all()
    assert (city.heights <= 40.0).all()
    # Its own door takes it: valid, inside, disjoint.
    City.from_outlines(city.outlines, city.heights, city.size)
    # A vehicle 6 m wide gets everywhere: its centre's space is one piece, along the edge too.
    built = shapely.union_all(list(city.outlines), grid_size=1e-6)
    ground = shapely.box(0, 0, width, height)
    space = ground.buffer(-2.999).difference(built.buffer(2.999))
    assert isinstance(space, shapely.Polygon)
    assert shapely.Polygon(space.exterior).equals(ground.buffer(-2.999))
    # And no street or alley is narrower: what such vehicles sweep is all that is free, but for
    # the inner corners that a disc cannot fill.
    swept = space.buffer(3.01)
    missed = shapely.difference(ground, shapely.union(built, swept, grid_size=1e-6), grid_size=1e-6)
    assert all(part.area < 3.0 for part in shapely.get_parts(missed))


def test_generated_city_is_a_city_and_not_a_chessboard():
    city = City.generate()
    corners = [len(outline.exterior.coords) - 1 for outline in city.outlines]
    assert sum(n == 4 for n in corners) >= 10
    assert sum(n == 6 for n in corners) >= 3  # wings around a place
    assert sum(n == 8 for n in corners) >= 3  # courts
    assert len(set(np.round(city.heights, 6))) == len(city.heights)


def test_same_seed_same_city():
    assert City.generate(seed=9).to_dict() == City.generate(seed=9).to_dict()
    assert City.generate(seed=9).to_dict() != City.generate(seed=10).to_dict()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"density": 0.0}, r"density: expected a number in \(0, 0.8\], got 0.0"),
        ({"density": 0.81}, "density: expected a number in"),
        ({"density": float("nan")}, "density: expected a number in"),
        ({"density": "dense"}, "density: expected a number in"),
        ({"density": 0.8}, "density: expected what 600 x 600 m hold in blocks of 40 to 60 m"),
        ({"density": 0.001}, "density: expected what"),
        ({"size": (45.0, 45.0)}, "density: expected what"),
        ({"size": (0.0, 600.0)}, "size: expected two numbers greater than 0"),
        ({"size": (9e4, 9e4)}, "size: expected at most 20000 blocks"),
        ({"size": (1e6, 1e6)}, "size: expected two numbers greater than 0 and at most 100000"),
        ({"block": (60.0, 40.0)}, "block: expected metres 10 <= shortest <= longest"),
        ({"block": (2.0, 4.0)}, "block: expected metres"),
        ({"block": 40.0}, "block: expected two numbers"),
        ({"heights": (0.0, 4.0)}, "heights: expected two numbers 0 < lowest"),
        ({"seed": -1}, "seed: expected an integer"),
    ],
)
def test_impossible_cities_are_refused(arguments, message):
    with pytest.raises(CityError, match=message):
        City.generate(**arguments)
