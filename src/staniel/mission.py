"""START HERE: one tick of a mission, read down the page.

What is said in one tick is heard in the next at the earliest. The loop knows no clock, no thread,
no socket and no file: `frames` yields what happened, and others record it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from staniel.agent import Agent
from staniel.datatypes.command import Command
from staniel.datatypes.message import Message
from staniel.datatypes.truth import Truth
from staniel.record import Frame
from staniel.world import Cameras, Radio, World

__all__ = ["Mission"]


@dataclass(slots=True)
class Mission:
    """A team in its world, ready to fly.

    Attributes
    ----------
    world : World
        Vehicles drive, aircraft fly.
    cameras : Cameras
        What each aircraft sees of it.
    radio : Radio
        What each hears of the others.
    agents : list of Agent
        One mind an aircraft, in the order of the aircraft.
    start : Truth
        Where everything stands before anything moved.
    ticks : int
        Decision steps until the end.
    """

    world: World
    cameras: Cameras
    radio: Radio
    agents: list[Agent]
    start: Truth
    ticks: int

    def frames(self) -> Iterator[Frame]:
        """Fly the mission, a frame a tick; the first is the start itself, before anything moved."""
        truth = self.start
        commands: list[Command] = []
        outboxes: list[list[Message]] = [[] for _ in self.agents]
        for tick in range(self.ticks + 1):
            if tick > 0:
                truth = self.world.advance(truth, commands)
            percepts, origins = self.cameras.sense(truth)
            inboxes, deliveries = self.radio.deliver(outboxes, truth)
            commands, outboxes = [], []
            for agent, percept, inbox in zip(self.agents, percepts, inboxes, strict=True):
                command, outbox = agent.step(percept, inbox)
                commands.append(command)
                outboxes.append(outbox)
            beliefs = [agent.belief for agent in self.agents]
            yield Frame(truth, percepts, origins, deliveries, commands, beliefs)
