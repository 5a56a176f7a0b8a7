"""Line of sight and free space against slow answers: exact fractions, and shapely."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.kernels import walls as sight
from staniel.kernels.pieces import BEGIN, BUILT, LANES

SIZE = 24


def exact_rings(outline):
    rings = [outline.exterior, *outline.interiors]
    return [[tuple(map(Fraction, p)) for p in ring.coords] for ring in rings]


def exactly_inside(rings, x, y):
    """Strict interior, even-odd over all rings, in exact arithmetic."""
    odd = False
    for ring in rings:
        for (x0, y0), (x1, y1) in pairwise(ring):
            cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            if cross == 0 and min(x0, x1) <= x <= max(x0, x1) and min(y0, y1) <= y <= max(y0, y1):
                return False
            if (y0 <= y) != (y1 <= y) and (cross > 0) == (y1 > y0):
                odd = not odd
    return odd


def exactly_blocked(outline, height, a, b):
    """Does the open segment meet the open prism? Cut at every contact, look at every interval."""
    a, b = [Fraction(v) for v in a], [Fraction(v) for v in b]
    rings = exact_rings(outline)
    dx, dy, dz = (q - p for p, q in zip(a, b, strict=True))
    cuts = {Fraction(0), Fraction(1)}
    if (dx, dy) != (0, 0):
        for ring in rings:
            for (x0, y0), (x1, y1) in pairwise(ring):
                ex, ey = x1 - x0, y1 - y0
                turn = dx * ey - dy * ex
                if turn != 0:
                    t = ((x0 - a[0]) * ey - (y0 - a[1]) * ex) / turn
                    s = ((x0 - a[0]) * dy - (y0 - a[1]) * dx) / turn
                    if 0 <= s <= 1:
                        cuts.add(t)
                else:
                    for x, y in ((x0, y0), (x1, y1)):
                        cuts.add(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy))
    for t0, t1 in pairwise(sorted(t for t in cuts if 0 <= t <= 1)):
        middle = (t0 + t1) / 2
        if min(a[2] + t0 * dz, a[2] + t1 * dz) < height and exactly_inside(
            rings, a[0] + middle * dx, a[1] + middle * dy
        ):
            return True
    return False


def exactly_visible(city, a, b):
    return not any(
        exactly_blocked(outline, Fraction(float(height)), a, b)
        for outline, height in zip(city.outlines, city.heights, strict=True)
    )


COURT = shapely.Polygon(
    [(2, 2), (10, 2), (10, 10), (2, 10)],
    [[(4, 4), (6, 4), (6, 6), (4, 6)], [(6, 6), (8, 6), (8, 8), (6, 8)]],
)
NOTCHED = shapely.Polygon([(12, 2), (20, 2), (20, 10), (16, 6), (12, 10)])
ROOFS = (
    shapely.Polygon([(2, 12), (6, 12), (6, 16)]),
    shapely.Polygon([(6, 12), (10, 12), (10, 16), (6, 16)]),
    shapely.Polygon([(10, 16), (14, 16), (14, 20), (10, 20)]),
    shapely.Polygon([(16, 12), (22, 14), (18, 22)]),
)
CROOKED = City.from_outlines([COURT, NOTCHED, *ROOFS], [4.0, 6.0, 3.0, 3.0, 8.0, 5.0], (SIZE, SIZE))

whole = st.integers(-3, SIZE + 3)
half = st.integers(-6, 2 * SIZE + 6).map(lambda n: n / 2)
level = st.one_of(st.integers(0, 10).map(float), st.sampled_from([3.0, 4.0, 0.5, 12.0]))
point = st.tuples(st.one_of(whole.map(float), half), st.one_of(whole.map(float), half), level)


@settings(max_examples=80, deadline=None)
@given(st.lists(st.tuples(point, point), min_size=20, max_size=20))
def test_grazing_rays_agree_with_exact_fractions(pairs):
    a, b = np.array([p for p, _ in pairs]), np.array([q for _, q in pairs])
    got = CROOKED.visible_pairs(a, b)
    assert got.tolist() == [exactly_visible(CROOKED, p, q) for p, q in pairs]
    assert CROOKED.visible_pairs(b, a).tolist() == got.tolist()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_unit_houses_agree_with_exact_fractions(data):
    """Houses on a chessboard touch at corners and along walls: every ray between nodes grazes."""
    n = 6
    taken = data.draw(st.lists(st.booleans(), min_size=n * n, max_size=n * n))
    squares = [shapely.box(k % n, k // n, k % n + 1, k // n + 1) for k in range(n * n) if taken[k]]
    heights = data.draw(st.lists(st.integers(1, 4), min_size=len(squares), max_size=len(squares)))
    city = City.from_outlines(squares, np.array(heights, dtype=float), (n, n))
    node = st.tuples(st.integers(-1, n + 1), st.integers(-1, n + 1), st.integers(0, 5))
    pairs = data.draw(st.lists(st.tuples(node, node), min_size=10, max_size=10))
    got = city.visible_pairs([p for p, _ in pairs], [q for _, q in pairs])
    assert got.tolist() == [exactly_visible(city, p, q) for p, q in pairs]


@pytest.mark.parametrize("miss", [1e-1, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8])
def test_rays_that_nearly_touch_are_decided_exactly(miss):
    """Kilometres from the origin, past corners, over roofs and onto walls by less and less."""
    rng = np.random.default_rng(7)
    house = shapely.Polygon([(5001.25, 4003.5), (5020.5, 4008.25), (5015.75, 4027), (4997, 4020)])
    city = City.from_outlines([house], [16.0], (6000.0, 6000.0))
    corners = np.array(house.exterior.coords)[:4]
    a, b = [], []
    for corner in corners:
        for _ in range(12):
            aim = np.array([*(corner + rng.uniform(-1, 1, 2) * miss), 16.0 + rng.normal() * miss])
            way = rng.normal(size=3) * (1.0, 1.0, 0.2)
            far = 10.0 ** rng.uniform(0.5, 2.3, 2)
            a.append(aim + far[0] * way)
            b.append(aim if rng.random() < 0.3 else aim - far[1] * way)
    got = city.visible_pairs(a, b)
    assert got.tolist() == [exactly_visible(city, p, q) for p, q in zip(a, b, strict=True)]
    assert 0.1 < got.mean() < 0.95


def test_many_walls_in_one_cell_and_ends_far_away():
    """More walls than a block holds, some shorter than a decimetre; sight over any distance."""
    turns = np.arange(300) * np.pi / 150.0
    tower = shapely.Polygon(50.0 + 4.0 * np.column_stack([np.cos(turns), np.sin(turns)]))
    court = shapely.box(20, 20, 32, 32) - shapely.box(24, 24, 28, 28)
    city = City.from_outlines([tower, court], [30.0, 12.0], (100.0, 80.0))
    rng = np.random.default_rng(3)
    a = rng.uniform((-20, -20, 0), (120, 100, 60), (400, 3))
    b = rng.uniform((0, 0, 0), (100, 80, 20), (400, 3))
    assert city.visible_pairs(a, b).tolist() == [
        shapely_visible(city, p, q) for p, q in zip(a, b, strict=True)
    ]
    for far in (1e3, 1e4, 1e6, 1e8, 1e12):
        ends = [[-far, 50.0, 5.0], [far, 50.0, 5.0], [-far, 75.0, 5.0], [26.0, 26.0, far]]
        assert city.visible(ends, [[70.0, 50.0, 5.0]])[:2, 0].tolist() == [False, True]
        assert city.visible_pairs(ends[2:], [[far, 75.0, 5.0], [26.0, 26.0, 1.0]]).all()


def test_every_wall_is_in_a_block_of_each_cell_it_touches():
    city = City.generate(size=(300.0, 260.0), seed=1)
    walls = city.walls
    held = []
    for c in range(walls.nx * walls.ny):
        begin, end = walls.blocks[c, BEGIN:BUILT].astype(int)
        corner = np.array([c % walls.nx, c // walls.nx]) * walls.cell
        for row in (c, *range(begin, end)):
            x, y, ex, ey, roof = walls.blocks[row, : 5 * LANES].reshape(5, LANES)
            start = np.column_stack([x, y]) + corner
            ends = np.column_stack([start, start + np.column_stack([ex, ey]), roof])
            held += [[c, *e] for e in ends if e[4] > 0.0]
    first = walls.cells[:, 0].astype(int)
    cell = np.repeat(np.arange(walls.nx * walls.ny), np.diff(first))
    expected = np.column_stack([cell, walls.pieces[:, :5]])
    assert len(held) == len(expected)
    assert np.allclose(held, expected, rtol=1e-6, atol=1e-4)


def shapely_visible(city, a, b):
    """Cut the ground segment with each outline; the interval is hidden where it dips under it."""
    line = shapely.LineString([a[:2], b[:2]])
    for outline, height in zip(city.outlines, city.heights, strict=True):
        for part in shapely.get_parts(line.intersection(outline)):
            if part.length < 1e-6:
                continue
            along = [math.dist(a[:2], end) / line.length for end in part.coords]
            if min(a[2] + t * (b[2] - a[2]) for t in along) < height - 1e-9:
                return False
    return True


@pytest.mark.parametrize("seed", range(3))
def test_rays_over_a_generated_city_agree_with_shapely(seed):
    city = City.generate(size=(300.0, 260.0), seed=seed, density=0.4)
    rng = np.random.default_rng(seed)
    a = rng.uniform((-60, -60, 20), (360, 320, 90), (400, 3))
    b = rng.uniform((0, 0, 0), (300, 260, 12), (400, 3))
    a[:40, 2] = b[:40, 2]
    got = city.visible_pairs(a, b)
    assert 0.02 < got.mean() < 0.9
    assert got.tolist() == [shapely_visible(city, p, q) for p, q in zip(a, b, strict=True)]
    assert np.array_equal(
        city.visible(a[:20], b), [city.visible_pairs([p] * 400, b) for p in a[:20]]
    )


def test_rotated_walls_are_touched_not_entered():
    """Rays along walls, and to corners, whose coordinates are not exact in binary."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        turn, centre = rng.uniform(0, np.pi), rng.uniform(400, 600, 2)
        spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        corners = np.array([[-9, -5], [9, -5], [9, 5], [-9, 5]]) @ spin.T + centre
        city = City.from_outlines([shapely.Polygon(corners)], [10.0], (1000.0, 1000.0))
        along = (corners[1] - corners[0]) / 18.0
        a, b = corners[0] - 30.0 * along, corners[1] + 200.0 * along
        across = corners[0] + 25.0 * (corners[0] - corners[2])
        inward = 1e-6 * (centre - corners[0])
        hits = city.visible_pairs(
            [[*a, 1.0], [*across, 1.0], [*(a + inward), 1.0], [*across, 1.0]],
            [[*b, 1.0], [*corners[0], 1.0], [*(b + inward), 1.0], [*(corners[0] + inward), 1.0]],
        )
        assert hits.tolist() == [True, True, False, False]


@pytest.mark.parametrize(
    ("a", "b", "seen"),
    [
        pytest.param((3, 3, 9), (3, 3, 4), True, id="straight down to the roof"),
        pytest.param((3, 3, 9), (3, 3, 3.5), False, id="straight down into the house"),
        pytest.param((5, 5, 9), (5, 5, 0), True, id="straight down into the court"),
        pytest.param((2, 3, 9), (2, 3, 0), True, id="straight down along the wall"),
        pytest.param((5, 5, 0), (7, 7, 0), True, id="from court to court through the corner"),
        pytest.param((5, 5, 0), (7, 6.5, 0), False, id="from court to court through the house"),
        pytest.param((0, 3, 4), (24, 3, 4), False, id="over the roof's height into a taller one"),
        pytest.param((0, 3, 4), (12, 3, 4), True, id="along the roof"),
        pytest.param((0, 3, 4), (5, 3, 4), True, id="onto the roof from the side"),
        pytest.param((-50, 3, 2), (-1, 3, 2), True, id="wholly west of the city"),
        pytest.param((-50, 3, 2), (50, 3, 2), False, id="across the city from outside"),
        pytest.param((3, 3, 1), (3, 3, 1), False, id="one point inside"),
        pytest.param((1, 1, 1), (1, 1, 1), True, id="one point outside"),
        pytest.param((3, 3, 1), (3.5, 3, 1), False, id="both ends in one house"),
    ],
)
def test_named_rays(a, b, seen):
    assert CROOKED.visible([a], [b]).tolist() == [[seen]]
    assert CROOKED.visible([b], [a]).tolist() == [[seen]]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(half, half), min_size=30, max_size=30))
def test_inside_agrees_with_exact_fractions(points):
    rings = [exact_rings(outline) for outline in CROOKED.outlines]
    for x, y in points:
        holders = [k for k, r in enumerate(rings) if exactly_inside(r, Fraction(x), Fraction(y))]
        assert sight.inside(CROOKED.walls, x, y) == (holders[0] if holders else -1)


@pytest.mark.parametrize("cells_per_wall", [0.05, 1.5, 20.0])
def test_inside_agrees_with_shapely_at_any_grid(cells_per_wall, monkeypatch):
    monkeypatch.setattr("staniel.city.index._WALLS_A_CELL", 1.0 / cells_per_wall)
    city = City.generate(size=(400.0, 300.0), seed=4)
    rng = np.random.default_rng(0)
    points = rng.uniform((0, 0), (400, 300), (20_000, 2))
    tree = shapely.STRtree(np.array(city.outlines, dtype=object))
    which, holder = tree.query(shapely.points(points), predicate="within")
    expected = np.full(len(points), -1)
    expected[which] = holder
    assert [sight.inside(city.walls, x, y) for x, y in points] == expected.tolist()
    assert np.array_equal(city.inside(points), expected >= 0)


def test_discs_and_paths_agree_with_shapely():
    city = City.generate(size=(300.0, 300.0), seed=2)
    built = shapely.MultiPolygon(city.outlines).buffer(0)
    ground = shapely.box(0, 0, 300, 300)
    rng = np.random.default_rng(1)
    for x, y, radius in rng.uniform((-5, -5, 0.5), (305, 305, 12), (3000, 3)):
        centre = shapely.Point(x, y)
        room = (
            min(centre.distance(built), centre.distance(ground.exterior))
            if ground.contains(centre)
            else -1.0
        )
        assert sight.disc_clear(city.walls, x, y, radius) == (room >= radius)
    for ax, ay, bx, by in rng.uniform(-5, 305, (1500, 4)):
        bx, by = ax + 0.15 * (bx - ax), ay + 0.15 * (by - ay)
        line = shapely.LineString([(ax, ay), (bx, by)])
        free = ground.covers(line) and line.intersection(built).length == 0.0
        assert sight.path_clear(city.walls, ax, ay, bx, by) == free


def test_disc_touching_a_wall_fits():
    city = City.from_outlines([shapely.box(4, 4, 8, 8)], [3.0], (12.0, 12.0))
    assert sight.disc_clear(city.walls, 2.0, 6.0, 2.0)
    assert not sight.disc_clear(city.walls, 2.0 + 1e-6, 6.0, 2.0)
    assert not sight.disc_clear(city.walls, 2.0 - 1e-6, 6.0, 2.0)  # the city's edge
    assert not sight.disc_clear(city.walls, 6.0, 6.0, 0.5)
    assert not sight.disc_clear(city.walls, math.nan, 6.0, 0.5)


def test_open_city_hides_nothing():
    city = City.open((50.0, 20.0))
    assert city.tallest == 0.0
    assert city.density == 0.0
    assert city.visible([[-5, -5, 0], [10, 10, 30]], [[40, 10, 0]]).all()
    assert not city.inside([[10, 10]]).any()


def test_kernels_warm_up_on_one_wall():
    sight.warm()
    assert sight.inside(sight.warm_walls(), 0.5, 0.5) == -1
