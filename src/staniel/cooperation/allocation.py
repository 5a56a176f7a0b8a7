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
leader         of several whose auctions end together that of the highest id: it awards them all
holder         revokes an auction of its own target, unless the announced cost undercuts its own
               by the hand-over margin: then it holds it until somebody else says he does
two holders    the one whose cost, both as of the same instant, is higher yields
two names      a holder's name for a target rules; before that, the older one
unfit agent    bids for nothing; a weak one has its target auctioned, a blind one lets go of it
=============  ==============================================================================

`Allocation` is the door. Behind it are a book, `ledger`, and those that write in it: `hearing`,
`bidder`, `auctioneer` and `relief`.
"""

from collections.abc import Iterable

from staniel.cooperation.auctioneer import BIDS_TOLD, Auctioneer
from staniel.cooperation.bidder import Bidder
from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.cost import Prices
from staniel.cooperation.hearing import Hearing
from staniel.cooperation.ledger import Ledger
from staniel.cooperation.relief import Relief
from staniel.cooperation.table import Holding, Task
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.command import Command
from staniel.datatypes.message import Announce, Heartbeat, Message, Point, Release, Unheld

__all__ = ["BIDS_TOLD", "Allocation"]


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
    """

    def __init__(
        self, agent: int, config: CooperationConfig, *, step: float, centre: int | None = None
    ) -> None:
        self._ledger = ledger = Ledger(agent, config, step=step)
        self._hearing = Hearing(ledger, centre)
        self._bidder, self._auctioneer = Bidder(ledger), Auctioneer(ledger)
        self._relief = Relief(ledger, self._auctioneer)

    def step(
        self,
        time: float,
        pose: Pose,
        tasks: Iterable[Task],
        inbox: Iterable[Message],
        prices: Prices,
        *,
        health: str = "healthy",
        alone: bool = False,
        overdue: float = 0.0,
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
        overdue : float
            Share of the streets that were not looked at for `CooperationConfig.revisit_after`.

        Returns
        -------
        list of Message
            To be broadcast.
        """
        ledger = self._ledger
        ledger.turn_to(time, pose, tasks, health)
        if alone:
            self._hold_nearest()
            return []
        heard = list(inbox)
        self._hearing.hear(heard)
        ledger.follow_holding()
        if not self._hearing.led:
            self._bidder.answer([m for m in heard if isinstance(m, Announce)], prices)
            self._auctioneer.tend()
            ledger.note_unheld()
            self._auctioneer.open_due(prices)
            self._relief.relieve_or_patrol(overdue)
        else:
            ledger.patrolling = False
            if health == "blind" and ledger.holding is not None:
                ledger.let_go()
        return ledger.outbox

    @property
    def holding(self) -> Holding | None:
        """The target to pursue."""
        return self._ledger.holding

    @property
    def patrolling(self) -> bool:
        """Whether it lets all targets be, and looks where nobody has looked for long."""
        return self._ledger.patrolling

    @property
    def renames(self) -> list[tuple[TrackId, TrackId]]:
        """Old and new names that the agent's tracker is to take over, of the last step."""
        return self._ledger.renames

    @property
    def held(self) -> set[TrackId]:
        """Names of the targets that somebody is known to hold, or that are up for auction."""
        return self._ledger.held

    @property
    def unheld(self) -> list[Unheld]:
        """Targets that nobody is known to hold, the longest unseen first."""
        return self._ledger.unheld.all

    @property
    def cost(self) -> float:
        """Of the held target [m]; infinite without one, or where another is to take it."""
        return self._ledger.cost

    def heartbeat(
        self,
        role: str,
        goal: Point,
        helps: TrackId | None = None,
        command: Command | None = None,
        helpers: tuple[int, ...] = (),
    ) -> Heartbeat:
        """The message that tells the others where the agent is and renews its lease."""
        ledger = self._ledger
        holding, cost = ledger.holding, ledger.cost
        task = None if holding is None else ledger.tasks.get(holding.id)
        ledger.said[ledger.time] = cost
        return Heartbeat(
            ledger.agent,
            ledger.next_sequence(),
            ledger.time,
            pose=ledger.pose,
            role=role,
            goal=goal,
            target=None if holding is None else holding.id,
            target_position=None if holding is None else holding.position,
            cost=cost,
            helps=helps,
            command=command,
            target_velocity=(0.0, 0.0) if task is None else task.velocity,
            helpers=helpers,
            health=ledger.health,
            unheld=ledger.unheld.told,
        )

    def give_up(self) -> Release:
        """Let go of the held target because it is lost; the message says so."""
        ledger = self._ledger
        holding, ledger.holding = ledger.holding, None
        if holding is None:
            raise ValueError("give_up: the agent holds no target")
        ledger.unheld.bury(holding.id, ledger.time)
        return Release(
            ledger.agent,
            ledger.next_sequence(),
            ledger.time,
            target=holding.id,
            position=holding.position,
            lost=True,
            seen=holding.seen,
        )

    def next_sequence(self) -> int:
        """Number for a message that the agent says outside of auctions."""
        return self._ledger.next_sequence()

    def _hold_nearest(self) -> None:
        """What an agent does that does not cooperate: the nearest target that it sees itself."""
        ledger = self._ledger
        ledger.leases, ledger.auctions, ledger.patrolling = {}, {}, False
        if ledger.holding is not None and ledger.holding.id in ledger.tasks:
            ledger.follow_holding()
            return
        seen = [task for task in ledger.tasks.values() if task.seen]
        if seen:
            task = min(seen, key=lambda task: (task.cost, task.id))
            ledger.hold(task.id, task.position)
