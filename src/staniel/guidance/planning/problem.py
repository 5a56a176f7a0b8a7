"""What a planner is asked and what it answers."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from staniel.angles import wrap, wrap_array
from staniel.datatypes.command import Command, FlyLine, FlyOrbit
from staniel.errors import PlanningError
from staniel.guidance.planning.obstacles import Obstacles
from staniel.kernels.cells import Cells
from staniel.kernels.through import path_cost, pieces, sampled

__all__ = ["NoPath", "Plan", "Problem"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """Fly from a pose to a pose or a place, around obstacles, and rather not through dangers.

    Attributes
    ----------
    start : (float, float, float)
        x, y [m], course [rad].
    goal : (float, float, float) or (float, float)
        The same, or a place where the course is free.
    turn_radius : float [m]
        Of the tightest turn, greater than 0.
    obstacles : Obstacles
    tolerance : float [m]
        A place is reached within it; at least 0, and 0 for a pose.
    risk : (rows, columns) float array, optional [1/s]
        Exposure per second in each cell, such as `Obstacles.exposure_rates`.
    risk_weight : float [m]
        The detour that one unit of exposure is worth, at least 0.
    speed : float [m/s]
        Turns exposure per second into exposure on the way.
    limit : int, optional
        Bound of the work, in the planner's own unit: states, samples, generations. Not given: the
        planner's default. Not a clock, so that the answer is the same on every machine.

    Raises
    ------
    PlanningError
        A value that is not finite or out of its range; a start or goal where nobody may fly.
    """

    start: tuple[float, float, float]
    goal: tuple[float, float, float] | tuple[float, float]
    turn_radius: float
    obstacles: Obstacles
    tolerance: float = 0.0
    risk: Floats | None = None
    risk_weight: float = 0.0
    speed: float = 15.0
    limit: int | None = None

    def __post_init__(self) -> None:
        for name, pose, sizes in (("start", self.start, (3,)), ("goal", self.goal, (2, 3))):
            if len(pose) not in sizes or not all(map(math.isfinite, pose)):
                form = "(x, y, course)" if sizes == (3,) else "(x, y, course) or (x, y)"
                raise PlanningError(f"{name} = {tuple(pose)}: expected finite numbers {form}")
            obstacle = self.obstacles.what_blocks(pose[0], pose[1])
            if obstacle is not None:
                raise PlanningError(
                    f"{name} = ({pose[0]:g}, {pose[1]:g}): expected a place where one may fly, is "
                    f"in {obstacle} or nearer than {self.obstacles.clearance:g} m and a cell to it"
                )
        for name, value, zero in (
            ("turn_radius", self.turn_radius, False),
            ("speed", self.speed, False),
            ("tolerance", self.tolerance, True),
            ("risk_weight", self.risk_weight, True),
        ):
            if not (0.0 < value < math.inf or (zero and value == 0.0)):
                least = "at least" if zero else "greater than"
                raise PlanningError(f"{name} = {value}: expected a number {least} 0")
        if self.tolerance > 0.0 and len(self.goal) == 3:
            raise PlanningError(f"tolerance = {self.tolerance:g}: expected 0 where goal is a pose")
        if self.limit is not None and self.limit < 1:
            raise PlanningError(f"limit = {self.limit}: expected at least 1")
        if self.risk is not None:
            shape = self.obstacles.state.shape
            if self.risk.shape != shape or not (np.isfinite(self.risk) & (self.risk >= 0.0)).all():
                raise PlanningError(
                    f"risk has shape {self.risk.shape}: expected {shape}, finite, at least 0"
                )

    @cached_property
    def cells(self) -> Cells:
        """The grid as kernels take it, with what a metre costs in each cell."""
        if self.risk is None or self.risk_weight == 0.0:
            return self.obstacles.cells()
        return self.obstacles.cells(self.risk * (self.risk_weight / self.speed))

    @property
    def from_pose(self) -> Floats:
        """(3,) the start."""
        return np.array(self.start, dtype=np.float64)

    @property
    def to_pose(self) -> Floats:
        """(3,) the goal; its course is not a number where it is free."""
        return np.array((*self.goal, math.nan)[:3], dtype=np.float64)

    def plan_through(self, poses: Floats, work: int) -> "Plan | NoPath":
        """The plan that flies a row of poses (m, 3) by Dubins paths; the first is the start.

        `work` is what was expanded or sampled. `NoPath` where it does not stay free after all,
        which differs by rounding from what a search has walked.
        """
        path = pieces(np.ascontiguousarray(poses), self.turn_radius)
        cost = path_cost(self.cells, self.from_pose, path)
        if cost == math.inf:
            return NoPath("limit", work)
        exposure = 0.0
        if self.risk is not None:
            cells = self.obstacles.cells(self.risk / self.speed)
            exposure = path_cost(cells, self.from_pose, path) - float(path[:, 1].sum())
        return Plan(self.start, path, cost, max(exposure, 0.0), work)


@dataclass(frozen=True, slots=True)
class NoPath:
    """There is no path, or none was found within the bound; false where a plan is true.

    Attributes
    ----------
    reason : {"closed", "limit"}
        ``"closed"``: all that can be reached, at the planner's resolution, does not reach the goal.
        ``"limit"``: the bound was met first.
    work : int
        What was expanded or sampled.
    """

    reason: str
    work: int

    def __bool__(self) -> bool:
        return False


@dataclass(frozen=True, eq=False)
class Plan:
    """A path of straights and turns that is flown exactly.

    Attributes
    ----------
    start : (float, float, float)
        x, y [m], course [rad].
    pieces : (m, 2) float array
        Curvature [1/m], positive to the left, and length [m] of each piece in turn.
    cost : float [m]
        Length, and what the exposure was worth.
    exposure : float
        Expected, on the whole way.
    work : int
        What the planner expanded or sampled.

    Examples
    --------
    >>> plan = Plan((0.0, 0.0, 0.0), np.array([[0.0, 10.0], [0.02, 25.0 * np.pi]]), 88.5, 0.0, 1)
    >>> [round(value, 6) for value in plan.end]
    [60.0, 50.0, 1.570796]
    """

    start: tuple[float, float, float]
    pieces: Floats
    cost: float
    exposure: float
    work: int = field(compare=False)

    @property
    def length(self) -> float:
        """Of the whole path [m]."""
        return float(self.pieces[:, 1].sum())

    @property
    def end(self) -> tuple[float, float, float]:
        """Where it ends: x, y [m], course [rad]."""
        x, y, course = self.at(np.array([self.length]))[0].tolist()
        return x, y, course

    def at(self, ways: Floats) -> Floats:
        """(n, 3) poses at ascending ways (n,) along the path [m]; it goes on beyond the end."""
        poses = sampled(np.array(self.start), self.pieces, np.ascontiguousarray(ways, dtype=float))
        poses[:, 2] = wrap_array(poses[:, 2])
        return poses

    def poses(self, spacing: float) -> Floats:
        """(n, 3) poses from start to end, not farther apart than `spacing` [m] along the path."""
        count = max(math.ceil(self.length / spacing), 1)
        return self.at(np.linspace(0.0, self.length, count + 1))

    def commands(self, speed: float, altitude: float) -> list[tuple[Command, float]]:
        """What to ask of an autopilot: a line or an orbit for each piece, and for how long [s].

        Parameters
        ----------
        speed : float [m/s]
        altitude : float [m]

        Notes
        -----
        An autopilot that needs time to roll in cuts into and out of turns; plan with a radius and a
        clearance that leave it room.
        """
        told: list[tuple[Command, float]] = []
        ways = np.concatenate(([0.0], np.cumsum(self.pieces[:, 1])))
        corners = self.at(ways).tolist()
        for (bend, length), a, b in zip(
            self.pieces.tolist(), corners[:-1], corners[1:], strict=True
        ):
            command: Command = FlyLine((a[0], a[1]), (b[0], b[1]), speed, altitude)
            if bend != 0.0:
                side = wrap(a[2] + math.copysign(0.5 * math.pi, bend))
                radius = 1.0 / abs(bend)
                center = a[0] + radius * math.cos(side), a[1] + radius * math.sin(side)
                command = FlyOrbit(center, radius, 1 if bend > 0.0 else -1, speed, altitude)
            told.append((command, length / speed))
        return told
