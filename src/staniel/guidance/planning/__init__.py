"""Planning around obstacles and risk: one problem, one answer, rival planners by name."""

from staniel.guidance.planning.astar import astar
from staniel.guidance.planning.obstacles import Obstacles
from staniel.guidance.planning.planners import (
    Planner,
    plan,
    planner,
    planner_named,
    planner_names,
)
from staniel.guidance.planning.problem import NoPath, Plan, Problem

__all__ = [
    "NoPath",
    "Obstacles",
    "Plan",
    "Planner",
    "Problem",
    "astar",
    "plan",
    "planner",
    "planner_named",
    "planner_names",
]
