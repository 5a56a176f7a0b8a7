"""What an agent knows of dangers: told before the start, noticed itself, told by others.

Regions are known exactly and for good. Carriers move and are known where they were noticed last:
each is a Gaussian that widens until it is noticed again, and is forgotten after `FORGET`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.datatypes.belief import TrackEstimate
from staniel.datatypes.risk import CarriedThreat, RiskRegion, region_arrays
from staniel.datatypes.threats import NO_THREATS, Carrier, Threats
from staniel.errors import StanielError
from staniel.kernels.risk import Regions
from staniel.kernels.threats import inside_regions, reach_chances

__all__ = ["FORGET", "NO_DANGERS", "RETELL", "Dangers", "KnownDangers"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FORGET = 60.0
"""A carrier that nobody has noticed for longer is forgotten [s]."""

RETELL = 10.0
"""A region that an agent noticed itself is told again so often, since words get lost [s]."""

_GATE = 4.29  # standard deviations within which two places are one's: all but 1 in 10 000
_CLOCK_TOLERANCE = 1e-3  # [s]

_Key = tuple[float, int, float, float]


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


@dataclass(slots=True)
class _Suspect:
    """A carrier as it was noticed last."""

    time: float
    position: Floats
    covariance: Floats
    radius: float
    rate: float


class KnownDangers:
    r"""One agent's memory of dangers.

    Parameters
    ----------
    briefed : sequence of RiskRegion, optional
        Told before the start.
    carried : CarriedThreat, optional
        Told before the start: vehicles carry this. Nobody says which, so every track is suspect.
    speed : float [m/s], optional
        No carrier is faster.

    Notes
    -----
    A carrier noticed at :math:`t_0` with covariance :math:`P` has
    :math:`P + \frac12 v^2 (t - t_0)^2 I` at :math:`t`: the second moment of driving off at speed
    v in an unknown direction. What is noticed no farther off than it can have driven, but for 4.29
    standard deviations of the two places, is the same carrier, and they are fused (Kalman). A
    narrower gate would make a carrier of every hundredth measurement, and keep it for a minute.
    What is older than the news of its carrier changes nothing, and neither does a copy. Of one
    look, what one aircraft noticed at one time, each belongs to another carrier.

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
        self._arrays: Regions | None = None
        self._carried, self._speed = carried, speed
        self._said: dict[RiskRegion, float] = {}
        self._suspects: list[_Suspect] = []
        self._heard: dict[_Key, None] = {}

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
            For the others: what was noticed now, and every `RETELL` seconds the regions noticed
            before. What others told is not passed on.

        Raises
        ------
        StanielError
            A carrier from the future. Nothing has changed then.
        """
        sources = [threats for threats in (noticed, *told) if threats]
        if not (sources or self._said or self._suspects):
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
                if region not in self._regions:
                    self._regions[region] = None
                    self._arrays = None
        self._learn(carriers, time)
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
        rows, suspects = [], self._suspects
        if self._carried is not None:
            radius, rate = self._carried.radius, self._carried.rate
            for track in tracks:
                place, spread = track.position, track.covariance
                rows.append(_row(place, spread, radius, rate * track.existence))
                suspects = [one for one in suspects if not self._is_one(one, place, spread, time)]
        rows += [
            _row(suspect.position, self._widened(suspect, time), suspect.radius, suspect.rate)
            for suspect in suspects
        ]
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

    def _learn(self, carriers: Iterable[Carrier], now: float) -> None:
        """Take in what is new, look by look from the oldest on, and forget."""
        oldest = now - FORGET
        looks: dict[tuple[float, int], dict[_Key, Carrier]] = {}
        for carrier in carriers:
            key = (carrier.time, carrier.reporter, *carrier.position.tolist())
            if carrier.time >= oldest and key not in self._heard:
                looks.setdefault(key[:2], {})[key] = carrier
        for _, look in sorted(looks.items()):
            self._heard.update(dict.fromkeys(look))
            self._meet([look[key] for key in sorted(look)])
        self._heard = {key: None for key in self._heard if key[0] >= oldest}
        self._suspects = [suspect for suspect in self._suspects if suspect.time >= oldest]

    def _meet(self, look: list[Carrier]) -> None:
        """Let the carriers of one look meet those known, nearest pairs first; the rest are new."""
        pairs = []
        for c, carrier in enumerate(look):
            for s, suspect in enumerate(self._suspects):
                if self._is_one(suspect, carrier.position, carrier.covariance, carrier.time):
                    spread = self._widened(suspect, carrier.time) + carrier.covariance
                    off = carrier.position - suspect.position
                    pairs.append((float(off @ np.linalg.solve(spread, off)), c, s))
        free, unmet = set(range(len(look))), set(range(len(self._suspects)))
        for _, c, s in sorted(pairs):
            if c in free and s in unmet:
                free.remove(c)
                unmet.remove(s)
                self._fuse(self._suspects[s], look[c])
        for c in sorted(free):
            new = look[c]
            self._suspects.append(
                _Suspect(new.time, new.position, new.covariance, new.radius, new.rate)
            )

    def _fuse(self, suspect: _Suspect, carrier: Carrier) -> None:
        if carrier.time < suspect.time:
            return
        before = self._widened(suspect, carrier.time)
        gain = np.linalg.solve(before + carrier.covariance, before).T
        after = before - gain @ before
        suspect.position = suspect.position + gain @ (carrier.position - suspect.position)
        suspect.covariance = 0.5 * (after + after.T)
        suspect.time, suspect.radius, suspect.rate = carrier.time, carrier.radius, carrier.rate

    def _is_one(self, suspect: _Suspect, place: Floats, covariance: Floats, time: float) -> bool:
        """Whether a suspect can be what is at a place, so uncertain, at a time."""
        (xx, xy), (_, yy) = (suspect.covariance + covariance).tolist()
        variance = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)  # along the longer axis
        farthest = self._speed * abs(time - suspect.time) + _GATE * math.sqrt(variance)
        return math.dist(place.tolist(), suspect.position.tolist()) <= farthest

    def _widened(self, suspect: _Suspect, time: float) -> Floats:
        """Covariance of a suspect's place at another time, before or after."""
        drift = self._speed * (time - suspect.time)
        covariance: Floats = suspect.covariance + 0.5 * drift * drift * np.eye(2)
        return covariance


def _row(position: Floats, covariance: Floats, radius: float, rate: float) -> list[float]:
    """What `Dangers.carriers` holds of one."""
    (xx, xy), (_, yy) = covariance.tolist()
    return [*position.tolist(), xx, xy, yy, radius, rate]
