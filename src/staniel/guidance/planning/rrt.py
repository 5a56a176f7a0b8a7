"""Random trees of Dubins paths: the first path found (RRT) or ever shorter ones (RRT*)."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.astar import shortened
from staniel.guidance.planning.planners import planner
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.kernels.rrt import grow

__all__ = ["free_poses", "rrt", "rrt_star"]

Floats = NDArray[np.float64]

SAMPLES, SAMPLES_STAR = 20_000, 4_000
"""Drawn at most, unless the problem says so."""

_STRIDE = 3.0  # longest branch in turn radii
_GOAL_SHARE = 0.05  # of the samples are the goal


def free_poses(problem: Problem, count: int, rng: np.random.Generator) -> Floats:
    """(count, 3) poses, even over all free cells and courses."""
    obstacles = problem.obstacles
    middles = obstacles.middles[~obstacles.blocked]
    poses = np.empty((count, 3))
    shift = rng.uniform(-0.5, 0.5, (count, 2)) * obstacles.cell
    poses[:, :2] = middles[rng.integers(len(middles), size=count)] + shift
    poses[:, 2] = rng.uniform(-math.pi, math.pi, count)
    return poses


def _grown(problem: Problem, rng: np.random.Generator, count: int, optimal: bool) -> Plan | NoPath:
    samples = free_poses(problem, count, rng)
    toward = rng.random(count) < _GOAL_SHARE
    samples[toward, :2] = problem.goal[:2]
    if len(problem.goal) == 3:
        samples[toward, 2] = problem.goal[2]
    radius = problem.turn_radius
    cost, used, poses = grow(
        problem.cells,
        problem.from_pose,
        problem.to_pose,
        problem.tolerance,
        radius,
        _STRIDE * radius,
        samples,
        optimal,
    )
    if math.isinf(cost):
        return NoPath("limit", used)
    return problem.plan_through(shortened(problem.cells, poses, radius), used)


@planner("rrt")
def rrt(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """RRT with Dubins steering; stops at the first path, which is then straightened.

    Parameters
    ----------
    problem : Problem
        Its `limit` is in samples.
    rng : numpy.random.Generator

    Returns
    -------
    Plan or NoPath
        ``"limit"``: random trees cannot tell that there is no path.
    """
    return _grown(problem, rng, problem.limit or SAMPLES, optimal=False)


@planner("rrt-star")
def rrt_star(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """RRT*: as `rrt`, with the cheapest parent and rewiring, over all samples.

    Parameters
    ----------
    problem : Problem
        Its `limit` is in samples.
    rng : numpy.random.Generator

    Returns
    -------
    Plan or NoPath
    """
    return _grown(problem, rng, problem.limit or SAMPLES_STAR, optimal=True)
