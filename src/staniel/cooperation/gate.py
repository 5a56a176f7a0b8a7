"""One agent's door for messages: what comes from a radio is checked before anybody acts on it.

===========  =====================================================================================
counted as   dropped, in this order
===========  =====================================================================================
malformed    what `staniel.datatypes.malformed.fault_of` finds fault with, or a packet that is none
oversized    more than `staniel.datatypes.wire.LARGEST` bytes
forged       in the agent's own name, or that of no member of the team; a packet that is not signed
             with the team's key; a sequence number that its sender cannot have come to
stale        said more than `patience` ago, or more than a tick and a second from now, or telling
             what was seen after now
replayed     heard before, or 256 or more numbers behind the newest of its sender, where nobody
             remembers
===========  =====================================================================================

What is dropped changes nothing but the count. So every message is idempotent: a copy is no news.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import Final

from staniel.datatypes.malformed import fault_of, faults_of
from staniel.datatypes.message import Message
from staniel.datatypes.wire import decode
from staniel.errors import WireError

__all__ = ["BURST", "COPIES", "MOST_SENDERS", "PACE", "REASONS", "Gate"]

REASONS: Final = ("malformed", "oversized", "forged", "stale", "replayed")
"""Why a message is dropped: the keys of `Gate.dropped`."""

COPIES: Final = 256
"""Sequence numbers back from a sender's newest in which a copy is recognised; older is refused."""

BURST: Final = 128
"""A sender's numbers may jump so far ahead at once ..."""

PACE: Final = 100.0
"""... and so much farther for each second since it was last heard."""

MOST_SENDERS: Final = 1000
"""No more senders are remembered at a time; one more is refused."""

_ALL_COPIES = (1 << COPIES) - 1
_SKEW: Final = 1.0  # clocks of two aircraft may differ by [s]


@dataclass(slots=True)
class _Sender:
    """The newest number heard, bit k for the one k before it, and when one was last admitted."""

    newest: int
    heard: int
    at: float


class Gate:
    """Lets each good message through once.

    Parameters
    ----------
    agent : int
        Whose door it is: nobody else speaks in its name.
    team : collection of int, optional
        Who may speak; not given, anybody.
    key : bytes, optional
        The team's, with which packets are signed; 16 to 64 bytes.
    patience : float, optional [s]
        What was said longer ago is stale: more than any delay of the radio.
    step : float, optional [s]
        The decision step.

    Attributes
    ----------
    dropped : dict of str to int
        How many messages were dropped, by `REASONS`.

    Notes
    -----
    A number that was made up must not silence who is heard after it for ever. Where a sender was
    heard a second ago, the greatest jump allowed is 228: its own next numbers are still among the
    256 that are remembered. And who had no message admitted for `patience`, a step and a second is
    forgotten, since copies of all it said by then are stale. So a false first number, too, silences
    for no longer than that. Only a key keeps strangers out altogether.

    Examples
    --------
    >>> from staniel.datatypes.belief import TrackId
    >>> from staniel.datatypes.message import AssistanceEnd
    >>> gate = Gate(0, team=range(4))
    >>> word = AssistanceEnd(3, 1, 5.0, target=TrackId(2.5, 3, 1))
    >>> len(gate.admit(6.0, [word, word, replace(word, sender=9), replace(word, time=700.0)]))
    1
    >>> {reason: count for reason, count in gate.dropped.items() if count}
    {'forged': 1, 'stale': 1, 'replayed': 1}
    """

    def __init__(
        self,
        agent: int,
        *,
        team: Collection[int] | None = None,
        key: bytes | None = None,
        patience: float = 60.0,
        step: float = 1.0,
    ) -> None:
        self.dropped: dict[str, int] = dict.fromkeys(REASONS, 0)
        self._agent, self._key = agent, key
        self._team = None if team is None else frozenset(team)
        self._patience, self._ahead = patience, step + _SKEW
        self._senders: dict[int, _Sender] = {}

    def admit(self, time: float, messages: Iterable[Message]) -> list[Message]:
        """What of the messages is sound, in time and new, in the order in which they come.

        Parameters
        ----------
        time : float [s]
            Now, by the agent's clock; never less than in the call before.
        messages : iterable of Message

        Returns
        -------
        list of Message
            None was said after `time`: one by a clock that is a little ahead counts as said now.
        """
        admitted = []
        oldest, senders = time - self._patience, self._senders
        box = list(messages)
        for message, fault in zip(box, faults_of(box), strict=True):
            if fault is None:
                # Nearly all are of somebody known, in time and in order: those the short way.
                known = senders.get(message.sender)
                if known is not None and oldest <= message.time <= time and oldest <= known.at:
                    ahead = message.sequence - known.newest
                    if 0 < ahead <= BURST:
                        known.newest = message.sequence
                        known.heard = (known.heard << ahead | 1) & _ALL_COPIES
                        known.at = time
                        admitted.append(message)
                        continue
            reason = self._refusal(time, message) if fault is None else fault.reason
            if reason:
                self.dropped[reason] += 1
            else:
                admitted.append(message if message.time <= time else replace(message, time=time))
        return admitted

    def open(self, time: float, packets: Iterable[bytes]) -> list[Message]:
        """What of the packets are messages to be admitted, in the order in which they come.

        Parameters
        ----------
        time : float [s]
            As in `admit`.
        packets : iterable of bytes
            From anywhere.

        Returns
        -------
        list of Message
        """
        admitted = []
        for packet in packets:
            try:
                message = decode(packet, self._key)
            except WireError as error:
                self.dropped[error.reason] += 1
            else:
                admitted += self.admit(time, (message,))
        return admitted

    def _refusal(self, time: float, message: Message) -> str:
        """Why a sound message is dropped; nothing where it is admitted, and then remembered."""
        sender, said, team = message.sender, message.time, self._team
        if sender == self._agent or (team is not None and sender not in team):
            return "forged"
        if not time - self._patience <= said <= time + self._ahead:
            return "stale"
        # Of a clock that is ahead: with what was seen after now it would not have been sound.
        if said > time and fault_of(replace(message, time=time)) is not None:
            return "stale"
        sequence, known = message.sequence, self._senders.get(sender)
        if known is None or time - known.at > self._patience + self._ahead:
            if known is None and not self._has_room(time):
                return "forged"
            self._senders[sender] = _Sender(sequence, 1, time)
            return ""
        age = known.newest - sequence
        if age >= COPIES or (age >= 0 and known.heard >> age & 1):
            return "replayed"
        if age < 0:
            if -age > BURST + PACE * (time - known.at):
                return "forged"
            known.newest, known.heard = sequence, known.heard << min(-age, COPIES) & _ALL_COPIES
            age = 0
        known.heard |= 1 << age
        known.at = time
        return ""

    def _has_room(self, time: float) -> bool:
        """Whether one more sender can be remembered, once those silent for long are forgotten."""
        if len(self._senders) >= MOST_SENDERS:
            since = time - self._patience - self._ahead
            self._senders = {k: v for k, v in self._senders.items() if v.at >= since}
        return len(self._senders) < MOST_SENDERS
