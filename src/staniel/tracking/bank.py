"""The particles of all tracks of one tracker, in common arrays, and what is done with them."""

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.kernels import motion, particles, weighing
from staniel.kernels.lineage import SLOTS, places_at
from staniel.kernels.random import fold
from staniel.kernels.resampling import SCHEMES
from staniel.tracking.config import TrackingConfig
from staniel.tracking.streets import raster_of

__all__ = ["Bank"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ROWS = (
    "state", "weights", "log_weights", "origins", "keys", "rests", "habits", "spans",
    "past", "ancestors", "copied", "depth",
)  # fmt: skip


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
    habits, spans : (capacity, 4), (capacity, 6) float64 array
        How each track moves, see `staniel.kernels.motion.learn`.
    past, ancestors, copied, depth : arrays
        Where its particles were, see `staniel.kernels.lineage`.
    rests : (capacity, 4, 4) float64 array
        Covariance that all particles of a track have in common.
    means, covariances : (count, 4), (count, 4, 4) float64 array
        Of the particles, as last predicted.
    """

    def __init__(self, config: TrackingConfig, key: np.uint64, chart: City | None) -> None:
        self.count = 0
        self._config = c = config
        self._key = key
        self._born = 0
        self._steps = 0
        self._head = 0
        self._times = np.zeros(SLOTS)
        n = c.particles
        self._draws = particles.draws_of(n)
        self._kind = motion.STRAIGHT if c.dynamics == "constant-velocity" else motion.CONTROLS
        self._motion = np.array([c.max_speed, c.diffusion, c.turn_rate, c.restart_rate])
        self._least = 0.5 * np.array([c.turn_noise, c.speed_noise])
        self._memory = c.learning_time if c.dynamics == "learned" else 0.0
        self._threshold = c.resample_below if c.filter == "sir" else 0.0
        self._floor = c.clutter_density * (1.0 - c.detection_probability) / c.detection_probability
        self._blocked, self._frame = raster_of(chart if c.streets else None)
        self.means, self.covariances = np.zeros((0, 4)), np.zeros((0, 4, 4))
        self.state = np.empty((4, 4, n), np.float32)
        self.weights = np.empty((4, n), np.float32)
        self.log_weights = np.empty((4, n), np.float32)
        self.origins = np.empty((4, 2))
        self.keys = np.empty(4, np.uint64)
        self.rests = np.zeros((4, 4, 4))
        self.habits = np.zeros((4, 4))
        self.spans = np.zeros((4, 6))
        self.past = np.zeros((4, SLOTS, 2, n), np.float32)
        self.ancestors = np.zeros((4, SLOTS, n), np.int32)
        self.copied = np.zeros((4, SLOTS), np.bool_)
        self.depth = np.zeros(4, np.int64)

    def launch(self, place: Floats) -> None:
        """Add a cloud around `place`, as `staniel.kernels.births.fit` gives it."""
        if self.count == len(self.keys):
            self._grow()
        k, c = self.count, self._config
        self._born += 1
        self.origins[k] = place[:, 0]
        self.keys[k] = fold(self._key, self._born)
        around = place.copy()
        around[:, 0] = 0.0
        particles.spawn(
            self.state[k],
            self.weights[k],
            self.log_weights[k],
            self.keys[k],
            around,
            c.max_speed,
        )
        self.habits[k] = np.hypot(*place[:, 1]), 0.0, c.turn_noise, c.speed_noise
        self.spans[k] = 0.0, *place[:, 1], 0.0, c.turn_noise**2, c.speed_noise**2
        self.rests[k] = 0.0
        self.copied[k] = False
        self.depth[k] = 0
        self.count += 1

    def adopt(self, other: "Bank", k: int) -> None:
        """Add a copy of another bank's cloud `k`, as it stands."""
        if self.count == len(self.keys):
            self._grow()
        for name in _ROWS:
            getattr(self, name)[self.count] = getattr(other, name)[k]
        self.copied[self.count] = False
        self.depth[self.count] = 0
        self.count += 1

    def predict(self, before: float, now: float) -> None:
        """Take all clouds from one time to the next."""
        dt = now - before
        self._steps += 1
        if dt > 0.0:
            self._times[self._head % SLOTS] = before
        self.means, self.covariances = motion.predict(
            self.state, self.weights, self.log_weights, self.origins, self.keys, self.habits,
            self.past, self.copied, self.depth, self._head, self.count, self._steps, self._draws,
            dt, self._kind, self._motion, self.rests, self._config.acceleration_noise,
            self._blocked, self._frame,
        )  # fmt: skip
        self._head += dt > 0.0

    def correct(
        self, now: float, sightings: Floats, looks: Ints, pairs: Ints, shares: Floats
    ) -> Ints:
        """Let the clouds meet their sightings; returns in how many looks each had a share.

        See `staniel.kernels.weighing.correct`.
        """
        hits = np.empty(self.count, np.int64)
        weighing.correct(
            self.state, self.weights, self.log_weights, self.origins, self.past, self.ancestors,
            self.copied, self._times, self.depth, self._head, pairs, shares, looks, sightings, now,
            self._config.kernel, self._floor, self.means, self.covariances, self.rests, hits,
        )  # fmt: skip
        return hits

    @property
    def expected(self) -> Floats:
        """(count, 4, 4) covariances of the predicted states, what all particles share included."""
        return self.covariances + self.rests[: self.count]

    def settle(self) -> Floats:
        """Normalise, estimate, resample; see `staniel.kernels.particles.settle`."""
        rows: Floats = particles.settle(
            self.state, self.weights, self.log_weights, self.origins, self.keys, self.ancestors,
            self.copied, self._head, self.count, self._steps, self._draws, self._threshold,
            SCHEMES[self._config.resampling], self._config.roughening, self.rests,
            self._kind == motion.CONTROLS,
        )  # fmt: skip
        return rows

    def learn(self, rows: Floats, seen: NDArray[np.bool_], dt: float) -> None:
        """Take from the estimates how each track moves."""
        motion.learn(
            self.habits, self.spans, np.ascontiguousarray(rows[:, 2:4]), self.covariances, seen,
            self.count, dt, self._least, self._memory,
        )  # fmt: skip

    def places(self, k: int, time: float, now: float) -> Floats:
        """Where the particles of cloud `k` were at `time`, before they settle, (n, 2) [m]."""
        if time >= now:
            present: Floats = self.state[k, :2].T + self.origins[k]
            return present
        n = self.state.shape[2]
        out = np.empty((2, n), np.float32)
        places_at(
            time, now, self.state, self.past, self.ancestors, self.copied, self._times, self.depth,
            k, self._head, np.empty(n, np.int32), out,
        )  # fmt: skip
        places: Floats = out.T + self.origins[k]
        return places

    def keep(self, kept: list[int]) -> None:
        """Keep only the clouds with these numbers, given in ascending order."""
        for new, old in enumerate(kept):
            if new != old:
                self.overwrite(new, old)
        self.count = len(kept)

    def overwrite(self, target: int, source: int) -> None:
        """Copy the cloud `source` over the cloud `target`."""
        for name in _ROWS:
            rows = getattr(self, name)
            rows[target] = rows[source]

    def _grow(self) -> None:
        for name in _ROWS:
            rows = getattr(self, name)
            setattr(self, name, np.concatenate([rows, np.zeros_like(rows)]))
