"""Rival planners on the same questions: each keeps its clearance, its bound and its seed."""

import dataclasses
import math

import numpy as np
import pytest
import shapely
from test_planning import CLEARANCE, check, open_air, random_problem, ringed, slalom, tall

from staniel.city import City
from staniel.guidance.planning import Obstacles, Problem, plan, planner_names
from staniel.guidance.planning.follow import taut
from staniel.guidance.planning.roadmaps import free_corners, shortest_way
from staniel.kernels.dubins import shortest_length

ALL = ["astar", "dstar", "prm", "rrt", "rrt-star", "spline", "visibility", "voronoi"]
LEAST = {"spline": 2, "rrt": 5, "prm": 5}  # of ten


FEWER = {"spline": 80, "rrt": 4_000}  # to be quick


@pytest.fixture(scope="module")
def town():
    return City.generate(size=(400.0, 400.0), density=0.25, heights=(10.0, 40.0), seed=3)


def test_all_are_registered():
    assert set(planner_names()) >= set(ALL)


@pytest.mark.parametrize("name", ALL)
def test_in_a_town_every_plan_is_flown_clear_of_walls(name, town):
    obstacles = Obstacles.from_city(town, altitude=28.0, clearance=CLEARANCE, margin=40.0)
    rng, solved, reachable = np.random.default_rng(11), 0, 0
    while reachable < 10:
        problem = random_problem(obstacles, 15.0, rng)
        best = plan(problem)
        if not best:
            continue
        reachable += 1
        asked = dataclasses.replace(problem, limit=FEWER.get(name))
        found = plan(asked, name, np.random.default_rng(reachable))
        if found:
            solved += 1
            check(found, problem, tall(town, 28.0))
            free = shortest_length(*problem.start, *problem.goal, 15.0)
            assert free - 1e-6 <= found.length == pytest.approx(found.cost)
    assert solved >= LEAST.get(name, 7)


@pytest.mark.parametrize("name", ALL)
def test_the_same_seed_is_the_same_plan(name):
    problem = Problem((20.0, 200.0, 0.0), (380.0, 200.0, 0.5), 15.0, slalom()[0])
    runs = [plan(problem, name, np.random.default_rng(2)) for _ in range(2)]
    assert bool(runs[0]) == bool(runs[1])
    if runs[0]:
        assert runs[0].pieces.tobytes() == runs[1].pieces.tobytes()
    assert runs[0].work == runs[1].work


@pytest.mark.parametrize("name", ALL)
def test_an_enclosed_goal_is_not_reached_and_is_said_within_the_bound(name):
    problem = Problem((20.0, 20.0, 0.0), (200.0, 200.0), 15.0, ringed(), limit=300)
    found = plan(problem, name)
    assert not found
    if name in ("astar", "dstar", "visibility"):
        assert found.reason == "closed"
    else:
        assert found.reason == "limit"


@pytest.mark.parametrize("name", ALL)
def test_a_place_beside_is_reached(name):
    problem = Problem((200.0, 200.0, 0.0), (240.0, 230.0), 15.0, open_air(), tolerance=5.0)
    found = plan(problem, name)
    check(found, problem)
    assert found.length < 120.0


def test_the_visibility_graph_is_a_taut_string():
    obstacles, _ = slalom()
    problem = Problem((20.0, 200.0, 0.0), (380.0, 200.0), 15.0, obstacles)
    corners = free_corners(problem)
    places = np.concatenate(([problem.start[:2], problem.goal], corners))
    way, cost = shortest_way(problem, places, np.column_stack(np.triu_indices(len(places), 1)))
    string = shapely.LineString(
        [
            (20, 200),
            (96, 284),
            (108, 284),
            (196, 116),
            (208, 116),
            (296, 284),
            (308, 284),
            (380, 200),
        ]
    )
    assert cost == pytest.approx(string.length, abs=0.01)
    assert shapely.LineString(way).hausdorff_distance(string) < 0.01
    np.testing.assert_array_equal(taut(problem, way), way)


def test_no_planner_beats_the_string_and_the_best_come_near(town):
    """The visibility graph without turns bounds every path from below."""
    obstacles = Obstacles.from_city(town, altitude=28.0, clearance=CLEARANCE, margin=40.0)
    rng, ratios = np.random.default_rng(5), {"astar": [], "rrt-star": []}
    for _ in range(8):
        problem = random_problem(obstacles, 12.0, rng)
        places = np.concatenate(([problem.start[:2], problem.goal[:2]], free_corners(problem)))
        links = np.column_stack(np.triu_indices(len(places), 1))
        _, string = shortest_way(problem, places, links)
        string = max(string, shortest_length(*problem.start, *problem.goal, 12.0))
        for name, known in ratios.items():
            found = plan(problem, name)
            if found:
                assert found.length >= string - 0.2
                known.append(found.length / string)
    assert len(ratios["astar"]) >= 5
    assert np.median(ratios["astar"]) < 1.12
    assert np.median(ratios["rrt-star"]) < 1.25


def test_more_samples_make_the_optimal_tree_shorter():
    problem = Problem((20.0, 200.0, 0.0), (380.0, 200.0), 15.0, slalom()[0])
    means = []
    for limit in (400, 4000):
        asked = dataclasses.replace(problem, limit=limit)
        found = [plan(asked, "rrt-star", np.random.default_rng(s)) for s in range(5)]
        means.append(np.mean([f.length if f else 1e4 for f in found]))
    assert means[1] < means[0]
    assert math.isfinite(means[1])
