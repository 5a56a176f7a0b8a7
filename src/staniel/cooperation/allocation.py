"""Who watches what: one agent's side of the auctions, by messages that may be lost (thesis 7.2.1).

announce → bid → award → heartbeats that renew it. An agent holds at most one target. What it knows
of the others it heard: who holds what is a table of leases that heartbeats renew and silence ends.

=============  ==============================================================================
who            does
=============  ==============================================================================
finder         announces a target that it sees and that nobody is known to hold
free agent     bids its Dubins distance; lowest cost wins, ties go to the higher id
holder         revokes an auction of its own target, unless the announced cost undercuts its own
               by the hand-over margin: then it lets go
two holders    the one whose heartbeat says the higher cost yields
two names      a holder's name for a target rules; before that, the older one
=============  ==============================================================================
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from staniel.cooperation.config import CooperationConfig
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.command import Command
from staniel.datatypes.message import (
    Announce,
    Award,
    Bid,
    Heartbeat,
    Message,
    Point,
    Release,
    Revoke,
)
from staniel.kernels.dubins import shortest_length

__all__ = ["Allocation", "Holding", "Task"]

_COPIES = 256
"""Sequence numbers back from a sender's newest in which a copy is recognised; older is ignored."""

_ALL_COPIES = (1 << _COPIES) - 1

UNSOLD_PAUSE = 10.0
"""An auction without a bidder is not repeated for this long [s]."""


@dataclass(frozen=True, slots=True)
class Task:
    """One of the agent's own tracks, as the auction sees it.

    Attributes
    ----------
    id : TrackId
    position : (float, float) [m]
    course : float [rad]
    cost : float [m]
        Dubins distance from the agent to it.
    seen : bool
        By the agent's own camera, just now.
    """

    id: TrackId
    position: Point
    course: float
    cost: float
    seen: bool


@dataclass(frozen=True, slots=True)
class Holding:
    """The target that the agent is responsible for, where it last was, and since when."""

    id: TrackId
    position: Point
    since: float


@dataclass(frozen=True, slots=True)
class _Lease:
    """What another agent holds, as of the message said at `said`."""

    target: TrackId
    cost: float
    said: float


@dataclass(slots=True)
class _Auction:
    """An auction that the agent itself opened."""

    closes: float
    bids: list[tuple[float, int]] = field(default_factory=list)


class Allocation:
    """One agent's part in sharing out the targets.

    Parameters
    ----------
    agent : int
        Its id.
    config : CooperationConfig
    turn_radius : float [m]
        Of the tightest turn: what the Dubins distance is measured with.
    step : float [s]
        The decision step.
    """

    def __init__(
        self, agent: int, config: CooperationConfig, *, turn_radius: float, step: float
    ) -> None:
        self.holding: Holding | None = None
        self.renames: list[tuple[TrackId, TrackId]] = []
        self._agent, self._config, self._radius, self._step = agent, config, turn_radius, step
        self._leases: dict[int, _Lease] = {}
        self._auctions: dict[TrackId, _Auction] = {}
        self._paused: dict[TrackId, float] = {}
        # By sender: the newest number heard, and bit k for the one k before it.
        self._heard: dict[int, tuple[int, int]] = {}
        self._told: dict[int, int] = {}
        self._said_cost = math.inf
        self._sequence = 0
        self._tasks: dict[TrackId, Task] = {}
        self._out: list[Message] = []
        self._time = -math.inf
        self._pose = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(
        self, time: float, pose: Pose, tasks: Iterable[Task], inbox: Iterable[Message]
    ) -> list[Message]:
        """Hear what was said, decide, and say what follows.

        Parameters
        ----------
        time : float [s]
        pose : Pose
            The agent's own.
        tasks : iterable of Task
            All its live tracks.
        inbox : iterable of Message
            What arrived since the last call.

        Returns
        -------
        list of Message
            To be broadcast. Afterwards `holding` is the target to pursue, if any, and `renames` the
            (old, new) names that the agent's tracker is to take over.
        """
        self._time, self._pose, self._out, self.renames = time, pose, [], []
        self._tasks = {task.id: task for task in tasks}
        lease = self._config.lease
        self._leases = {k: v for k, v in self._leases.items() if time - v.said <= lease}
        self._paused = {k: v for k, v in self._paused.items() if v > time}
        for message in inbox:
            self._hear(message)
        self._follow_holding()
        self._close_auctions()
        self._open_auctions()
        return self._out

    @property
    def held(self) -> set[TrackId]:
        """Names of the targets that somebody is known to hold, or that are up for auction."""
        names = {lease.target for lease in self._leases.values()} | set(self._auctions)
        return names if self.holding is None else names | {self.holding.id}

    def heartbeat(
        self,
        role: str,
        goal: Point,
        helps: TrackId | None = None,
        command: Command | None = None,
    ) -> Heartbeat:
        """The message that tells the others where the agent is and renews its lease."""
        holding = self.holding
        task = None if holding is None else self._tasks.get(holding.id)
        self._said_cost = self._cost_of_holding()
        self._sequence += 1
        return Heartbeat(
            self._agent,
            self._sequence,
            self._time,
            pose=self._pose,
            role=role,
            goal=goal,
            target=None if holding is None else holding.id,
            target_position=None
            if holding is None
            else (holding.position if task is None else task.position),
            cost=self._said_cost,
            helps=helps,
            command=command,
        )

    def give_up(self) -> Release:
        """Let go of the held target because it is lost; the message says so."""
        if self.holding is None:
            raise ValueError("give_up: the agent holds no target")
        holding, self.holding = self.holding, None
        self._sequence += 1
        return Release(
            self._agent,
            self._sequence,
            self._time,
            target=holding.id,
            position=holding.position,
            lost=True,
        )

    def next_sequence(self) -> int:
        """Number for a message that the agent says outside of auctions."""
        self._sequence += 1
        return self._sequence

    # -- hearing ---------------------------------------------------------------------------------

    def _is_copy(self, message: Message) -> bool:
        """Whether it was heard before, or is so old that nobody remembers."""
        newest, heard = self._heard.get(message.sender, (message.sequence, 0))
        age = newest - message.sequence
        if age >= _COPIES or (age >= 0 and heard >> age & 1):
            return True
        if age < 0:
            newest, heard, age = message.sequence, heard << min(-age, _COPIES), 0
        self._heard[message.sender] = newest, (heard | 1 << age) & _ALL_COPIES
        return False

    def _hear(self, message: Message) -> None:
        if self._is_copy(message):
            return
        match message:
            case Heartbeat():
                self._hear_heartbeat(message)
            case Announce():
                self._hear_announce(message)
            case Bid(sender=sender):
                for target, auctioneer, cost in zip(
                    message.targets, message.auctioneers, message.costs, strict=True
                ):
                    if auctioneer == self._agent and target in self._auctions:
                        self._auctions[target].bids.append((cost, -sender))
            case Award():
                self._hear_award(message)
            case Revoke():
                self._hear_revoke(message)
            case Release(target=target, sender=sender):
                self._told[sender] = max(self._told.get(sender, 0), message.sequence)
                lease = self._leases.get(sender)
                # A heartbeat that was said later may have come before it.
                if lease is not None and lease.target == target and lease.said <= message.time:
                    del self._leases[sender]

    def _hear_heartbeat(self, message: Heartbeat) -> None:
        target, sender, position = message.target, message.sender, message.target_position
        # What the sender said of itself since then, and was heard first, is the news.
        if message.sequence < self._told.get(sender, 0):
            return
        self._told[sender] = message.sequence
        if target is None or position is None:
            lease = self._leases.get(sender)
            # Who says nothing of an award after it was made did not hear it.
            if lease is not None and message.time > lease.said:
                del self._leases[sender]
            return
        self._leases[sender] = _Lease(target, message.cost, message.time)
        self._auctions.pop(target, None)
        own = self._own_name(target, position)
        if self.holding is not None and self.holding.id in (target, own):
            if (message.cost, -sender) > (self._said_cost, -self._agent):
                return  # The other one yields when it hears our heartbeat.
            self.holding = None
        self._rename(own, target)

    def _hear_announce(self, message: Announce) -> None:
        target = message.target
        own = self._own_name(target, message.position)
        holding = self.holding
        # Whatever comes of it, this target needs no second auction before this one is over.
        self._paused[target] = max(self._paused.get(target, 0.0), self._time + self._bid_time)
        if holding is not None and holding.id in (target, own):
            cost = self._cost_of_holding()
            if message.cost + self._config.handover_margin < cost:
                self.holding = None
                self._rename(own, target)
            else:
                self._say(
                    Revoke,
                    target=target,
                    auctioneer=message.sender,
                    held_as=holding.id,
                    position=holding.position,
                    cost=cost,
                )
            return
        if own is not None and own in self._auctions:
            if (own, self._agent) < (target, message.sender):
                return  # The auction of the older name goes on; the other hears of it too.
            del self._auctions[own]
        if own is not None and target < own:
            self._rename(own, target)
        if holding is None:
            cost = shortest_length(
                self._pose.x, self._pose.y, self._pose.heading,
                *message.position, message.course, self._radius,
            )  # fmt: skip
            if cost <= message.cost:
                self._say(Bid, targets=(target,), auctioneers=(message.sender,), costs=(cost,))

    def _hear_award(self, message: Award) -> None:
        target = message.target
        self._auctions.pop(target, None)
        if message.winner != self._agent:
            self._leases[message.winner] = _Lease(target, message.cost, message.time)
        elif self.holding is None:
            self._rename(self._own_name(target, message.position), target)
            self.holding = Holding(target, message.position, self._time)
        elif self.holding.id != target:
            self._say(Release, target=target, position=message.position, lost=False)

    def _hear_revoke(self, message: Revoke) -> None:
        if message.auctioneer == self._agent:
            self._auctions.pop(message.target, None)
            self._leases[message.sender] = _Lease(message.held_as, message.cost, message.time)
            self._rename(message.target, message.held_as)

    # -- own auctions ----------------------------------------------------------------------------

    @property
    def _bid_time(self) -> float:
        return self._config.bid_wait * self._step

    def _open_auctions(self) -> None:
        leases = {lease.target: lease for lease in self._leases.values()}
        for task in list(self._tasks.values()):
            target, lease = task.id, leases.get(task.id)
            if (
                not task.seen
                or target in self._auctions
                or target in self._paused
                or (self.holding is not None and self.holding.id == target)
            ):
                continue
            if lease is not None and (
                self.holding is not None or task.cost + self._config.handover_margin >= lease.cost
            ):
                continue
            self._auctions[target] = _Auction(self._time + self._bid_time)
            self._say(
                Announce,
                target=target,
                position=task.position,
                course=task.course,
                cost=task.cost if self.holding is None else math.inf,
            )

    def _close_auctions(self) -> None:
        for target, auction in list(self._auctions.items()):
            if self._time < auction.closes:
                continue
            del self._auctions[target]
            task = self._tasks.get(target)
            if task is None:
                continue  # The track died meanwhile: there is nothing left to award.
            bids = list(auction.bids)
            if self.holding is None:
                bids.append((task.cost, -self._agent))
            if not bids:
                self._paused[target] = self._time + UNSOLD_PAUSE
                continue
            cost, negative_winner = min(bids)
            winner = -negative_winner
            self._say(Award, target=target, position=task.position, winner=winner, cost=cost)
            if winner == self._agent:
                self.holding = Holding(target, task.position, self._time)
            else:
                self._leases[winner] = _Lease(target, cost, self._time)

    # -- small things ----------------------------------------------------------------------------

    def _follow_holding(self) -> None:
        """Keep the held target's place; a new track that appears there is that target again."""
        if self.holding is None:
            return
        name, position = self.holding.id, self.holding.position
        self._rename(self._own_name(name, position), name)
        if name in self._tasks:
            self.holding = replace(self.holding, position=self._tasks[name].position)

    def _cost_of_holding(self) -> float:
        """Dubins distance to the held target: by its track, else by where it was last known."""
        if self.holding is None:
            return math.inf
        task = self._tasks.get(self.holding.id)
        if task is not None:
            return task.cost
        (x, y), pose = self.holding.position, self._pose
        return math.hypot(x - pose.x, y - pose.y)

    def _own_name(self, target: TrackId, position: Point) -> TrackId | None:
        """The agent's own track of what another calls `target`: of that name, else the nearest."""
        if target in self._tasks:
            return target
        nearest, name = self._config.same_target, None
        for task in self._tasks.values():
            distance = math.dist(task.position, position)
            if distance <= nearest:
                nearest, name = distance, task.id
        return name

    def _rename(self, old: TrackId | None, new: TrackId) -> None:
        if old is None or old == new or new in self._tasks or old not in self._tasks:
            return
        self._tasks[new] = replace(self._tasks.pop(old), id=new)
        self._auctions.pop(old, None)
        if self.holding is not None and self.holding.id == old:
            self.holding = replace(self.holding, id=new)
        self.renames.append((old, new))

    def _say(self, kind: type[Message], **content: Any) -> None:  # noqa: ANN401 - what the kind holds
        self._sequence += 1
        self._out.append(kind(self._agent, self._sequence, self._time, **content))
