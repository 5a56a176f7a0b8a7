"""The radio: every message is a broadcast that each other aircraft hears or misses by itself."""

from collections.abc import Sequence

import numpy as np

from staniel.datatypes.equipment import RadioSet
from staniel.datatypes.message import Delivery, Message
from staniel.datatypes.truth import Truth
from staniel.kernels.radio import hear

__all__ = ["Radio"]


class Radio:
    """Delivers messages, or loses them with distance.

    Parameters
    ----------
    radio : RadioSet
    key : uint64
        Of the stream of its draws.
    """

    def __init__(self, radio: RadioSet, key: np.uint64) -> None:
        self._radio = radio
        self._key = np.uint64(key)

    def deliver(
        self, outboxes: Sequence[Sequence[Message]], truth: Truth
    ) -> tuple[list[list[Message]], list[Delivery]]:
        """What everybody hears of what was said.

        Parameters
        ----------
        outboxes : sequence of sequence of Message
            One an aircraft, in the order of `Truth.aircraft`.
        truth : Truth
            Distances are of its instant.

        Returns
        -------
        inboxes : list of list of Message
            One an aircraft, in the order of sender and sequence.
        deliveries : list of Delivery
            One a message, in the same order.
        """
        said = [
            (sender, message)
            for sender, outbox in enumerate(outboxes)
            for message in sorted(outbox, key=_sequence)
        ]
        inboxes: list[list[Message]] = [[] for _ in range(len(truth.aircraft))]
        if not said:
            return inboxes, []
        senders = np.array([sender for sender, _ in said], dtype=np.int64)
        sequences = np.array([message.sequence for _, message in said], dtype=np.int64)
        radio = self._radio
        heard = hear(truth.aircraft, senders, sequences, radio.sigma, radio.range, self._key)
        others = len(inboxes) - 1
        deliveries = []
        for (_, message), row in zip(said, heard.tolist(), strict=True):
            heard_by = tuple(i for i, yes in enumerate(row) if yes)
            for i in heard_by:
                inboxes[i].append(message)
            deliveries.append(Delivery(message, others, heard_by))
        return inboxes, deliveries


def _sequence(message: Message) -> int:
    return message.sequence
