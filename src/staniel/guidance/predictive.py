"""The last word before the autopilot: what was commanded, or the nearest to it that is safe.

Priority: buildings and other aircraft, then no-fly regions and the fence, then whatever was
commanded, be it a person's order or the team's own decision. See ``docs/avoidance.md``.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.autopilot import decode, encode, limits
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command, FlyBanks, way_point
from staniel.datatypes.equipment import Airframe, Lidar
from staniel.datatypes.message import Heartbeat
from staniel.datatypes.risk import RiskRegion, region_arrays
from staniel.guidance.alternatives import alternatives, last_resorts
from staniel.guidance.config import GuidanceConfig
from staniel.guidance.drift import Drift
from staniel.guidance.neighbours import Neighbours
from staniel.guidance.surroundings import Surroundings
from staniel.kernels.avoidance import Bans, Choice, Others, Rules, badness, choose, ways
from staniel.kernels.flight import LINE
from staniel.kernels.occupancy import Tops

__all__ = ["FORESIGHT", "NEIGHBOURHOOD", "Predictive", "bans"]

Floats = NDArray[np.float64]

FORESIGHT = 8.0
"""How far ahead the way of a command is flown out [s]."""

NEIGHBOURHOOD = 450.0
"""Other aircraft beyond are not reckoned with [m]: twice the way of `FORESIGHT`, and a turn."""

_LOOKS = 0.25  # beyond the decision step, so often a way is looked at, or a little oftener [s]
_APART_FOR = 7.0  # how long an escape keeps away from where others are expected [s]
_SHORT = 2.0  # what a metre that a way falls short of `FORESIGHT` counts
_BANNED = 1e3  # what a second in a ban counts [m]


class Predictive:
    """Flies what is commanded as long as that is safe; else the safe way that leads nearest to it.

    Parameters
    ----------
    own : int
        The aircraft's number in the team.
    airframe : Airframe
    clock : Clock
    chart : City
        The map that the agent holds.
    lidar : Lidar
        What it carries.
    config : GuidanceConfig
    """

    def __init__(
        self,
        own: int,
        airframe: Airframe,
        clock: Clock,
        chart: City,
        lidar: Lidar,
        config: GuidanceConfig,
    ) -> None:
        self._airframe, self._config = airframe, config
        self._limits = limits([airframe], config.following, config.approach)[0]
        self._around = Surroundings(chart, config.clearance, lidar.range, config.safe_altitude)
        self._neighbours = Neighbours(own, airframe, config)
        self._drift = Drift(clock.decision_step)
        stride = max(int(_LOOKS / clock.dynamics_step), 1)
        self._rules = Rules(clock.dynamics_step, clock.substeps, stride, FORESIGHT, _APART_FOR)
        self._regions: tuple[RiskRegion, ...] = ()
        self._bans = bans((), config)
        self._escape: Floats | None = None
        self._heading: float | None = None

    def step(
        self,
        percept: Percept,
        heartbeats: Sequence[Heartbeat],
        regions: Sequence[RiskRegion],
        command: Command,
    ) -> tuple[Command, str]:
        """As `staniel.guidance.avoidance.Avoidance.step`."""
        pose, drift, airframe = percept.pose, self._drift, self._airframe
        drift.step(pose)
        self._neighbours.step(percept.time, heartbeats, drift.wind)
        tops = self._around.step(pose, percept.lidar)
        others = self._neighbours.at(percept.time, pose, NEIGHBOURHOOD)
        if tuple(regions) != self._regions:
            self._regions = tuple(regions)
            self._bans = bans(regions, self._config)
        level, goal = pose.z + drift.climb, way_point(command)
        wanted = encode([command])[0]
        rows, longer = wanted[None], np.zeros(1)
        choice, clear = self._choose(pose, rows, longer, goal, tops, others)
        if not clear or choice.harm.any():
            rows, longer = alternatives(pose, level, wanted, airframe, self._heading, self._escape)
            choice, _ = self._choose(pose, rows, longer, goal, tops, others)
        guard = "avoid" if choice.row else ""
        if choice.harm.any():
            resorts = last_resorts(pose, level, airframe, self._escape)
            other, _ = self._choose(pose, resorts, np.ones(len(resorts)), goal, tops, others)
            if badness(other.harm) < badness(choice.harm):
                choice, rows = other, resorts
            guard = "loiter" if choice.harm.any() else "avoid"
        row = rows[choice.row]
        self._escape, self._heading = choice.escape, None
        if guard and row[0] == LINE:
            self._heading = math.atan2(row[6] - row[4], row[5] - row[3])
        drift.expect(choice.there.tolist(), choice.climb)
        return _looking(decode(row), command) if guard else command, guard

    def _choose(
        self,
        pose: Pose,
        rows: Floats,
        longer: Floats,
        goal: tuple[float, float],
        tops: Tops,
        others: Others,
    ) -> tuple[Choice, bool]:
        """The verified row that leads nearest to the goal, and whether the first one is clear."""
        state, climb, speed = np.array(pose), self._drift.climb, self._airframe.speed
        wind = np.array(self._drift.wind)
        common = (self._limits, wind, tops, others, self._bans, self._rules)
        ends, clear, banned = ways(state, climb, rows, *common)
        east, north = goal if math.isfinite(goal[0]) else ends[0]
        cost = np.hypot(ends[:, 0] - east, ends[:, 1] - north) + longer
        cost += _SHORT * speed * (FORESIGHT - clear) + _BANNED * banned
        order = np.argsort(cost, kind="stable")
        return choose(state, climb, rows, order, speed, *common), bool(clear[0] >= FORESIGHT)


def _looking(flown: Command, wanted: Command) -> Command:
    """What is flown, with the look that was wanted: other banks need not take a gimbal off it."""
    if isinstance(flown, FlyBanks) and isinstance(wanted, FlyBanks):
        return replace(flown, look=wanted.look)
    return flown


def bans(regions: Sequence[RiskRegion], config: GuidanceConfig) -> Bans:
    """No-fly regions and the scenario's fence, as the kernels read them."""
    held = [region for region in regions if region.kind == "no-fly"]
    outside = np.zeros(len(held) + (config.fence is not None), dtype=np.bool_)
    if config.fence is not None:
        held.append(RiskRegion(kind="no-fly", polygon=config.fence, floor=-1e5))
        outside[-1] = True
    return Bans(region_arrays(held), outside, config.ban_margin)
