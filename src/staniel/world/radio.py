"""The radio: every message is a broadcast that each other aircraft hears or misses by itself.

On its way a message waits for its sender's bandwidth, goes on the air, is lost or not to each
receiver on its own (by distance, by a building, by a partition), and arrives after the latency and
a jitter, perhaps twice.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.equipment import RadioSet
from staniel.datatypes.message import Delivery, Message
from staniel.datatypes.truth import RADIO, Truth
from staniel.datatypes.wire import wire_size
from staniel.kernels.radio import fates, hear

__all__ = ["Radio"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

_Said = tuple[int, Message]  # by whom, what

_CLOSE = 1e-9  # of a tick: instants this near to each other are one


class _Aired(NamedTuple):
    """Messages that go on the air in one tick, in the order of sender and sequence."""

    messages: list[Message]
    senders: Indices
    sequences: Indices
    at: Floats  # when the last byte is out [s]


class _Arrivals(NamedTuple):
    """Receptions to come, one an element; `row` is the message's place in `messages`."""

    due: Floats  # [s]
    senders: Indices
    sequences: Indices
    copy: Indices
    receiver: Indices
    row: Indices
    messages: list[Message]


@dataclass(slots=True)
class _Transmitter:
    """What one sender has not yet brought on the air, with the time when each will be out [s]."""

    waiting: deque[tuple[float, Message]] = field(default_factory=deque)
    free_at: float = 0.0


class Radio:
    """Delivers messages, late or twice, or loses them.

    It remembers who waits to be sent and what is on its way; with latency, jitter, duplication,
    bandwidth, building loss and partitions all off it remembers nothing.

    Parameters
    ----------
    radio : RadioSet
    key : uint64
        Of the stream of its draws.
    city : City, optional
        Whose buildings stand between antennas; none without.
    step : float [s]
        The decision step: arrivals round up to its multiples.
    """

    def __init__(
        self, radio: RadioSet, key: np.uint64, city: City | None = None, step: float = 1.0
    ) -> None:
        self._radio = radio
        self._key = np.uint64(key)
        self._city = city
        self._step = step
        self._instant = not (
            radio.latency
            or radio.jitter
            or radio.duplication
            or radio.bandwidth
            or radio.building_loss
            or radio.partitions
        )
        self._before: float | None = None
        self._transmitters: dict[int, _Transmitter] = {}
        self._coming: dict[int, list[_Arrivals]] = {}

    @property
    def waiting(self) -> int:
        """Messages that were said and are still in their senders' queues."""
        return sum(len(transmitter.waiting) for transmitter in self._transmitters.values())

    @property
    def in_flight(self) -> int:
        """Receptions, copies included, that are still on their way."""
        return sum(len(part.due) for parts in self._coming.values() for part in parts)

    def deliver(
        self, outboxes: Sequence[Sequence[Message]], truth: Truth
    ) -> tuple[list[list[Message]], list[Delivery]]:
        """What everybody hears now, and what becomes of what goes on the air.

        Parameters
        ----------
        outboxes : sequence of sequence of Message
            One an aircraft, in the order of `Truth.aircraft`: said at the instant of the call
            before this one (in the first call: of this one).
        truth : Truth
            Distances are of its instant, and what has arrived by then is heard.

        Returns
        -------
        inboxes : list of list of Message
            One an aircraft, in the order of arrival; what arrives at once in that of sender and
            sequence. Copies of a message are equal.
        deliveries : list of Delivery
            One for each message that went on the air or was dropped, by a full queue or since its
            sender's radio is dead, in the order of sender and sequence. Whom it reaches is decided
            now, even where it arrives later: a radio that dies in between does not hear it.
        """
        working = truth.condition[:, RADIO] > 0.0
        said = [
            (sender, message)
            for sender, outbox in enumerate(outboxes)
            for message in sorted(outbox, key=_sequence)
        ]
        inboxes: list[list[Message]] = [[] for _ in range(len(truth.aircraft))]
        dropped: list[Message] = []
        if not working.all():
            said, dropped = self._silence(said, working)
        if self._instant:
            deliveries = self._deliver_at_once(said, truth, working, inboxes)
        else:
            deliveries = self._deliver_in_time(said, truth, working, inboxes, dropped)
        if dropped:
            deliveries += [Delivery(message, 0, ()) for message in dropped]
            deliveries.sort(key=_origin)
        return inboxes, deliveries

    def _silence(self, said: list[_Said], working: Bools) -> tuple[list[_Said], list[Message]]:
        """What working radios say, and what the dead ones do not, their queues included."""
        dropped = [message for sender, message in said if not working[sender]]
        for sender, transmitter in self._transmitters.items():
            if not working[sender]:
                dropped += [message for _, message in transmitter.waiting]
                transmitter.waiting.clear()
        return [(sender, message) for sender, message in said if working[sender]], dropped

    def _deliver_at_once(
        self, said: list[_Said], truth: Truth, working: Bools, inboxes: list[list[Message]]
    ) -> list[Delivery]:
        """Distance alone decides, and what is heard is heard now."""
        if not said:
            return []
        senders = np.array([sender for sender, _ in said], dtype=np.int64)
        sequences = np.array([message.sequence for _, message in said], dtype=np.int64)
        heard = self._hear(senders, sequences, truth, working)
        others = len(inboxes) - 1
        deliveries = []
        for (_, message), row in zip(said, heard.tolist(), strict=True):
            heard_by = tuple(i for i, yes in enumerate(row) if yes)
            for i in heard_by:
                inboxes[i].append(message)
            deliveries.append(Delivery(message, others, heard_by))
        return deliveries

    def _deliver_in_time(
        self,
        said: list[_Said],
        truth: Truth,
        working: Bools,
        inboxes: list[list[Message]],
        dropped: list[Message],
    ) -> list[Delivery]:
        """Whatever is on decides; what the queues have no room for is added to `dropped`."""
        before = truth.time if self._before is None else self._before
        self._before = truth.time
        aired = self._transmit(said, before, truth.time, dropped)
        deliveries = self._launch(aired, truth, working) if aired.messages else []
        self._land(truth.time, working, inboxes)
        return deliveries

    def _hear(self, senders: Indices, sequences: Indices, truth: Truth, working: Bools) -> Bools:
        radio = self._radio
        heard: Bools = hear(
            truth.aircraft, senders, sequences, radio.sigma, radio.range, radio.loss, self._key
        )
        return heard if working.all() else heard & working

    # -- bandwidth -------------------------------------------------------------------------------

    def _transmit(
        self, said: list[_Said], before: float, now: float, dropped: list[Message]
    ) -> _Aired:
        """What is out by `now`; what finds its queue full is `dropped`, everything else waits."""
        bandwidth = self._radio.bandwidth
        if not bandwidth:
            return _aired([(before, sender, message) for sender, message in said])
        for sender, message in said:
            transmitter = self._transmitters.setdefault(sender, _Transmitter())
            if len(transmitter.waiting) >= self._radio.queue_limit:
                dropped.append(message)
                continue
            # The last byte is out after all that waits, at the sender's own rate.
            transmitter.free_at = max(transmitter.free_at, before) + wire_size(message) / bandwidth
            transmitter.waiting.append((transmitter.free_at, message))
        out = []
        for sender, transmitter in self._transmitters.items():
            queue = transmitter.waiting
            while queue and queue[0][0] <= now + _CLOSE * self._step:
                at, message = queue.popleft()
                out.append((at, sender, message))
        return _aired(sorted(out, key=lambda entry: (entry[1], entry[2].sequence)))

    # -- on the air ------------------------------------------------------------------------------

    def _launch(self, aired: _Aired, truth: Truth, working: Bools) -> list[Delivery]:
        """Draw who will hear each message and when, and put it on its way."""
        radio, now = self._radio, truth.time
        heard = self._hear(aired.senders, aired.sequences, truth, working)
        late = fates(
            heard,
            self._hidden(heard, aired.senders, truth.aircraft),
            aired.senders,
            aired.sequences,
            radio.building_loss,
            radio.jitter,
            radio.jitter_kind == "exponential",
            radio.duplication,
            self._key,
        )
        due = aired.at[:, None, None] + radio.latency + late
        ticks = np.maximum(np.ceil(due / self._step - _CLOSE), round(now / self._step))
        for start, end, group in self._groups(len(truth.aircraft)):
            apart = group[aired.senders][:, None] != group
            meets = (ticks * self._step >= start) & (aired.at < end)[:, None, None]
            ticks[apart[:, :, None] & meets] = np.inf
        reached = np.isfinite(ticks)
        rows, receivers, copies = np.nonzero(reached)
        when, arrival = ticks[reached].astype(np.int64), due[reached]
        for tick in np.unique(when).tolist():
            part = when == tick
            row = rows[part]
            self._coming.setdefault(tick, []).append(
                _Arrivals(
                    arrival[part],
                    aired.senders[row],
                    aired.sequences[row],
                    copies[part],
                    receivers[part],
                    row,
                    aired.messages,
                )
            )
        others = len(truth.aircraft) - 1
        hearers = (reached[:, :, 0] | reached[:, :, 1]).tolist()
        return [
            Delivery(message, others, tuple(i for i, hears in enumerate(row) if hears))
            for message, row in zip(aired.messages, hearers, strict=True)
        ]

    def _hidden(self, heard: Bools, senders: Indices, aircraft: Floats) -> Bools:
        """(n, n) whether a building stands between two that would hear each other now."""
        count = len(aircraft)
        hidden = np.zeros((count, count), dtype=np.bool_)
        if self._radio.building_loss and self._city is not None:
            linked = np.zeros((count, count), dtype=np.bool_)
            np.logical_or.at(linked, senders, heard)
            a, b = np.nonzero(np.triu(linked | linked.T))
            places = aircraft[:, :3]
            hidden[a, b] = ~self._city.visible_pairs(places[a], places[b])
            hidden |= hidden.T
        return hidden

    def _groups(self, count: int) -> list[tuple[float, float, Indices]]:
        """Start, end and each aircraft's group of every partition."""
        table = []
        for partition in self._radio.partitions:
            group = np.full(count, -1, dtype=np.int64)
            for number, members in enumerate(partition.groups):
                group[[member for member in members if member < count]] = number
            table.append((partition.start, partition.end, group))
        return table

    def _land(self, now: float, working: Bools, inboxes: list[list[Message]]) -> None:
        """Put what has arrived by now into the inboxes."""
        tick = round(now / self._step)
        landed = [part for key in sorted(self._coming) if key <= tick for part in self._coming[key]]
        if not landed:
            return
        self._coming = {key: parts for key, parts in self._coming.items() if key > tick}
        messages: list[Message] = []
        rows = []
        for part in landed:
            rows.append(part.row + len(messages))
            messages += part.messages
        due, senders, sequences, copies, receivers = (
            np.concatenate([part[column] for part in landed]) for column in range(5)
        )
        order = np.lexsort((copies, sequences, senders, due))
        row = np.concatenate(rows)
        for i, k in zip(receivers[order].tolist(), row[order].tolist(), strict=True):
            if working[i]:
                inboxes[i].append(messages[k])


def _sequence(message: Message) -> int:
    return message.sequence


def _origin(delivery: Delivery) -> tuple[int, int]:
    return delivery.message.sender, delivery.message.sequence


def _aired(out: list[tuple[float, int, Message]]) -> _Aired:
    return _Aired(
        [message for _, _, message in out],
        np.array([sender for _, sender, _ in out], dtype=np.int64),
        np.array([message.sequence for _, _, message in out], dtype=np.int64),
        np.array([at for at, _, _ in out], dtype=np.float64),
    )
