"""How well each aircraft was heard, in all and by each other one."""

from typing import Any, Final

import numpy as np

from staniel.record import Record

__all__ = ["LARGEST_MATRIX", "link_matrix", "sender_metrics"]

LARGEST_MATRIX: Final = 16
"""Up to this many aircraft the metrics hold a share for each link."""


def sender_metrics(record: Record) -> list[dict[str, Any]]:
    """``heard_share`` of each aircraft: receptions of its broadcasts by those that were possible.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of dict
        None where it said nothing that anybody could have heard.
    """
    count = record.aircraft.shape[1]
    messages = record.messages[(record.messages["sender"] >= 0)]
    messages = messages[messages["sender"] < count]
    heard = np.bincount(messages["sender"], messages["heard"], count).tolist()
    possible = np.bincount(messages["sender"], messages["receivers"], count).tolist()
    return [
        {"heard_share": of / out_of if out_of else None}
        for of, out_of in zip(heard, possible, strict=True)
    ]


def link_matrix(record: Record) -> list[list[float | None]] | None:
    """Share of the broadcasts of each aircraft (row) that each other one (column) heard.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of lists of float, or None
        None for the whole where the team is larger than `LARGEST_MATRIX` or the record has no
        links, for an aircraft itself, and where one said nothing.
    """
    count = record.aircraft.shape[1]
    if count > LARGEST_MATRIX or record.links.shape != (count, count):
        return None
    on_air = record.messages[record.messages["receivers"] > 0]
    sent = [int((on_air["sender"] == own).sum()) for own in range(count)]
    return [
        [
            heard / sent[own] if sent[own] and own != other else None
            for other, heard in enumerate(row)
        ]
        for own, row in enumerate(record.links.tolist())
    ]
