"""How many bytes each message takes on the air, without packing it: `staniel.datatypes.wire`."""

from collections.abc import Callable
from typing import Any, Final

from staniel.datatypes.belief import Sighting
from staniel.datatypes.command import Command, FlyBanks, FlyLine
from staniel.datatypes.message import (
    Acknowledge,
    Announce,
    AssistanceEnd,
    AssistanceOffer,
    AssistanceRequest,
    Award,
    Beacon,
    Bid,
    Bundle,
    Handover,
    Heartbeat,
    Looked,
    Message,
    Release,
    Report,
    Revoke,
    Warn,
)
from staniel.datatypes.risk import RiskRegion

__all__ = ["CARRIER", "HEAD", "LARGEST", "SIGHTING", "TAG", "wire_size"]

HEAD: Final = 16
"""What every message has [byte]."""

TAG: Final = 8
"""What authentication adds [byte]; not part of `wire_size`."""

LARGEST: Final = 32_768
"""No message is larger, without its tag [byte]: it fits into one datagram, and into any memory."""

SIGHTING: Final = 31
"""What each sighting adds to a report, without pose, deviation and name [byte]."""

CARRIER: Final = 38
"""What each carrier adds to a warning [byte]."""

_POINT, _POSE, _NAME, _ID, _FLOAT, _DOUBLE, _COUNT = 8, 24, 14, 2, 4, 8, 2
_UNHELD = _NAME + _POINT + _FLOAT + _DOUBLE


def wire_size(message: Message) -> int:
    """Bytes of a message on the air; of a kind that the wire does not know, its head's.

    Exactly the length of what `staniel.datatypes.wire.encode` makes of it without a key. May be
    more than `LARGEST`: that one is refused.

    Examples
    --------
    >>> wire_size(Report(0, 1, 5.0, sightings=()))
    19
    """
    size, more = _SIZES.get(type(message), (HEAD, None))
    return size if more is None else size + more(message)


def _heartbeat(message: Heartbeat) -> int:
    size = 0
    if message.target is not None:
        size += _NAME
    if message.target_position is not None:
        size += _POINT
    if message.target_velocity != (0.0, 0.0):
        size += _POINT
    if message.helps is not None:
        size += _NAME
    if message.helpers:
        size += _COUNT + _ID * len(message.helpers)
    if message.unheld:
        size += _COUNT + _UNHELD * len(message.unheld)
    return size if message.command is None else size + _command(message.command)


def _command(command: Command) -> int:
    if isinstance(command, FlyBanks):
        look = 0 if command.look is None else _POINT
        return 1 + 1 + 3 * _FLOAT + 2 * len(command.banks) + look
    return 1 + 2 * _POINT + 2 * _FLOAT if isinstance(command, FlyLine) else 1 + _POINT + 13


def _report(message: Report) -> int:
    named = _NAME * sum(name is not None for name in message.names)
    return sum(map(_sighting, message.sightings)) + named


def _sighting(sighting: Sighting) -> int:
    pose = 0 if sighting.pose is None else _POSE
    return SIGHTING + pose + (_FLOAT if sighting.pose_deviation else 0)


def _warn(message: Warn) -> int:
    threats = message.threats
    return CARRIER * len(threats.carriers) + sum(map(_region, threats.regions))


def _region(region: RiskRegion) -> int:
    size = 1 + _DOUBLE
    size += _DOUBLE * ((region.rate is not None) + (region.ceiling is not None))
    corners = region.polygon
    return size + (3 * _DOUBLE if corners is None else _COUNT + 2 * _DOUBLE * len(corners))


def _bid(message: Bid) -> int:
    terms = sum(1 + _FLOAT * len(terms) for terms in message.terms)
    return (_NAME + _ID + _FLOAT) * len(message.targets) + terms


def _award(message: Award) -> int:
    return sum(_ID + _FLOAT + 1 + _FLOAT * len(offer.terms) for offer in message.bids)


def _bundle(message: Bundle) -> int:
    claims = (_NAME + _ID + _FLOAT) * len(message.claims)
    return claims + (_ID + _DOUBLE) * len(message.heard)


def _looked(message: Looked) -> int:
    return len(message.cells)


_SIZES: Final[dict[type[Message], tuple[int, Callable[[Any], int] | None]]] = {
    Heartbeat: (HEAD + 3 + _POSE + _POINT + _FLOAT, _heartbeat),
    Report: (HEAD + _COUNT + 1, _report),
    Warn: (HEAD + 2 * _COUNT, _warn),
    Looked: (HEAD + _COUNT, _looked),
    Announce: (HEAD + _NAME + _POINT + 3 * _FLOAT, None),
    Bid: (HEAD + _COUNT + 1, _bid),
    Award: (HEAD + _NAME + _POINT + _ID + _FLOAT + _COUNT, _award),
    Acknowledge: (HEAD + _NAME + _ID, None),
    Revoke: (HEAD + 2 * _NAME + _ID + _POINT + _FLOAT, None),
    Handover: (HEAD + 2 * _NAME + _ID + _POINT + _FLOAT, None),
    Release: (HEAD + _NAME + _POINT + 1 + _DOUBLE, None),
    AssistanceRequest: (HEAD + _NAME + _POINT + 1, None),
    AssistanceOffer: (HEAD + _NAME + _ID + _FLOAT, None),
    AssistanceEnd: (HEAD + _NAME, None),
    Bundle: (HEAD + 2 * _COUNT, _bundle),
    Beacon: (HEAD, None),
}
