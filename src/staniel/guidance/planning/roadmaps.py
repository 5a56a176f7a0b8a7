"""Roadmaps of straight lines that know no turns: random, between obstacles, around corners.

Each is a graph whose shortest path scipy finds; Dubins paths then follow it as `dubins_along` can.
"""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.follow import dubins_along, taut
from staniel.guidance.planning.planners import planner
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.guidance.planning.rrt import free_poses
from staniel.kernels.cells import lines_cost

__all__ = ["prm", "shortest_way", "visibility", "voronoi"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLES = 1_000
"""Random places of a roadmap, unless the problem says so."""

_NEIGHBOURS = 15  # that a place is joined with
_CORNERS = 1_500  # of a visibility graph at most, the nearest to the straight line first


def shortest_way(problem: Problem, places: Floats, links: Ints) -> tuple[Floats, float]:
    """The cheapest way on a roadmap.

    Parameters
    ----------
    problem : Problem
    places : (n, 2) float array [m]
        The start first, the goal second.
    links : (m, 2) int array
        Which places may be joined, each pair once; those that are not free do not count.

    Returns
    -------
    way : (k, 2) float array [m]
        Empty where there is none.
    cost : float
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    costs = lines_cost(problem.cells, places[links[:, 0]], places[links[:, 1]])
    free = np.isfinite(costs) & (costs > 0.0)
    n = len(places)
    graph = coo_array((costs[free], (links[free, 0], links[free, 1])), shape=(n, n)).tocsr()
    cost, before = dijkstra(graph, directed=False, indices=np.array(0), return_predecessors=True)
    if math.isinf(cost[1]):
        return np.empty((0, 2)), math.inf
    way = [1]
    while way[-1] != 0:
        way.append(int(before[way[-1]]))
    return places[way[::-1]], float(cost[1])


def _ends(problem: Problem) -> Floats:
    return np.array([problem.start[:2], problem.goal[:2]])


def _neighbours(places: Floats, count: int) -> Ints:
    """(m, 2) pairs of each place and its nearest ones, each pair once."""
    from scipy.spatial import cKDTree

    _, near = cKDTree(places).query(places, k=min(count + 1, len(places)))
    pairs = np.column_stack((np.repeat(np.arange(len(places)), near.shape[1]), near.ravel()))
    pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
    return np.unique(pairs, axis=0)


def _followed(problem: Problem, places: Floats, links: Ints, closed: str) -> Plan | NoPath:
    way, cost = shortest_way(problem, places, links)
    if math.isinf(cost):
        return NoPath(closed, len(places))
    return dubins_along(problem, taut(problem, way), len(places))


@planner("prm")
def prm(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """Probabilistic roadmap: random free places, each joined with its nearest.

    Parameters
    ----------
    problem : Problem
        Its `limit` is in places.
    rng : numpy.random.Generator

    Returns
    -------
    Plan or NoPath
        Always ``"limit"`` where nothing is found: more places might.

    Notes
    -----
    Kavraki, Švestka, Latombe and Overmars (1996).
    """
    places = free_poses(problem, problem.limit or SAMPLES, rng)[:, :2]
    places = np.concatenate((_ends(problem), places))
    return _followed(problem, places, _neighbours(places, _NEIGHBOURS), "limit")


@planner("voronoi")
def voronoi(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """Voronoi diagram of the obstacles' edges: as far from them as can be.

    Parameters
    ----------
    problem : Problem
        Its `limit` is not needed: the diagram is finite.
    rng : numpy.random.Generator
        Not used.

    Returns
    -------
    Plan or NoPath
        ``"limit"``: the diagram misses ways narrower than two cells.
    """
    from scipy.spatial import Voronoi

    grid = problem.obstacles
    free = np.pad(~grid.blocked, 1)
    inner = free[1:-1, 1:-1]
    beside = free[:-2, 1:-1] | free[2:, 1:-1] | free[1:-1, :-2] | free[1:-1, 2:]
    edges = grid.middles[~inner & beside]
    rows, columns = grid.state.shape
    # A frame of points just outside keeps the diagram on the grid.
    x = grid.west + grid.cell * (np.arange(-1, columns + 1) + 0.5)
    y = grid.south + grid.cell * (np.arange(-1, rows + 1) + 0.5)
    frame = [np.column_stack((x, np.full(len(x), side))) for side in (y[0], y[-1])]
    frame += [np.column_stack((np.full(len(y), side), y)) for side in (x[0], x[-1])]
    diagram = Voronoi(np.unique(np.concatenate((edges, *frame)), axis=0))
    ridges = np.array(diagram.ridge_vertices)
    ridges = ridges[(ridges >= 0).all(axis=1)]
    places = np.concatenate((_ends(problem), diagram.vertices))
    links = np.concatenate((ridges + 2, _doors(places)))
    return _followed(problem, places, links, "limit")


def _doors(places: Floats) -> Ints:
    """(m, 2) pairs of the start, or the goal, and what is near it."""
    doors = []
    for end in (0, 1):
        near = np.argsort(np.hypot(*(places - places[end]).T), kind="stable")[:60]
        doors.append(np.column_stack((np.full(len(near), end), near)))
    pairs = np.concatenate(doors)
    links: Ints = pairs[pairs[:, 0] != pairs[:, 1]]
    return links


@planner("visibility")
def visibility(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """Visibility graph: straight from corner to corner of the blocked cells.

    Parameters
    ----------
    problem : Problem
        Its `limit` bounds the corners, those nearest to the straight line first.
    rng : numpy.random.Generator
        Not used.

    Returns
    -------
    Plan or NoPath
        ``"closed"`` where all corners were in it.

    Notes
    -----
    With all corners its length, before turns, is the least that there is (Lozano-Pérez and Wesley
    1979).
    """
    most = problem.limit or _CORNERS
    corners = free_corners(problem)
    start, goal = _ends(problem)
    total = np.hypot(*(corners - start).T) + np.hypot(*(corners - goal).T)
    kept = np.argsort(total, kind="stable")[:most]
    places = np.concatenate((_ends(problem), corners[kept]))
    links = np.column_stack(np.triu_indices(len(places), 1))
    return _followed(problem, places, links, "closed" if len(corners) <= most else "limit")


def free_corners(problem: Problem) -> Floats:
    """(n, 2) convex corners of the blocked cells, a hair into the free cell beyond [m]."""
    grid = problem.obstacles
    free = np.pad(~grid.blocked, 1)
    corners = []
    for dj, di in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        # A free cell whose neighbour across the corner is blocked, and both beside it are free.
        across = np.roll(free, (dj, di), (0, 1))
        beside = np.roll(free, dj, 0) & np.roll(free, di, 1)
        j, i = np.nonzero((free & ~across & beside)[1:-1, 1:-1])
        hair = 0.5 - 1e-6
        x = grid.west + grid.cell * (i + 0.5 - di * hair)
        y = grid.south + grid.cell * (j + 0.5 - dj * hair)
        corners.append(np.column_stack((x, y)))
    return np.concatenate(corners)
