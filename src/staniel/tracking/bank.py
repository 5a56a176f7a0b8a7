"""The particles of all tracks of one tracker, in common arrays."""

import numpy as np
from numpy.typing import NDArray

from staniel.kernels import particles as kernels
from staniel.kernels.random import fold
from staniel.tracking.config import TrackingConfig

__all__ = ["Bank"]

Floats = NDArray[np.float64]


class Bank:
    """Particle clouds, the oldest track first; grows as needed.

    Attributes
    ----------
    count : int
        Tracks alive; the arrays' first axis is the capacity.
    state : (capacity, 4, n) float32 array
        x, y [m, from the track's origin], vx, vy [m/s].
    weights, log_weights : (capacity, n) float32 array
    origins : (capacity, 2) float64 array [m]
        Where each track was born.
    keys : (capacity,) uint64 array
        Random stream of each track.
    """

    def __init__(self, config: TrackingConfig, key: np.uint64) -> None:
        self.count = 0
        self._key = key
        self._born = 0
        self._max_speed = config.max_speed
        n = config.particles
        self.state = np.empty((4, 4, n), np.float32)
        self.weights = np.empty((4, n), np.float32)
        self.log_weights = np.empty((4, n), np.float32)
        self.origins = np.empty((4, 2))
        self.keys = np.empty(4, np.uint64)

    def launch(self, place: Floats) -> None:
        """Add a cloud around `place`, as `staniel.kernels.births.fit` gives it."""
        if self.count == len(self.keys):
            self._grow()
        k = self.count
        self._born += 1
        self.origins[k] = place[:, 0]
        self.keys[k] = fold(self._key, self._born)
        around = place.copy()
        around[:, 0] = 0.0
        kernels.spawn(
            self.state[k],
            self.weights[k],
            self.log_weights[k],
            self.keys[k],
            around,
            self._max_speed,
        )
        self.count += 1

    def keep(self, kept: list[int]) -> None:
        """Keep only the clouds with these numbers, given in ascending order."""
        for new, old in enumerate(kept):
            if new != old:
                self.overwrite(new, old)
        self.count = len(kept)

    def overwrite(self, target: int, source: int) -> None:
        """Copy the cloud `source` over the cloud `target`."""
        for rows in (self.state, self.weights, self.log_weights, self.origins, self.keys):
            rows[target] = rows[source]

    def _grow(self) -> None:
        for name in ("state", "weights", "log_weights", "origins", "keys"):
            rows = getattr(self, name)
            setattr(self, name, np.concatenate([rows, np.empty_like(rows)]))
