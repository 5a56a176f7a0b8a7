"""Road networks: what becomes a node, what may be driven, what a city leaves of it."""

import json
import math

import numpy as np
import pytest
import shapely

from staniel.city import City, RoadNetwork
from staniel.city.features import Origin
from staniel.errors import CityError

HERE = Origin("metres", 0.0, 0.0)


def road(*points, **properties):
    geometry = {"type": "LineString", "coordinates": list(points)}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def write(path, *features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": list(features)}))
    return path


def read(tmp_path, *features, **options):
    path = write(tmp_path / "roads.geojson", *features)
    return RoadNetwork.from_geojson(path, **(options or {"origin": HERE}))


def pieces(net):
    """Where each piece starts and ends, and whether it goes both ways."""
    ends = net.nodes[net.edges].tolist()
    return {(*map(tuple, pair), bool(both)) for pair, both in zip(ends, net.both_ways, strict=True)}


def test_shared_vertices_are_junctions(tmp_path):
    net = read(tmp_path, road([0, 0], [50, 0], [100, 0]), road([50.2, 0.3], [50, 80]))
    assert net.nodes.tolist() == [[0, 0], [50, 0], [100, 0], [50, 80]]
    assert net.edges.tolist() == [[0, 1], [1, 2], [1, 3]]
    assert net.both_ways.all()
    assert net.lengths == pytest.approx([50, 50, 80])
    assert (net.nodes.dtype, net.edges.dtype, net.both_ways.dtype) == (float, np.int64, bool)


def test_nodes_stay_apart_and_near_their_vertices(tmp_path):
    points = np.random.default_rng(0).uniform(0, 20, (3000, 2))
    net = read(tmp_path, road(*points.tolist()))
    between = np.hypot(*(net.nodes[:, None] - net.nodes[None]).T)
    assert between[~np.eye(len(net.nodes), dtype=bool)].min() >= 0.5
    assert np.hypot(*(points[:, None] - net.nodes[None]).T).min(axis=0).max() < 0.5


def test_oneway_tunnel_and_pieces_met_twice(tmp_path):
    net = read(
        tmp_path,
        road([0, 0], [9, 0], oneway="yes"),
        road([0, 5], [9, 5], oneway="-1"),
        road([0, 10], [9, 10], oneway="no"),
        road([0, 15], [9, 15], oneway=True),
        road([0, 20], [9, 20], tunnel="yes"),
        road([0, 25], [9, 25], tunnel=None, oneway=None),
        road([0, 30], [9, 30], [9.1, 30], oneway="yes"),
        road([9, 30], [0, 30], oneway="yes"),
        road([0, 35], [9, 35], oneway="yes"),
        road([0, 35], [9, 35], oneway="yes"),
        road([3, 3]),
    )
    assert pieces(net) == {
        ((0, 0), (9, 0), False),
        ((9, 5), (0, 5), False),
        ((0, 10), (9, 10), True),
        ((0, 15), (9, 15), False),
        ((0, 25), (9, 25), True),
        ((0, 30), (9, 30), True),
        ((0, 35), (9, 35), False),
    }


def test_origin_of_a_city_of_the_file_and_given(tmp_path):
    house = [[24.95, 60.17], [24.951, 60.17], [24.951, 60.171], [24.95, 60.171], [24.95, 60.17]]
    outline = {"type": "Polygon", "coordinates": [house]}
    file = tmp_path / "city.geojson"
    file.write_text(json.dumps(outline))
    roads = write(tmp_path / "roads.geojson", road([24.9499, 60.16995], [24.9511, 60.16995]))
    city = City.from_geojson(file, heights=(10, 20), roads=roads, size=(150.0, 150.0))
    wide = 0.0012 * 111320 * math.cos(math.radians(60.17))
    south = 10 - 0.00005 * 111132
    west = 10 - 0.0001 / 0.0012 * wide
    assert city.roads.nodes == pytest.approx(np.array([[west, south], [west + wide, south]]), 1e-4)
    alone = RoadNetwork.from_geojson(roads)
    assert alone.nodes == pytest.approx(np.array([[0, 0], [wide, 0]]), rel=1e-4, abs=1e-4)
    assert City.from_geojson(file, heights=(10, 20)).roads is None
    with pytest.raises(CityError, match=r"roads\.geojson: roads need a city .* read from GeoJSON"):
        RoadNetwork.from_geojson(roads, city=City.open((9.0, 9.0)))
    metres = write(tmp_path / "metres.geojson", road([0, 0], [9, 0]))
    with pytest.raises(CityError, match=r"metres\.geojson: expected roads in the city's rectangle"):
        RoadNetwork.from_geojson(metres, city=city)


@pytest.mark.parametrize(
    ("feature", "message"),
    [
        ({"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}}, "got none"),
        (road([0, 0], ["a", 1]), "feature 1: expected positions"),
        (road([0, 0], [float("nan"), 1]), "feature 1: expected finite coordinates"),
        (road([0, 0], [9, 9], tunnel="yes"), "expected roads as LineStrings, got none"),
    ],
)
def test_what_is_no_road_is_refused(tmp_path, feature, message):
    with pytest.raises(CityError, match=message) as caught:
        read(tmp_path, feature)
    assert "roads.geojson" in str(caught.value)
    with pytest.raises(CityError, match="found no such file"):
        RoadNetwork.from_geojson(tmp_path / "none.geojson")


def ring_with_spurs():
    """A ring of four, a two-way spur, a one-way way out, a second part, a road through a house."""
    nodes = [[20, 20], [80, 20], [80, 80], [20, 80], [20, 95], [95, 80], [5, 5], [5, 15], [50, 80]]
    edges = [[0, 1], [1, 2], [2, 8], [8, 3], [3, 0], [3, 4], [2, 5], [6, 7], [0, 8]]
    both = [False, False, False, False, False, True, False, True, True]
    return RoadNetwork(np.array(nodes, dtype=float), np.array(edges), np.array(both))


def test_clear_of_a_city_is_one_part_that_can_be_driven_for_ever():
    net = ring_with_spurs()
    city = City.from_outlines([shapely.box(30, 30, 60, 60)], [9.0], (100.0, 100.0))
    clear = net.clear_of(city)
    expected = {piece for piece in pieces(net) if piece[0] != (5, 5)}
    expected -= {((20, 20), (50, 80), True), ((80, 80), (95, 80), False)}
    assert pieces(clear) == expected
    assert net.clear_of(City.open((100.0, 100.0))).lengths.sum() > clear.lengths.sum()
    # In the rectangle, and further from walls than a vehicle's radius.
    assert len(net.clear_of(City.open((90.0, 90.0)), radius=15.0).edges) == 0
    assert pieces(net.clear_of(city, radius=10.0 - 1e-6)) == expected - {((20, 80), (20, 95), True)}
    assert len(net.clear_of(city, radius=10.0 + 1e-6).edges) == 0
    assert net.clear_of(City.open((3.0, 3.0))).nodes.shape == (0, 2)


def net_of(nodes, edges, both=None):
    edges = np.array(edges)
    ones = np.ones(len(edges), dtype=np.bool_)
    return RoadNetwork(np.array(nodes, dtype=float), edges, ones if both is None else both)


def test_short_dead_ends_and_those_that_end_beside_a_road_are_left_out():
    square = [[0, 0], [100, 0], [100, 100], [0, 100]]
    ring = [[0, 1], [1, 2], [2, 3], [3, 0]]
    # From a corner each: 10 m, twice 15 m, 50 m into the open, and 95 m to beside a road.
    spurs = [[-10, 0], [100, -15], [100, -30], [150, 100], [95, 50]]
    edges = [*ring, [0, 4], [1, 5], [5, 6], [2, 7], [3, 8]]
    left = net_of([*square, *spurs], edges).without_stubs(20.0, 6.0)
    assert {tuple(node) for node in left.nodes.tolist()} == {
        (0, 0), (100, 0), (100, 100), (0, 100), (100, -15), (100, -30), (150, 100)
    }  # fmt: skip
    # Of two short ones at the end of a long one the second is not short without the first.
    fork = net_of(
        [*square, [-80, 0], [-85, 5], [-85, -5]], [*ring, [0, 4], [4, 5], [4, 6]]
    ).without_stubs(20.0, 6.0)
    assert len(fork.edges) == 6
    assert (-80.0, 0.0) in {tuple(node) for node in fork.nodes.tolist()}
    lonely = net_of([[0, 0], [5, 0]], [[0, 1]])
    assert len(lonely.without_stubs(20.0, 6.0).edges) == 1


def test_of_roads_side_by_side_each_keeps_the_direction_on_its_right():
    # Two streets 4 m apart, joined at both ends by a bend: lanes 1.5 m to the right lie 1 m apart.
    nodes = [[0, 0], [100, 0], [110, 2], [100, 4], [0, 4], [-10, 2]]
    edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]]
    left = net_of(nodes, edges).without_head_on(1.5, 2.1)
    assert pieces(left) >= {((0, 0), (100, 0), False), ((100, 4), (0, 4), False)}
    apart = net_of([[x, 5 * y] for x, y in nodes], edges).without_head_on(1.5, 2.1)
    assert apart.both_ways.all()
    short = net_of([[x / 10, y] for x, y in nodes], edges).without_head_on(1.5, 2.1)
    assert short.both_ways.all()
