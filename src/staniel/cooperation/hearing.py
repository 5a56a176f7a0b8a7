"""What an agent makes of what it hears: leases, names, awards, and who leads."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from staniel.cooperation.ledger import Ledger
from staniel.cooperation.table import Holding, Lease
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import (
    Acknowledge,
    Award,
    Beacon,
    Bid,
    Handover,
    Heartbeat,
    Message,
    Point,
    Release,
    Revoke,
    Unheld,
)

__all__ = ["Hearing"]


class Hearing:
    """The agent as hearer.

    Parameters
    ----------
    ledger : Ledger
        Into which goes what is heard.
    centre : int or None
        Id of the ground station whose awards are orders, where there is one.
    """

    def __init__(self, ledger: Ledger, centre: int | None) -> None:
        self._ledger, self._centre = ledger, centre
        self._told: dict[int, int] = {}
        self._led_at = -math.inf
        self._hearers: dict[type[Message], Callable[[Any], None]] = {
            Heartbeat: self._hear_heartbeat,
            Beacon: self._hear_beacon,
            Bid: self._hear_bid,
            Award: self._hear_award,
            Acknowledge: self._hear_acknowledge,
            Revoke: self._hear_revoke,
            Handover: self._hear_handover,
            Release: self._hear_release,
        }

    @property
    def led(self) -> bool:
        """Whether the ground station shares the targets out: it was heard within a lease."""
        ledger = self._ledger
        return self._centre is not None and ledger.time - self._led_at <= ledger.config.lease

    def hear(self, messages: Sequence[Message]) -> None:
        """Take in what arrived, then the awards to the agent itself, of which it takes the best."""
        hearers = self._hearers
        for message in messages:
            hear = hearers.get(type(message))
            if hear is not None:
                hear(message)
        agent = self._ledger.agent
        self._take([m for m in messages if type(m) is Award and m.winner == agent])

    def _hear_beacon(self, message: Beacon) -> None:
        if message.sender == self._centre:
            self._led_at = max(self._led_at, message.time)

    def _hear_bid(self, message: Bid) -> None:
        self._ledger.bids.append((self._ledger.time, message))

    def _hear_acknowledge(self, message: Acknowledge) -> None:
        self._settle(message.target, message.sender)

    def _hear_handover(self, message: Handover) -> None:
        auctions = self._ledger.auctions
        self._ledger.elsewhere.pop(message.target, None)
        if message.auctioneer == self._ledger.agent and message.target in auctions:
            auctions[message.target].holder = message.sender
            self._lease(message, message.held_as, message.cost)

    def _hear_heartbeat(self, message: Heartbeat) -> None:
        ledger = self._ledger
        sender = message.sender
        # What the sender said of itself since then, and was heard first, is the news.
        if message.sequence < self._told.get(sender, 0):
            return
        self._told[sender] = message.sequence
        ledger.beats[sender] = message
        if message.unheld:
            self._correct(ledger.unheld.hear(message.unheld, ledger.time))
        target, position = message.target, message.target_position
        if target is None or position is None:
            lease = ledger.leases.get(sender)
            # Who says nothing of an award after it was made did not hear it.
            if lease is not None and message.time > lease.said:
                del ledger.leases[sender]
            return
        self._lease(message, target, message.cost)
        place = _moved(message, position, ledger.time)
        ledger.uncross(target, place)
        own = ledger.own_name(target, place)
        self._settle(target, sender)
        if ledger.holding is not None and ledger.holding.id in (target, own):
            if not self._yields(message, ledger.holding):
                return  # The other one does when it hears our heartbeat.
            ledger.holding = None
        ledger.rename(own, target)

    def _yields(self, message: Heartbeat, holding: Holding) -> bool:
        """Whether the agent leaves its target to another one that says it holds it, too."""
        ledger = self._ledger
        if message.time < max(holding.since, ledger.time - ledger.config.lease):
            return False
        # Both compare the same two words: of the lower number the last until one of the higher, and
        # of the higher the next after that, which may be this step's. Where they speak at the same
        # instants these are of one, and never do both yield; else they may, while costs cross.
        if ledger.agent < message.sender:
            before = [(t, cost) for t, cost in ledger.said.items() if t <= message.time]
            mine = max(before)[1] if before else -math.inf
        else:
            later = [(t, cost) for t, cost in ledger.said.items() if t >= message.time]
            mine = min(later)[1] if later else ledger.cost
        return (message.cost, -message.sender) <= (mine, -ledger.agent)

    def _correct(self, wrong: list[Unheld]) -> None:
        """Tell who still counts a target as unheld that was looked for, or is known otherwise."""
        ledger = self._ledger
        for unheld in wrong:
            if unheld.target not in ledger.paused:
                ledger.paused[unheld.target] = ledger.time + 2.0 * ledger.bid_time
                ledger.say(
                    Release,
                    target=unheld.target,
                    position=unheld.position,
                    lost=True,
                    seen=unheld.seen,
                )

    def _hear_award(self, message: Award) -> None:
        ledger, target, winner = self._ledger, message.target, message.winner
        ledger.elsewhere.pop(target, None)
        if winner == ledger.agent:
            return  # See `_take`.
        auction = ledger.auctions.get(target)
        if auction is not None and auction.award is None and message.sender not in (
            winner, self._centre
        ):  # fmt: skip
            # Awarded by who settled it with others: to be said again until the winner answers.
            auction.award, auction.tries = replace(message, sender=ledger.agent), 1
            auction.closes = message.time + ledger.bid_time
        else:
            ledger.auctions.pop(target, None)
        self._lease(message, target, message.cost, winner)
        if message.sender == self._centre and ledger.holding is not None:
            own = ledger.own_name(target, message.position)
            if ledger.holding.id in (target, own):
                ledger.holding = None

    def _take(self, awards: list[Award]) -> None:
        """Take the best of what was awarded, acknowledge it and decline the rest."""
        ledger, wanted = self._ledger, None
        for award in sorted(awards, key=lambda award: (award.cost, award.target)):
            ordered = award.sender == self._centre
            held = ledger.holding is not None and ledger.holding.id == award.target
            if held or (wanted is None and (ordered or ledger.free) and self._may_take):
                if not held:
                    ledger.rename(ledger.own_name(award.target, award.position), award.target)
                    if ledger.holding is not None and ledger.holding.id != award.target:
                        ledger.let_go()
                    ledger.hold(award.target, award.position)
                ledger.auctions.pop(award.target, None)
                wanted = award.target
                ledger.say(Acknowledge, target=award.target, auctioneer=award.sender)
            else:
                ledger.say(Release, target=award.target, position=award.position, lost=False)

    @property
    def _may_take(self) -> bool:
        return self._ledger.health != "blind" and not self._ledger.patrolling

    def _hear_revoke(self, message: Revoke) -> None:
        ledger = self._ledger
        ledger.elsewhere.pop(message.target, None)
        if message.auctioneer == ledger.agent:
            ledger.auctions.pop(message.target, None)
            self._lease(message, message.held_as, message.cost)
            ledger.rename(message.target, message.held_as)

    def _hear_release(self, message: Release) -> None:
        ledger, target, sender = self._ledger, message.target, message.sender
        self._told[sender] = max(self._told.get(sender, 0), message.sequence)
        lease = ledger.leases.get(sender)
        # A heartbeat that was said later may have come before it.
        if lease is not None and lease.target == target and lease.said <= message.time:
            del ledger.leases[sender]
        ledger.unheld.hear_release(message, ledger.time)
        auction = ledger.auctions.get(target)
        if auction is not None and auction.award is not None and auction.award.winner == sender:
            # It was awarded something better: to the next.
            auction.declined.add(sender)
            auction.award, auction.closes, auction.tries = None, ledger.time, 0

    def _settle(self, target: TrackId, holder: int) -> None:
        """Somebody says that he holds a target: an own auction of it is over.

        But for the one that is to take the target from him.
        """
        auction = self._ledger.auctions.get(target)
        if auction is not None and auction.holder != holder:
            del self._ledger.auctions[target]

    def _lease(
        self, message: Message, target: TrackId, cost: float, holder: int | None = None
    ) -> None:
        ledger, said = self._ledger, message.time
        holder = message.sender if holder is None else holder
        known = ledger.leases.get(holder)
        if known is None or known.said <= said:
            ledger.leases[holder] = Lease(target, cost, said)
            ledger.unheld.drop(target)


def _moved(message: Heartbeat, position: Point, time: float) -> Point:
    """Where the target of a heartbeat is by now, if it kept its velocity."""
    (x, y), (vx, vy), late = position, message.target_velocity, time - message.time
    return x + vx * late, y + vy * late
