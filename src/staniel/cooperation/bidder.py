"""What an agent answers to the auctions of others: it revokes, consents, or bids."""

import math
from itertools import islice

from staniel.cooperation.cost import Goal, Price, Prices
from staniel.cooperation.ledger import Ledger
from staniel.datatypes.message import COST_TERMS, Announce, Bid, Handover, Revoke

__all__ = ["Bidder"]

_HANDOVER = COST_TERMS.index("handover")


class Bidder:
    """The agent in the auctions of others.

    Parameters
    ----------
    ledger : Ledger
    """

    def __init__(self, ledger: Ledger) -> None:
        self._ledger = ledger

    def answer(self, announced: list[Announce], prices: Prices) -> None:
        """Answer all that was announced since the last step, with one bid for what is wanted.

        Parameters
        ----------
        announced : list of Announce
            It is sorted in place.
        prices : callable
        """
        ledger = self._ledger
        announced.sort(key=lambda message: (message.target, message.sender))
        wanted: list[Announce] = []
        for message in _first_names(announced, ledger.config.same_target):
            if self._is_for_bids(message):
                wanted.append(message)
                ledger.elsewhere[message.target] = message, ledger.time + ledger.bid_time
        if wanted and ledger.able:
            self._bid(wanted, prices)

    def _bid(self, wanted: list[Announce], prices: Prices) -> None:
        ledger, joint = self._ledger, self._ledger.config.award == "joint"
        offers = []
        held = {lease.target for lease in ledger.leases.values()}
        goals = [Goal(m.position, m.course, m.speed) for m in wanted]
        for message, price in zip(wanted, prices(goals), strict=True):
            if message.target in held:
                price = self._with_handover(price)
            if joint or price.cost <= message.cost:
                offers.append((message.target, message.sender, price))
        if offers and joint:
            offers += [
                (name, ledger.agent, task.price)
                for name, auction in ledger.auctions.items()
                if auction.award is None and (task := ledger.tasks.get(name)) is not None
            ]
            offers.sort(key=lambda offer: offer[:2])
        if offers:
            targets, auctioneers, costs = zip(*offers, strict=True)
            ledger.say(
                Bid,
                targets=targets,
                auctioneers=auctioneers,
                costs=tuple(price.cost for price in costs),
                terms=tuple(p.terms for p in costs) if any(p.terms for p in costs) else (),
            )
            ledger.bids.append((ledger.time, ledger.outbox[-1]))  # type: ignore[arg-type]

    def _is_for_bids(self, message: Announce) -> bool:
        """Whether another's auction stands, for all that the agent knows."""
        ledger, target = self._ledger, message.target
        own = ledger.own_name(target, message.position)
        holding = ledger.holding
        # Whatever comes of it, this target needs no second auction before this one is over.
        until = ledger.time + 2.0 * ledger.bid_time
        ledger.paused[target] = max(ledger.paused.get(target, 0.0), until)
        if holding is not None and holding.id in (target, own):
            cost = ledger.cost
            stands = message.cost + ledger.config.handover_margin < cost
            ledger.say(
                Handover if stands else Revoke,
                target=target,
                auctioneer=message.sender,
                held_as=holding.id,
                position=holding.position,
                cost=cost,
            )
            return False
        if own is not None and own in ledger.auctions:
            if ledger.auctions[own].award is not None:
                return False  # Who won it says so; until then the award is to be repeated.
            if (own, ledger.agent) < (target, message.sender):
                return False  # The auction of the older name goes on; the other hears of it too.
            del ledger.auctions[own]
        if own is not None and target < own:
            ledger.rename(own, target)
        return True

    def _with_handover(self, price: Price) -> Price:
        """The price of a target that another holds is higher by the hand-over margin."""
        margin = self._ledger.config.handover_margin
        terms = list(price.terms)
        if terms:
            terms[_HANDOVER] = margin
        return Price(price.cost + margin, tuple(terms))


def _first_names(announced: list[Announce], near: float) -> list[Announce]:
    """Without those at whose place another one is announced under an older name."""
    if len(announced) < 2:
        return announced
    places = sorted((*message.position, k) for k, message in enumerate(announced))
    again = set()
    for i, (x, y, k) in enumerate(places):
        for east, north, j in islice(places, i + 1, None):
            if east - x > near:
                break
            if math.hypot(east - x, north - y) <= near:
                again.add(max(j, k))
    return [message for k, message in enumerate(announced) if k not in again]
