"""START HERE: one tick of a mission, read down the page.

What is said in one tick is heard in the next at the earliest. The loop knows no clock, no thread,
no socket and no file: `frames` yields what happened, and others record it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from staniel.agent import Agent
from staniel.datatypes.belief import Belief
from staniel.datatypes.command import Command, FlyBanks
from staniel.datatypes.message import Message
from staniel.datatypes.truth import FLYING, RADIO, Truth, nominal
from staniel.ground import Ground
from staniel.record import Frame
from staniel.world import Lidars, MixedCameras, Radio, ThreatSensors, World, impair

__all__ = ["Mission", "Station"]

_NO_COMMAND = FlyBanks((0.0,), 1.0, 0.0, 0.0)
_NO_BELIEF = Belief((), "down", None, (0.0, 0.0))


class Station(NamedTuple):
    """The ground node, where its antenna is [m], and from when on it is silent [s]."""

    ground: Ground
    antenna: tuple[float, float, float]
    silent_from: float = math.inf


@dataclass(slots=True)
class Mission:
    """A team in its world, ready to fly.

    Attributes
    ----------
    world : World
        Vehicles drive, aircraft fly.
    cameras : MixedCameras
        What each aircraft sees of it.
    radio : Radio
        What each hears of the others.
    agents : list of Agent
        One mind an aircraft, in the order of the aircraft.
    start : Truth
        Where everything stands before anything moved.
    ticks : int
        Decision steps until the end.
    lidars : Lidars, optional
        What each aircraft measures of the walls at its height.
    threat_sensors : ThreatSensors, optional
        What each aircraft notices of dangers that nobody briefed it on.
    station : Station, optional
        The ground node: one more on the radio, after the aircraft.
    """

    world: World
    cameras: MixedCameras
    radio: Radio
    agents: list[Agent]
    start: Truth
    ticks: int
    lidars: Lidars | None = None
    threat_sensors: ThreatSensors | None = None
    station: Station | None = None

    def frames(self) -> Iterator[Frame]:
        """Fly the mission, a frame a tick; the first is the start itself, before anything moved."""
        truth = self.start
        commands: list[Command] = []
        station = self.station
        outboxes: list[list[Message]] = [
            [] for _ in [*self.agents, *([station] if station else [])]
        ]
        for tick in range(self.ticks + 1):
            if tick > 0:
                truth = self.world.advance(truth, commands)
            percepts, origins = self.cameras.sense(truth)
            if self.lidars is not None:
                percepts = self.lidars.sense(truth, percepts)
            noticed: list[tuple[int, ...]] = []
            if self.threat_sensors is not None:
                percepts, noticed = self.threat_sensors.sense(truth, percepts)
            percepts = impair(percepts, truth)
            inboxes, deliveries = self.radio.deliver(outboxes, self._on_air(truth))
            flying = truth.condition[:, FLYING].tolist()
            commands, outboxes, beliefs = [], [], []
            for agent, percept, inbox, flies in zip(
                self.agents, percepts, inboxes[: len(self.agents)], flying, strict=True
            ):
                # Before its launch, and once it is lost, an aircraft has no mind.
                command, outbox = agent.step(percept, inbox) if flies else (_NO_COMMAND, [])
                commands.append(command)
                outboxes.append(outbox)
                beliefs.append(agent.belief if flies else _NO_BELIEF)
            if station is not None:
                outboxes.append(station.ground.step(truth.time, inboxes[-1]))
            yield Frame(truth, percepts, origins, deliveries, commands, beliefs, noticed)

    def _on_air(self, truth: Truth) -> Truth:
        """The truth as the radio needs it: with the station's antenna as one more aircraft."""
        if self.station is None:
            return truth
        antenna, condition = np.zeros((1, truth.aircraft.shape[1])), nominal(1)
        antenna[0, :3] = self.station.antenna
        condition[0, RADIO] = truth.time < self.station.silent_from
        return replace(
            truth,
            aircraft=np.vstack([truth.aircraft, antenna]),
            condition=np.vstack([truth.condition, condition]),
        )
