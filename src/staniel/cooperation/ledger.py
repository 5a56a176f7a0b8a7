"""What one agent knows of itself and of the team, and what it says: the auctions' shared book.

The parts of `staniel.cooperation.allocation` read it and write in it. It decides nothing; it keeps
the entries true to one another: who holds or lets go of a target, or calls it by another name,
changes all of them at once.
"""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.table import Auction, Holding, Lease, Task, UnheldTable
from staniel.cooperation.trails import Trails
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import Announce, Bid, Heartbeat, Message, Point, Release, Unheld

__all__ = ["Ledger"]


class Ledger:
    """One agent's book.

    Parameters
    ----------
    agent : int
        Its id.
    config : CooperationConfig
    step : float [s]
        The decision step.

    Attributes
    ----------
    agent : int
    config : CooperationConfig
    bid_time : float [s]
        For which an auction waits for bids, or an award for its answer.
    time : float [s]
        Of the present step, like `pose`, `health` and `tasks`.
    pose : Pose
        The agent's own.
    health : {"healthy", "blind", "weak"}
        The agent's own.
    patrolling : bool
        It lets all targets be, and looks where nobody has looked for long.
    tasks : dict of TrackId to Task
        All its live tracks.
    holding : Holding or None
        The target to pursue.
    said : dict of float to float
        Cost of the held target that the agent's heartbeats told [m], by when they were said [s].
    leases : dict of int to Lease
        What others hold, by holder.
    beats : dict of int to Heartbeat
        The last one of every other agent.
    unheld : UnheldTable
        Targets that nobody is known to hold.
    auctions : dict of TrackId to Auction
        The agent's own.
    elsewhere : dict of TrackId to (Announce, float)
        Auctions of others, and until when they wait for bids [s].
    bids : list of (float, Bid)
        When they were heard [s], or said, and the bids.
    paused : dict of TrackId to float
        Targets that the agent does not auction, nor corrects others about, and until when [s].
    outbox : list of Message
        To be broadcast, of the present step.
    renames : list of (TrackId, TrackId)
        Old and new names that the agent's tracker is to take over, of the present step.
    sequence : int
        Number of the message that was said last.
    """

    def __init__(self, agent: int, config: CooperationConfig, *, step: float) -> None:
        self.agent, self.config = agent, config
        self.bid_time = config.bid_wait * step
        self.time, self.pose = -math.inf, Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.health, self.patrolling = "healthy", False
        self.tasks: dict[TrackId, Task] = {}
        self.holding: Holding | None = None
        self.said: dict[float, float] = {}
        self.leases: dict[int, Lease] = {}
        self.beats: dict[int, Heartbeat] = {}
        self.unheld = UnheldTable(config.unheld_memory)
        self.auctions: dict[TrackId, Auction] = {}
        self.elsewhere: dict[TrackId, tuple[Announce, float]] = {}
        self.bids: list[tuple[float, Bid]] = []
        self.paused: dict[TrackId, float] = {}
        self.outbox: list[Message] = []
        self.renames: list[tuple[TrackId, TrackId]] = []
        self.sequence = 0
        self._trails = Trails(config.unheld_memory, config.same_target)

    def turn_to(self, time: float, pose: Pose, tasks: Iterable[Task], health: str) -> None:
        """Begin the step of `time` [s], and drop what is too old by then to count."""
        self.time, self.pose, self.outbox, self.renames = time, pose, [], []
        self.health, self.tasks = health, {task.id: task for task in tasks}
        lease, window = self.config.lease, 2.0 * self.bid_time
        self.leases = {k: v for k, v in self.leases.items() if time - v.said <= lease}
        self.beats = {k: v for k, v in self.beats.items() if time - v.time <= lease}
        self.said = {k: v for k, v in self.said.items() if time - k <= lease}
        self.paused = {k: v for k, v in self.paused.items() if v > time}
        self.elsewhere = {k: v for k, v in self.elsewhere.items() if v[1] >= time}
        self.bids = [(heard, bid) for heard, bid in self.bids if time - heard <= window]
        self.unheld.forget(time)

    # -- saying ----------------------------------------------------------------------------------

    def next_sequence(self) -> int:
        """Number for one more message."""
        self.sequence += 1
        return self.sequence

    def say(self, kind: type[Message], **content: Any) -> None:  # noqa: ANN401 - what the kind holds
        """Put a message into the outbox."""
        self.outbox.append(kind(self.agent, self.next_sequence(), self.time, **content))

    # -- asking ----------------------------------------------------------------------------------

    @property
    def held(self) -> set[TrackId]:
        """Names of the targets that somebody is known to hold, or that are up for auction."""
        names = {lease.target for lease in self.leases.values()} | self.auctions.keys()
        return names if self.holding is None else names | {self.holding.id}

    @property
    def cost(self) -> float:
        """Of the held target [m]; infinite without one, or where another is to take it."""
        if self.holding is None or self.health != "healthy":
            return math.inf
        task = self.tasks.get(self.holding.id)
        if task is not None:
            return task.cost
        return math.dist(self.holding.position, (self.pose.x, self.pose.y))

    @property
    def free(self) -> bool:
        """Whether it can take a target: also while it only looks for one where it lost it."""
        return self.holding is None or self.holding.id not in self.tasks

    @property
    def able(self) -> bool:
        """Whether it bids: it is free, fit, and not on patrol."""
        return self.health == "healthy" and self.free and not self.patrolling

    def is_busy_with(self, target: TrackId) -> bool:
        """Whether the agent holds it, auctions it, or lets it rest."""
        return (
            target in self.auctions
            or target in self.paused
            or (self.holding is not None and self.holding.id == target)
        )

    # -- holding ---------------------------------------------------------------------------------

    def hold(self, target: TrackId, position: Point) -> None:
        """The target is the agent's from now on."""
        task = self.tasks.get(target)
        seen = self.unheld.seen(target, self.time) if task is None else task.last_seen
        self.holding = Holding(target, position, self.time, seen)
        self.unheld.drop(target)

    def let_go(self) -> None:
        """Leave the held target to others, and say so."""
        assert self.holding is not None
        holding, self.holding = self.holding, None
        self.say(
            Release, target=holding.id, position=holding.position, lost=False, seen=holding.seen
        )
        self.unheld.note(Unheld(holding.id, holding.position, 0.0, holding.seen), self.time)

    def follow_holding(self) -> None:
        """Keep the held target's place; a new track that appears there is that target again."""
        if self.holding is None:
            return
        name, position = self.holding.id, self.holding.position
        self.rename(self.own_name(name, position), name)
        if name in self.tasks:
            task = self.tasks[name]
            self.holding = replace(self.holding, position=task.position, seen=task.last_seen)

    def note_unheld(self) -> None:
        """Note which of the agent's tracks nobody holds."""
        taken = self.held
        for task in self.tasks.values():
            if task.id not in taken:
                self.unheld.note(
                    Unheld(task.id, task.position, task.course, task.last_seen), self.time
                )
        self.unheld.drop_all(taken - self.auctions.keys())
        # What goes by another name by now is not without a holder, or is told under that name.
        self._trails.note(self.time, self.tasks.values())
        speeds = {task.id: math.hypot(*task.velocity) for task in self.tasks.values()}
        strange = [unheld for unheld in self.unheld.all if unheld.target not in self.tasks]
        for unheld in self._trails.explained(strange, speeds):
            self.unheld.bury(unheld.target, self.time)

    # -- names -----------------------------------------------------------------------------------

    def own_name(self, target: TrackId, position: Point) -> TrackId | None:
        """The agent's own track of what another calls `target`: of that name, else the nearest."""
        if target in self.tasks:
            return target
        nearest, name = self.config.same_target, None
        for task in self.tasks.values():
            distance = math.dist(task.position, position)
            if distance <= nearest:
                nearest, name = distance, task.id
        return name

    def rename(self, old: TrackId | None, new: TrackId) -> None:
        """Call the own track `old` by another name, unless another own track has it."""
        if old is None or old == new or new in self.tasks or old not in self.tasks:
            return
        self.tasks[new] = replace(self.tasks.pop(old), id=new)
        self.auctions.pop(old, None)
        self.unheld.bury(old, self.time)
        self._trails.rename(old, new)
        if self.holding is not None and self.holding.id == old:
            self.holding = replace(self.holding, id=new)
        self.renames.append((old, new))

    def uncross(self, target: TrackId, position: Point) -> None:
        """Exchange two names that a holder uses the other way round: its names rule."""
        task, near = self.tasks.get(target), self.config.same_target / 2.0
        if task is None or math.dist(task.position, position) <= near:
            return
        others = [other for other in self.tasks.values() if other.id != target]
        nearest = min(others, key=lambda o: math.dist(o.position, position), default=None)
        if nearest is None or math.dist(nearest.position, position) > near:
            return
        other, held = nearest.id, None if self.holding is None else self.holding.id
        aside = TrackId(self.time, self.agent, 2**31 + self.sequence % 2**31)
        self.renames += [(target, aside), (other, target), (aside, other)]
        self.tasks[target] = replace(nearest, id=target)
        self.tasks[other] = replace(task, id=other)
        self._trails.exchange(target, other)
        for name in (target, other):
            if name in self.auctions and self.auctions[name].award is None:
                del self.auctions[name]  # It was announced at the other one's place.
        if self.holding is not None and held in (target, other):
            self.holding = replace(self.holding, id=other if held == target else target)
