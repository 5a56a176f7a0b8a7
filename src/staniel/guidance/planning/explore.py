"""Into the unknown: a chart that starts blank and grows from lidar scans, and who flies by it.

What is unknown is planned through, but never flown into: a stretch is flown only if all of it, and
a full circle at its end, has been seen to be free. The stretch may be long, as through a street in
which no circle fits. Otherwise the last such circle is flown on. As walls do not move, the aircraft
never has to be where it has not looked.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.lidar import LidarScan
from staniel.errors import PlanningError
from staniel.guidance.planning.dstar import GridWay
from staniel.guidance.planning.follow import dubins_along, taut
from staniel.guidance.planning.obstacles import FREE, WALL, Obstacles
from staniel.guidance.planning.planners import plan, planner_named
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.guidance.walls import fit_walls
from staniel.kernels.beams import block, pass_through
from staniel.kernels.cells import Cells
from staniel.kernels.through import path_cost

__all__ = ["Chart", "Explorer", "Leg"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Pose = tuple[float, float, float]

_SIGMAS = 4.0  # by which a return may be off its wall
_NEWS = 10  # cells seen for the first time that count as something new
_STRIDES = 20  # that a stretch has at most
_EXPANSIONS = 60_000  # of one replanning

PATIENCE = 12
"""After so many circles of waiting in all it is given up."""


class Chart:
    """What an aircraft has seen of the obstacles at its height.

    Parameters
    ----------
    obstacles : Obstacles
        What it knew before: blank air, or no-fly regions that it was told of.
    range : float [m]
        How far its lidar reaches: beams that do not come back have seen so far.

    Attributes
    ----------
    obstacles : Obstacles
        As known now.
    known : (rows, columns) bool array
        Cells that a beam went through.
    """

    def __init__(self, obstacles: Obstacles, range: float) -> None:
        if not 0.0 < range < math.inf:
            raise PlanningError(f"range = {range}: expected metres greater than 0")
        self.obstacles, self._range = obstacles, range
        self.known: Bools = np.zeros(obstacles.state.shape, dtype=np.bool_)

    def learn(self, scan: LidarScan) -> int:
        """Add a scan: returns and the wall lines through them block, beams make known.

        Returns
        -------
        int
            How many cells are newly blocked.
        """
        grid = self.obstacles
        corner = grid.west, grid.south, grid.cell
        reach = np.minimum(scan.ranges, self._range)[:, None]
        pass_through(self.known, *corner, scan.origins, scan.origins + reach * scan.directions())
        margin = grid.clearance + _SIGMAS * scan.sigma
        blocked = grid.blocked
        new = block(blocked, *corner, scan.points(), margin)
        walls = replace(grid, clearance=margin).with_walls(fit_walls(scan)).blocked
        new += int((walls & ~blocked).sum())
        if new:
            state = np.where((blocked | walls) & (grid.state == FREE), WALL, grid.state)
            self.obstacles = replace(grid, state=state.astype(np.uint8))
        return new

    def seen_free(self) -> Cells:
        """The grid as kernels take it, in which one may only be where it was seen to be free.

        A beam may pass a cell and miss a building in its far corner, but not go on through that
        building: so beams must have passed, or ended in, all eight neighbours as well.
        """
        wide = np.pad(self.known, 1, constant_values=True)
        across = wide[:-2] & wide[1:-1] & wide[2:]
        seen = across[:, :-2] & across[:, 1:-1] & across[:, 2:]
        return self.obstacles.cells(np.where(seen, 0.0, np.inf))


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """What to fly until the next step.

    Attributes
    ----------
    path : Plan
        Of the stride's length.
    outcome : {"flying", "waiting", "arrived", "no path"}
        Underway; on a circle, looking; at the goal; or given up. The last two hold until the end,
        and the aircraft circles, at the end of the stretch that it is on.
    """

    path: Plan
    outcome: str


class Explorer:
    """Flies to a place through obstacles that it learns of on the way.

    Parameters
    ----------
    chart : Chart
    goal : (float, float) [m]
    turn_radius : float [m]
    home : {+1, -1}
        A left or a right circle at the start is known to be free.
    tolerance : float [m]
        The goal is reached within it.
    stride : float [m]
        Flown from step to step.
    planner : str
        By name; ``"dstar"`` mends its grid from step to step.

    Raises
    ------
    PlanningError
        A stride, a radius or a tolerance that is not greater than 0, an unknown planner.
    """

    def __init__(
        self,
        chart: Chart,
        goal: tuple[float, float],
        *,
        turn_radius: float,
        home: int,
        tolerance: float = 20.0,
        stride: float = 15.0,
        planner: str = "astar",
    ) -> None:
        for name, value in (
            ("turn_radius", turn_radius),
            ("tolerance", tolerance),
            ("stride", stride),
        ):
            if not 0.0 < value < math.inf:
                raise PlanningError(f"{name} = {value}: expected metres greater than 0")
        planner_named(planner)
        self.chart, self._goal, self._radius = chart, goal, turn_radius
        self._tolerance, self._stride, self._planner = tolerance, stride, planner
        self._escape = home
        self._plan: Plan | None = None
        self._flown = self._sure = 0.0  # of the plan, and how far it is seen to be free
        self._idle = 0.0  # flown since something new was seen
        self._refused: Bools = np.zeros_like(chart.known)
        self._waited = 0.0
        self._way: GridWay | None = None
        self._over: str | None = None
        self.plans = 0
        """How often it planned anew."""

    def step(self, pose: Pose, scan: LidarScan | None = None) -> Leg:
        """Learn, plan where that is needed, and say what to fly until the next step.

        Parameters
        ----------
        pose : (float, float, float)
            x, y [m], course [rad]: where the last leg ended.
        scan : LidarScan, optional

        Returns
        -------
        Leg
        """
        self._idle += self._stride
        if scan is not None:
            before = int(self.chart.known.sum())
            self.chart.learn(scan)
            if int(self.chart.known.sum()) >= before + _NEWS:
                self._idle = 0.0
        if self._over is None and math.dist(pose[:2], self._goal) <= self._tolerance:
            self._over = "arrived"
        if self._flown >= self._sure and self._over is None:
            self._look_ahead(pose)
        if self._plan is not None and self._flown < self._sure:
            start, self._flown = self._flown, min(self._flown + self._stride, self._sure)
            return Leg(_cut(self._plan, start, self._flown), self._over or "flying")
        return Leg(self._circle(pose, self._stride), self._over or "waiting")

    def _look_ahead(self, pose: Pose) -> None:
        """Find the next stretch to fly, and plan anew where that is needed; or else wait."""
        if self._plan is None or not self._is_free(self._plan):
            answer = self._replan(pose)
            self._plan = answer if isinstance(answer, Plan) else None
            self._flown = self._sure = 0.0
        if self._plan is None or not self._make_sure(self._plan):
            self._wait()

    def _is_free(self, path: Plan) -> bool:
        """Whether what is left of the plan is not known to be blocked."""
        left = _cut(path, self._flown, path.length)
        air = self.chart.obstacles.cells()
        return math.isfinite(path_cost(air, np.array(left.start), left.pieces))

    def _replan(self, pose: Pose) -> Plan | NoPath:
        self.plans += 1
        obstacles = self.chart.obstacles
        state = np.where(self._refused & (obstacles.state == FREE), WALL, obstacles.state)
        here = replace(obstacles, state=state.astype(np.uint8))
        if here.what_blocks(*pose[:2]) is not None or here.what_blocks(*self._goal) is not None:
            return NoPath("closed", 0)
        problem = Problem(
            pose, self._goal, self._radius, here, 0.5 * self._tolerance, limit=_EXPANSIONS
        )
        if self._planner != "dstar":
            return plan(problem, self._planner)
        if self._way is None:
            self._way = GridWay(problem.cells, self._goal)
        else:
            self._way.change(problem.cells, pose[:2])
        way = self._way.way(pose[:2])
        if len(way) < 2:
            return NoPath("closed", self._way.work)
        way[0], way[-1] = pose[:2], self._goal
        found = dubins_along(problem, taut(problem, way), self._way.work)
        return found if found else plan(problem, "astar")

    def _make_sure(self, path: Plan) -> bool:
        """Find the shortest stretch of the plan that, with a circle at its end, is seen free."""
        seen = self.chart.seen_free()
        until = self._flown
        for _ in range(_STRIDES):
            leg = _cut(path, until, min(until + self._stride, path.length))
            until += leg.length
            if math.isinf(path_cost(seen, np.array(leg.start), leg.pieces)):
                return False
            for side in (self._escape, -self._escape):
                circle = np.array([[side / self._radius, 2.0 * math.pi * self._radius]])
                if math.isfinite(path_cost(seen, np.array(leg.end), circle)):
                    self._escape, self._sure = side, until
                    return True
            if until >= path.length:
                return False
        return False

    def _wait(self) -> None:
        """One stride more on the circle; where nothing new is seen, another way or the end."""
        self._waited += self._stride
        around = 2.0 * math.pi * self._radius
        if self._waited > PATIENCE * around:
            self._over = "no path"
        elif self._idle > around:
            self._idle = 0.0
            if self._plan is None:
                self._over = "no path"
            else:
                # Where it leads cannot be made sure from here: plan no longer through there.
                end = self._plan.at(np.array([self._flown + self._stride]))[:, :2]
                grid = self.chart.obstacles
                block(self._refused, grid.west, grid.south, grid.cell, end, 0.5 * self._stride)
        self._plan, self._flown, self._sure = None, 0.0, 0.0  # it begins where the circle does not

    def _circle(self, pose: Pose, length: float) -> Plan:
        pieces = np.array([[self._escape / self._radius, length]])
        return Plan(pose, pieces, length, 0.0, 0)


def _cut(path: Plan, start: float, end: float) -> Plan:
    """The part of a path between two distances along it [m]."""
    ends = np.cumsum(path.pieces[:, 1])
    inside = np.minimum(ends, end) - np.maximum(ends - path.pieces[:, 1], start)
    kept = inside > 0.0
    pieces = np.column_stack((path.pieces[kept, 0], inside[kept]))
    x, y, course = path.at(np.array([start]))[0].tolist()
    return Plan((x, y, course), pieces, float(pieces[:, 1].sum()), 0.0, 0)
