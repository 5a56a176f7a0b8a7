"""What each kind of message says after its head: see the table of `staniel.datatypes.wire`."""

from collections.abc import Callable
from struct import Struct
from typing import Any, Final, NamedTuple

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
    Claim,
    Handover,
    Heartbeat,
    Looked,
    Message,
    Offer,
    Release,
    Report,
    Revoke,
    Unheld,
    Warn,
)
from staniel.datatypes.packing import (
    Reader,
    Writer,
    code_of,
    get_carrier,
    get_command,
    get_region,
    get_sighting,
    put_carrier,
    put_command,
    put_region,
    put_sighting,
    word_of,
)
from staniel.datatypes.parts import HEALTHS, REASONS, ROLES
from staniel.datatypes.threats import Threats
from staniel.datatypes.wire_sizes import CARRIER, SIGHTING
from staniel.errors import WireError

__all__ = ["BODIES", "Body"]

Content = dict[str, Any]

_COURSE: Final = Struct("<3f")
_STATE: Final = Struct("<3B")
_NEWS: Final = Struct("<Hd")
_TARGET, _PLACE, _MOVES, _HELPS, _HELPED, _FLIES, _KNOWS = 1, 2, 4, 8, 16, 32, 64


class Body(NamedTuple):
    """How a kind's content is written, and read again as the kind's arguments."""

    put: Callable[[Writer, Any], None]
    get: Callable[[Reader], Content]


def _put_heartbeat(writer: Writer, m: Heartbeat) -> None:
    moves = m.target_velocity != (0.0, 0.0)
    flags = (
        (_TARGET if m.target is not None else 0)
        | (_PLACE if m.target_position is not None else 0)
        | (_MOVES if moves else 0)
        | (_HELPS if m.helps is not None else 0)
        | (_HELPED if m.helpers else 0)
        | (_FLIES if m.command is not None else 0)
        | (_KNOWS if m.unheld else 0)
    )
    writer.put(_STATE, code_of(m.role, ROLES), code_of(m.health, HEALTHS), flags)
    writer.pose(m.pose)
    writer.point(m.goal)
    writer.number(m.cost)
    if m.target is not None:
        writer.name(m.target)
    if m.target_position is not None:
        writer.point(m.target_position)
    if moves:
        writer.point(m.target_velocity)
    if m.helps is not None:
        writer.name(m.helps)
    if m.helpers:
        writer.count(len(m.helpers))
        for helper in m.helpers:
            writer.agent(helper)
    if m.command is not None:
        put_command(writer, m.command)
    if m.unheld:
        writer.count(len(m.unheld))
        for unheld in m.unheld:
            writer.name(unheld.target)
            writer.point(unheld.position)
            writer.number(unheld.course)
            writer.time(unheld.seen)


def _get_unheld(reader: Reader) -> Unheld:
    return Unheld(reader.name(), reader.point(), reader.number(), reader.time())


def _get_some(
    reader: Reader, present: int, least: int, get: Callable[[Reader], Any]
) -> tuple[Any, ...]:
    """As many of something as are told of; a list that is there is not empty."""
    if not present:
        return ()
    count = reader.count(least)
    if not count:
        raise WireError("a list of none: expected one at least")
    return tuple(get(reader) for _ in range(count))


def _get_heartbeat(reader: Reader) -> Content:
    role, health, flags = reader.take(_STATE)
    if flags >= 2 * _KNOWS:
        raise WireError(f"flags {flags:#04x}: expected less than {2 * _KNOWS:#04x}")
    return {
        "role": word_of(role, ROLES),
        "health": word_of(health, HEALTHS),
        "pose": reader.pose(),
        "goal": reader.point(),
        "cost": reader.number(),
        "target": reader.name() if flags & _TARGET else None,
        "target_position": reader.point() if flags & _PLACE else None,
        "target_velocity": reader.point() if flags & _MOVES else (0.0, 0.0),
        "helps": reader.name() if flags & _HELPS else None,
        "helpers": _get_some(reader, flags & _HELPED, 2, Reader.agent),
        "command": get_command(reader) if flags & _FLIES else None,
        "unheld": _get_some(reader, flags & _KNOWS, 34, _get_unheld),
    }


def _put_report(writer: Writer, m: Report) -> None:
    writer.count(len(m.sightings))
    writer.byte(1 if m.names else 0)
    for seen, name in zip(m.sightings, m.names or (None,) * len(m.sightings), strict=True):
        put_sighting(writer, seen, name)


def _get_report(reader: Reader) -> Content:
    count, named = reader.count(SIGHTING), reader.flags(1)
    told = [get_sighting(reader) for _ in range(count)]
    names = tuple(name for _, name in told)
    if not named and any(names):
        raise WireError("a name in a report that names nothing")
    return {"sightings": tuple(seen for seen, _ in told), "names": names if named else ()}


def _put_warn(writer: Writer, m: Warn) -> None:
    writer.count(len(m.threats.regions))
    writer.count(len(m.threats.carriers))
    for region in m.threats.regions:
        put_region(writer, region)
    for carrier in m.threats.carriers:
        put_carrier(writer, carrier)


def _get_warn(reader: Reader) -> Content:
    regions, carriers = reader.count(33), reader.count(CARRIER)
    return {
        "threats": Threats(
            tuple(get_region(reader) for _ in range(regions)),
            tuple(get_carrier(reader) for _ in range(carriers)),
        )
    }


def _put_looked(writer: Writer, m: Looked) -> None:
    writer.count(len(m.cells))
    writer.raw(m.cells)


def _get_looked(reader: Reader) -> Content:
    return {"cells": reader.raw(reader.count(1))}


def _put_announce(writer: Writer, m: Announce) -> None:
    writer.name(m.target)
    writer.point(m.position)
    writer.put(_COURSE, m.course, m.cost, m.speed)


def _get_announce(reader: Reader) -> Content:
    target, position = reader.name(), reader.point()
    course, cost, speed = reader.take(_COURSE)
    return {
        "target": target,
        "position": position,
        "course": course,
        "cost": cost,
        "speed": speed,
    }


def _put_bid(writer: Writer, m: Bid) -> None:
    writer.count(len(m.targets))
    writer.byte(1 if m.terms else 0)
    for k, target in enumerate(m.targets):
        writer.name(target)
        writer.agent(m.auctioneers[k])
        writer.number(m.costs[k])
        if m.terms:
            writer.terms(m.terms[k])


def _get_bid(reader: Reader) -> Content:
    count, termed = reader.count(20), reader.flags(1)
    rows = [
        (reader.name(), reader.agent(), reader.number(), reader.terms() if termed else ())
        for _ in range(count)
    ]
    columns = tuple(zip(*rows, strict=True)) or ((), (), (), ())
    content = dict(zip(("targets", "auctioneers", "costs", "terms"), columns, strict=True))
    return content if termed else {**content, "terms": ()}


def _put_award(writer: Writer, m: Award) -> None:
    writer.name(m.target)
    writer.point(m.position)
    writer.agent(m.winner)
    writer.number(m.cost)
    writer.count(len(m.bids))
    for offer in m.bids:
        writer.agent(offer.bidder)
        writer.number(offer.cost)
        writer.terms(offer.terms)


def _get_award(reader: Reader) -> Content:
    return {
        "target": reader.name(),
        "position": reader.point(),
        "winner": reader.agent(),
        "cost": reader.number(),
        "bids": tuple(
            Offer(reader.agent(), reader.number(), reader.terms()) for _ in range(reader.count(7))
        ),
    }


def _put_acknowledge(writer: Writer, m: Acknowledge) -> None:
    writer.name(m.target)
    writer.agent(m.auctioneer)


def _get_acknowledge(reader: Reader) -> Content:
    return {"target": reader.name(), "auctioneer": reader.agent()}


def _put_revoke(writer: Writer, m: Revoke | Handover) -> None:
    writer.name(m.target)
    writer.agent(m.auctioneer)
    writer.name(m.held_as)
    writer.point(m.position)
    writer.number(m.cost)


def _get_revoke(reader: Reader) -> Content:
    return {
        "target": reader.name(),
        "auctioneer": reader.agent(),
        "held_as": reader.name(),
        "position": reader.point(),
        "cost": reader.number(),
    }


def _put_release(writer: Writer, m: Release) -> None:
    writer.name(m.target)
    writer.point(m.position)
    writer.byte(m.lost)
    writer.time(m.seen)


def _get_release(reader: Reader) -> Content:
    target, position = reader.name(), reader.point()
    return {
        "target": target,
        "position": position,
        "lost": bool(reader.flags(1)),
        "seen": reader.time(),
    }


def _put_assistance_request(writer: Writer, m: AssistanceRequest) -> None:
    writer.name(m.target)
    writer.point(m.position)
    writer.byte(code_of(m.reason, REASONS))


def _get_assistance_request(reader: Reader) -> Content:
    target, position = reader.name(), reader.point()
    return {"target": target, "position": position, "reason": word_of(reader.byte(), REASONS)}


def _put_assistance_offer(writer: Writer, m: AssistanceOffer) -> None:
    writer.name(m.target)
    writer.agent(m.holder)
    writer.number(m.cost)


def _get_assistance_offer(reader: Reader) -> Content:
    return {"target": reader.name(), "holder": reader.agent(), "cost": reader.number()}


def _put_assistance_end(writer: Writer, m: AssistanceEnd) -> None:
    writer.name(m.target)


def _get_assistance_end(reader: Reader) -> Content:
    return {"target": reader.name()}


def _put_bundle(writer: Writer, m: Bundle) -> None:
    writer.count(len(m.claims))
    writer.count(len(m.heard))
    for claim in m.claims:
        writer.name(claim.target)
        writer.agent(claim.winner)
        writer.number(claim.bid)
    for news in m.heard:
        writer.put(_NEWS, *news)


def _get_bundle(reader: Reader) -> Content:
    claims, heard = reader.count(20), reader.count(10)
    return {
        "claims": tuple(
            Claim(reader.name(), reader.agent(), reader.number()) for _ in range(claims)
        ),
        "heard": tuple(reader.take(_NEWS) for _ in range(heard)),
    }


BODIES: Final[dict[type[Message], Body]] = {
    Heartbeat: Body(_put_heartbeat, _get_heartbeat),
    Report: Body(_put_report, _get_report),
    Warn: Body(_put_warn, _get_warn),
    Looked: Body(_put_looked, _get_looked),
    Announce: Body(_put_announce, _get_announce),
    Bid: Body(_put_bid, _get_bid),
    Award: Body(_put_award, _get_award),
    Acknowledge: Body(_put_acknowledge, _get_acknowledge),
    Revoke: Body(_put_revoke, _get_revoke),
    Handover: Body(_put_revoke, _get_revoke),
    Release: Body(_put_release, _get_release),
    AssistanceRequest: Body(_put_assistance_request, _get_assistance_request),
    AssistanceOffer: Body(_put_assistance_offer, _get_assistance_offer),
    AssistanceEnd: Body(_put_assistance_end, _get_assistance_end),
    Bundle: Body(_put_bundle, _get_bundle),
    Beacon: Body(lambda writer, message: None, lambda reader: {}),
}
"""By kind, in the order of their codes on the wire, which count from 1: new kinds come last."""
