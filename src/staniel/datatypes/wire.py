"""Messages as packets of bytes, for real links; and how long each is on the air, for radios.

Little-endian, in this order:

=============  =====================================================================================
part           bytes
=============  =====================================================================================
head           16: format 1, kind 1, sender 2, sequence 4, time 8; every message has it
track name     14: born 8, founder 2, serial 4
point, cost    8 (two 4-byte numbers), 4
pose           24 (six 4-byte numbers)
heartbeat      head, role 1, health 1, flags 1, pose, goal, cost; and where there are any: track
               name, point, velocity 8 unless it is 0, track name helped, count 2 and 2 for each
               helper, command; count 2 and for each unheld target track name, point, course 4,
               seen 8
command        line 25: kind 1, start, end, speed 4, height 4; orbit 22: kind 1, centre, radius 4,
               turn 1, speed 4, height 4; banks 14: kind 1, hold, speed and height 4 each, count 1;
               and 2 for each bank, and a point where they name a look
report         head, count 2, whether it names 1; for each sighting 31: flags 1, time 8, point,
               covariance 12, reporter 2; and pose, deviation 4 and track name where there are any
warn           head, two counts 2; for each region 9: flags 1, floor 8; rate 8 and ceiling 8 where
               there are any; and a disc 24, or count 2 and 16 for each corner; for each carrier 38:
               time 8, point, covariance 12, reporter 2, radius and rate 4 each
looked         head, count 2, cells
announce       head, track name, point, course 4, cost, speed 4
bid            head, count 2, whether it tells terms 1; for each target a track name, auctioneer 2,
               cost, and count 1 and 4 for each term where it tells them
award          head, track name, point, winner 2, cost, count 2; for each bid bidder 2, cost,
               count 1 and 4 for each term
acknowledge    head, track name, auctioneer 2
revoke         head, track name, auctioneer 2, track name, point, cost; handover alike
release        head, track name, point, lost 1, seen 8
assistance     request: head, track name, point, reason 1; offer: head, track name, holder 2, cost;
               end: head, track name
beacon         head
bundle         head, two counts 2; for each claim a track name, winner 2, bid 4; for each agent
               heard 2 and 8
=============  =====================================================================================

Times, track names and regions are exact. Other numbers are rounded to four bytes, to a
quarter of a millimetre within 8 km; banks to 1e-4 rad.
"""

import hmac
from collections.abc import Callable
from hashlib import blake2b
from struct import Struct
from typing import Final

from staniel.datatypes.malformed import fault_of
from staniel.datatypes.message import Message
from staniel.datatypes.packing import Reader, Writer
from staniel.datatypes.wire_bodies import BODIES
from staniel.datatypes.wire_sizes import CARRIER, HEAD, LARGEST, SIGHTING, TAG, wire_size
from staniel.errors import StanielError, WireError

__all__ = ["CARRIER", "HEAD", "LARGEST", "SIGHTING", "TAG", "decode", "encode", "wire_size"]

_HEAD: Final = Struct("<BBHId")
_PLAIN, _SIGNED = 0xA0, 0xA1  # the format: this one, without and with a tag
_PERSON: Final = b"staniel wire"
_CODES: Final = {kind: code for code, kind in enumerate(BODIES, 1)}
_KINDS: Final = tuple(BODIES)


def encode(message: Message, key: bytes | None = None) -> bytes:
    """A message as a packet.

    Parameters
    ----------
    message : Message
    key : bytes, optional
        16 to 64 bytes that the team shares: with it the packet ends with a tag of `TAG` bytes that
        nobody else can make (keyed BLAKE2b).

    Returns
    -------
    bytes
        `wire_size` of them, and `TAG` more with a key.

    Raises
    ------
    WireError
        The message is malformed, or takes more than `LARGEST` bytes.
    StanielError
        A key of another length.

    Examples
    --------
    >>> from staniel.datatypes.belief import TrackId
    >>> from staniel.datatypes.message import AssistanceEnd
    >>> packet = encode(AssistanceEnd(3, 17, 5.0, target=TrackId(2.5, 3, 1)))
    >>> len(packet), decode(packet).target
    (30, TrackId(born=2.5, founder=3, serial=1))
    """
    _check_key(key)
    fault = fault_of(message)
    if fault is not None:
        raise WireError(f"cannot be sent: {fault.words}", fault.reason)
    writer, kind = Writer(), type(message)
    first = _PLAIN if key is None else _SIGNED
    writer.put(_HEAD, first, _CODES[kind], message.sender, message.sequence, message.time)
    BODIES[kind].put(writer, message)
    packet = bytes(writer)
    return packet if key is None else packet + _tag(packet, key)


def decode(packet: bytes, key: bytes | None = None) -> Message:
    """The message that a packet holds.

    Parameters
    ----------
    packet : bytes
        From anywhere.
    key : bytes, optional
        With which `encode` signed it.

    Returns
    -------
    Message
        `fault_of` finds nothing wrong with it.

    Raises
    ------
    WireError
        Whatever else is in the packet. Its `reason` is ``"oversized"``, ``"forged"`` (with a key:
        no tag, or another than the key makes; without: a tag that cannot be checked) or
        ``"malformed"``.
    StanielError
        A key of another length than 16 to 64.
    """
    _check_key(key)
    if not isinstance(packet, (bytes, bytearray, memoryview)):
        raise WireError(f"a packet of type {type(packet).__name__}: expected bytes")
    if memoryview(packet).nbytes > LARGEST + TAG:
        size = memoryview(packet).nbytes
        raise WireError(f"{size:,} bytes: expected at most {LARGEST + TAG:,}", "oversized")
    packet = _checked(bytes(packet), key)
    try:
        message = _read(packet)
        fault = fault_of(message)
    except WireError:
        raise
    except ValueError as error:
        raise WireError(f"malformed: {error}") from error
    if fault is not None:
        raise WireError(fault.words, fault.reason)
    return message


def _read(packet: bytes) -> Message:
    reader = Reader(packet)
    _, code, sender, sequence, time = reader.take(_HEAD)
    if not 1 <= code <= len(_KINDS):
        raise WireError(f"kind {code}: expected 1 to {len(_KINDS)}")
    kind: Callable[..., Message] = _KINDS[code - 1]
    content = BODIES[_KINDS[code - 1]].get(reader)
    if reader.left:
        raise WireError(f"{reader.left} bytes too long for a message of its kind")
    return kind(sender, sequence, time, **content)


def _checked(packet: bytes, key: bytes | None) -> bytes:
    """The packet without its tag."""
    form = packet[0] if packet else -1
    if form not in (_PLAIN, _SIGNED):
        raise WireError(f"format {form}: expected {_PLAIN} or {_SIGNED}")
    if key is None:
        if form == _SIGNED:
            raise WireError("signed, and there is no key to check it with", "forged")
        return packet
    body, tag = packet[:-TAG], packet[-TAG:]
    if form == _PLAIN or not hmac.compare_digest(tag, _tag(body, key)):
        raise WireError("not signed with the team's key", "forged")
    return body


def _tag(packet: bytes, key: bytes) -> bytes:
    return blake2b(packet, digest_size=TAG, key=key, person=_PERSON).digest()


def _check_key(key: bytes | None) -> None:
    if key is not None and not 16 <= len(key) <= 64:
        raise StanielError(f"key of {len(key)} bytes: expected 16 to 64")
