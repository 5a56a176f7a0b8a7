"""What is wrong with a message as it stands: said once, before anybody acts on it.

Cheap, as every message that is heard passes here; and where one object is heard by many, as in a
simulation, it is looked at once.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, NamedTuple

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
from staniel.datatypes.parts import (
    HEALTHS,
    LAST_NUMBER,
    LATEST,
    REASONS,
    ROLES,
    agent_fault,
    carrier_fault,
    claim_fault,
    command_fault,
    cost_fault,
    count_fault,
    each_fault,
    name_fault,
    name_or_none_fault,
    news_fault,
    number_fault,
    offer_fault,
    place_fault,
    pose_fault,
    region_fault,
    shortened,
    sighting_fault,
    terms_fault,
    unheld_fault,
    until_fault,
    whole_fault,
    word_fault,
)
from staniel.datatypes.threats import Threats
from staniel.datatypes.wire_sizes import LARGEST, wire_size

__all__ = ["Fault", "fault_of", "faults_of"]


class Fault(NamedTuple):
    """What is wrong with a message.

    Attributes
    ----------
    reason : {"malformed", "oversized"}
    words : str
        Field, value and what was expected.
    """

    reason: Literal["malformed", "oversized"]
    words: str


# By identity, which stays theirs for as long as they are in here.
_sound: dict[int, Message] = {}
_REMEMBERED: Final = 4096


def fault_of(message: Message) -> Fault | None:
    """What is wrong with a message, or None: then no number in it surprises who reads it.

    Parameters
    ----------
    message : Message
        Of any kind that `staniel.datatypes.message` has.

    Returns
    -------
    Fault or None

    Notes
    -----
    A message is immutable, so a sound one stays sound: up to 4096 of them are known again by
    identity, in a tenth of a microsecond.

    Examples
    --------
    >>> from staniel.datatypes.belief import TrackId
    >>> fault_of(AssistanceEnd(-3, 1, 5.0, target=TrackId(0.0, 1, 2))).words
    'sender = -3: expected a whole number from 0 to 65534'
    """
    if id(message) in _sound:
        return None
    return _examine(message)


def faults_of(messages: Sequence[Message]) -> list[Fault | None]:
    """What is wrong with each of many messages: as `fault_of`, faster."""
    return [None if id(m) in _sound else _examine(m) for m in messages]


def _examine(message: Message) -> Fault | None:
    try:
        words = _head(message) or _FAULTS[type(message)](message)
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        words = f"of wrong types ({error})"
    if words:
        return Fault("malformed", words)
    size = wire_size(message)
    if size > LARGEST:
        return Fault("oversized", f"takes {size:,} bytes: expected at most {LARGEST:,}")
    if len(_sound) >= _REMEMBERED:
        _sound.clear()
    _sound[id(message)] = message
    return None


def _head(message: Message) -> str:
    if type(message) not in _FAULTS:
        return f"of no known kind: {type(message).__name__}"
    return (
        number_fault(message.time, "time", -LATEST, LATEST)
        or agent_fault(message.sender, "sender")
        or whole_fault(message.sequence, "sequence", LAST_NUMBER)
    )


def _heartbeat(m: Heartbeat) -> str:
    words = (
        pose_fault(m.pose, "pose")
        or word_fault(m.role, ROLES, "role")
        or place_fault(m.goal, "goal")
        or cost_fault(m.cost)
        or place_fault(m.target_velocity, "target_velocity")
        or word_fault(m.health, HEALTHS, "health")
    )
    if m.target is not None:
        words = words or name_fault(m.target)
    if m.target_position is not None:
        words = words or place_fault(m.target_position, "target_position")
    if m.helps is not None:
        words = words or name_fault(m.helps, "helps")
    words = words or each_fault(m.helpers, agent_fault, "helpers")
    words = words or each_fault(m.unheld, lambda u, at: unheld_fault(u, at, m.time), "unheld")
    return words or ("" if m.command is None else command_fault(m.command))


def _report(m: Report) -> str:
    words = each_fault(m.sightings, lambda seen, _: sighting_fault(seen, m.time), "sightings")
    words = words or each_fault(m.names, name_or_none_fault, "names")
    return words or (count_fault(m.names, "names", len(m.sightings)) if m.names else "")


def _warn(m: Warn) -> str:
    if type(m.threats) is not Threats:
        return f"threats = {shortened(m.threats)}: expected threats"
    words = each_fault(m.threats.regions, region_fault, "regions")
    return words or each_fault(
        m.threats.carriers, lambda c, _: carrier_fault(c, m.time), "carriers"
    )


def _looked(m: Looked) -> str:
    return "" if type(m.cells) is bytes else f"cells = {shortened(m.cells)}: expected bytes"


def _announce(m: Announce) -> str:
    return (
        name_fault(m.target)
        or place_fault(m.position)
        or number_fault(m.course, "course")
        or cost_fault(m.cost)
        or number_fault(m.speed, "speed", 0.0)
    )


def _bid(m: Bid) -> str:
    count = len(m.targets)
    words = (
        each_fault(m.targets, name_fault, "targets")
        or each_fault(m.auctioneers, agent_fault, "auctioneers")
        or each_fault(m.costs, cost_fault, "costs")
        or count_fault(m.auctioneers, "auctioneers", count)
        or count_fault(m.costs, "costs", count)
        or each_fault(m.terms, terms_fault, "terms")
    )
    return words or (count_fault(m.terms, "terms", count) if m.terms else "")


def _award(m: Award) -> str:
    words = (
        name_fault(m.target)
        or place_fault(m.position)
        or agent_fault(m.winner, "winner")
        or cost_fault(m.cost)
    )
    return words or each_fault(m.bids, offer_fault, "bids")


def _acknowledge(m: Acknowledge) -> str:
    return name_fault(m.target) or agent_fault(m.auctioneer, "auctioneer")


def _revoke(m: Revoke | Handover) -> str:
    words = (
        name_fault(m.target)
        or agent_fault(m.auctioneer, "auctioneer")
        or name_fault(m.held_as, "held_as")
    )
    return words or place_fault(m.position) or cost_fault(m.cost)


def _release(m: Release) -> str:
    words = name_fault(m.target) or place_fault(m.position)
    if type(m.lost) is not bool:
        return words or f"lost = {shortened(m.lost)}: expected true or false"
    return words or ("" if m.seen == -math.inf else until_fault(m.seen, "seen", m.time))


def _assistance_request(m: AssistanceRequest) -> str:
    return (
        name_fault(m.target) or place_fault(m.position) or word_fault(m.reason, REASONS, "reason")
    )


def _assistance_offer(m: AssistanceOffer) -> str:
    return name_fault(m.target) or agent_fault(m.holder, "holder") or cost_fault(m.cost)


def _assistance_end(m: AssistanceEnd) -> str:
    return name_fault(m.target)


def _beacon(m: Beacon) -> str:
    return ""


def _bundle(m: Bundle) -> str:
    return each_fault(m.claims, claim_fault, "claims") or each_fault(
        m.heard, lambda news, _: news_fault(news, m.time), "heard"
    )


_FAULTS: Final[dict[type[Message], Callable[[Any], str]]] = {
    Heartbeat: _heartbeat,
    Report: _report,
    Warn: _warn,
    Looked: _looked,
    Announce: _announce,
    Bid: _bid,
    Award: _award,
    Acknowledge: _acknowledge,
    Revoke: _revoke,
    Handover: _revoke,
    Release: _release,
    AssistanceRequest: _assistance_request,
    AssistanceOffer: _assistance_offer,
    AssistanceEnd: _assistance_end,
    Bundle: _bundle,
    Beacon: _beacon,
}
