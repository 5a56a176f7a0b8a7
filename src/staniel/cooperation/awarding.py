"""Who gets a target of those who bid: the lowest bid, or the best for all open auctions at once."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.cooperation.auction import assign
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Bid, Offer

__all__ = ["Offers", "best_for_all", "lowest", "offers_of"]

Offers = Mapping[int, Offer]
"""By bidder."""


def offers_of(target: TrackId, bids: Sequence[Bid]) -> dict[int, Offer]:
    """What was bid for one target, by bidder; of several bids of one bidder the last counts."""
    offers = {}
    for bid in bids:
        if target in bid.targets:
            k = bid.targets.index(target)
            terms = bid.terms[k] if bid.terms else ()
            offers[bid.sender] = Offer(bid.sender, bid.costs[k], terms)
    return offers


def lowest(offers: Offers) -> Offer | None:
    """The lowest cost, ties to the higher id (thesis section 7.2.1); None where nobody bids."""
    return min(offers.values(), key=lambda offer: (offer.cost, -offer.bidder), default=None)


def best_for_all(
    target: TrackId,
    offers: Offers,
    auctions: Collection[TrackId],
    bids: Sequence[Bid],
    auctioneers: Mapping[TrackId, Offer],
) -> Offer | None:
    """Who gets `target` where all open auctions are settled together at the least total cost.

    All auctioneers that heard the same bids come to the same assignment without another word.

    Parameters
    ----------
    target : TrackId
    offers : mapping of int to Offer
        For it, by bidder; nobody else gets it.
    auctions : collection of TrackId
        The other open auctions.
    bids : sequence of Bid
        All that were heard.
    auctioneers : mapping of TrackId to Offer
        What the auctions' own auctioneers, this one included, would do them for.

    Returns
    -------
    Offer or None
        None where others need all who bid.
    """
    if not offers or not auctions:
        return lowest(offers)
    order = tuple(sorted({target, *auctions}))
    place = {name: k for k, name in enumerate(order)}
    rows: dict[int, NDArray[np.float64]] = {}

    def row_of(bidder: int) -> NDArray[np.float64]:
        return rows.setdefault(bidder, np.full(len(order), np.inf))

    for bid in bids:
        if bid.targets == order:
            rows[bid.sender] = np.array(bid.costs)
            continue
        row = row_of(bid.sender)
        for name, cost in zip(bid.targets, bid.costs, strict=True):
            if name in place:
                row[place[name]] = cost
    for name, offer in auctioneers.items():
        if name in place:
            row_of(offer.bidder)[place[name]] = offer.cost
    # Of equal assignments that of the higher ids comes first.
    bidders = sorted(rows, reverse=True)
    table, column = np.stack([rows[bidder] for bidder in bidders]), place[target]
    table[[k for k, bidder in enumerate(bidders) if bidder not in offers], column] = np.inf
    winners = np.flatnonzero(assign(table).columns == column)
    return offers[bidders[winners[0]]] if len(winners) else None
