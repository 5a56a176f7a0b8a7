"""An evolutionary planner: splines whose control points mutate until they are free and bend enough.

Differential evolution (Storn and Price 1997) over the control points of a cubic B-spline.
"""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.follow import dubins_along
from staniel.guidance.planning.planners import planner
from staniel.guidance.planning.problem import NoPath, Plan, Problem

__all__ = ["spline"]

Floats = NDArray[np.float64]

GENERATIONS = 150
"""At most, unless the problem says so."""

_POINTS = 7  # control points that mutate
_PEOPLE = 60  # splines of a generation
_STEPS = 120  # places on a spline that are judged
_BLOCKED = 30.0  # price of a metre in a blocked cell, and of one that bends too much
_FACTOR, _CROSSING = 0.6, 0.8  # of a mutation, and the share that is taken over


def _basis(points: int, steps: int) -> tuple[Floats, Floats, Floats]:
    """(steps, points) values and first two derivatives of clamped cubic B-splines."""
    from scipy.interpolate import BSpline

    knots = np.concatenate((np.zeros(3), np.linspace(0.0, 1.0, points - 2), np.ones(3)))
    at = np.linspace(0.0, 1.0, steps)
    splines = BSpline(knots, np.eye(points), 3)
    return splines(at), splines.derivative(1)(at), splines.derivative(2)(at)


class _Judge:
    """What splines cost: their length, and dearly what is blocked or bends too much."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        # The second control point gives the course at the start, the last but one that at the goal.
        arm = 0.6 * problem.turn_radius
        x, y, course = problem.start
        self._head = np.array([(x, y), (x + arm * math.cos(course), y + arm * math.sin(course))])
        self._tail = np.array([problem.goal[:2]])
        if len(problem.goal) == 3:
            x, y, course = problem.goal
            before = (x - arm * math.cos(course), y - arm * math.sin(course))
            self._tail = np.array([before, (x, y)])
        points = len(self._head) + _POINTS + len(self._tail)
        self._values, self._first, self._second = _basis(points, _STEPS)
        price = problem.cells.price.astype(np.float64)
        # Deeper inside is worse, so that the way out is downhill.
        from scipy.ndimage import distance_transform_edt

        depth = np.asarray(distance_transform_edt(problem.obstacles.blocked))
        self._price = np.where(np.isinf(price), _BLOCKED + depth, price)

    def points(self, people: Floats) -> Floats:
        """(p, points, 2) all control points of people (p, 2 `_POINTS`)."""
        middle = people.reshape(len(people), _POINTS, 2)
        head = np.broadcast_to(self._head, (len(people), *self._head.shape))
        tail = np.broadcast_to(self._tail, (len(people), *self._tail.shape))
        return np.concatenate((head, middle, tail), axis=1)

    def places(self, people: Floats) -> Floats:
        """(p, `_STEPS`, 2) places along the splines."""
        places: Floats = np.einsum("sk,pkd->psd", self._values, self.points(people))
        return places

    def costs(self, people: Floats) -> Floats:
        """(p,) what each of people (p, 2 `_POINTS`) costs."""
        grid = self._problem.obstacles
        points = self.points(people)
        places = np.einsum("sk,pkd->psd", self._values, points)
        one = np.einsum("sk,pkd->psd", self._first, points)
        two = np.einsum("sk,pkd->psd", self._second, points)
        speed = np.hypot(one[..., 0], one[..., 1])
        cross = np.abs(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])
        bend = cross / np.maximum(speed, 1e-9) ** 3
        rows, columns = grid.state.shape
        i = np.floor((places[..., 0] - grid.west) / grid.cell).astype(np.int64)
        j = np.floor((places[..., 1] - grid.south) / grid.cell).astype(np.int64)
        inside = (i >= 0) & (i < columns) & (j >= 0) & (j < rows)
        price = self._price[np.clip(j, 0, rows - 1), np.clip(i, 0, columns - 1)]
        price = np.where(inside, price, 3.0 * _BLOCKED)
        tight = np.minimum(bend * self._problem.turn_radius - 1.0, 1.0)
        price = price + np.where(tight > 0.02, _BLOCKED * (0.1 + tight), 0.0)
        steps = np.hypot(*np.moveaxis(np.diff(places, axis=1), -1, 0))
        costs: Floats = (0.5 * (price[:, 1:] + price[:, :-1]) * steps).sum(axis=1)
        return costs


@planner("spline")
def spline(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """Evolve a spline, and follow the best by Dubins paths.

    Parameters
    ----------
    problem : Problem
        Its `limit` is in generations.
    rng : numpy.random.Generator

    Returns
    -------
    Plan or NoPath
        ``"limit"`` where the best spline's neighbourhood is not free in the end.
    """
    judge = _Judge(problem)
    start, goal = np.array(problem.start[:2]), np.array(problem.goal[:2])
    shares = np.linspace(0.0, 1.0, _POINTS + 2)[1:-1, None]
    straight = (start + shares * (goal - start)).ravel()
    spread = max(math.dist(start, goal) / 3.0, 2.0 * problem.turn_radius)
    people = straight + rng.normal(0.0, spread, (_PEOPLE, 2 * _POINTS))
    # Some are bent as a whole: ways round, not zigzags.
    bow = rng.normal(0.0, spread, (_PEOPLE // 2, 1, 2)) * np.sin(math.pi * shares)
    people[: _PEOPLE // 2] = straight + bow.reshape(_PEOPLE // 2, -1)
    people[0] = straight
    costs = judge.costs(people)
    generations = problem.limit or GENERATIONS
    for _ in range(generations):
        a, b = rng.integers(_PEOPLE, size=(2, _PEOPLE))
        best = people[np.argmin(costs)]
        mutants = people + _FACTOR * (best - people) + _FACTOR * (people[a] - people[b])
        taken = rng.random(people.shape) < _CROSSING
        children = np.where(taken, mutants, people)
        theirs = judge.costs(children)
        better = theirs < costs
        people[better], costs[better] = children[better], theirs[better]
    best = judge.places(people[[np.argmin(costs)]])[0]
    best[0], best[-1] = start, goal
    return dubins_along(problem, best, generations * _PEOPLE)
