"""What agents say to one another. Every message is a broadcast that may be lost.

A message names its sender, its number in the sender's own sequence, and when it was said; with the
first two a receiver recognises a copy. The auction's words are those of thesis section 7.2.1.
"""

from dataclasses import dataclass

from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import Command
from staniel.datatypes.threats import Threats

__all__ = [
    "Announce",
    "Award",
    "Bid",
    "Delivery",
    "Heartbeat",
    "Message",
    "Point",
    "Release",
    "Report",
    "Revoke",
    "Warn",
]

Point = tuple[float, float]


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


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """I am alive, here, doing this. A held target's award is a lease that this renews.

    `helps` is the target that the sender watches beside its holder; `command` is what it flies from
    `pose` on, where partners or those who avoid it want to know.
    """

    pose: Pose
    role: str
    goal: Point
    target: TrackId | None
    target_position: Point | None
    cost: float
    helps: TrackId | None = None
    command: Command | None = None


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
class Announce(Message):
    """P(i): this target is up for auction, and so much would it cost me (thesis eq. 7.1)."""

    target: TrackId
    position: Point
    course: float
    cost: float


@dataclass(frozen=True, slots=True)
class Bid(Message):
    """Q_j: so much would it cost me (thesis eq. 7.2)."""

    target: TrackId
    auctioneer: int
    cost: float


@dataclass(frozen=True, slots=True)
class Award(Message):
    """The target is the winner's."""

    target: TrackId
    position: Point
    winner: int
    cost: float


@dataclass(frozen=True, slots=True)
class Revoke(Message):
    """Your auction is void: I hold that target already, under this name and at this cost."""

    target: TrackId
    auctioneer: int
    held_as: TrackId
    position: Point
    cost: float


@dataclass(frozen=True, slots=True)
class Release(Message):
    """I no longer hold that target: lost from sight, or left to a better-placed aircraft."""

    target: TrackId
    position: Point
    lost: bool


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
