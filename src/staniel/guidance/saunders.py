"""A reactive rival: round each obstacle that comes up ahead on a circle, then on to the goal.

After Saunders, Call, Curtis, Beard and McLain, *Static and dynamic obstacle avoidance in miniature
air vehicles* (2005), which thesis 10.2 points to: obstacles that were not on the map are met by a
geometric detour around a circle, without planning and without a proof that the detour is clear.
"""

import math
from collections.abc import Sequence

from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.command import Command, FlyOrbit, way_point
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.message import Heartbeat, Point
from staniel.datatypes.risk import RiskRegion
from staniel.guidance.config import GuidanceConfig

__all__ = ["Saunders"]

_AHEAD = 3.0  # turn radii: so near an obstacle begins to be gone round
_OLD = 3.0  # what others said longer ago is not heeded [s]


class Saunders:
    """Goes round what the lidar returns ahead, and round others at its height; knows of no ban.

    Parameters
    ----------
    own : int
        The aircraft's number in the team.
    airframe : Airframe
    config : GuidanceConfig
    """

    def __init__(self, own: int, airframe: Airframe, config: GuidanceConfig) -> None:
        self._own, self._airframe, self._config = own, airframe, config
        self._radius = 1.1 * airframe.min_turn_radius
        self._others: dict[int, tuple[float, Pose]] = {}
        self._round: tuple[Point, int] | None = None

    def step(
        self,
        percept: Percept,
        heartbeats: Sequence[Heartbeat],
        regions: Sequence[RiskRegion],
        command: Command,
    ) -> tuple[Command, str]:
        """As `staniel.guidance.avoidance.Avoidance.step`; it never finds that nothing is safe."""
        time, pose = percept.time, percept.pose
        for word in heartbeats:
            self._others[word.sender] = (word.time, word.pose)
        goal = way_point(command)
        if not math.isfinite(goal[0]):
            goal = (pose.x + math.cos(pose.heading), pose.y + math.sin(pose.heading))
        if self._round is not None and not self._in_the_way(pose, goal, self._round[0]):
            self._round = None
        ahead = (pose.x + math.cos(pose.heading), pose.y + math.sin(pose.heading))
        met = [
            point
            for point in self._obstacles(time, percept)
            if self._in_the_way(pose, ahead, point) or self._in_the_way(pose, goal, point)
        ]
        if met:
            nearest = min(met, key=lambda point: math.dist(point, (pose.x, pose.y)))
            turn = self._side(pose, nearest) if self._round is None else self._round[1]
            self._round = (nearest, turn)
        if self._round is None:
            return command, ""
        center, turn = self._round
        orbit = FlyOrbit(center, self._radius, turn, command.speed, command.altitude)
        return orbit, "avoid"

    def _obstacles(self, time: float, percept: Percept) -> list[Point]:
        """Walls that the lidar met, and where others at this height were heard to be [m]."""
        points: list[Point] = []
        if percept.lidar is not None:
            points += [(x, y) for x, y in percept.lidar.points().tolist()]
        apart = self._config.separation + self._config.clearance
        points += [
            (pose.x, pose.y)
            for said, pose in self._others.values()
            if time - said <= _OLD and abs(pose.z - percept.pose.z) < apart
        ]
        return points

    def _in_the_way(self, pose: Pose, goal: Point, point: Point) -> bool:
        """Whether the straight way from here towards the goal comes too near to a point ahead."""
        east, north = goal[0] - pose.x, goal[1] - pose.y
        length = math.hypot(east, north)
        dx, dy = point[0] - pose.x, point[1] - pose.y
        if length == 0.0:
            return False
        along, aside = (dx * east + dy * north) / length, (dy * east - dx * north) / length
        reach = _AHEAD * self._airframe.min_turn_radius
        return 0.0 < along < reach and abs(aside) < self._config.clearance + 0.3 * self._radius

    def _side(self, pose: Pose, point: Point) -> int:
        """Which way round: an obstacle on the right stays there."""
        dx, dy = point[0] - pose.x, point[1] - pose.y
        return -1 if math.cos(pose.heading) * dy - math.sin(pose.heading) * dx < 0.0 else 1
