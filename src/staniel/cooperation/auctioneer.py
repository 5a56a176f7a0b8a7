"""An agent's own auctions: it opens them, awards them, and says so until the winner answers."""

import math
from collections.abc import Collection
from dataclasses import replace

from staniel.cooperation.awarding import Offers, best_for_all, lowest, offers_of
from staniel.cooperation.cost import Goal, Price, Prices
from staniel.cooperation.ledger import Ledger
from staniel.cooperation.table import Auction, Lease
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Announce, Award, Offer, Point

__all__ = ["BIDS_TOLD", "Auctioneer"]

UNSOLD_PAUSE = 10.0
"""A busy agent repeats an auction without a bidder after this long [s]."""

BIDS_TOLD = 8
"""Bids that an award tells of at most: the winner's and the lowest."""


class Auctioneer:
    """The agent in its own auctions.

    Parameters
    ----------
    ledger : Ledger
    """

    def __init__(self, ledger: Ledger) -> None:
        self._ledger = ledger

    # -- opening ---------------------------------------------------------------------------------

    def open(self, target: TrackId, goal: Goal, price: Price, holder: int | None = None) -> None:
        """Announce a target.

        Parameters
        ----------
        target : TrackId
        goal : Goal
        price : Price
            The agent's own, which it tells only where it could take the target itself.
        holder : int, optional
            Who is to hand it over.
        """
        ledger = self._ledger
        ledger.auctions[target] = Auction(goal, price, ledger.time + ledger.bid_time, holder)
        ledger.say(
            Announce,
            target=target,
            position=goal.position,
            course=goal.course,
            cost=price.cost if ledger.able else math.inf,
            speed=goal.speed,
        )

    def open_due(self, prices: Prices) -> None:
        """Announce what the agent sees and nobody holds, or it would do for much less.

        Parameters
        ----------
        prices : callable
        """
        ledger = self._ledger
        holders = {lease.target: k for k, lease in ledger.leases.items()}
        able, margin = ledger.able, ledger.config.handover_margin
        for task in list(ledger.tasks.values()):
            if not task.seen or ledger.is_busy_with(task.id):
                continue
            holder = holders.get(task.id)
            if holder is None or (able and task.cost + margin < ledger.leases[holder].cost):
                self.open(task.id, task.goal, task.price, holder)
        if able and not any(auction.award is None for auction in ledger.auctions.values()):
            self._open_for_others(prices)

    def _open_for_others(self, prices: Prices) -> None:
        """A free agent auctions the best target that others knew and nobody holds.

        Whoever sees it has had the time to do so by then.
        """
        ledger = self._ledger
        patience = 2.0 * ledger.bid_time
        due = [
            unheld
            for unheld in ledger.unheld.all
            if ledger.time - ledger.unheld.since(unheld.target) > patience
            and not ledger.is_busy_with(unheld.target)
        ]
        goals = [Goal(unheld.position, unheld.course) for unheld in due]
        if due:
            price, k = min((price, k) for k, price in enumerate(prices(goals)))
            self.open(due[k].target, goals[k], price)

    # -- awarding --------------------------------------------------------------------------------

    def tend(self) -> None:
        """Go on with the auctions whose time is up: award, say the award again, or end them."""
        ledger, due = self._ledger, []
        for target, auction in list(ledger.auctions.items()):
            if ledger.time < auction.closes:
                continue
            if auction.award is None:
                due.append(target)
            elif auction.tries < ledger.config.award_tries:
                self._repeat(auction, auction.award)
            else:
                # Whoever won it does not answer: as if it had never been awarded.
                ledger.leases.pop(auction.award.winner, None)
                del ledger.auctions[target]
        if due and ledger.config.award == "lowest":
            for target in due:
                offers = self._offers((target,))[target]
                self._close(target, lowest(offers), offers)
        elif due:
            self._close_jointly(due)

    def _close_jointly(self, due: list[TrackId]) -> None:
        """Settle all open auctions at once: for all as the leader, or for who has none.

        Where several auctions end together the auctioneer of the highest id settles them all. So
        one table counts, and a bid that did not reach everybody makes no difference. The others
        wait for its word, half as long as for bids, and then award what it did not.
        """
        ledger = self._ledger
        others = self._others_due()
        lead = max((message.sender for message in others.values()), default=-1)
        if ledger.agent < lead:
            late = ledger.time - 0.5 * ledger.bid_time
            due = [k for k in due if self._has_holder(k) or ledger.auctions[k].closes <= late]
        if not due:
            return
        open_ = [name for name, auction in ledger.auctions.items() if auction.award is None]
        offers = self._offers((*open_, *ledger.elsewhere))
        winners = best_for_all(offers)
        for target in due:
            self._close(target, winners.get(target), offers[target])
        if ledger.agent > lead:
            for target, message in others.items():
                if target in winners:
                    self._close_for_other(message, winners[target], offers[target])

    def _others_due(self) -> dict[TrackId, Announce]:
        """Auctions of others whose bids are in, but for those of targets that are held."""
        ledger = self._ledger
        opened, held = ledger.time - ledger.bid_time, ledger.held
        return {
            target: message
            for target, (message, _) in ledger.elsewhere.items()
            if message.time <= opened and target not in held
        }

    def _has_holder(self, target: TrackId) -> bool:
        """Whether the target of an own auction has a holder: then nobody else can settle it."""
        holding = self._ledger.holding
        held = holding is not None and holding.id == target
        return held or self._ledger.auctions[target].holder is not None

    def _close(self, target: TrackId, winner: Offer | None, offers: Offers) -> None:
        """Award an own auction, if anybody wants it."""
        ledger = self._ledger
        auction = ledger.auctions[target]
        if winner is None:
            del ledger.auctions[target]
            free = any(beat.is_free for beat in ledger.beats.values())
            pause = 2.0 * ledger.bid_time if free else UNSOLD_PAUSE
            ledger.paused[target] = ledger.time + pause
            return
        task = ledger.tasks.get(target)
        position = auction.goal.position if task is None else task.position
        award = self._award(target, position, winner, offers)
        if winner.bidder == ledger.agent:
            del ledger.auctions[target]
        else:
            auction.award, auction.tries = award, 1
            auction.closes = ledger.time + ledger.bid_time

    def _close_for_other(self, message: Announce, winner: Offer, offers: Offers) -> None:
        """Award an auction of another, who says so again until the winner answers."""
        ledger, target = self._ledger, message.target
        del ledger.elsewhere[target]
        if winner.bidder == ledger.agent:
            ledger.rename(ledger.own_name(target, message.position), target)
        self._award(target, message.position, winner, offers)

    def _offers(self, targets: Collection[TrackId]) -> dict[TrackId, dict[int, Offer]]:
        """What counts of the bids for open auctions, and of the auctioneers' own prices."""
        ledger = self._ledger
        agent, able, leases = ledger.agent, ledger.able, ledger.leases
        bids = [bid for _, bid in ledger.bids if bid.sender not in leases]
        offers = offers_of(targets, [bid for bid in bids if able or bid.sender != agent])
        for target, bidders in offers.items():
            auction = ledger.auctions.get(target)
            if auction is None:
                message = ledger.elsewhere[target][0]
                if math.isfinite(message.cost) and message.sender not in leases:
                    bidders[message.sender] = Offer(message.sender, message.cost)
                continue
            for declined in auction.declined:
                bidders.pop(declined, None)
            if able:
                task = ledger.tasks.get(target)
                bidders[agent] = Offer(agent, *(auction.price if task is None else task.price))
            holder = None if auction.holder is None else leases.get(auction.holder)
            if holder is not None:
                limit = holder.cost - ledger.config.handover_margin
                offers[target] = {k: offer for k, offer in bidders.items() if offer.cost < limit}
        return offers

    def _award(self, target: TrackId, position: Point, winner: Offer, offers: Offers) -> Award:
        """Say who gets it, and the bids that this comes from, and act on it."""
        ledger = self._ledger
        told = sorted(
            offers.values(), key=lambda offer: (offer != winner, offer.cost, -offer.bidder)
        )[:BIDS_TOLD]
        ledger.say(
            Award,
            target=target,
            position=position,
            winner=winner.bidder,
            cost=winner.cost,
            bids=tuple(told),
        )
        award = ledger.outbox[-1]
        assert isinstance(award, Award)
        if winner.bidder == ledger.agent:
            if ledger.holding is not None:
                ledger.let_go()
            ledger.hold(target, position)
        else:
            ledger.leases[winner.bidder] = Lease(target, winner.cost, ledger.time)
            ledger.unheld.drop(target)
        return award

    def _repeat(self, auction: Auction, award: Award) -> None:
        ledger = self._ledger
        ledger.outbox.append(replace(award, sequence=ledger.next_sequence(), time=ledger.time))
        auction.tries += 1
        auction.closes = ledger.time + ledger.bid_time
        ledger.leases[award.winner] = Lease(award.target, award.cost, ledger.time)
