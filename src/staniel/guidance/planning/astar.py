"""A* over Dubins primitives, thesis 5.5, with a check from behind and a straightened result."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.planners import planner
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.kernels.astar import FOUND, GAVE_UP, NO_WAY, Motion, search
from staniel.kernels.cells import Cells
from staniel.kernels.field import cost_to
from staniel.kernels.through import chain

__all__ = ["astar", "shortened"]

Floats = NDArray[np.float64]

LIMIT = 300_000
"""States that are expanded at most, unless the problem says so."""

_SHORT = 20_000  # expansions after which it is tried from the goal as well
_TRAP = 100_000  # ... and at most, where from the goal backwards all was soon searched
_ARC = 1.5  # wanted length of a turning primitive in cells
_COURSES = (16, 48)  # bounds of how many there are
_WINDOW = 200  # poses that one shortcut may leave out


def _motion(problem: Problem, limit: int) -> Motion:
    around = 2.0 * math.pi * problem.turn_radius
    courses = round(around / (_ARC * problem.obstacles.cell))
    return Motion(problem.turn_radius, min(max(courses, _COURSES[0]), _COURSES[1]), 1.0, limit)


def _flipped(poses: Floats) -> Floats:
    """The same way backwards: a Dubins path reversed is a Dubins path."""
    back = poses[::-1].copy()
    back[:, 2] += math.pi
    return back


def shortened(cells: Cells, poses: Floats, radius: float) -> Floats:
    """The poses (m, 3) of a free chain without those that a free Dubins path need not visit."""
    _, kept = chain(cells, poses, np.arange(len(poses)), _WINDOW, radius)
    return poses[kept] if len(kept) else poses


@planner("astar")
def astar(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """A* over left, straight and right pieces; see `staniel.kernels.astar`.

    Parameters
    ----------
    problem : Problem
        Its `limit` is in states expanded.
    rng : numpy.random.Generator
        Not used.

    Returns
    -------
    Plan or NoPath

    Notes
    -----
    The heuristic is the larger of the Dubins length and the cost along eight directions of the
    grid, which may exceed the cheapest way by 8.3 %. Where a short search does not get there,
    another goes from the goal backwards, which helps where it is the start that is hard to leave.
    Then the first goes on; not for long where the one from the goal found that end a trap, which
    to some grid of courses a tight place is although it can be reached, so that it does not decide
    alone. What was found is straightened by dynamic programming over its own poses.
    """
    cells, radius = problem.cells, problem.turn_radius
    start, goal = problem.from_pose, problem.to_pose
    limit = LIMIT if problem.limit is None else problem.limit
    field = cost_to(cells, goal[0], goal[1])
    short = _motion(problem, min(_SHORT, limit))
    outcome, work, _, poses = search(cells, field, start, goal, problem.tolerance, short)
    if outcome == GAVE_UP and not math.isnan(goal[2]) and limit > work:
        ends = _flipped(np.stack((start, goal)))
        back = cost_to(cells, start[0], start[1])
        found, more, _, way = search(cells, back, ends[0], ends[1], 0.0, short)
        work += more
        if found == FOUND:
            outcome, poses = FOUND, _flipped(way)
        elif found == NO_WAY:
            limit = min(limit, _TRAP)
    if outcome == GAVE_UP and limit > work:
        long = _motion(problem, limit - work)
        outcome, more, _, poses = search(cells, field, start, goal, problem.tolerance, long)
        work += more
    if outcome != FOUND:
        return NoPath("closed" if outcome == NO_WAY else "limit", work)
    return problem.plan_through(shortened(cells, poses, radius), work)
