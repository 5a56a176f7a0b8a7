"""From a way that knows no turns to a path that is flown: Dubins paths through places on it."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.kernels.cells import line_cost
from staniel.kernels.through import chain

__all__ = ["dubins_along", "taut"]

Floats = NDArray[np.float64]

_COURSES = math.radians(25.0) * np.arange(-2.0, 3.0)  # tried off the way's own
_WINDOW = 12  # places that one Dubins path may leave out
_MOST = 80  # places on the way


def taut(problem: Problem, way: Floats) -> Floats:
    """The places (m, 2) of a free way without those between which one sees one another."""
    kept, at = [0], 0
    cells = problem.cells
    while at < len(way) - 1:
        ahead = len(way) - 1
        while ahead > at + 1 and math.isinf(line_cost(cells, *way[at], *way[ahead])):
            ahead -= 1
        kept.append(ahead)
        at = ahead
    return way[kept]


def dubins_along(problem: Problem, way: Floats, work: int) -> Plan | NoPath:
    """The cheapest chain of Dubins paths from start to goal through some places of a way.

    Parameters
    ----------
    problem : Problem
    way : (m, 2) float array [m]
        From the start to the goal; flown near, not over: every place may be left out.
    work : int
        That it took to find.

    Returns
    -------
    Plan or NoPath
        `NoPath` where no such chain is free.

    Notes
    -----
    Dynamic programming over places about 0.6 turn radii apart and five courses in each, around that
    of the way.
    """
    steps = np.hypot(*np.diff(way, axis=0).T)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    count = int(min(max(along[-1] / (0.6 * problem.turn_radius), 2.0), _MOST))
    ways = np.linspace(0.0, along[-1], count + 1)[1:-1]
    places = np.column_stack([np.interp(ways, along, way[:, k]) for k in range(2)])
    reach = 0.5 * problem.turn_radius
    before, after = (
        np.column_stack([np.interp(ways + side, along, way[:, k]) for k in range(2)])
        for side in (-reach, reach)
    )
    courses = np.arctan2(*(after - before).T[::-1])
    tried = len(_COURSES)
    poses = np.empty((tried * len(places) + 2, 3))
    poses[0], poses[-1] = problem.from_pose, problem.to_pose
    poses[1:-1, :2] = np.repeat(places, tried, axis=0)
    poses[1:-1, 2] = (courses[:, None] + _COURSES).ravel()
    layers = np.concatenate(([0], np.repeat(np.arange(len(places)), tried) + 1, [len(places) + 1]))
    cost, kept = chain(problem.cells, poses, layers, _WINDOW, problem.turn_radius)
    if math.isinf(cost):
        return NoPath("limit", work)
    return problem.plan_through(poses[kept], work)
