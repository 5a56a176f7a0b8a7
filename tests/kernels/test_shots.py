"""Paths to places against all courses, costs on cells against shapely, fields against scipy."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from staniel.kernels.cells import SAGITTA, Cells, advanced, line_cost, piece_cost
from staniel.kernels.dubins import shortest_length
from staniel.kernels.field import cost_to
from staniel.kernels.heap import pop, push
from staniel.kernels.shots import TURNS, shot, to_place

near = st.floats(-6.0, 6.0)
angles = st.floats(-3.1, 3.1)


def flown(x, y, course, word, parts, radius):
    for turn, part in zip(TURNS[word], parts, strict=True):
        x, y, course = advanced(x, y, course, turn / radius, part * radius)
    return x, y, course


@settings(max_examples=150, deadline=None)
@given(near, near, angles)
@example(0.0, 0.0, 1.0)
@example(0.0, 1.0, 0.0)
@example(0.0, 0.5, 0.0)
def test_to_place_is_the_best_over_all_courses(x, y, course):
    # A place that is all but reached costs nothing or a whole circle: rounding may decide.
    assume(math.hypot(x, y) > 1e-6 or x == y == 0.0)
    length, word, *parts = to_place(1.0, 2.0, course, 1.0 + x, 2.0 + y, 1.0)
    end = flown(1.0, 2.0, course, word, parts, 1.0)
    assert math.hypot(end[0] - 1.0 - x, end[1] - 2.0 - y) < 1e-6
    courses = np.append(np.linspace(-math.pi, math.pi, 721), course)
    for step in (0.01, 1e-4):
        tried = [shortest_length(1.0, 2.0, course, 1.0 + x, 2.0 + y, c, 1.0) for c in courses]
        best = courses[int(np.argmin(tried))]
        courses = np.append(np.linspace(best - step, best + step, 201), best)
    assert min(tried) - 1e-4 <= length <= min(tried) + 1e-6


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("angle", [1e-3, 0.19, 2.0, 4.0, 6.0])
def test_a_single_turn_has_no_circle_too_many(turn, angle):
    rng = np.random.default_rng(3)
    for x, y, course, radius in rng.uniform(
        (-1e3, -1e3, -9.0, 5.0), (1e3, 1e3, 9.0, 60.0), (200, 4)
    ):
        goal = advanced(x, y, course, turn / radius, angle * radius)
        assert shot(x, y, course, *goal, radius)[0] == pytest.approx(angle * radius, rel=1e-6)


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 12.0), st.floats(0.0, 9.0))
def test_a_line_costs_what_shapely_says(seed, bx, by):
    rng = np.random.default_rng(seed)
    price = rng.uniform(1.0, 3.0, (5, 6)).astype(np.float32)
    price[rng.random((5, 6)) < 0.15] = np.inf
    ax, ay = rng.uniform((-1.0, -1.0), (11.0, 9.0))
    cells = Cells(-1.0, -1.0, 2.0, price)
    line = shapely.LineString([(ax, ay), (bx, by)])
    cost = line_cost(cells, ax, ay, bx, by)
    boxes = shapely.box(
        *(np.meshgrid(np.arange(-1, 11, 2), np.arange(-1, 9, 2))),
        *(np.meshgrid(np.arange(1, 13, 2), np.arange(1, 11, 2))),
    )
    inside = shapely.length(shapely.intersection(line, boxes))
    outside = line.length - inside.sum()
    exact = (inside * np.where(inside > 1e-9, price, 0.0)).sum() if outside < 1e-9 else np.inf
    if np.isinf(price[inside > 0.0]).any() or np.isfinite(exact):
        # Where the line only touches a blocked cell it may be called blocked.
        touches = (np.isinf(price) & (shapely.distance(line, boxes) < 1e-9)).any()
        # ... and so may what touches the rim: beyond it nothing is known.
        touches |= line.distance(shapely.box(-1.0, -1.0, 11.0, 9.0).exterior) < 1e-9
        assert cost == pytest.approx(exact, rel=1e-5) or (cost == np.inf and touches)
    else:
        assert cost == np.inf


def test_an_arc_never_gets_through_a_wall_and_costs_its_length():
    rng = np.random.default_rng(5)
    price = np.ones((50, 50), dtype=np.float32)
    wall = shapely.box(100.0, 0.0, 104.0, 200.0)
    price[:, 25] = np.inf
    cells = Cells(0.0, 0.0, 4.0, price)
    met = 0
    for _ in range(500):
        x, y = rng.uniform(60.0, 140.0, 2)
        course, bend, length = rng.uniform((-3.0, -0.1, 0.0), (3.0, 0.1, 60.0))
        points = [advanced(x, y, course, bend, s)[:2] for s in np.linspace(0.0, length, 400)]
        line = shapely.LineString(points)
        if not shapely.box(0, 0, 199, 199).contains(line):
            continue
        cost = piece_cost(cells, x, y, course, bend, length)
        if line.intersection(wall).length > 1.0 and line.intersection(wall.buffer(-SAGITTA)).length:
            assert cost == np.inf
            met += 1
        elif line.distance(wall) > SAGITTA:
            assert cost == pytest.approx(length, rel=1e-6)
    assert met > 50


def test_the_field_is_what_scipy_finds():
    rng = np.random.default_rng(0)
    price = rng.uniform(1.0, 2.0, (30, 40)).astype(np.float32)
    price[rng.random(price.shape) < 0.35] = np.inf
    price[10, 10] = 1.0
    rows, columns = price.shape
    links = []
    for j, i in np.ndindex(price.shape):
        for dj, di in ((0, 1), (1, 0), (1, 1), (1, -1)):
            b, a = j + dj, i + di
            if 0 <= b < rows and 0 <= a < columns:
                square = price[[j, j, b, b], [i, a, i, a]]
                if np.isfinite(square).all():
                    mean = 0.5 * (float(price[j, i]) + float(price[b, a]))
                    links.append(
                        (j * columns + i, b * columns + a, 2.0 * mean * math.hypot(dj, di))
                    )
    a, b, cost = (np.array(part) for part in zip(*links, strict=True))
    graph = coo_matrix((cost, (a, b)), shape=(price.size, price.size)).tocsr()
    expected = dijkstra(graph, directed=False, indices=10 * columns + 10).reshape(price.shape)
    found = cost_to(Cells(5.0, 7.0, 2.0, price), 5.0 + 21.0, 7.0 + 21.0)
    assert np.isinf(expected).sum() > 100
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=60))
def test_the_heap_gives_the_smallest_first(steps):
    keys, items, size, held = np.empty(64), np.empty(64, dtype=np.int32), 0, []
    for number, (key, take) in enumerate(steps):
        if take and held:
            held.sort()
            assert (keys[0], items[0]) == held.pop(0)
            size = pop(keys, items, size)
        size = push(keys, items, size, float(key), number)
        held.append((float(key), number))
    assert size == len(held)
