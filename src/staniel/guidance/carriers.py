"""Vehicles that were noticed to carry a threat: which notices are of one, and where it may be."""

import math
from collections.abc import Iterable
from itertools import takewhile
from typing import NamedTuple

from staniel.datatypes.belief import TrackEstimate
from staniel.datatypes.threats import Carrier

__all__ = ["FORGET", "Place", "Suspects"]

FORGET = 60.0
"""A carrier that nobody has noticed for longer is forgotten [s]."""

_GATE = 4.29  # standard deviations within which two places are one's: all but 1 in 10 000

_Key = tuple[float, int, float, float]


class Place(NamedTuple):
    """A Gaussian on the ground at one time, and the threat that is there.

    Plain numbers: of the few carriers that an agent knows, arrays would cost more than the sums.
    """

    time: float
    x: float
    y: float
    xx: float
    xy: float
    yy: float
    radius: float
    rate: float

    @classmethod
    def of(cls, carrier: Carrier) -> "Place":
        """Where a carrier was noticed."""
        (xx, xy), (_, yy) = carrier.covariance.tolist()
        x, y = carrier.position.tolist()
        return cls(carrier.time, x, y, xx, xy, yy, carrier.radius, carrier.rate)

    @classmethod
    def of_track(cls, track: TrackEstimate, radius: float, rate: float) -> "Place":
        """Where a track is, as far as it exists."""
        (xx, xy), (_, yy) = track.covariance.tolist()
        x, y = track.position.tolist()
        return cls(track.time, x, y, xx, xy, yy, radius, rate * track.existence)

    def at(self, time: float, speed: float) -> "Place":
        """The same at another time, before or after, having driven in an unknown direction."""
        drift = speed * (time - self.time)
        spread = 0.5 * drift * drift
        return Place(
            time, self.x, self.y, self.xx + spread, self.xy, self.yy + spread,
            self.radius, self.rate,
        )  # fmt: skip

    def fused(self, new: "Place") -> "Place":
        """What is believed after an independent measurement at the same time (Kalman)."""
        pxx, pxy, pyy = self.xx, self.xy, self.yy
        sxx, sxy, syy = pxx + new.xx, pxy + new.xy, pyy + new.yy
        det = sxx * syy - sxy * sxy
        # The gain, belief times inverse of the sum.
        kxx, kxy = (pxx * syy - pxy * sxy) / det, (pxy * sxx - pxx * sxy) / det
        kyx, kyy = (pxy * syy - pyy * sxy) / det, (pyy * sxx - pxy * sxy) / det
        dx, dy = new.x - self.x, new.y - self.y
        return Place(
            new.time,
            self.x + kxx * dx + kxy * dy,
            self.y + kyx * dx + kyy * dy,
            pxx - kxx * pxx - kxy * pxy,
            pxy - kxx * pxy - kxy * pyy,
            pyy - kyx * pxy - kyy * pyy,
            new.radius,
            new.rate,
        )


class Suspects:
    r"""Memory of the carriers that were noticed, by whomever.

    Parameters
    ----------
    speed : float [m/s]
        No carrier is faster.

    Notes
    -----
    A carrier noticed at :math:`t_0` with covariance :math:`P` has
    :math:`P + \frac12 v^2 (t - t_0)^2 I` at :math:`t`: the second moment of driving off at speed
    v in an unknown direction. What is noticed no farther off than it can have driven, but for 4.29
    standard deviations of the two places, is the same carrier, and they are fused. A narrower gate
    would make a carrier of every hundredth measurement, and keep it for a minute. What is older
    than the news of its carrier changes nothing, and neither does a copy. Of one look, what one
    aircraft noticed at one time, each belongs to another carrier.
    """

    def __init__(self, speed: float) -> None:
        self.known: list[Place] = []
        self._speed = speed
        self._heard: dict[_Key, None] = {}

    def learn(self, carriers: Iterable[Carrier], now: float) -> None:
        """Take in what is new, look by look from the oldest on, and forget.

        Parameters
        ----------
        carriers : iterable of Carrier
            In any order, none later than `now`.
        now : float [s]
        """
        oldest = now - FORGET
        looks: dict[tuple[float, int], dict[_Key, Place]] = {}
        for carrier in carriers:
            place = Place.of(carrier)
            key = (place.time, carrier.reporter, place.x, place.y)
            if place.time >= oldest and key not in self._heard:
                looks.setdefault(key[:2], {})[key] = place
        for _, look in sorted(looks.items()):
            self._heard.update(dict.fromkeys(look))
            self._meet([look[key] for key in sorted(look)])
        for key in list(takewhile(lambda key: key[0] < oldest, self._heard)):
            del self._heard[key]
        self.known = [place for place in self.known if place.time >= oldest]

    def at(self, time: float, tracks: Iterable[Place] = ()) -> list[Place]:
        """Where all of them may be at a time, but for those that may be one of some tracks."""
        others = list(tracks)
        return [
            place.at(time, self._speed)
            for place in self.known
            if not any(self._is_one(place, other) for other in others)
        ]

    def _meet(self, look: list[Place]) -> None:
        """Let the carriers of one look meet those known, nearest pairs first; the rest are new."""
        pairs = sorted(
            (_apart(known.at(new.time, self._speed), new), n, k)
            for n, new in enumerate(look)
            for k, known in enumerate(self.known)
            if self._is_one(known, new)
        )
        free, unmet = set(range(len(look))), set(range(len(self.known)))
        for _, n, k in pairs:
            if n in free and k in unmet:
                free.remove(n)
                unmet.remove(k)
                known, new = self.known[k], look[n]
                if new.time >= known.time:
                    self.known[k] = known.at(new.time, self._speed).fused(new)
        self.known += [look[n] for n in sorted(free)]

    def _is_one(self, known: Place, new: Place) -> bool:
        """Whether both can be places of one carrier, each at its time."""
        xx, xy, yy = known.xx + new.xx, known.xy + new.xy, known.yy + new.yy
        variance = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)  # along the longer axis
        farthest = self._speed * abs(new.time - known.time) + _GATE * math.sqrt(variance)
        return math.hypot(new.x - known.x, new.y - known.y) <= farthest


def _apart(one: Place, other: Place) -> float:
    """Squared Mahalanobis distance of two places at one time."""
    x, y = other.x - one.x, other.y - one.y
    xx, xy, yy = one.xx + other.xx, one.xy + other.xy, one.yy + other.yy
    return (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
