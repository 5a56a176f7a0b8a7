"""What an agent perceives and believes: poses, sightings, track estimates, beliefs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.checks import checked_covariance, checked_floats
from staniel.datatypes.lidar import LidarScan
from staniel.datatypes.threats import NO_THREATS, Threats

__all__ = ["Belief", "Health", "Percept", "Pose", "Sighting", "TrackEstimate", "TrackId"]


_SEVEN = Struct("7d")


class Pose(NamedTuple):
    """Where an aircraft is and how it lies: m and rad, east-north-up, left bank positive."""

    x: float
    y: float
    z: float
    heading: float
    bank: float
    speed: float


class TrackId(NamedTuple):
    """Identity of a track in the whole team. Of two names for one target the older sorts first."""

    born: float
    founder: int
    serial: int

    def __str__(self) -> str:
        return f"{self.founder}-{self.serial}"


@dataclass(frozen=True, slots=True)
class Sighting:
    """One camera detection: anonymous, with its covariance and the pose it was taken from.

    Parameters
    ----------
    time : float [s]
        When the picture was taken.
    position : (2,) array_like [m]
        On the ground, east and north.
    covariance : (2, 2) array_like [m²]
        Of the position; symmetric and positive definite.
    reporter : int, optional
        Who saw it; -1 when unknown.
    pose : Pose, optional
        Where the camera was.
    pose_deviation : float, optional [m]
        Standard deviation of where the reporter believes to be, on each axis: a tracker adds it to
        the covariance.

    Attributes
    ----------
    row : tuple
        Time, x, y, covariance xx, xy, yy with the reporter's own, reporter: as plain numbers, for
        who reads many.
    packed : bytes
        The same as seven doubles.
    key : tuple
        Reporter, time, x, y: by which a copy is recognised.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite, a covariance that is not positive definite.

    Examples
    --------
    >>> Sighting(3.0, [10.0, 20.0], [[2.25, 0.0], [0.0, 2.25]], reporter=1).position
    array([10., 20.])
    """

    time: float
    position: NDArray[np.float64]
    covariance: NDArray[np.float64]
    reporter: int = field(default=-1, kw_only=True)
    pose: Pose | None = field(default=None, kw_only=True)
    pose_deviation: float = field(default=0.0, kw_only=True)
    row: tuple[float, float, float, float, float, float, int] = field(init=False, repr=False)
    packed: bytes = field(init=False, repr=False)
    key: tuple[int, float, float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        position = checked_floats(self.position, (2,), "Sighting.position")
        covariance = checked_covariance(self.covariance, "Sighting.covariance")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "covariance", covariance)
        off = self.pose_deviation
        if not 0.0 <= off <= 1e6:
            raise ValueError(f"Sighting.pose_deviation = {off}: expected 0 to a million metres")
        (xx, xy), (_, yy) = covariance.tolist()
        own = off * off
        row = (float(self.time), *position.tolist(), xx + own, xy, yy + own, self.reporter)
        object.__setattr__(self, "row", row)
        object.__setattr__(self, "packed", _SEVEN.pack(*row))
        object.__setattr__(self, "key", (self.reporter, *row[:3]))
        if not math.isfinite(self.time):
            raise ValueError(f"Sighting.time = {self.time}: expected a finite number of seconds")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sighting):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[Any, ...]:
        return (
            self.time,
            self.reporter,
            self.pose,
            self.position.tobytes(),
            self.covariance.tobytes(),
            self.pose_deviation,
        )


class TrackEstimate(NamedTuple):
    """What a tracker says of one target at one time.

    Attributes
    ----------
    id : TrackId
    time : float [s]
        Of the estimate.
    position : (2,) float array [m]
    velocity : (2,) float array [m/s]
    covariance : (2, 2) float array [m²]
        Of the position.
    existence : float
        Probability in [0, 1] that the target is there at all.
    last_seen : float [s]
        Time of the newest sighting that went into it.
    turn_rate : float [rad/s]
        Mean of late, left positive; 0 where it is not known.
    """

    id: TrackId
    time: float
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    covariance: NDArray[np.float64]
    existence: float
    last_seen: float
    turn_rate: float = 0.0

    @property
    def course(self) -> float:
        """Direction of motion [rad], counter-clockwise from east (thesis eq. 6.24, corrected)."""
        return math.atan2(float(self.velocity[1]), float(self.velocity[0]))

    @property
    def speed(self) -> float:
        """Speed over ground [m/s]."""
        return math.hypot(float(self.velocity[0]), float(self.velocity[1]))

    def ahead(self, seconds: float) -> NDArray[np.float64]:
        """Position `seconds` later, if it keeps its velocity [m]."""
        return self.position + seconds * self.velocity


class Health(NamedTuple):
    """What an aircraft knows of itself: do camera and radio work, what share of energy is left."""

    camera: bool = True
    radio: bool = True
    energy: float = 1.0


@dataclass(frozen=True, slots=True)
class Percept:
    """What one aircraft perceives in one tick: navigation, camera, lidar, threat sensor, itself."""

    time: float
    pose: Pose
    sightings: tuple[Sighting, ...]
    lidar: LidarScan | None = None
    threats: Threats = NO_THREATS
    health: Health = Health()  # noqa: RUF009 - immutable


@dataclass(frozen=True, slots=True)
class Belief:
    """What an agent holds true and what it is doing: for the recorder, never for another agent.

    Attributes
    ----------
    tracks : sequence of TrackEstimate
    role : str
        ``"search"``, ``"pursue"``, ``"help"``, ``"recover"``, ``"patrol"``, ``"standby"`` where it
        cannot see, or ``"loiter"`` where its policy found no flight that is safe.
    target : TrackId or None
        The track it is responsible for.
    goal : (float, float) [m]
        Where it is heading.
    guard : str
        What avoidance made of it: ``""`` where it flies what it decided, ``"avoid"`` where it flies
        something else that is safe, ``"loiter"`` where it found nothing that it knows to be safe.
    """

    tracks: Sequence[TrackEstimate]
    role: str
    target: TrackId | None
    goal: tuple[float, float]
    guard: str = ""
