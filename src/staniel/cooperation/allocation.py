"""Who watches what: one agent's side of the auctions, by messages that may be lost (thesis 7.2.1).

announce → bid → award → acknowledge, and heartbeats that renew it: docs/cooperation.md has the
state chart and the table of messages. An agent holds at most one target. What it knows of the
others it heard: who holds what is a table of leases that heartbeats renew and silence ends.

=============  ==============================================================================
who            does
=============  ==============================================================================
finder         announces a target that it sees and that nobody is known to hold
free agent     bids; announces targets that others know and nobody holds, itself
auctioneer     awards to the lowest bid, ties to the higher id, or by the best assignment of
               all open auctions; says it again until the winner acknowledges it
holder         revokes an auction of its own target, unless the announced cost undercuts its own
               by the hand-over margin: then it holds it until somebody else says he does
two holders    the one whose cost, both as of the same instant, is higher yields
two names      a holder's name for a target rules; before that, the older one
unfit agent    bids for nothing; a weak one has its target auctioned, a blind one lets go of it
=============  ==============================================================================
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from staniel.cooperation.awarding import best_for_all, lowest, offers_of
from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.cost import Goal, Price
from staniel.cooperation.table import Holding, Lease, Task, UnheldTable
from staniel.cooperation.trails import Trails
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.command import Command
from staniel.datatypes.message import (
    Acknowledge,
    Announce,
    Award,
    Beacon,
    Bid,
    Handover,
    Heartbeat,
    Message,
    Offer,
    Point,
    Release,
    Revoke,
    Unheld,
)

__all__ = ["BIDS_TOLD", "Allocation"]

UNSOLD_PAUSE = 10.0
"""A busy agent repeats an auction without a bidder after this long [s]."""

BIDS_TOLD = 8
"""Bids that an award tells of at most: the winner's and the lowest."""


@dataclass(slots=True)
class _Auction:
    """An auction that the agent itself opened; once awarded it waits for the winner's word."""

    goal: Goal
    price: Price  # the agent's own
    closes: float
    holder: int | None = None  # who held the target when it was opened
    declined: set[int] = field(default_factory=set)
    award: Award | None = None
    tries: int = 0


class Allocation:
    """One agent's part in sharing out the targets.

    Parameters
    ----------
    agent : int
        Its id.
    config : CooperationConfig
    step : float [s]
        The decision step.
    centre : int, optional
        Id of the ground station whose awards are orders, where there is one. While it is silent for
        longer than a lease the agents auction by themselves.

    Attributes
    ----------
    holding : Holding or None
        The target to pursue.
    renames : list of (TrackId, TrackId)
        Old and new names that the agent's tracker is to take over, of the last step.
    """

    def __init__(
        self, agent: int, config: CooperationConfig, *, step: float, centre: int | None = None
    ) -> None:
        self.holding: Holding | None = None
        self.renames: list[tuple[TrackId, TrackId]] = []
        self._agent, self._config, self._centre = agent, config, centre
        self._bid_time = config.bid_wait * step
        self._leases: dict[int, Lease] = {}
        self._auctions: dict[TrackId, _Auction] = {}
        self._elsewhere: dict[TrackId, tuple[Announce, float]] = {}
        self._bids: list[tuple[float, Bid]] = []
        self._paused: dict[TrackId, float] = {}
        self._unheld = UnheldTable(config.unheld_memory)
        self._trails = Trails(config.unheld_memory, config.same_target)
        self._told: dict[int, int] = {}
        self._beats: dict[int, Heartbeat] = {}
        self._said: dict[float, float] = {}
        self._sequence = 0
        self._tasks: dict[TrackId, Task] = {}
        self._health, self._led_at = "healthy", -math.inf
        self._out: list[Message] = []
        self._time = -math.inf
        self._pose = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(
        self,
        time: float,
        pose: Pose,
        tasks: Iterable[Task],
        inbox: Iterable[Message],
        prices: Callable[[Sequence[Goal]], list[Price]],
        *,
        health: str = "healthy",
        alone: bool = False,
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
            What arrived since the last call, no message twice.
        prices : callable
            What targets of others would cost the agent, as `CostModel.prices`.
        health : {"healthy", "blind", "weak"}
            The agent's own.
        alone : bool
            It does not cooperate: it follows the nearest target that it sees, and says nothing.

        Returns
        -------
        list of Message
            To be broadcast.
        """
        self._time, self._pose, self._out, self.renames = time, pose, [], []
        self._health, self._tasks = health, {task.id: task for task in tasks}
        self._forget()
        if alone:
            self._hold_nearest()
            return []
        heard = list(inbox)
        for message in heard:
            self._hear(message)
        self._take([m for m in heard if isinstance(m, Award) and m.winner == self._agent])
        self._follow_holding()
        if not self._led:
            self._bid([m for m in heard if isinstance(m, Announce)], prices)
            self._tend_auctions()
            self._note_unheld()
            self._open_auctions(prices)
            self._relieve_or_revisit(prices)
        elif self._unfit == "blind" and self.holding is not None:
            self._let_go()
        return self._out

    @property
    def held(self) -> set[TrackId]:
        """Names of the targets that somebody is known to hold, or that are up for auction."""
        names = {lease.target for lease in self._leases.values()} | set(self._auctions)
        return names if self.holding is None else names | {self.holding.id}

    @property
    def unheld(self) -> list[Unheld]:
        """Targets that nobody is known to hold, the longest unseen first."""
        return self._unheld.all

    @property
    def cost(self) -> float:
        """Of the held target [m]; infinite without one, or where another is to take it."""
        if self.holding is None or self._health != "healthy":
            return math.inf
        task = self._tasks.get(self.holding.id)
        if task is not None:
            return task.cost
        return math.dist(self.holding.position, (self._pose.x, self._pose.y))

    def heartbeat(
        self,
        role: str,
        goal: Point,
        helps: TrackId | None = None,
        command: Command | None = None,
        helpers: tuple[int, ...] = (),
    ) -> Heartbeat:
        """The message that tells the others where the agent is and renews its lease."""
        holding = self.holding
        task = None if holding is None else self._tasks.get(holding.id)
        self._sequence += 1
        self._said[self._time] = self.cost
        return Heartbeat(
            self._agent,
            self._sequence,
            self._time,
            pose=self._pose,
            role=role,
            goal=goal,
            target=None if holding is None else holding.id,
            target_position=None if holding is None else holding.position,
            cost=self.cost,
            helps=helps,
            command=command,
            target_velocity=(0.0, 0.0) if task is None else task.velocity,
            helpers=helpers,
            health=self._health,
            unheld=self._unheld.told,
        )

    def give_up(self) -> Release:
        """Let go of the held target because it is lost; the message says so."""
        if self.holding is None:
            raise ValueError("give_up: the agent holds no target")
        holding, self.holding = self.holding, None
        self._unheld.bury(holding.id, self._time)
        self._sequence += 1
        return Release(
            self._agent,
            self._sequence,
            self._time,
            target=holding.id,
            position=holding.position,
            lost=True,
            seen=holding.seen,
        )

    def next_sequence(self) -> int:
        """Number for a message that the agent says outside of auctions."""
        self._sequence += 1
        return self._sequence

    # -- hearing ---------------------------------------------------------------------------------

    def _hear(self, message: Message) -> None:
        match message:
            case Heartbeat():
                self._hear_heartbeat(message)
            case Beacon() if message.sender == self._centre:
                self._led_at = message.time
            case Bid():
                self._bids.append((self._time, message))
            case Award():
                self._hear_award(message)
            case Acknowledge(target=target, sender=sender):
                self._settle(target, sender)
            case Revoke():
                self._hear_revoke(message)
            case Handover():
                if message.auctioneer == self._agent and message.target in self._auctions:
                    self._auctions[message.target].holder = message.sender
                    self._lease(message, message.held_as, message.cost)
            case Release():
                self._hear_release(message)

    def _hear_heartbeat(self, message: Heartbeat) -> None:
        target, sender, position = message.target, message.sender, message.target_position
        # What the sender said of itself since then, and was heard first, is the news.
        if message.sequence < self._told.get(sender, 0):
            return
        self._told[sender] = message.sequence
        self._beats[sender] = message
        if message.unheld:
            self._correct(self._unheld.hear(message.unheld, self._time))
        if target is None or position is None:
            lease = self._leases.get(sender)
            # Who says nothing of an award after it was made did not hear it.
            if lease is not None and message.time > lease.said:
                del self._leases[sender]
            return
        self._lease(message, target, message.cost)
        place = _moved(message, position, self._time)
        self._uncross(target, place)
        own = self._own_name(target, place)
        self._settle(target, sender)
        if self.holding is not None and self.holding.id in (target, own):
            # Both as of the same instant: never do both yield.
            mine = self._said.get(message.time, -math.inf)
            if message.time < self.holding.since or (message.cost, -sender) > (mine, -self._agent):
                return  # The other one yields when it hears our heartbeat.
            self.holding = None
        self._rename(own, target)

    def _correct(self, wrong: list[Unheld]) -> None:
        """Tell who still counts a target as unheld that was looked for, or is known otherwise."""
        for unheld in wrong:
            if unheld.target not in self._paused:
                self._paused[unheld.target] = self._time + 2.0 * self._bid_time
                self._say(
                    Release,
                    target=unheld.target,
                    position=unheld.position,
                    lost=True,
                    seen=unheld.seen,
                )

    def _hear_award(self, message: Award) -> None:
        target, winner = message.target, message.winner
        if winner == self._agent:
            return  # See `_take`.
        self._auctions.pop(target, None)
        self._lease(message, target, message.cost, winner)
        if message.sender == self._centre and self.holding is not None:
            own = self._own_name(target, message.position)
            if self.holding.id in (target, own):
                self.holding = None

    def _take(self, awards: list[Award]) -> None:
        """Take the best of what was awarded, acknowledge it and decline the rest."""
        wanted = None
        for award in sorted(awards, key=lambda award: (award.cost, award.target)):
            ordered = award.sender == self._centre
            held = self.holding is not None and self.holding.id == award.target
            if held or (wanted is None and (ordered or self._free) and self._unfit != "blind"):
                if not held:
                    self._rename(self._own_name(award.target, award.position), award.target)
                    if self.holding is not None and self.holding.id != award.target:
                        self._let_go()
                    self._hold(award.target, award.position)
                wanted = award.target
                self._say(Acknowledge, target=award.target, auctioneer=award.sender)
            else:
                self._say(Release, target=award.target, position=award.position, lost=False)

    def _hear_revoke(self, message: Revoke) -> None:
        if message.auctioneer == self._agent:
            self._auctions.pop(message.target, None)
            self._lease(message, message.held_as, message.cost)
            self._rename(message.target, message.held_as)

    def _hear_release(self, message: Release) -> None:
        target, sender = message.target, message.sender
        self._told[sender] = max(self._told.get(sender, 0), message.sequence)
        lease = self._leases.get(sender)
        # A heartbeat that was said later may have come before it.
        if lease is not None and lease.target == target and lease.said <= message.time:
            del self._leases[sender]
        self._unheld.hear_release(message, self._time)
        auction = self._auctions.get(target)
        if auction is not None and auction.award is not None and auction.award.winner == sender:
            # It was awarded something better: to the next.
            auction.declined.add(sender)
            auction.award, auction.closes, auction.tries = None, self._time, 0

    def _settle(self, target: TrackId, holder: int) -> None:
        """Somebody says that he holds a target: an own auction of it is over.

        But for the one that is to take the target from him.
        """
        auction = self._auctions.get(target)
        if auction is not None and auction.holder != holder:
            del self._auctions[target]

    def _lease(
        self, message: Message, target: TrackId, cost: float, holder: int | None = None
    ) -> None:
        holder = message.sender if holder is None else holder
        known = self._leases.get(holder)
        if known is None or known.said <= message.time:
            self._leases[holder] = Lease(target, cost, message.time)
            self._unheld.drop((target,))

    # -- bids ------------------------------------------------------------------------------------

    def _bid(
        self, announced: list[Announce], prices: Callable[[Sequence[Goal]], list[Price]]
    ) -> None:
        """Answer the auctions of others: revoke, consent, or bid."""
        announced.sort(key=lambda message: (message.target, message.sender))
        wanted: list[Announce] = []
        for message in _first_names(announced, self._config.same_target):
            if self._is_for_bids(message):
                wanted.append(message)
                self._elsewhere[message.target] = message, self._time + self._bid_time
        if not wanted or not self._free or self._unfit:
            return
        offers = []
        goals = [Goal(m.position, m.course, m.speed) for m in wanted]
        for message, price in zip(wanted, prices(goals), strict=True):
            price = self._with_handover(price, message.target)
            if self._config.award == "joint" or price.cost <= message.cost:
                offers.append((message.target, message.sender, price))
        if offers and self._config.award == "joint":
            offers += [
                (name, self._agent, Price(task.cost, task.terms))
                for name, auction in self._auctions.items()
                if auction.award is None and (task := self._tasks.get(name)) is not None
            ]
            offers.sort(key=lambda offer: offer[:2])
        if offers:
            targets, auctioneers, costs = zip(*offers, strict=True)
            self._say(
                Bid,
                targets=targets,
                auctioneers=auctioneers,
                costs=tuple(price.cost for price in costs),
                terms=tuple(p.terms for p in costs) if any(p.terms for p in costs) else (),
            )
            self._bids.append((self._time, self._out[-1]))  # type: ignore[arg-type]

    def _is_for_bids(self, message: Announce) -> bool:
        """Whether another's auction stands, for all that the agent knows."""
        target = message.target
        own = self._own_name(target, message.position)
        holding = self.holding
        # Whatever comes of it, this target needs no second auction before this one is over.
        until = self._time + 2.0 * self._bid_time
        self._paused[target] = max(self._paused.get(target, 0.0), until)
        if holding is not None and holding.id in (target, own):
            stands = message.cost + self._config.handover_margin < self.cost
            self._say(
                Handover if stands else Revoke,
                target=target,
                auctioneer=message.sender,
                held_as=holding.id,
                position=holding.position,
                cost=self.cost,
            )
            return False
        if own is not None and own in self._auctions:
            if (own, self._agent) < (target, message.sender):
                return False  # The auction of the older name goes on; the other hears of it too.
            del self._auctions[own]
        if own is not None and target < own:
            self._rename(own, target)
        return True

    def _with_handover(self, price: Price, target: TrackId) -> Price:
        """The price of a target that another holds is higher by the hand-over margin."""
        margin = self._config.handover_margin
        if all(lease.target != target for lease in self._leases.values()):
            return price
        terms = list(price.terms)
        if terms:
            terms[6] = margin
        return Price(price.cost + margin, tuple(terms))

    # -- own auctions ----------------------------------------------------------------------------

    def _open_auctions(self, prices: Callable[[Sequence[Goal]], list[Price]]) -> None:
        holders = {lease.target: k for k, lease in self._leases.items()}
        able = self._free and not self._unfit
        margin = self._config.handover_margin
        for task in list(self._tasks.values()):
            if not task.seen or self._is_busy_with(task.id):
                continue
            holder = holders.get(task.id)
            if holder is None or (able and task.cost + margin < self._leases[holder].cost):
                self._open(task.id, _goal(task), Price(task.cost, task.terms), holder)
        if able and not any(auction.award is None for auction in self._auctions.values()):
            self._open_for_others(prices)

    def _open_for_others(self, prices: Callable[[Sequence[Goal]], list[Price]]) -> None:
        """A free agent auctions the best target that others knew and nobody holds.

        Whoever sees it has had the time to do so by then.
        """
        patience = 2.0 * self._bid_time
        due = [
            unheld
            for unheld in self._unheld.all
            if self._time - self._unheld.since(unheld.target) > patience
            and not self._is_busy_with(unheld.target)
        ]
        goals = [Goal(unheld.position, unheld.course) for unheld in due]
        if due:
            price, k = min((price, k) for k, price in enumerate(prices(goals)))
            self._open(due[k].target, goals[k], price)

    def _is_busy_with(self, target: TrackId) -> bool:
        return (
            target in self._auctions
            or target in self._paused
            or (self.holding is not None and self.holding.id == target)
        )

    def _open(self, target: TrackId, goal: Goal, price: Price, holder: int | None = None) -> None:
        self._auctions[target] = _Auction(goal, price, self._time + self._bid_time, holder)
        self._say(
            Announce,
            target=target,
            position=goal.position,
            course=goal.course,
            cost=price.cost if self._free and not self._unfit else math.inf,
            speed=goal.speed,
        )

    def _tend_auctions(self) -> None:
        for target, auction in list(self._auctions.items()):
            if self._time < auction.closes or target not in self._auctions:
                continue
            if auction.award is None:
                self._close(target, auction)
            elif auction.tries < self._config.award_tries:
                self._repeat(auction)
            else:
                # Whoever won it does not answer: as if it had never been awarded.
                self._leases.pop(auction.award.winner, None)
                del self._auctions[target]

    def _close(self, target: TrackId, auction: _Auction) -> None:
        """Award it, if anybody wants it."""
        task, position = self._tasks.get(target), auction.goal.position
        busy = set(self._leases) | auction.declined
        bids = [bid for _, bid in self._bids if bid.sender not in busy]
        offers = offers_of(target, bids)
        offers.pop(self._agent, None)
        if self._free and not self._unfit:
            own = auction.price if task is None else Price(task.cost, task.terms)
            offers[self._agent] = Offer(self._agent, *own)
        holder = None if auction.holder is None else self._leases.get(auction.holder)
        if holder is not None:
            limit = holder.cost - self._config.handover_margin
            offers = {k: offer for k, offer in offers.items() if offer.cost < limit}
        winner = lowest(offers) if self._config.award == "lowest" else self._joint(
            target, offers, bids
        )  # fmt: skip
        if winner is None:
            del self._auctions[target]
            free = any(b.target is None and b.health == "healthy" for b in self._beats.values())
            self._paused[target] = self._time + (2.0 * self._bid_time if free else UNSOLD_PAUSE)
            return
        told = sorted(
            offers.values(), key=lambda offer: (offer != winner, offer.cost, -offer.bidder)
        )[:BIDS_TOLD]
        self._say(
            Award,
            target=target,
            position=position if task is None else task.position,
            winner=winner.bidder,
            cost=winner.cost,
            bids=tuple(told),
        )
        award = self._out[-1]
        assert isinstance(award, Award)
        if winner.bidder == self._agent:
            del self._auctions[target]
            if self.holding is not None:
                self._let_go()
            self._hold(target, award.position)
        else:
            auction.award, auction.tries = award, 1
            auction.closes = self._time + self._bid_time
            self._leases[winner.bidder] = Lease(target, winner.cost, self._time)
            self._unheld.drop((target,))

    def _joint(self, target: TrackId, offers: dict[int, Offer], bids: list[Bid]) -> Offer | None:
        able = self._free and not self._unfit
        own = {
            name: Offer(self._agent, task.cost, task.terms)
            for name, auction in self._auctions.items()
            if able and auction.award is None and (task := self._tasks.get(name)) is not None
        }
        if self._agent in offers:
            own[target] = offers[self._agent]
        for name, (said, _) in self._elsewhere.items():
            if math.isfinite(said.cost) and said.sender not in self._leases:
                own[name] = Offer(said.sender, said.cost)
        auctions = {name for name, other in self._auctions.items() if other.award is None}
        return best_for_all(target, offers, (auctions | set(self._elsewhere)) - {target}, bids, own)

    def _repeat(self, auction: _Auction) -> None:
        award = auction.award
        assert award is not None
        self._sequence += 1
        self._out.append(replace(award, sequence=self._sequence, time=self._time))
        auction.tries += 1
        auction.closes = self._time + self._bid_time
        self._leases[award.winner] = Lease(award.target, award.cost, self._time)

    # -- unfit, or more targets than aircraft ----------------------------------------------------

    def _relieve_or_revisit(self, prices: Callable[[Sequence[Goal]], list[Price]]) -> None:
        """Have another take the target, or leave it for one that was out of sight for longer."""
        holding = self.holding
        if holding is None:
            return
        if self._unfit == "blind":
            self._let_go()
        elif self._unfit == "weak":
            if holding.id not in self._auctions and holding.id not in self._paused:
                task = self._tasks.get(holding.id)
                goal = Goal(holding.position, 0.0) if task is None else _goal(task)
                self._open(holding.id, goal, Price(math.inf))
        elif self._config.revisit_after and self._time - holding.since >= (
            self._config.revisit_dwell
        ):
            self._revisit(prices)

    def _revisit(self, prices: Callable[[Sequence[Goal]], list[Price]]) -> None:
        """Leave a target in sight for the one that was out of sight longest, if nobody is nearer.

        The one that is left is unheld then, and in its turn the longest unseen some day.
        """
        assert self.holding is not None
        task = self._tasks.get(self.holding.id)
        if task is None or self._time - task.last_seen > 2.0 * self._bid_time:
            return
        healthy = [beat for beat in self._beats.values() if beat.health == "healthy"]
        if any(beat.target is None for beat in healthy):
            return  # Somebody is free.
        for unheld in self._unheld.all:
            if self._time - unheld.seen < self._config.revisit_after:
                return
            own = math.dist(unheld.position, (self._pose.x, self._pose.y))
            ways = [math.dist(unheld.position, (b.pose.x, b.pose.y)) for b in healthy]
            if self._is_busy_with(unheld.target) or any(way < own for way in ways):
                continue
            (price,) = prices([Goal(unheld.position, unheld.course)])
            self._let_go()
            offer = Offer(self._agent, *price)
            self._say(
                Award,
                target=unheld.target,
                position=unheld.position,
                winner=self._agent,
                cost=price.cost,
                bids=(offer,),
            )
            self._hold(unheld.target, unheld.position)
            return

    def _hold_nearest(self) -> None:
        """What an agent does that does not cooperate: the nearest target that it sees itself."""
        self._leases, self._auctions = {}, {}
        if self.holding is not None and self.holding.id in self._tasks:
            self._follow_holding()
            return
        seen = [task for task in self._tasks.values() if task.seen]
        if seen:
            task = min(seen, key=lambda task: (task.cost, task.id))
            self._hold(task.id, task.position)

    # -- small things ----------------------------------------------------------------------------

    @property
    def _led(self) -> bool:
        return self._centre is not None and self._time - self._led_at <= self._config.lease

    @property
    def _unfit(self) -> str:
        return "" if self._health == "healthy" else self._health

    @property
    def _free(self) -> bool:
        """Whether it can take a target: also while it only looks for one where it lost it."""
        return self.holding is None or self.holding.id not in self._tasks

    def _forget(self) -> None:
        """Drop what is too old to count."""
        time, lease = self._time, self._config.lease
        self._leases = {k: v for k, v in self._leases.items() if time - v.said <= lease}
        self._beats = {k: v for k, v in self._beats.items() if time - v.time <= lease}
        self._said = {k: v for k, v in self._said.items() if time - k <= lease}
        self._paused = {k: v for k, v in self._paused.items() if v > time}
        self._elsewhere = {k: v for k, v in self._elsewhere.items() if v[1] >= time}
        window = 2.0 * self._bid_time
        self._bids = [(heard, bid) for heard, bid in self._bids if time - heard <= window]
        self._unheld.forget(time)

    def _note_unheld(self) -> None:
        taken = self.held
        for task in self._tasks.values():
            if task.id not in taken:
                self._unheld.note(
                    Unheld(task.id, task.position, task.course, task.last_seen), self._time
                )
        self._unheld.drop(taken - set(self._auctions))
        # What goes by another name by now is not without a holder, or is told under that name.
        self._trails.note(self._time, self._tasks.values())
        speeds = {task.id: math.hypot(*task.velocity) for task in self._tasks.values()}
        for unheld in self._unheld.all:
            if unheld.target not in self._tasks and self._trails.explains(unheld, speeds):
                self._unheld.bury(unheld.target, self._time)

    def _hold(self, target: TrackId, position: Point) -> None:
        task = self._tasks.get(target)
        seen = self._unheld.seen(target, self._time) if task is None else task.last_seen
        self.holding = Holding(target, position, self._time, seen)
        self._unheld.drop((target,))

    def _let_go(self) -> None:
        """Leave the held target to others, and say so."""
        assert self.holding is not None
        holding, self.holding = self.holding, None
        self._say(
            Release, target=holding.id, position=holding.position, lost=False, seen=holding.seen
        )
        self._unheld.note(Unheld(holding.id, holding.position, 0.0, holding.seen), self._time)

    def _follow_holding(self) -> None:
        """Keep the held target's place; a new track that appears there is that target again."""
        if self.holding is None:
            return
        name, position = self.holding.id, self.holding.position
        self._rename(self._own_name(name, position), name)
        if name in self._tasks:
            task = self._tasks[name]
            self.holding = replace(self.holding, position=task.position, seen=task.last_seen)

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

    def _uncross(self, target: TrackId, position: Point) -> None:
        """Exchange two names that a holder uses the other way round: its names rule."""
        task, near = self._tasks.get(target), self._config.same_target / 2.0
        if task is None or math.dist(task.position, position) <= near:
            return
        others = [other for other in self._tasks.values() if other.id != target]
        nearest = min(others, key=lambda o: math.dist(o.position, position), default=None)
        if nearest is None or math.dist(nearest.position, position) > near:
            return
        other, held = nearest.id, None if self.holding is None else self.holding.id
        aside = TrackId(self._time, self._agent, 2**31 + self._sequence % 2**31)
        self.renames += [(target, aside), (other, target), (aside, other)]
        self._tasks[target] = replace(nearest, id=target)
        self._tasks[other] = replace(task, id=other)
        if self.holding is not None and held in (target, other):
            self.holding = replace(self.holding, id=other if held == target else target)

    def _rename(self, old: TrackId | None, new: TrackId) -> None:
        if old is None or old == new or new in self._tasks or old not in self._tasks:
            return
        self._tasks[new] = replace(self._tasks.pop(old), id=new)
        self._auctions.pop(old, None)
        self._unheld.bury(old, self._time)
        self._trails.rename(old, new)
        if self.holding is not None and self.holding.id == old:
            self.holding = replace(self.holding, id=new)
        self.renames.append((old, new))

    def _say(self, kind: type[Message], **content: Any) -> None:  # noqa: ANN401 - what the kind holds
        self._sequence += 1
        self._out.append(kind(self._agent, self._sequence, self._time, **content))


def _first_names(announced: list[Announce], near: float) -> list[Announce]:
    """Without those at whose place another one is announced under an older name."""
    if len(announced) < 2:
        return announced
    places = np.array([message.position for message in announced])
    apart = places[:, None, :] - places
    again = np.tril((apart * apart).sum(axis=2) <= near * near, -1).any(axis=1).tolist()
    return [message for message, twice in zip(announced, again, strict=True) if not twice]


def _goal(task: Task) -> Goal:
    return Goal(task.position, task.course, math.hypot(*task.velocity))


def _moved(message: Heartbeat, position: Point, time: float) -> Point:
    """Where the target of a heartbeat is by now, if it kept its velocity."""
    (x, y), (vx, vy), late = position, message.target_velocity, time - message.time
    return x + vx * late, y + vy * late
