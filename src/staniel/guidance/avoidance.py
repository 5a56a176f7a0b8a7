"""Avoidance: rivals of one signature, by name.

What stands between an agent's decision and its autopilot. Which one does is chosen by
``guidance.avoidance``; see ``docs/avoidance.md``.
"""

from collections.abc import Sequence
from typing import Protocol

from staniel.city import City
from staniel.datatypes.belief import Percept
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command
from staniel.datatypes.equipment import Airframe, Lidar
from staniel.datatypes.message import Heartbeat
from staniel.datatypes.risk import RiskRegion
from staniel.guidance.config import GuidanceConfig
from staniel.guidance.predictive import Predictive
from staniel.guidance.saunders import Saunders

__all__ = ["Avoidance", "avoidance_for"]


class Avoidance(Protocol):
    """The last word before the autopilot."""

    def step(
        self,
        percept: Percept,
        heartbeats: Sequence[Heartbeat],
        regions: Sequence[RiskRegion],
        command: Command,
    ) -> tuple[Command, str]:
        """Judge a command, once every decision step.

        Parameters
        ----------
        percept : Percept
        heartbeats : sequence of Heartbeat
            Heard since the last step.
        regions : sequence of RiskRegion
            That are known; of them the no-fly ones count.
        command : Command
            What is wanted.

        Returns
        -------
        command : Command
            What to fly: the same object where that is safe.
        guard : str
            ``""``: as commanded. ``"avoid"``: another command in its place. ``"loiter"``: no
            command was found to be safe, and this one does least harm.
        """


def avoidance_for(
    own: int,
    airframe: Airframe,
    clock: Clock,
    chart: City,
    lidar: Lidar,
    config: GuidanceConfig,
) -> Avoidance | None:
    """The avoidance that a scenario names, for one aircraft.

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

    Returns
    -------
    Avoidance or None
        None where ``guidance.avoidance`` is ``"none"``: what is commanded is flown.
    """
    if config.avoidance == "predictive":
        return Predictive(own, airframe, clock, chart, lidar, config)
    if config.avoidance == "saunders":
        return Saunders(own, airframe, config)
    return None
