"""What a part of a message may be. Each check says in words what is wrong, or nothing.

The limits are far beyond what any mission needs: what is within them overflows nowhere.
"""

import math
import reprlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.message import COST_TERMS, Claim, Offer, Unheld
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.threats import Carrier
from staniel.kernels.flight import MAX_BANKS

__all__ = [
    "HEALTHS",
    "LAST_ID",
    "LAST_NUMBER",
    "LATEST",
    "NOBODY",
    "REASONS",
    "ROLES",
    "agent_fault",
    "agent_or_nobody_fault",
    "carrier_fault",
    "claim_fault",
    "command_fault",
    "cost_fault",
    "count_fault",
    "each_fault",
    "name_fault",
    "name_or_none_fault",
    "news_fault",
    "number_fault",
    "numbers_fault",
    "offer_fault",
    "place_fault",
    "pose_fault",
    "region_fault",
    "shortened",
    "sighting_fault",
    "terms_fault",
    "unheld_fault",
    "until_fault",
    "whole_fault",
    "word_fault",
]

ROLES: Final = ("search", "pursue", "help", "recover", "loiter", "standby", "patrol")
HEALTHS: Final = ("healthy", "blind", "weak")
REASONS: Final = ("visibility", "value", "avoidance")

LAST_ID: Final = 65_534
"""Greatest number of an agent."""

NOBODY: Final = -1
"""In place of an agent where none is known: of who saw something, or wins it."""

LAST_NUMBER: Final = 2**32 - 1
"""Greatest number in a sequence, and of a track of one founder."""

_FAR: Final = 1e6
"""Greatest length [m], speed [m/s], rate [1/s] and angle [rad]."""

LATEST: Final = 1e10
"""Greatest time before or after 0 [s]."""

# Limits that four bytes hold exactly, so that rounding crosses none of them.
_DEAR: Final = 2.0**40  # of a cost
_LEAST: Final = 2.0**-20  # of what is greater than 0: a radius [m], a hold [s]
_FINEST, _COARSEST = 2.0**-40, 2.0**33  # of a variance [m²]
_STEEP: Final = 3.2  # of a bank [rad]
_ASTRAY: Final = 1e5  # of `Sighting.pose_deviation` [m]
_CLOCKS: Final = 1e-3  # two clocks of one aircraft may differ by [s]

_REAL: Final = frozenset({float, int, np.float64})


def shortened(value: object) -> str:
    """Any value in a line at most, however large it is."""
    return reprlib.repr(value)[:80]


def whole_fault(value: int, field: str, last: int, first: int = 0) -> str:
    """A whole number of Python's own."""
    if type(value) is int and first <= value <= last:
        return ""
    return f"{field} = {shortened(value)}: expected a whole number from {first} to {last}"


def agent_fault(value: int, field: str) -> str:
    """An agent's number."""
    return whole_fault(value, field, LAST_ID)


def agent_or_nobody_fault(value: int, field: str) -> str:
    """An agent's number, or `NOBODY`."""
    return whole_fault(value, field, LAST_ID, NOBODY)


def number_fault(value: float, field: str, least: float = -_FAR, most: float = _FAR) -> str:
    """A finite number, by default of metres, metres per second or radians."""
    if type(value) in _REAL and least <= value <= most:
        return ""
    return f"{field} = {shortened(value)}: expected a number from {least:g} to {most:g}"


def cost_fault(value: float, field: str = "cost") -> str:
    """Priorities may have made it negative; who cannot come says infinity."""
    if type(value) in _REAL and (-_DEAR <= value <= _DEAR or value == math.inf):
        return ""
    return f"{field} = {shortened(value)}: expected up to ±{_DEAR:.3g}, or infinity"


def until_fault(value: float, field: str, now: float) -> str:
    """A time that is past when the message is said."""
    if type(value) in _REAL and -LATEST <= value <= now + _CLOCKS:
        return ""
    return f"{field} = {shortened(value)}: expected up to {now:g}, when that was said"


def numbers_fault(value: tuple[float, ...], count: int, field: str) -> str:
    """So many finite numbers in a tuple."""
    if isinstance(value, tuple) and len(value) == count:
        for x in value:
            if type(x) not in _REAL or not -_FAR <= x <= _FAR:
                break
        else:
            return ""
    return f"{field} = {shortened(value)}: expected {count} numbers within ±{_FAR:g}"


def place_fault(value: tuple[float, float], field: str = "position") -> str:
    """East and north [m], or [m/s]."""
    return numbers_fault(value, 2, field)


def pose_fault(value: Pose, field: str) -> str:
    """Where an aircraft is and how it lies."""
    if type(value) is not Pose:
        return f"{field} = {shortened(value)}: expected a pose"
    return numbers_fault(value, 6, field)


def name_fault(value: TrackId, field: str = "target") -> str:
    """Name of a track."""
    if type(value) is TrackId:
        born, founder, serial = value
        if (
            type(born) in _REAL
            and type(founder) is type(serial) is int
            and -LATEST <= born <= LATEST
            and 0 <= founder <= LAST_ID
            and 0 <= serial <= LAST_NUMBER
        ):
            return ""
    return f"{field} = {shortened(value)}: expected the name of a track"


def word_fault(value: str, words: tuple[str, ...], field: str) -> str:
    """One of some words."""
    if type(value) is str and value in words:
        return ""
    return f"{field} = {shortened(value)}: expected one of {', '.join(words)}"


def each_fault(values: tuple[Any, ...], check: Callable[[Any, str], str], field: str) -> str:
    """A tuple of what `check` looks at."""
    if type(values) is not tuple:
        return f"{field} = {shortened(values)}: expected a tuple"
    for value in values:
        words = check(value, field)
        if words:
            return words
    return ""


def count_fault(values: tuple[Any, ...], field: str, count: int) -> str:
    """A tuple that has one entry for each of another."""
    if len(values) == count:
        return ""
    return f"{field} has {len(values)} entries: expected {count}"


def terms_fault(value: tuple[float, ...], field: str) -> str:
    """What a cost is the sum of, as far as it is told."""
    if type(value) is tuple and len(value) > len(COST_TERMS):
        return f"{field} has {len(value)} entries: expected at most {len(COST_TERMS)}"
    return each_fault(value, cost_fault, field)


def command_fault(command: FlyLine | FlyOrbit | FlyBanks) -> str:
    """What an aircraft flies."""
    words = number_fault(command.speed, "speed") or number_fault(command.altitude, "altitude")
    match command:
        case FlyLine():
            return words or place_fault(command.start, "start") or place_fault(command.end, "end")
        case FlyOrbit():
            if command.turn not in (1, -1):
                return f"turn = {shortened(command.turn)}: expected 1 or -1"
            radius = number_fault(command.radius, "radius", _LEAST)
            return words or radius or place_fault(command.center, "center")
        case FlyBanks(banks=banks):
            words = words or number_fault(command.hold, "hold", _LEAST)
            words = words or each_fault(banks, _bank_fault, "banks")
            if not 1 <= len(banks) <= MAX_BANKS:
                return words or f"banks has {len(banks)} entries: expected 1 to {MAX_BANKS}"
            return words or ("" if command.look is None else place_fault(command.look, "look"))
        case _:
            return f"command = {shortened(command)}: expected a line, an orbit or banks"


def _bank_fault(value: float, field: str) -> str:
    return number_fault(value, field, -_STEEP, _STEEP)


def sighting_fault(seen: Sighting, now: float) -> str:
    """Its constructor has seen to the shapes, and that the covariance is one."""
    if type(seen) is not Sighting:
        return f"sightings: {shortened(seen)}: expected a sighting"
    time, x, y = seen.row[:3]
    covariance = seen.covariance
    return (
        until_fault(time, "sighting time", now)
        or place_fault((x, y), "sighting position")
        or number_fault(seen.pose_deviation, "pose_deviation", 0.0, _ASTRAY)
        or _variances_fault(covariance.item(0), covariance.item(3))
        or agent_or_nobody_fault(seen.reporter, "reporter")
        or ("" if seen.pose is None else pose_fault(seen.pose, "sighting pose"))
    )


def _variances_fault(xx: float, yy: float) -> str:
    if _FINEST <= xx <= _COARSEST and _FINEST <= yy <= _COARSEST:
        return ""
    return f"variances {xx:g} and {yy:g}: expected {_FINEST:.2g} to {_COARSEST:.2g} m²"


def carrier_fault(carrier: Carrier, now: float) -> str:
    """Its constructor has seen to the shapes, and that the covariance is one."""
    if type(carrier) is not Carrier:
        return f"carriers: {shortened(carrier)}: expected a carrier"
    x, y = carrier.position.tolist()
    (xx, _), (_, yy) = carrier.covariance.tolist()
    return (
        until_fault(carrier.time, "carrier time", now)
        or place_fault((x, y), "carrier position")
        or _variances_fault(xx, yy)
        or number_fault(carrier.radius, "radius", _LEAST)
        or number_fault(carrier.rate, "rate", 0.0)
        or agent_or_nobody_fault(carrier.reporter, "reporter")
    )


def name_or_none_fault(value: TrackId | None, field: str) -> str:
    """Name of a track, or none."""
    return "" if value is None else name_fault(value, field)


def region_fault(value: RiskRegion, field: str) -> str:
    """Its constructor has seen to everything else."""
    return "" if type(value) is RiskRegion else f"{field}: {shortened(value)}: expected a region"


def offer_fault(value: Offer, field: str) -> str:
    """One bidder's cost for one target."""
    if type(value) is not Offer:
        return f"{field}: {shortened(value)}: expected an offer"
    bidder, cost, terms = value
    return agent_fault(bidder, "bidder") or cost_fault(cost) or terms_fault(terms, "terms")


def claim_fault(value: Claim, field: str) -> str:
    """Who wins a target."""
    if type(value) is not Claim:
        return f"{field}: {shortened(value)}: expected a claim"
    target, winner, bid = value
    return name_fault(target) or agent_or_nobody_fault(winner, "winner") or cost_fault(bid, "bid")


def unheld_fault(value: Unheld, field: str, now: float) -> str:
    """A target that nobody holds, last seen by `now`."""
    if type(value) is not Unheld:
        return f"{field} = {shortened(value)}: expected an unheld target"
    return (
        name_fault(value.target, field)
        or place_fault(value.position, field)
        or number_fault(value.course, field)
        or until_fault(value.seen, field, now)
    )


def news_fault(value: tuple[int, float], now: float) -> str:
    """Of which agent there is word from when."""
    if type(value) is not tuple or len(value) != 2:
        return f"heard: {shortened(value)}: expected an agent and a time"
    agent, time = value
    return agent_fault(agent, "heard") or until_fault(time, "heard", now)
