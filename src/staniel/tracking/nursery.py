"""Where new tracks come from: free sightings that agree over some steps (thesis section 6.3)."""

import numpy as np
from numpy.typing import NDArray

from staniel.kernels import births
from staniel.tracking.config import TrackingConfig

__all__ = ["Newborn", "Nursery"]

Floats = NDArray[np.float64]

_MISFIT = 1.5  # of a candidate with a straight line, over the gate squared

Newborn = tuple[Floats, float]
"""A place as `staniel.kernels.births.fit` gives it, and the time of its newest sighting [s]."""


class Nursery:
    """Candidates, each a short row of places that one target may have caused."""

    def __init__(self, config: TrackingConfig) -> None:
        self._config = config
        self._candidates = np.zeros((0, 2 + 6 * config.confirmations))

    def step(self, free: Floats, now: float) -> list[Newborn]:
        """Let candidates meet the free sightings; those confirmed leave.

        Parameters
        ----------
        free : (m, 6) float64 array
            Time [s], x, y [m], covariance xx, xy, yy [m²]; ascending in time, then in x.
        now : float [s]
        """
        c = self._config
        if not len(free) and not len(self._candidates):
            return []
        self._candidates, count = births.grow(
            self._candidates, free, c.birth_spacing, c.birth_window, c.max_speed, c.birth_gate,
            c.confirmations,
        )  # fmt: skip
        if not count:
            return []
        candidates = self._candidates
        confirmed = candidates[:, 0] >= c.confirmations
        self._candidates = np.ascontiguousarray(candidates[~confirmed])
        born = [
            (births.fit(candidate, now, 0.5 * c.max_speed), float(candidate[-6]))
            for candidate in candidates[confirmed]
        ]
        most = _MISFIT * c.birth_gate**2
        return [(place, last) for place, last in born if place[:, 5].sum() <= most]
