"""D*-Lite after every change costs what Dijkstra from scratch costs, and works less."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.guidance.planning.dstar import GridWay
from staniel.kernels.cells import Cells
from staniel.kernels.field import cost_to


def middle(cells, number):
    j, i = divmod(number, cells.price.shape[1])
    return cells.west + (i + 0.5) * cells.cell, cells.south + (j + 0.5) * cells.cell


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10_000))
def test_after_every_change_the_cost_is_dijkstras(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 18, 2))
    dearest = rng.choice([1.0, 2.0])  # where all cost the same there are many ways of equal cost
    price = np.where(rng.random(shape) < 0.2, np.inf, rng.uniform(1.0, dearest, shape))
    cells = Cells(-3.0, 5.0, 2.0, price.astype(np.float32))
    goal, *starts = rng.integers(price.size, size=12)
    way = GridWay(cells, middle(cells, goal))
    for number in starts:
        price = cells.price.copy()
        flips = rng.integers(price.size, size=rng.integers(0, 9))
        price.ravel()[flips] = np.where(
            rng.random(len(flips)) < 0.5, np.inf, rng.uniform(1.0, dearest, len(flips))
        )
        if number % 3:
            way.cost(middle(cells, number))
        cells = cells._replace(price=price)
        start = middle(cells, number)
        way.change(cells, start)
        expected = cost_to(cells, *middle(cells, goal))[divmod(number, price.shape[1])]
        if number == goal:
            expected = 0.0
        assert way.cost(start) == pytest.approx(expected, rel=1e-6)
        places = way.way(start)
        if math.isfinite(expected):
            assert tuple(places[0]) == start
            assert tuple(places[-1]) == middle(cells, goal)
            assert np.abs(np.diff(places, axis=0)).max(initial=0.0) <= 2.0 + 1e-9


def test_what_changes_near_the_aircraft_is_little_work():
    rng = np.random.default_rng(2)
    price = np.where(rng.random((120, 120)) < 0.15, np.inf, 1.0).astype(np.float32)
    cells = Cells(0.0, 0.0, 1.0, price)
    start, goal = middle(cells, 3 * 120 + 3), middle(cells, 100 * 120 + 117)
    price[3, 3] = price[100, 117] = 1.0
    way = GridWay(cells, goal)
    scratch_work, first = 0, None
    for _ in range(20):
        places = way.way(start)
        first = way.work if first is None else first
        start = tuple(places[2])
        j, i = (places[5, ::-1] - 0.5).astype(int)
        price = cells.price.copy()
        price[j, i] = np.inf
        cells = cells._replace(price=price)
        way.change(cells, start)
        scratch = GridWay(cells, goal)
        assert way.cost(start) == pytest.approx(scratch.cost(start))
        scratch_work += scratch.work
    assert way.work - first < 0.3 * scratch_work
