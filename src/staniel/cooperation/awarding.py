"""Who gets a target of those who bid: the lowest bid, or the best for all open auctions at once."""

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from staniel.cooperation.auction import assign
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Bid, Offer

__all__ = ["Offers", "best_for_all", "lowest", "offers_of"]

Offers = Mapping[int, Offer]
"""By bidder."""


def offers_of(targets: Collection[TrackId], bids: Iterable[Bid]) -> dict[TrackId, dict[int, Offer]]:
    """What was bid for each target, by bidder; of several bids of one bidder the last counts."""
    offers: dict[TrackId, dict[int, Offer]] = {target: {} for target in targets}
    for bid in bids:
        for k, target in enumerate(bid.targets):
            if target in offers:
                terms = bid.terms[k] if bid.terms else ()
                offers[target][bid.sender] = Offer(bid.sender, bid.costs[k], terms)
    return offers


def lowest(offers: Offers) -> Offer | None:
    """The lowest cost, ties to the higher id (thesis section 7.2.1); None where nobody bids."""
    return min(offers.values(), key=lambda offer: (offer.cost, -offer.bidder), default=None)


def best_for_all(offers: Mapping[TrackId, Offers]) -> dict[TrackId, Offer]:
    """Who gets each of several targets where they are settled together at the least total cost.

    All that heard the same bids come to the same assignment without another word.

    Parameters
    ----------
    offers : mapping of TrackId to mapping of int to Offer
        For each target, by bidder; nobody else gets it.

    Returns
    -------
    dict of TrackId to Offer
        Without targets for which nobody is left.
    """
    targets = sorted(target for target, bids in offers.items() if bids)
    if len(targets) == 1:
        return {target: offer for target in targets if (offer := lowest(offers[target]))}
    # Of equal assignments that of the higher ids comes first.
    bidders = sorted({bidder for target in targets for bidder in offers[target]}, reverse=True)
    row = {bidder: k for k, bidder in enumerate(bidders)}
    table = np.full((len(bidders), len(targets)), np.inf)
    for column, target in enumerate(targets):
        for bidder, offer in offers[target].items():
            table[row[bidder], column] = offer.cost
    return {
        targets[column]: offers[targets[column]][bidder]
        for bidder, column in zip(bidders, assign(table).columns.tolist(), strict=True)
        if column >= 0
    }
