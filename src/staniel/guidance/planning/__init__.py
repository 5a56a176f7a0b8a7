"""Planning around obstacles and risk: one problem, one answer, rival planners by name."""

from staniel.guidance.planning.astar import astar
from staniel.guidance.planning.dstar import GridWay, dstar
from staniel.guidance.planning.explore import Chart, Explorer, Leg
from staniel.guidance.planning.obstacles import Obstacles
from staniel.guidance.planning.planners import (
    Planner,
    plan,
    planner,
    planner_named,
    planner_names,
)
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.guidance.planning.roadmaps import prm, visibility, voronoi
from staniel.guidance.planning.rrt import rrt, rrt_star
from staniel.guidance.planning.spline import spline

__all__ = [
    "Chart",
    "Explorer",
    "GridWay",
    "Leg",
    "NoPath",
    "Obstacles",
    "Plan",
    "Planner",
    "Problem",
    "astar",
    "dstar",
    "plan",
    "planner",
    "planner_named",
    "planner_names",
    "prm",
    "rrt",
    "rrt_star",
    "spline",
    "visibility",
    "voronoi",
]
