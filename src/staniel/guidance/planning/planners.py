"""Planners: rivals of one signature, chosen by name.

A planner is a plain function ``(Problem, Generator) -> Plan | NoPath``. Whoever writes one of his
own registers it::

    @planner("mine")
    def mine(problem: Problem, rng: np.random.Generator) -> Plan | NoPath: ...

and calls ``plan(problem, "mine")``.
"""

from collections.abc import Callable

import numpy as np

from staniel.errors import PlanningError
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.guidance.registry import Registry

__all__ = ["PLANNERS", "Planner", "plan", "planner", "planner_named", "planner_names"]

Planner = Callable[[Problem, np.random.Generator], Plan | NoPath]

PLANNERS: Registry[Planner] = Registry("planner", "planner", PlanningError)
"""All that are registered."""

planner = PLANNERS.register
"""Decorator: registers a function as the planner of a name; ValueError where it is taken."""

planner_names = PLANNERS.names
"""Names of all registered planners, sorted."""

planner_named = PLANNERS.named
"""The planner registered under a name; PlanningError where nobody did."""


def plan(
    problem: Problem, name: str = "astar", rng: np.random.Generator | None = None
) -> Plan | NoPath:
    """Plan a path.

    Parameters
    ----------
    problem : Problem
    name : str
        Of the planner.
    rng : numpy.random.Generator, optional
        Of planners that sample. Not given: a fixed seed, so that the same problem has the same
        answer.

    Returns
    -------
    Plan or NoPath
        The first is true, the second false.

    Raises
    ------
    PlanningError
        A planner that nobody registered.

    Examples
    --------
    >>> from staniel.guidance.planning import Obstacles
    >>> free = Obstacles.open((400.0, 300.0), altitude=60.0, clearance=5.0)
    >>> found = plan(Problem((50.0, 50.0, 0.0), (350.0, 50.0, 0.0), 30.0, free))
    >>> found.length, found.pieces.shape
    (300.0, (1, 2))
    """
    return planner_named(name)(problem, np.random.default_rng(0) if rng is None else rng)
