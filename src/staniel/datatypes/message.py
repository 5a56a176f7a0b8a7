"""What agents say to one another. Every message is a broadcast that may be lost.

A message names its sender, its number in the sender's own sequence, and when it was said; with the
first two a receiver recognises a copy. The auction's words are those of thesis section 7.2.1.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import Command
from staniel.datatypes.threats import Threats

__all__ = [
    "COST_TERMS",
    "Acknowledge",
    "Announce",
    "AssistanceEnd",
    "AssistanceOffer",
    "AssistanceRequest",
    "Award",
    "Beacon",
    "Bid",
    "Bundle",
    "Claim",
    "Delivery",
    "Handover",
    "Heartbeat",
    "Looked",
    "Message",
    "Offer",
    "Point",
    "Release",
    "Report",
    "Revoke",
    "Unheld",
    "Warn",
]

Point = tuple[float, float]

COST_TERMS = (
    "distance",
    "energy",
    "exposure",
    "visibility",
    "sensor",
    "speed",
    "handover",
    "priority",
)
"""What a cost is the sum of, in the order of `Offer.terms`."""


@dataclass(frozen=True, slots=True)
class Message:
    """What every message carries: sender, its running number there, and when it was said [s]."""

    sender: int
    sequence: int
    time: float

    @property
    def kind(self) -> str:
        """Name of the message on the wire and in records."""
        return type(self).__name__.lower()


class Unheld(NamedTuple):
    """A target that nobody holds: where it was [m], which way it drove [rad], when seen [s]."""

    target: TrackId
    position: Point
    course: float
    seen: float


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """I am alive, here, doing this. A held target's award is a lease that this renews.

    Attributes
    ----------
    pose : Pose
    role : str
        As in `Belief`.
    goal : (float, float) [m]
    target : TrackId or None
        What the sender holds.
    target_position : (float, float) [m] or None
    target_velocity : (float, float) [m/s]
    cost : float [m]
        Of holding it; infinite without a target.
    helps : TrackId or None
        The target that the sender watches beside its holder.
    helpers : tuple of int
        Whom the sender, a holder, took as its helpers.
    unheld : tuple of Unheld
        Targets that the sender knows and nobody holds, as far as it knows; the longest unseen
        first.
    health : str
        ``"healthy"``, ``"blind"`` (its camera is dead) or ``"weak"`` (little energy left).
    command : Command or None
        What it flies from `pose` on, where partners or those who avoid it want to know.
    """

    pose: Pose
    role: str
    goal: Point
    target: TrackId | None
    target_position: Point | None
    cost: float
    helps: TrackId | None = None
    command: Command | None = None
    target_velocity: Point = (0.0, 0.0)
    helpers: tuple[int, ...] = ()
    health: str = "healthy"
    unheld: tuple[Unheld, ...] = ()

    @property
    def is_free(self) -> bool:
        """Whether the sender could take a target."""
        return self.target is None and self.health == "healthy" and self.role != "patrol"


@dataclass(frozen=True, slots=True)
class Report(Message):
    """What my camera saw, and by which name I know what caused each sighting, if I do."""

    sightings: tuple[Sighting, ...]
    names: tuple[TrackId | None, ...] = ()


@dataclass(frozen=True, slots=True)
class Warn(Message):
    """There is danger: what my threat sensor noticed."""

    threats: Threats


@dataclass(frozen=True, slots=True)
class Looked(Message):
    """Which street cells were looked at when, as `staniel.cooperation.SearchMap` packs it."""

    cells: bytes


@dataclass(frozen=True, slots=True)
class Beacon(Message):
    """I am the ground station, and I share the targets out: my awards are orders."""


@dataclass(frozen=True, slots=True)
class Announce(Message):
    """P(i): this target is up for auction, and so much would it cost me (thesis eq. 7.1).

    Course [rad] and speed [m/s] are the target's.
    """

    target: TrackId
    position: Point
    course: float
    cost: float
    speed: float = 0.0


class Offer(NamedTuple):
    """One bidder's cost for one target, and the terms that it is the sum of (`COST_TERMS`)."""

    bidder: int
    cost: float
    terms: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Bid(Message):
    """Q_j: so much would these targets cost me (thesis eq. 7.2), all that I heard of at once.

    Attributes
    ----------
    targets : tuple of TrackId
    auctioneers : tuple of int
        Who announced each.
    costs : tuple of float [m]
    terms : tuple of tuple of float [m]
        Of each cost, in the order of `COST_TERMS`; empty where the cost is the distance alone.
    """

    targets: tuple[TrackId, ...]
    auctioneers: tuple[int, ...]
    costs: tuple[float, ...]
    terms: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Award(Message):
    """The target is the winner's; `bids` say why, the winner's own included."""

    target: TrackId
    position: Point
    winner: int
    cost: float
    bids: tuple[Offer, ...] = ()


@dataclass(frozen=True, slots=True)
class Acknowledge(Message):
    """I heard your award and hold the target."""

    target: TrackId
    auctioneer: int


@dataclass(frozen=True, slots=True)
class Revoke(Message):
    """Your auction is void: I hold that target already, under this name and at this cost."""

    target: TrackId
    auctioneer: int
    held_as: TrackId
    position: Point
    cost: float


@dataclass(frozen=True, slots=True)
class Handover(Message):
    """Your auction of the target that I hold stands: I hold it until its winner says it does."""

    target: TrackId
    auctioneer: int
    held_as: TrackId
    position: Point
    cost: float


@dataclass(frozen=True, slots=True)
class Release(Message):
    """I no longer hold that target: lost from sight, or left to a better-placed aircraft.

    It was last seen at `seen` [s], as far as the sender knows.
    """

    target: TrackId
    position: Point
    lost: bool
    seen: float = -math.inf


@dataclass(frozen=True, slots=True)
class AssistanceRequest(Message):
    """I hold this target and want another aircraft beside me.

    The reason is ``"visibility"``, ``"value"`` or ``"avoidance"``.
    """

    target: TrackId
    position: Point
    reason: str


@dataclass(frozen=True, slots=True)
class AssistanceOffer(Message):
    """I am free and would help, at this cost; the holder's heartbeat says whom it took."""

    target: TrackId
    holder: int
    cost: float


@dataclass(frozen=True, slots=True)
class AssistanceEnd(Message):
    """I want no help any more; said by the holder, or by a helper that leaves."""

    target: TrackId


class Claim(NamedTuple):
    """Who wins a target in a consensus on bundles, and at what bid."""

    target: TrackId
    winner: int
    bid: float


@dataclass(frozen=True, slots=True)
class Bundle(Message):
    """Who I think wins what, and when I last had word of each agent (consensus-based bundles).

    Attributes
    ----------
    claims : tuple of Claim
    heard : tuple of (int, float)
        Agent, and the newest time of what the sender knows of it [s], directly or not.
    """

    claims: tuple[Claim, ...]
    heard: tuple[tuple[int, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Delivery:
    """What became of one message: who could have heard it, who does, now or later.

    Attributes
    ----------
    message : Message
    receivers : int
        How many could have heard it; 0 where it never went on the air, since its sender's queue
        was full.
    heard_by : tuple of int
        Who hears it, each once, however many copies come.
    """

    message: Message
    receivers: int
    heard_by: tuple[int, ...]
