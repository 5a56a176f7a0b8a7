"""When a holder leaves its target: it is unfit, or there are more targets than aircraft."""

import math

from staniel.cooperation.auctioneer import Auctioneer
from staniel.cooperation.cost import Goal, Price, Prices
from staniel.cooperation.ledger import Ledger
from staniel.datatypes.message import Award, Offer

__all__ = ["Relief"]


class Relief:
    """The agent as the holder of a target that it cannot, or should not, keep.

    Parameters
    ----------
    ledger : Ledger
    auctioneer : Auctioneer
        The agent's own: it finds the one that takes over.
    """

    def __init__(self, ledger: Ledger, auctioneer: Auctioneer) -> None:
        self._ledger, self._auctioneer = ledger, auctioneer

    def relieve_or_revisit(self, prices: Prices) -> None:
        """Have another take the target, or leave it for one that was out of sight for longer.

        Parameters
        ----------
        prices : callable
        """
        ledger = self._ledger
        holding, config = ledger.holding, ledger.config
        if holding is None:
            return
        if ledger.health == "blind":
            ledger.let_go()
        elif ledger.health == "weak":
            if holding.id not in ledger.auctions and holding.id not in ledger.paused:
                task = ledger.tasks.get(holding.id)
                goal = Goal(holding.position, 0.0) if task is None else task.goal
                self._auctioneer.open(holding.id, goal, Price(math.inf))
        elif config.revisit_after and ledger.time - holding.since >= config.revisit_dwell:
            task = ledger.tasks.get(holding.id)
            if task is not None and ledger.time - task.last_seen <= 2.0 * ledger.bid_time:
                self._revisit(prices)

    def _revisit(self, prices: Prices) -> None:
        """Leave a target in sight for the one that was out of sight longest, if nobody is nearer.

        The one that is left is unheld then, and in its turn the longest unseen some day.
        """
        ledger = self._ledger
        healthy = [beat for beat in ledger.beats.values() if beat.health == "healthy"]
        if any(beat.target is None for beat in healthy):
            return  # Somebody is free.
        for unheld in ledger.unheld.all:
            if ledger.time - unheld.seen < ledger.config.revisit_after:
                return
            own = math.dist(unheld.position, (ledger.pose.x, ledger.pose.y))
            ways = [math.dist(unheld.position, (b.pose.x, b.pose.y)) for b in healthy]
            if ledger.is_busy_with(unheld.target) or any(way < own for way in ways):
                continue
            (price,) = prices([Goal(unheld.position, unheld.course)])
            ledger.let_go()
            ledger.say(
                Award,
                target=unheld.target,
                position=unheld.position,
                winner=ledger.agent,
                cost=price.cost,
                bids=(Offer(ledger.agent, *price),),
            )
            ledger.hold(unheld.target, unheld.position)
            return
