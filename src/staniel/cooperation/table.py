"""What an agent knows of who holds what, and of targets that nobody holds, as it heard it."""

import math
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from typing import NamedTuple

from staniel.cooperation.cost import Goal, Price
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Award, Point, Release, Unheld

__all__ = ["Auction", "Holding", "Lease", "Task", "UnheldTable"]

TOLD = 8
"""Unheld targets that a heartbeat tells of at most."""


@dataclass(frozen=True, slots=True)
class Task:
    """One of the agent's own tracks, as the auction sees it.

    Attributes
    ----------
    id : TrackId
    position : (float, float) [m]
    course : float [rad]
    cost : float [m]
        What it costs the agent to watch it, and in `terms` what that is the sum of.
    seen : bool
        By the agent's own camera, just now.
    terms : tuple of float [m]
        As in `staniel.datatypes.message.Offer`.
    velocity : (float, float) [m/s]
    last_seen : float [s]
        By anybody, as far as the agent heard.
    """

    id: TrackId
    position: Point
    course: float
    cost: float
    seen: bool
    terms: tuple[float, ...] = ()
    velocity: Point = (0.0, 0.0)
    last_seen: float = 0.0

    @property
    def goal(self) -> Goal:
        """Where it is and how it drives, as others price it."""
        return Goal(self.position, self.course, math.hypot(*self.velocity))

    @property
    def price(self) -> Price:
        """What it costs the agent, with the terms of that."""
        return Price(self.cost, self.terms)


@dataclass(frozen=True, slots=True)
class Holding:
    """The target that the agent is responsible for, where and when it last was, since when."""

    id: TrackId
    position: Point
    since: float
    seen: float


class Lease(NamedTuple):
    """What another agent holds, as of the message said at `said`."""

    target: TrackId
    cost: float
    said: float


@dataclass(slots=True)
class Auction:
    """An auction that the agent itself opened; once awarded it waits for the winner's word."""

    goal: Goal
    price: Price  # the agent's own
    closes: float
    holder: int | None = None  # who held the target when it was opened
    declined: set[int] = field(default_factory=set)
    award: Award | None = None
    tries: int = 0


class _Entry(NamedTuple):
    known: Unheld
    since: float


class UnheldTable:
    """Targets that nobody holds, from own tracks and from what others say.

    Parameters
    ----------
    memory : float [s]
        A target that nobody has seen for so long is forgotten.
    """

    def __init__(self, memory: float) -> None:
        self._memory = memory
        self._entries: dict[TrackId, _Entry] = {}
        self._gone: dict[TrackId, float] = {}
        self._sorted: list[Unheld] | None = None  # until something changes
        self._known: tuple[Unheld, ...] = ()  # what was heard last: most tell of the same

    def __contains__(self, target: TrackId) -> bool:
        return target in self._entries

    def since(self, target: TrackId) -> float:
        """When the agent first knew that nobody holds it [s]; it has to be in the table."""
        return self._entries[target].since

    def seen(self, target: TrackId, otherwise: float) -> float:
        """When it was last seen [s], as far as the agent heard; `otherwise` where it did not."""
        entry = self._entries.get(target)
        return otherwise if entry is None else entry.known.seen

    @property
    def all(self) -> list[Unheld]:
        """All of them, the longest unseen first."""
        if self._sorted is None:
            known = [entry.known for entry in self._entries.values()]
            self._sorted = sorted(known, key=lambda unheld: (unheld.seen, unheld.target))
        return list(self._sorted)

    @property
    def told(self) -> tuple[Unheld, ...]:
        """What a heartbeat says of them."""
        return tuple(self.all[:TOLD])

    def note(self, unheld: Unheld, time: float) -> None:
        """Take in what is known at `time`; of two words the one of the newer sighting stands."""
        target = unheld.target
        if self.is_buried(unheld):
            return
        entry = self._entries.get(target)
        if entry is None:
            self._entries[target] = _Entry(unheld, time)
        elif unheld.seen > entry.known.seen:
            self._entries[target] = _Entry(unheld, entry.since)
        else:
            return
        self._sorted = None

    def is_buried(self, unheld: Unheld) -> bool:
        """Whether it was looked for in vain, or goes by another name, since it was seen."""
        return unheld.seen <= self._gone.get(unheld.target, -math.inf)

    def hear(self, told: tuple[Unheld, ...], time: float) -> list[Unheld]:
        """Take in what another agent says nobody holds; those that are buried come back."""
        if told == self._known:
            return []
        wrong, entries = [], self._entries
        for unheld in told:
            entry = entries.get(unheld.target)
            if entry is not None and entry.known.seen >= unheld.seen:
                continue
            if self.is_buried(unheld):
                wrong.append(unheld)
            else:
                self.note(unheld, time)
        self._known = () if wrong else told
        return wrong

    def hear_release(self, message: Release, time: float) -> None:
        """Another agent let go of a target: it is unheld, or not where it was."""
        if message.lost:
            self.bury(message.target, message.time)
        elif math.isfinite(message.seen):
            self.note(Unheld(message.target, message.position, 0.0, message.seen), time)

    def bury(self, target: TrackId, time: float) -> None:
        """It is not where it was, or goes by another name: only a newer sighting counts."""
        self._gone[target] = max(time, self._gone.get(target, time))
        self.drop(target)

    def drop(self, target: TrackId) -> None:
        """Somebody holds it, or it goes by another name."""
        if self._entries.pop(target, None) is not None:
            self._sorted, self._known = None, ()

    def drop_all(self, targets: AbstractSet[TrackId]) -> None:
        """As `drop`, many at once."""
        for target in self._entries.keys() & targets:
            self.drop(target)

    def forget(self, time: float) -> None:
        """Drop what nobody has seen for too long by `time` [s]."""
        oldest = time - self._memory
        for entry in [e for e in self._entries.values() if e.known.seen < oldest]:
            self.drop(entry.known.target)
        self._gone = {k: v for k, v in self._gone.items() if v >= oldest}
