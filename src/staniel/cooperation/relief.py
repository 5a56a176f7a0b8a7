"""When a holder leaves its target: it is unfit, or there are more targets than aircraft."""

import math

from staniel.cooperation.auctioneer import Auctioneer
from staniel.cooperation.cost import Goal, Price
from staniel.cooperation.ledger import Ledger

__all__ = ["Relief"]

TOO_MUCH, ENOUGH = 0.1, 0.05
"""Patrols begin where a greater share of the streets is overdue than the first, and end at the
second."""


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

    def relieve_or_patrol(self, overdue: float) -> None:
        """Have another take the target, or leave it to look where nobody has looked for long.

        Parameters
        ----------
        overdue : float
            Share of the streets that were not looked at for `CooperationConfig.revisit_after`.
        """
        ledger = self._ledger
        holding, config = ledger.holding, ledger.config
        ledger.patrolling = ledger.patrolling and overdue > ENOUGH
        if holding is None:
            return
        if ledger.health == "blind":
            ledger.let_go()
        elif ledger.health == "weak":
            if holding.id not in ledger.auctions and holding.id not in ledger.paused:
                task = ledger.tasks.get(holding.id)
                goal = Goal(holding.position, 0.0) if task is None else task.goal
                self._auctioneer.open(holding.id, goal, Price(math.inf))
        elif (
            overdue > TOO_MUCH
            and ledger.time - holding.since >= config.revisit_dwell
            # Whoever is free looks there anyway.
            and not any(beat.is_free for beat in ledger.beats.values())
        ):
            ledger.patrolling = True
            ledger.let_go()
