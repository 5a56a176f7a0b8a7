"""What a threat sensor notices of the dangers around, and what one agent tells another of them."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.checks import checked_covariance, checked_floats
from staniel.datatypes.risk import RiskRegion

__all__ = ["NO_THREATS", "Carrier", "Threats"]


@dataclass(frozen=True, slots=True)
class Carrier:
    """A vehicle that was noticed to be a threat: anonymous, like a sighting, and as inexact.

    Parameters
    ----------
    time : float [s]
        When it was noticed.
    position : (2,) array_like [m]
        On the ground, east and north.
    covariance : (2, 2) array_like [m²]
        Of the position; symmetric and positive definite.
    radius : float [m]
        Slant range that the threat reaches, greater than 0.
    rate : float [1/s]
        Exposure per second within it, at least 0.
    reporter : int, optional
        Who noticed it; -1 when unknown.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite or out of its range, a covariance that is not
        positive definite.

    Examples
    --------
    >>> Carrier(3.0, [10.0, 20.0], [[25.0, 0.0], [0.0, 25.0]], 120.0, 0.1, reporter=1).position
    array([10., 20.])
    """

    time: float
    position: NDArray[np.float64]
    covariance: NDArray[np.float64]
    radius: float
    rate: float
    reporter: int = field(default=-1, kw_only=True)

    def __post_init__(self) -> None:
        position = checked_floats(self.position, (2,), "Carrier.position")
        covariance = checked_covariance(self.covariance, "Carrier.covariance")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "covariance", covariance)
        if not math.isfinite(self.time):
            raise ValueError(f"Carrier.time = {self.time}: expected a finite number of seconds")
        if not 0.0 < self.radius < math.inf:
            raise ValueError(f"Carrier.radius = {self.radius}: expected metres greater than 0")
        if not 0.0 <= self.rate < math.inf:
            raise ValueError(f"Carrier.rate = {self.rate}: expected at least 0 per second")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Carrier):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[Any, ...]:
        return (
            self.time,
            self.reporter,
            self.radius,
            self.rate,
            self.position.tobytes(),
            self.covariance.tobytes(),
        )


@dataclass(frozen=True, slots=True)
class Threats:
    """Dangers that were noticed; false where there is none.

    Attributes
    ----------
    regions : tuple of RiskRegion
        Threats and no-fly regions, exactly as they are.
    carriers : tuple of Carrier
        In the order of their places, which says nothing of who they are.
    """

    regions: tuple[RiskRegion, ...] = ()
    carriers: tuple[Carrier, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.regions or self.carriers)


NO_THREATS = Threats()
"""Nothing noticed."""
