"""The tracker: anonymous sightings in, tracks with identities out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Sighting, TrackEstimate, TrackId
from staniel.errors import StanielError
from staniel.kernels import association, births
from staniel.kernels import particles as kernels
from staniel.tracking.bank import Bank
from staniel.tracking.config import TrackingConfig
from staniel.tracking.doubles import Doubles, dispersion
from staniel.tracking.intake import Intake

__all__ = ["Tracker"]

Floats = NDArray[np.float64]

_LOG_ODDS_LIMIT = math.log(999.0)


@dataclass(slots=True)
class _Track:
    """What is kept of a track beside its particles, in the same order as they."""

    id: TrackId
    log_odds: float
    last_seen: float
    unseen: int
    known: TrackEstimate


class Tracker:
    r"""Multi-target particle tracker (thesis section 6.3 and alg. 6.1, corrected).

    One particle filter a track. A track is born where sightings that belong to no track agree over
    some steps; it lives on predictions while nothing is seen of its target, and is deleted when its
    particles disperse or after too many steps without a sighting.

    Parameters
    ----------
    config : TrackingConfig, optional
    rng : int or numpy.random.Generator, optional
        Seed, or a generator from which one key is drawn; None is seed 0. The same seed and calls
        give the same bytes.
    founder : int, optional
        Who names new tracks: goes into their `TrackId`.

    Attributes
    ----------
    estimates : list of TrackEstimate
        What the last step returned.
    lost : list of TrackEstimate
        Tracks deleted in the last step, each as it was when it was last seen.
    merged : list of (TrackId, TrackId)
        Tracks found to be doubles in the last step: the name dropped, the older name kept.

    Notes
    -----
    *Late sightings* (time before that of the step) meet every particle at
    :math:`x - v\,(t - t_s)`, which is exact for straight motion; older than ``late_limit`` are
    ignored, and so is a second copy of a sighting (same reporter, time and position).

    *Looks.* Sightings of one reporter and time are one look: a target causes at most one of them,
    so a track takes the likeliest and leaves the others to other tracks and to births. Looks of
    several reporters are independent and their likelihoods multiply.

    *Existence* is a two-state Bayes filter in log odds: an accepted sighting multiplies the odds by
    :math:`P_D \sum_i w_i N(z; x_i, \Sigma)/\lambda` (λ the clutter density), a step without one by
    :math:`1 - P_D P_V` (:math:`P_V` = ``view_probability``: nobody says here what was looked at).
    Odds are capped at 999 : 1.

    Examples
    --------
    >>> tracker = Tracker(rng=1)
    >>> for k in range(6):
    ...     tracks = tracker.step(k, [Sighting(k, [2.0 * k, 0.0], [[1.0, 0.0], [0.0, 1.0]])])
    >>> [str(track.id) for track in tracks]
    ['0-1']
    """

    def __init__(
        self,
        config: TrackingConfig | None = None,
        rng: int | np.random.Generator | None = None,
        *,
        founder: int = 0,
    ) -> None:
        self.config = c = config or TrackingConfig()
        if isinstance(rng, np.random.Generator):
            key = rng.integers(2**64, dtype=np.uint64)
        else:
            key = np.random.SeedSequence(rng or 0).generate_state(1, np.uint64)[0]
        self.estimates: list[TrackEstimate] = []
        self.lost: list[TrackEstimate] = []
        self.merged: list[tuple[TrackId, TrackId]] = []
        self._founder = founder
        self._time: float | None = None
        self._steps = 0
        self._born = 0
        self._tracks: list[_Track] = []
        self._bank = Bank(c, key)
        self._intake = Intake(c.late_limit)
        self._candidates = np.zeros((0, 2 + 6 * c.confirmations))
        self._doubles = Doubles(c.merge_distance, c.merge_steps)
        self._motion = np.array(
            [c.max_speed, c.turn_noise, c.speed_noise, c.diffusion, c.turn_rate, c.restart_rate]
        )
        # A sighting in the gate that is clutter stands beside a missed target: λ (1 - P_D)/P_D.
        missed = (1.0 - c.detection_probability) / c.detection_probability
        floor = c.clutter_density * missed
        self._limits = np.array([c.gate, c.clutter_density, floor, c.birth_distance, c.roughening])
        self._hit = math.log(c.detection_probability / c.clutter_density)
        self._miss = math.log(1.0 - c.detection_probability * c.view_probability)

    def step(self, time: float, sightings: Sequence[Sighting]) -> list[TrackEstimate]:
        """Take the tracks to `time` and let them meet what was seen.

        Parameters
        ----------
        time : float [s]
            Not before the last step's.
        sightings : sequence of Sighting
            Of any reporters, in any order, none later than `time`. May be empty.

        Returns
        -------
        list of TrackEstimate
            All live tracks at `time`, the oldest first.

        Raises
        ------
        StanielError
            Time not finite or running backwards, or a sighting that cannot be used. Nothing has
            changed then.
        """
        now = self._checked(time)
        batch = self._intake.read(now, sightings)
        dt = 0.0 if self._time is None else now - self._time
        self._time = now
        self._steps += 1
        self._intake.accept(batch, now)

        bank, c = self._bank, self.config
        moments = kernels.predict(
            bank.state, bank.weights, bank.keys, bank.count, self._steps, dt, self._motion
        )
        owners, scores = association.associate(
            bank.state,
            bank.weights,
            bank.log_weights,
            bank.origins,
            moments,
            batch.values,
            batch.looks,
            now,
            self._limits,
        )
        rows = kernels.settle(
            bank.state,
            bank.weights,
            bank.log_weights,
            bank.origins,
            bank.keys,
            bank.count,
            self._steps,
            c.resample_below,
            c.roughening,
        )
        seen = self._update(owners.tolist(), scores.tolist(), batch.times, dt)
        self.estimates = self._describe(rows, now, seen)
        self._delete(self._doubles.step(self.estimates, owners, batch.looks))
        self._give_birth(batch.values[owners == -1], now)
        return list(self.estimates)

    def particles(self, track: TrackId) -> Floats:
        """Copy of a track's particles, weights apart.

        Returns
        -------
        (n, 4) float64 array
            x, y [m], vx, vy [m/s].
        """
        k = self._index(track)
        cloud: Floats = self._bank.state[k].T.astype(np.float64)
        cloud[:, :2] += self._bank.origins[k]
        return cloud

    def weights(self, track: TrackId) -> Floats:
        """Copy of a track's normalised particle weights, (n,) float64 array."""
        weights: Floats = self._bank.weights[self._index(track)].astype(np.float64)
        return weights

    def rename(self, old: TrackId, new: TrackId) -> None:
        """Give the live track `old` the name `new`.

        Raises
        ------
        StanielError
            No live track is named `old`, or another one is named `new`.
        """
        k = self._index(old)
        if new != old and any(track.id == new for track in self._tracks):
            raise StanielError(f"rename: {new!r} is the name of another live track")
        track = self._tracks[k]
        track.id = new
        track.known = replace(track.known, id=new)
        self.estimates[k] = replace(self.estimates[k], id=new)
        self._doubles.forget(old)

    def _index(self, track: TrackId) -> int:
        for k, live in enumerate(self._tracks):
            if live.id == track:
                return k
        raise StanielError(f"no live track is named {track!r}")

    def _checked(self, time: float) -> float:
        now = float(time)
        if not math.isfinite(now):
            raise StanielError(f"step: time = {time}: expected a finite number of seconds")
        if self._time is not None and now < self._time:
            raise StanielError(
                f"step: time = {now:g}: expected {self._time:g}, the last step's, or later"
            )
        return now

    def _update(
        self, owners: list[int], scores: list[float], times: list[float], dt: float
    ) -> set[int]:
        """Existence, last sighting and patience of every track; returns those seen in this step."""
        seen = set()
        for owner, score, time in zip(owners, scores, times, strict=True):
            if owner >= 0:
                seen.add(owner)
                track = self._tracks[owner]
                track.log_odds += self._hit + score
                track.last_seen = max(track.last_seen, time)
        for k, track in enumerate(self._tracks):
            if k in seen:
                track.unseen = 0
                track.log_odds = min(track.log_odds, _LOG_ODDS_LIMIT)
            elif dt > 0.0:
                track.unseen += 1
                track.log_odds += self._miss
        return seen

    def _describe(self, rows: Floats, now: float, seen: set[int]) -> list[TrackEstimate]:
        rows.flags.writeable = False
        covariances = rows[:, 4:8].reshape(-1, 2, 2)
        estimates = []
        for k, (track, position, velocity, covariance) in enumerate(
            zip(self._tracks, rows[:, :2], rows[:, 2:4], covariances, strict=True)
        ):
            estimate = TrackEstimate(
                track.id,
                now,
                position,
                velocity,
                covariance,
                1.0 / (1.0 + math.exp(-track.log_odds)),
                track.last_seen,
            )
            if k in seen:
                track.known = estimate
            estimates.append(estimate)
        return estimates

    def _delete(self, doubles: list[tuple[int, int]]) -> None:
        """Delete doubles, and what dispersed or was unseen for too long."""
        c = self.config
        self.merged = [(self._tracks[k].id, self._tracks[older].id) for k, older in doubles]
        for k, older in doubles:
            self._inherit(k, older)
        dropped = [k for k, _ in doubles]
        expired = [
            k
            for k, track in enumerate(self._tracks)
            if k not in dropped
            and (
                track.unseen >= c.unseen_limit
                or dispersion(self.estimates[k].covariance) > c.dispersion_limit
            )
        ]
        self.lost = [self._tracks[k].known for k in expired]
        if dropped or expired:
            kept = [k for k in range(len(self._tracks)) if k not in dropped and k not in expired]
            self._tracks = [self._tracks[k] for k in kept]
            self.estimates = [self.estimates[k] for k in kept]
            self._bank.keep(kept)

    def _inherit(self, younger: int, older: int) -> None:
        """The older name lives on with the better cloud and all that was seen of both."""
        heir, donor = self._tracks[older], self._tracks[younger]
        if dispersion(self.estimates[younger].covariance) < dispersion(
            self.estimates[older].covariance
        ):
            self._bank.overwrite(older, younger)
            self.estimates[older] = replace(self.estimates[younger], id=heir.id)
        if donor.last_seen > heir.last_seen:
            heir.last_seen, heir.known = donor.last_seen, replace(donor.known, id=heir.id)
        heir.log_odds = max(heir.log_odds, donor.log_odds)
        heir.unseen = min(heir.unseen, donor.unseen)

    def _give_birth(self, free: Floats, now: float) -> None:
        """Let candidates meet the free sightings; confirmed ones become tracks."""
        c = self.config
        if not len(free) and not len(self._candidates):
            return
        places = births.propose(free, c.birth_spacing, c.birth_window)
        candidates = births.follow(self._candidates, places, c.max_speed, c.birth_gate)
        confirmed = candidates[:, 0] >= c.confirmations
        self._candidates = candidates
        if not confirmed.any():
            return
        self._candidates = np.ascontiguousarray(candidates[~confirmed])
        for candidate in candidates[confirmed]:
            place = births.fit(candidate, now, 0.5 * c.max_speed)
            if not self._occupied(place[:, 0].tolist()):
                self._launch(place, float(candidate[-6]), now)

    def _occupied(self, place: list[float]) -> bool:
        return any(
            math.dist(place, estimate.position.tolist()) < self.config.birth_distance
            for estimate in self.estimates
        )

    def _launch(self, place: Floats, last_seen: float, now: float) -> None:
        self._born += 1
        estimate = TrackEstimate(
            TrackId(now, self._founder, self._born),
            now,
            place[:, 0],
            place[:, 1],
            np.diag(place[:, 2]),
            self.config.birth_existence,
            last_seen,
        )
        odds = self.config.birth_existence / (1.0 - self.config.birth_existence)
        self._tracks.append(_Track(estimate.id, math.log(odds), last_seen, 0, estimate))
        self.estimates.append(estimate)
        self._bank.launch(place)
