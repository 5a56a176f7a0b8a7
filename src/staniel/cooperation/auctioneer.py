"""An agent's own auctions: it opens them, awards them, and says so until the winner answers."""

import math
from dataclasses import replace

from staniel.cooperation.awarding import best_for_all, lowest, offers_of
from staniel.cooperation.cost import Goal, Price, Prices
from staniel.cooperation.ledger import Ledger
from staniel.cooperation.table import Auction, Lease
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Announce, Award, Bid, Offer

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
        ledger = self._ledger
        for target, auction in list(ledger.auctions.items()):
            if ledger.time < auction.closes or target not in ledger.auctions:
                continue
            if auction.award is None:
                self._close(target, auction)
            elif auction.tries < ledger.config.award_tries:
                self._repeat(auction, auction.award)
            else:
                # Whoever won it does not answer: as if it had never been awarded.
                ledger.leases.pop(auction.award.winner, None)
                del ledger.auctions[target]

    def _close(self, target: TrackId, auction: Auction) -> None:
        """Award it, if anybody wants it."""
        ledger = self._ledger
        busy = set(ledger.leases) | auction.declined
        bids = [bid for _, bid in ledger.bids if bid.sender not in busy]
        offers = self._offers(target, auction, bids)
        joint = ledger.config.award != "lowest"
        winner = self._joint(target, offers, bids) if joint else lowest(offers)
        if winner is None:
            del ledger.auctions[target]
            free = any(beat.is_free for beat in ledger.beats.values())
            pause = 2.0 * ledger.bid_time if free else UNSOLD_PAUSE
            ledger.paused[target] = ledger.time + pause
            return
        award = self._award(target, auction, winner, offers)
        if winner.bidder == ledger.agent:
            del ledger.auctions[target]
            if ledger.holding is not None:
                ledger.let_go()
            ledger.hold(target, award.position)
        else:
            auction.award, auction.tries = award, 1
            auction.closes = ledger.time + ledger.bid_time
            ledger.leases[winner.bidder] = Lease(target, winner.cost, ledger.time)
            ledger.unheld.drop((target,))

    def _offers(self, target: TrackId, auction: Auction, bids: list[Bid]) -> dict[int, Offer]:
        """What counts of the bids for a target, and of the agent's own price, by bidder."""
        ledger = self._ledger
        offers = offers_of(target, bids)
        offers.pop(ledger.agent, None)
        if ledger.able:
            task = ledger.tasks.get(target)
            own = auction.price if task is None else task.price
            offers[ledger.agent] = Offer(ledger.agent, *own)
        holder = None if auction.holder is None else ledger.leases.get(auction.holder)
        if holder is not None:
            limit = holder.cost - ledger.config.handover_margin
            offers = {k: offer for k, offer in offers.items() if offer.cost < limit}
        return offers

    def _award(
        self, target: TrackId, auction: Auction, winner: Offer, offers: dict[int, Offer]
    ) -> Award:
        """Say who gets it, and the bids that this comes from."""
        ledger = self._ledger
        task = ledger.tasks.get(target)
        told = sorted(
            offers.values(), key=lambda offer: (offer != winner, offer.cost, -offer.bidder)
        )[:BIDS_TOLD]
        ledger.say(
            Award,
            target=target,
            position=auction.goal.position if task is None else task.position,
            winner=winner.bidder,
            cost=winner.cost,
            bids=tuple(told),
        )
        award = ledger.outbox[-1]
        assert isinstance(award, Award)
        return award

    def _joint(self, target: TrackId, offers: dict[int, Offer], bids: list[Bid]) -> Offer | None:
        """Who gets it where all open auctions that the agent hears of are settled at once."""
        ledger, able = self._ledger, self._ledger.able
        own = {
            name: Offer(ledger.agent, task.cost, task.terms)
            for name, auction in ledger.auctions.items()
            if able and auction.award is None and (task := ledger.tasks.get(name)) is not None
        }
        if ledger.agent in offers:
            own[target] = offers[ledger.agent]
        for name, (said, _) in ledger.elsewhere.items():
            if math.isfinite(said.cost) and said.sender not in ledger.leases:
                own[name] = Offer(said.sender, said.cost)
        auctions = {name for name, other in ledger.auctions.items() if other.award is None}
        others = (auctions | set(ledger.elsewhere)) - {target}
        return best_for_all(target, offers, others, bids, own)

    def _repeat(self, auction: Auction, award: Award) -> None:
        ledger = self._ledger
        ledger.outbox.append(replace(award, sequence=ledger.next_sequence(), time=ledger.time))
        auction.tries += 1
        auction.closes = ledger.time + ledger.bid_time
        ledger.leases[award.winner] = Lease(award.target, award.cost, ledger.time)
