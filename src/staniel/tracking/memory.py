"""Targets that were lost: where each may be by now, and whether it is the one that turns up."""

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import TrackId
from staniel.kernels.association import density_at
from staniel.tracking.bank import Bank
from staniel.tracking.config import TrackingConfig

__all__ = ["Memory", "gain_of"]

Floats = NDArray[np.float64]

_MOST = 50  # lost targets; the longest lost is forgotten first
_STRIDE = 2.0  # of the prediction in retrospect [s]
_BLUR = 9.0  # variance of the Gaussian that a particle stands for, at least [m²]
_BANDWIDTH = 0.25  # more of it: so much of the cloud's, for n particles over their cube root


def gain_of(bank: Bank, k: int, place: Floats, newcomers: float, blur: float = 0.0) -> float:
    """Log of how much likelier a newborn's place is for the cloud `k` than for a newcomer.

    Parameters
    ----------
    bank : Bank
    k : int
    place : (2, 6) float64 array
        As `staniel.kernels.births.fit` gives it.
    newcomers : float [1/m²]
        Density of targets that were never seen.
    blur : float [m]
        Standard deviation that each particle stands for, beside the usual.
    """
    own = _BANDWIDTH * bank.weights.shape[1] ** (-1.0 / 3.0)
    more = _BLUR + blur * blur
    density = density_at(
        bank.state[k],
        bank.weights[k],
        float(place[0, 0] - bank.origins[k, 0]),
        float(place[1, 0] - bank.origins[k, 1]),
        float(place[0, 2]) + more,
        float(place[1, 2]) + more,
        own,
    )
    return math.log(density + 1e-30) - math.log(newcomers)


class Memory:
    """The clouds of lost tracks, predicted on when somebody asks.

    A newborn track is a lost one when the lost one's particles, driven on to now, make its place
    likelier than a newcomer does. Time, place and motion are all in them.
    """

    def __init__(self, config: TrackingConfig, key: np.uint64, chart: City | None) -> None:
        self._config = config
        self._bank = Bank(config, key, chart)
        self._ids: list[TrackId] = []
        self._lost: list[float] = []
        self._time = -math.inf

    def store(self, id: TrackId, bank: Bank, k: int, now: float) -> None:
        """Keep the cloud `k` of `bank`, lost now."""
        if self._config.remember <= 0.0:
            return
        self.forget({id})
        self._advance(now)
        if len(self._ids) == _MOST:
            self._keep(list(range(1, _MOST)))
        self._bank.adopt(bank, k)
        self._ids.append(id)
        self._lost.append(now)

    def forget(self, ids: Collection[TrackId]) -> None:
        """Drop lost targets, as when somebody else is known by their name now."""
        if any(id in ids for id in self._ids):
            self._keep([k for k, id in enumerate(self._ids) if id not in ids])

    def claim(self, places: Sequence[Floats], now: float) -> list[TrackId | None]:
        """Who each newborn is, None for a newcomer; those who returned are lost no more.

        Parameters
        ----------
        places : sequence of (2, 6) float64 array
            As `staniel.kernels.births.fit` gives them.
        now : float [s]
        """
        oldest = now - self._config.remember
        if any(lost < oldest for lost in self._lost):
            self._keep([k for k, lost in enumerate(self._lost) if lost >= oldest])
        if not self._ids or not places:
            return [None] * len(places)
        self._advance(now)
        from scipy.optimize import linear_sum_assignment

        gains = np.array(
            [
                [gain_of(self._bank, k, place, self._config.newcomers) for place in places]
                for k in range(len(self._ids))
            ]
        )
        claimed: list[TrackId | None] = [None] * len(places)
        for k, n in zip(*linear_sum_assignment(-np.maximum(gains, 0.0)), strict=True):
            if gains[k, n] > 0.0:
                claimed[n] = self._ids[k]
        self.forget({id for id in claimed if id is not None})
        return claimed

    def clouds(self, now: float) -> dict[TrackId, tuple[Floats, Floats]]:
        """Where each lost target may be, at most a stride before `now`: places and weights.

        Only whole strides are predicted, the same ones as if nobody asked.
        """
        self._predict(now)
        bank, oldest = self._bank, now - self._config.remember
        return {
            id: (bank.places(k, self._time, self._time), bank.weights[k].astype(np.float64))
            for k, (id, lost) in enumerate(zip(self._ids, self._lost, strict=True))
            if lost >= oldest
        }

    def _advance(self, now: float) -> None:
        self._predict(now)
        if self._ids and self._time < now:
            self._step(now)
        self._time = now

    def _predict(self, now: float) -> None:
        """Whole strides, as many as have passed by `now`."""
        while self._ids and self._time + _STRIDE <= now:
            self._step(self._time + _STRIDE)

    def _step(self, after: float) -> None:
        self._bank.predict(self._time, after)
        self._bank.settle()
        self._time = after

    def _keep(self, kept: list[int]) -> None:
        self._bank.keep(kept)
        self._ids = [self._ids[k] for k in kept]
        self._lost = [self._lost[k] for k in kept]
