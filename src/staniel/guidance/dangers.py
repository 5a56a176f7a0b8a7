"""What an agent knows of dangers: told before the start, noticed itself, told by others.

Regions are known exactly and for good. Carriers move and are known where they were noticed last:
see `staniel.guidance.carriers`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.datatypes.belief import TrackEstimate
from staniel.datatypes.risk import CarriedThreat, RiskRegion, region_arrays
from staniel.datatypes.threats import NO_THREATS, Threats
from staniel.errors import StanielError
from staniel.guidance.carriers import Place, Suspects
from staniel.kernels.risk import Regions
from staniel.kernels.threats import inside_regions, reach_chances

__all__ = ["MOST_REGIONS", "NO_DANGERS", "RETELL", "Dangers", "KnownDangers"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

RETELL = 10.0
"""A region that an agent noticed itself is told again so often, since words get lost [s]."""

MOST_REGIONS = 1000
"""So many regions are believed beside those of the briefing: who makes up more is not heeded."""

_CLOCK_TOLERANCE = 1e-3  # [s]


@dataclass(frozen=True, slots=True, eq=False)
class Dangers:
    """All dangers that an agent knows of at one instant, as planners and policies ask for them.

    Attributes
    ----------
    regions : tuple of RiskRegion
        Threats (soft) and no-fly regions (hard).
    carriers : (c, 7) float array
        Mean x, y [m], covariance xx, xy, yy [m²], radius [m] and rate [1/s] of each vehicle that is
        taken for a threat.

    Examples
    --------
    >>> disc = RiskRegion(kind="threat", center=(0.0, 0.0), radius=50.0, rate=0.5, ceiling=100.0)
    >>> Dangers((disc,)).rate([[0.0, 0.0, 80.0], [0.0, 60.0, 80.0], [0.0, 0.0, 120.0]])
    array([0.5, 0. , 0. ])
    """

    regions: tuple[RiskRegion, ...] = ()
    carriers: Floats = field(default_factory=lambda: np.zeros((0, 7)))
    _arrays: Regions | None = field(default=None, repr=False)

    def __bool__(self) -> bool:
        return bool(self.regions or len(self.carriers))

    @property
    def no_fly(self) -> tuple[RiskRegion, ...]:
        """The hard regions."""
        return tuple(region for region in self.regions if region.kind == "no-fly")

    def rate(self, places: ArrayLike) -> Floats:
        """Expected exposure per second at some places.

        Parameters
        ----------
        places : (n, 3) array_like [m]
            East, north, above ground.

        Returns
        -------
        (n,) float array [1/s]
            Sum of the rates of the threats whose regions hold the place, and of the carriers'
            rates times the probability that the place is within their slant range (thesis eq. 3.2).

        Raises
        ------
        ValueError
            Wrong shape, or a place that is not finite.
        """
        points = _checked(places)
        rates = np.zeros(len(points))
        if self.regions:
            soft = np.array([region.rate or 0.0 for region in self.regions])
            rates += inside_regions(points, self._flat()) @ soft
        if len(self.carriers):
            columns = np.ascontiguousarray(self.carriers[:, :6])
            rates += reach_chances(points, columns) @ self.carriers[:, 6]
        return rates

    def forbidden(self, places: ArrayLike) -> Bools:
        """Which places lie in a no-fly region.

        Parameters
        ----------
        places : (n, 3) array_like [m]

        Returns
        -------
        (n,) bool array

        Raises
        ------
        ValueError
            Wrong shape, or a place that is not finite.
        """
        points = _checked(places)
        if not self.regions:
            return np.zeros(len(points), dtype=np.bool_)
        hard = np.array([region.kind == "no-fly" for region in self.regions])
        held: Bools = np.any(inside_regions(points, self._flat())[:, hard], axis=1)
        return held

    def _flat(self) -> Regions:
        return region_arrays(self.regions) if self._arrays is None else self._arrays


NO_DANGERS = Dangers()
"""Nothing known."""


def _checked(places: ArrayLike) -> Floats:
    points = np.ascontiguousarray(places, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"places: expected finite numbers (n, 3), got {points.shape}")
    return points


class KnownDangers:
    """One agent's memory of dangers.

    Parameters
    ----------
    briefed : sequence of RiskRegion, optional
        Told before the start.
    carried : CarriedThreat, optional
        Told before the start: vehicles carry this. Nobody says which, so every track is suspect.
    speed : float [m/s], optional
        No carrier is faster.

    Examples
    --------
    >>> known = KnownDangers()
    >>> ban = RiskRegion(kind="no-fly", center=(0.0, 0.0), radius=50.0, briefed=False)
    >>> known.step(0.0, Threats(regions=(ban,))).regions == (ban,)  # to be told to the others
    True
    >>> known.step(1.0).regions, known.at(1.0).forbidden([[10.0, 0.0, 80.0]])
    ((), array([ True]))
    """

    def __init__(
        self,
        briefed: Sequence[RiskRegion] = (),
        carried: CarriedThreat | None = None,
        speed: float = 4.0,
    ) -> None:
        self._regions = dict.fromkeys(briefed)
        self._most = len(self._regions) + MOST_REGIONS
        self._arrays: Regions | None = None
        self._carried, self._suspects = carried, Suspects(speed)
        self._said: dict[RiskRegion, float] = {}

    @property
    def regions(self) -> tuple[RiskRegion, ...]:
        """All regions known, in the order in which they came to be known."""
        return tuple(self._regions)

    def step(
        self, time: float, noticed: Threats = NO_THREATS, told: Iterable[Threats] = ()
    ) -> Threats:
        """Remember what was noticed and told, forget what is too old, and say what to tell.

        Parameters
        ----------
        time : float [s]
        noticed : Threats, optional
            By the agent's own sensor.
        told : iterable of Threats, optional
            By others, in any order, as often as it comes.

        Returns
        -------
        Threats
            For the others: the carriers noticed now, and each region when it is first noticed and
            every `RETELL` seconds from then on. What others told is not passed on.

        Raises
        ------
        StanielError
            A carrier from the future. Nothing has changed then.
        """
        sources = [threats for threats in (noticed, *told) if threats]
        if not (sources or self._said or self._suspects.known):
            return NO_THREATS
        carriers = [carrier for threats in sources for carrier in threats.carriers]
        for number, carrier in enumerate(carriers):
            if carrier.time > time + _CLOCK_TOLERANCE:
                raise StanielError(
                    f"carriers[{number}].time = {carrier.time:g}: expected {time:g}, "
                    "the step's, or earlier"
                )
        for threats in sources:
            for region in threats.regions:
                if region not in self._regions and len(self._regions) < self._most:
                    self._regions[region] = None
                    self._arrays = None
        self._suspects.learn(carriers, time)
        return Threats(self._to_say(noticed.regions, time), noticed.carriers)

    def at(self, time: float, tracks: Iterable[TrackEstimate] = ()) -> Dangers:
        """All dangers known, at the time of a step or some seconds later.

        Parameters
        ----------
        time : float [s]
        tracks : iterable of TrackEstimate, optional
            All that the agent holds. They count only where it was briefed that vehicles carry a
            threat: then each does, with its existence as a factor of the rate, and a carrier
            noticed within the gate of a track is taken for that one.

        Returns
        -------
        Dangers
        """
        held: list[Place] = []
        if self._carried is not None:
            radius, rate = self._carried.radius, self._carried.rate
            held = [Place.of_track(track, radius, rate) for track in tracks]
        rows = [place[1:] for place in (*held, *self._suspects.at(time, held))]
        if not (rows or self._regions):
            return NO_DANGERS
        if self._arrays is None:
            self._arrays = region_arrays(self.regions)
        return Dangers(self.regions, np.array(rows).reshape(-1, 7), self._arrays)

    def _to_say(self, noticed: Sequence[RiskRegion], time: float) -> tuple[RiskRegion, ...]:
        for region in noticed:
            self._said.setdefault(region, -math.inf)
        due = tuple(region for region, said in self._said.items() if time - said >= RETELL)
        self._said.update(dict.fromkeys(due, time))
        return due
