"""How long each message is on the air, in bytes, for radios whose bandwidth is limited.

An estimate of a compact binary format, not the format of any wire of ours:

=============  =====================================================================================
part           bytes
=============  =====================================================================================
head           16: kind 1, length 1, sender 2, sequence 4, time 8; every message has it
track name     14: born 8, founder 2, serial 4
point, cost    8 (two 4-byte numbers), 4
pose           24 (six 4-byte numbers)
heartbeat      head, pose, role 1, goal, track name, point, cost; where it helps a track name; and
               for a command 29: kind 1, seven 4-byte numbers, or of banks 13: kind 1, hold, speed
               and height, and 1 for their count and 2 for each, and a point where they name a look
report         head, and for each sighting 54: time 8, point, covariance 12, reporter 2, pose;
               and for each name that is told a track name
warn           head; for each region 15: kind 1, corners 2, rate, floor, ceiling 4 each; and 8 for
               each corner, or 12 for a disc; for each carrier 38: time 8, point, covariance 12,
               reporter 2, radius and rate 4 each
announce       head, track name, point, course 4, cost
bid            head, and for each target a track name, auctioneer 2, cost
award          head, track name, point, winner 2, cost
revoke         head, two track names, auctioneer 2, point, cost
release        head, track name, point, lost 1
=============  =====================================================================================
"""

from typing import Final

from staniel.datatypes.command import Command, FlyBanks
from staniel.datatypes.message import (
    Announce,
    Award,
    Bid,
    Heartbeat,
    Message,
    Release,
    Report,
    Revoke,
    Warn,
)
from staniel.datatypes.risk import RiskRegion

__all__ = ["CARRIER", "HEAD", "SIGHTING", "wire_size"]

HEAD: Final = 16
"""What every message has [byte]."""

SIGHTING: Final = 54
"""What each sighting adds to a report [byte]."""

CARRIER: Final = 38
"""What each carrier adds to a warning [byte]."""

_NAME, _POINT, _COST, _POSE, _REGION, _DISC, _COMMAND = 14, 8, 4, 24, 15, 12, 29

_SIZES: Final[dict[type[Message], int]] = {
    Heartbeat: HEAD + _POSE + 1 + _POINT + _NAME + _POINT + _COST,
    Report: HEAD,
    Warn: HEAD,
    Announce: HEAD + _NAME + _POINT + 4 + _COST,
    Bid: HEAD,
    Award: HEAD + _NAME + _POINT + 2 + _COST,
    Revoke: HEAD + 2 * _NAME + 2 + _POINT + _COST,
    Release: HEAD + _NAME + _POINT + 1,
}


def wire_size(message: Message) -> int:
    """Bytes of a message on the air; of a kind that the table lacks, its head's.

    Examples
    --------
    >>> wire_size(Report(0, 1, 5.0, sightings=()))
    16
    """
    size = _SIZES.get(type(message), HEAD)
    if isinstance(message, Heartbeat):
        size += _NAME if message.helps is not None else 0
        size += _command_size(message.command)
    elif isinstance(message, Bid):
        size += (_NAME + 2 + _COST) * len(message.targets)
    elif isinstance(message, Report):
        size += SIGHTING * len(message.sightings)
        size += _NAME * sum(name is not None for name in message.names)
    elif isinstance(message, Warn):
        size += CARRIER * len(message.threats.carriers)
        size += sum(map(_region_size, message.threats.regions))
    return size


def _region_size(region: RiskRegion) -> int:
    return _REGION + (_DISC if region.polygon is None else _POINT * len(region.polygon))


def _command_size(command: Command | None) -> int:
    if isinstance(command, FlyBanks):
        return 14 + 2 * len(command.banks) + (0 if command.look is None else _POINT)
    return 0 if command is None else _COMMAND
