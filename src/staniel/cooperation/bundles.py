"""Several targets per aircraft, agreed by messages: the consensus-based bundle algorithm.

Each agent adds targets to its *bundle*, one by one, each for what it adds to the score of its path,
as long as it outbids whom it knows as the winner. What it hears of others' winners is settled by
who has the newer word of the agents in question, then by the higher bid. Who is outbid gives up the
target and all that it added later, whose bids rested on it. (Choi, Brunet and How 2009, "Consensus-
based decentralized auctions for robust task allocation", IEEE Transactions on Robotics 25(4).)

============ =========================================================================
sender says  the receiver, who thinks that the winner is ...
============ =========================================================================
itself       the receiver: believes it if outbid; the sender or nobody: believes it;
             another: believes it if the word of that one is newer, or that one is outbid
the receiver the sender: makes it nobody; another: nobody if the word of that one is newer
another, m   the receiver: believes it if outbid and the word of m is newer;
             the sender: believes it if the word of m is newer, else makes it nobody;
             m or nobody: believes it if the word of m is newer;
             a fourth, n: believes it if the word of m is newer, and that of n is or n is outbid;
             makes it nobody if the word of n is newer and the receiver's own of m is
nobody       the sender: makes it nobody; another: nobody if the word of that one is newer
============ =========================================================================

Where the table says nothing the receiver thinks on as before. "Newer" is the sender's word,
compared with the receiver's own.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final

from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Bundle, Claim, Point
from staniel.errors import StanielError

__all__ = ["Bundles", "Path", "Score", "straight"]

Path = tuple[TrackId, ...]
Score = Callable[[Path], float]
"""What it is worth to an agent to visit these targets in this order; 0 for none."""

_NEVER: Final = -math.inf


class Bundles:
    """One agent's side of the consensus.

    Parameters
    ----------
    agent : int
    capacity : int
        Most targets in its bundle, at least 1.
    repeat : float [s]
        After so much silence it says again what it thinks, since all may have missed it.

    Attributes
    ----------
    path : tuple of TrackId
        What it takes, in the order in which it would visit them.

    Raises
    ------
    StanielError
        `capacity` below 1, `repeat` not greater than 0.

    Notes
    -----
    Where the gain of a target never grows with what is in the path already, the team's score is at
    least half of the best there is. A path's length can break this rule; then a bid counts at
    most as much as the one before it in the bundle, which keeps the agreement certain (Johnson,
    Choi and How 2012) but not the half. Scores count when a target is added: an agent that has
    moved keeps its bids.

    Examples
    --------
    Two aircraft on a line, a target beside each:

    >>> targets = {TrackId(0.0, 0, 0): (0.0, 10.0), TrackId(0.0, 0, 1): (500.0, 10.0)}
    >>> team = [Bundles(0, capacity=2), Bundles(1, capacity=2)]
    >>> scores = [straight((x, 0.0), targets, reward=400.0) for x in (0.0, 500.0)]
    >>> heard = []
    >>> for time in range(4):
    ...     said = [a.step(time, s, targets, heard) for a, s in zip(team, scores)]
    ...     heard = [message for messages in said for message in messages]
    >>> [[str(target) for target in a.path] for a in team]
    [['0-0'], ['0-1']]
    """

    def __init__(self, agent: int, capacity: int, *, repeat: float = 5.0) -> None:
        if capacity < 1:
            raise StanielError(f"capacity = {capacity}: expected at least 1 target")
        if not repeat > 0.0:
            raise StanielError(f"repeat = {repeat}: expected more than 0 s")
        self.agent = agent
        self.path: Path = ()
        self._capacity = capacity
        self._repeat = repeat
        self._bundle: list[TrackId] = []  # in the order of adding
        self._claims: dict[TrackId, Claim] = {}
        self._heard: dict[int, float] = {}  # newest word of each other agent [s]
        self._newest: dict[int, int] = {}  # sequence of its newest message
        self._said = _NEVER
        self._sequence = 0

    @property
    def claims(self) -> Mapping[TrackId, Claim]:
        """Who it thinks wins what."""
        return dict(self._claims)

    def step(
        self, time: float, score: Score, targets: Iterable[TrackId], inbox: Sequence[Bundle]
    ) -> tuple[Bundle, ...]:
        """Hear, give up what is lost, add what is worth it, and say so if others may not know.

        Parameters
        ----------
        time : float [s]
        score : callable
            Of a path; see `straight`.
        targets : iterable of TrackId
            What may be visited.
        inbox : sequence of Bundle
            Lost, repeated, late or out of order, as the radio has it.

        Returns
        -------
        tuple of Bundle
            At most one message.
        """
        before, differs = dict(self._claims), False
        for message in sorted(inbox, key=lambda word: (word.sender, word.sequence)):
            if message.sender != self.agent and message.sequence > self._newest.get(
                message.sender, -1
            ):
                differs |= self._hear(message)
        known = set(targets)
        self._give_up(known)
        self._add(score, known)
        if not (differs or self._claims != before or time >= self._said + self._repeat):
            return ()
        self._said = time
        self._sequence += 1
        heard = (*self._heard.items(), (self.agent, time))
        claims = tuple(sorted(self._claims.values()))
        return (Bundle(self.agent, self._sequence, time, claims, tuple(sorted(heard))),)

    def _hear(self, message: Bundle) -> bool:
        """Settle what the sender thinks; returns whether it should hear from this agent."""
        theirs = {claim.target: claim for claim in message.claims}
        word = {**dict(message.heard), message.sender: message.time}
        disputed = theirs.keys() | self._claims.keys() if theirs != self._claims else ()
        for target in disputed:
            claim, own = theirs.get(target), self._claims.get(target)
            if claim == own:
                continue
            settled = self._settle(message.sender, claim, own, word)
            if settled is None:
                self._claims.pop(target, None)
            else:
                self._claims[target] = settled
        self._newest[message.sender] = message.sequence
        for agent, time in word.items():
            if agent != self.agent and time > self._heard.get(agent, _NEVER):
                self._heard[agent] = time
        return theirs != self._claims

    def _settle(
        self, sender: int, claim: Claim | None, own: Claim | None, word: Mapping[int, float]
    ) -> Claim | None:
        """What to think of one target: the table at the head of this file."""

        def newer(agent: int) -> bool:
            return word.get(agent, _NEVER) > self._heard.get(agent, _NEVER)

        holder = None if own is None else own.winner
        winner = None if claim is None else claim.winner
        if winner == self.agent or winner is None:
            # Of its own bids nobody knows better; of the sender's, the sender does.
            if holder is None or holder == self.agent:
                return own
            return None if holder == sender or newer(holder) else own
        if winner == sender:
            mine = holder == self.agent
            fresh = holder is None or holder == sender or (not mine and newer(holder))
            return claim if fresh or _outbid(claim, own) else own
        if holder is None or holder == winner:
            return claim if newer(winner) else own
        if holder == self.agent:
            return claim if newer(winner) and _outbid(claim, own) else own
        if holder == sender:
            return claim if newer(winner) else None
        if newer(winner):
            return claim if newer(holder) or _outbid(claim, own) else own
        stale = word.get(winner, _NEVER) < self._heard.get(winner, _NEVER)
        return None if newer(holder) and stale else own

    def _give_up(self, targets: set[TrackId]) -> None:
        """Leave the first target that is lost or gone, and what was added after it."""
        for place, target in enumerate(self._bundle):
            claim = self._claims.get(target)
            if claim is None or claim.winner != self.agent or target not in targets:
                for later in self._bundle[place:]:
                    held = self._claims.get(later)
                    if held is not None and held.winner == self.agent:
                        del self._claims[later]
                left = set(self._bundle[:place])
                self._bundle = self._bundle[:place]
                self.path = tuple(kept for kept in self.path if kept in left)
                return

    def _add(self, score: Score, targets: set[TrackId]) -> None:
        """Add the target of the greatest gain among those it wins, until none is left or full."""
        limit = self._claims[self._bundle[-1]].bid if self._bundle else math.inf
        while len(self._bundle) < self._capacity:
            had = score(self.path)
            best: tuple[Claim, Path] | None = None
            for target in sorted(targets.difference(self._bundle)):
                gain, path = max(
                    ((score(path) - had, path) for path in _insertions(self.path, target)),
                    key=lambda option: option[0],
                )
                claim = Claim(target, self.agent, min(gain, limit))
                wins = claim.bid > 0.0 and _outbid(claim, self._claims.get(target))
                if wins and (best is None or claim.bid > best[0].bid):
                    best = claim, path
            if best is None:
                return
            claim, self.path = best
            self._bundle.append(claim.target)
            self._claims[claim.target] = claim
            limit = claim.bid


def _insertions(path: Path, target: TrackId) -> list[Path]:
    """The path with the target at each place."""
    return [(*path[:place], target, *path[place:]) for place in range(len(path) + 1)]


def _outbid(claim: Claim | None, other: Claim | None) -> bool:
    """Whether the first bid is higher; of equal ones the lower agent's is."""
    if claim is None or other is None:
        return other is None
    return (claim.bid, -claim.winner) > (other.bid, -other.winner)


def straight(start: Point, places: Mapping[TrackId, Point], reward: float) -> Score:
    """Score of a path: a reward for each target, less the length of the straight legs.

    Parameters
    ----------
    start : (float, float) [m]
    places : mapping of TrackId to (float, float) [m]
    reward : float [m]
        For a target, in metres that it is worth flying.
    """

    def score(path: Path) -> float:
        at, length = start, 0.0
        for target in path:
            length += math.dist(at, places[target])
            at = places[target]
        return reward * len(path) - length

    return score
