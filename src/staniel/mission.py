"""START HERE: one tick of a mission, read down the page.

What is said in one tick is heard in the next at the earliest. The loop knows no clock, no thread,
no socket and no file: `frames` yields what happened, and others record it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from staniel.agent import Agent
from staniel.datatypes.belief import Belief
from staniel.datatypes.command import Command, FlyBanks
from staniel.datatypes.message import Message
from staniel.datatypes.truth import FLYING, Truth
from staniel.record import Frame
from staniel.world import Lidars, MixedCameras, Radio, ThreatSensors, World, impair

__all__ = ["Mission"]

_NO_COMMAND = FlyBanks((0.0,), 1.0, 0.0, 0.0)
_NO_BELIEF = Belief((), "down", None, (0.0, 0.0))


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
    """

    world: World
    cameras: MixedCameras
    radio: Radio
    agents: list[Agent]
    start: Truth
    ticks: int
    lidars: Lidars | None = None
    threat_sensors: ThreatSensors | None = None

    def frames(self) -> Iterator[Frame]:
        """Fly the mission, a frame a tick; the first is the start itself, before anything moved."""
        truth = self.start
        commands: list[Command] = []
        outboxes: list[list[Message]] = [[] for _ in self.agents]
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
            inboxes, deliveries = self.radio.deliver(outboxes, truth)
            flying = truth.condition[:, FLYING].tolist()
            commands, outboxes, beliefs = [], [], []
            for agent, percept, inbox, flies in zip(
                self.agents, percepts, inboxes, flying, strict=True
            ):
                # Before its launch, and once it is lost, an aircraft has no mind.
                command, outbox = agent.step(percept, inbox) if flies else (_NO_COMMAND, [])
                commands.append(command)
                outboxes.append(outbox)
                beliefs.append(agent.belief if flies else _NO_BELIEF)
            yield Frame(truth, percepts, origins, deliveries, commands, beliefs, noticed)
