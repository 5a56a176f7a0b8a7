"""The tracker: anonymous sightings in, tracks with identities out."""

import math
from collections.abc import Sequence
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import Sighting, TrackEstimate, TrackId
from staniel.errors import StanielError
from staniel.kernels import lives
from staniel.kernels.association import paired
from staniel.kernels.random import fold
from staniel.tracking.assignment import FREE, assign
from staniel.tracking.bank import Bank
from staniel.tracking.config import TrackingConfig
from staniel.tracking.coverage import CameraView, Coverage, checked_coverage
from staniel.tracking.doubles import Doubles, dispersion
from staniel.tracking.intake import Batch, Intake, Key
from staniel.tracking.memory import Memory, gain_of
from staniel.tracking.nursery import Nursery
from staniel.tracking.roll import Roll

__all__ = ["Tracker"]

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

_SURPRISE = 3.0  # by so much more than its particles a missed target may have moved [m a step]


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
    chart : City, optional
        Particles keep to its streets; they turn where they would drive into a building.

    Attributes
    ----------
    estimates : list of TrackEstimate
        What the last step returned.
    lost : list of TrackEstimate
        Tracks deleted in the last step, each as it was when it was last seen.
    merged : list of (TrackId, TrackId)
        Tracks found to be doubles in the last step: the name dropped, the older name kept.
    returned : list of TrackId
        Lost targets that were found again in the last step, under their old names.

    Notes
    -----
    *Late sightings* meet every particle where it was at their time, along its own path, as far as
    the last seven steps tell and straight back beyond; older than ``late_limit`` are ignored, and
    so is a second copy of a sighting (same reporter, time and position).

    *Looks.* Sightings of one reporter and time are one look: a target causes at most one of them.
    Looks of several reporters are independent and their likelihoods multiply.

    *Weights.* A particle stands for a Gaussian of ``kernel`` times the cloud's spread; see
    `staniel.kernels.weighing`. With ``kernel = 0`` it is a bootstrap filter.

    *Existence* is a two-state Bayes filter in log odds: a step with k looks that showed the track
    multiplies the odds by :math:`\sum_i w_i \prod (1 - P_D + P_D N(z; x_i, S)/\lambda)` (λ the
    clutter density), one without by :math:`\sum_i w_i \prod (1 - P_D v_i)`, :math:`v_i` whether a
    look would have shown the particle, or :math:`1 - P_D P_V` (:math:`P_V` =
    ``view_probability``) where nobody says what was looked at. Odds are capped at 999 : 1.

    *Return.* A lost target's particles are kept for ``remember`` seconds. A track that is born
    where they make it likelier than a newcomer takes the old name.

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
        chart: City | None = None,
    ) -> None:
        self.config = c = config or TrackingConfig()
        if isinstance(rng, np.random.Generator):
            key = rng.integers(2**64, dtype=np.uint64)
        else:
            key = np.random.SeedSequence(rng or 0).generate_state(1, np.uint64)[0]
        self.estimates: list[TrackEstimate] = []
        self.lost: list[TrackEstimate] = []
        self.merged: list[tuple[TrackId, TrackId]] = []
        self.returned: list[TrackId] = []
        self._founder = founder
        self._owners: dict[Key, TrackId | None] = {}
        self._time: float | None = None
        self._born = 0
        self._roll = Roll()
        self._bank = Bank(c, key, chart)
        self._intake = Intake(c.late_limit)
        self._nursery = Nursery(c)
        self._memory = Memory(c, fold(key, 0), chart)
        self._doubles = Doubles(c.merge_distance, c.merge_steps)
        self._clutter = math.log(c.clutter_density)
        self._odds = c.detection_probability / (1.0 - c.detection_probability)
        self._hit = math.log(c.detection_probability / c.clutter_density)
        self._miss = math.log(1.0 - c.detection_probability * c.view_probability)

    def step(
        self,
        time: float,
        sightings: Sequence[Sighting],
        coverage: Sequence[Coverage | tuple[Any, ...]] | None = None,
    ) -> list[TrackEstimate]:
        """Take the tracks to `time` and let them meet what was seen, and what was not.

        Parameters
        ----------
        time : float [s]
            Not before the last step's.
        sightings : sequence of Sighting
            Of any reporters, in any order, none later than `time`. May be empty.
        coverage : sequence of Coverage, or of (pose, visible polygon, detection probability)
            What was looked at in this step: where a look shows nothing there is probably nothing.
            Not given: nobody says, and ``view_probability`` stands for it.

        Returns
        -------
        list of TrackEstimate
            All live tracks at `time`, the oldest first.

        Raises
        ------
        StanielError
            Time not finite or running backwards, a sighting or a look that cannot be used. Nothing
            has changed then.
        """
        now = self._checked(time)
        batch = self._intake.read(now, sightings)
        looks = checked_coverage(coverage, now)
        before = now if self._time is None else self._time
        self._time = now
        self._intake.accept(batch, now)

        bank = self._bank
        bank.predict(before, now)
        owners, pairs, shares, strangers = self._associate(batch, now)
        hits = bank.correct(now, batch.values, batch.looks, pairs, shares)
        if looks:
            self._miss_in_view(looks, hits, now)
        rows = bank.settle()
        roll = self._roll
        seen, existence = lives.live_on(
            roll.log_odds, roll.unseen, roll.last_seen, rows, hits, owners, batch.values,
            looks is not None, now > before, self._hit, self._miss,
        )  # fmt: skip
        covariances = rows[:, 4:8].copy()
        if now > before:
            bank.learn(rows, seen, now - before)
        self.estimates = self._describe(rows, now, existence.tolist(), seen.tolist())
        names = [roll.names[owner] if owner >= 0 else None for owner in owners.tolist()]
        self._owners = dict(zip(batch.keys, names, strict=True))
        doubles = self._doubles.step(roll.names, rows[:, :2], owners, batch.looks)
        self._delete(covariances, existence, doubles, now)
        self._give_birth(strangers, now)
        return list(self.estimates)

    def _associate(self, batch: Batch, now: float) -> tuple[Ints, Ints, Floats, Floats]:
        """Owner of each sighting, pairs inside the gates, their shares, and who may be new."""
        c, bank = self.config, self._bank
        pairs, scores, nearest = paired(
            bank.means, bank.expected, bank.state, bank.weights, bank.origins, batch.values,
            batch.looks, now, c.gate, c.birth_distance, c.kernel,
        )  # fmt: skip
        owners, shares = assign(
            c.association, pairs, scores, batch.looks, self._clutter, self._odds
        )
        # A free sighting at a track's place cannot start another one.
        strangers = (owners == FREE) & (nearest >= c.birth_distance)
        return owners, pairs, shares, batch.values[strangers]

    def _miss_in_view(self, looks: list[Coverage], hits: Ints, now: float) -> None:
        """Take weight from the particles of unseen tracks that a look would have shown."""
        bank, missed = self._bank, np.flatnonzero(hits == 0)
        for look in looks:
            loss, time = math.log1p(-look.detection_probability), look.time
            if isinstance(look.visible, CameraView) and time is None:
                look.visible.discount(bank.state, bank.origins, bank.log_weights, missed, loss)
                continue
            for k in missed.tolist():
                shown = look.shows(bank.places(k, now if time is None else time, now))
                bank.log_weights[k][shown] += loss

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

    def lost_particles(self) -> dict[TrackId, tuple[Floats, Floats]]:
        """Where each lost target may be by now, as far as it is remembered.

        Asking changes nothing: the tracker goes on as if nobody had asked.

        Returns
        -------
        dict
            By name, the longest lost first: places, (n, 2) float64 array [m], and their normalised
            weights, (n,) float64 array. At most 50 targets.
        """
        return {} if self._time is None else self._memory.clouds(self._time)

    def owner_of(self, sighting: Sighting) -> TrackId | None:
        """Name of the track that a sighting handed in with the last step went to, if any."""
        return self._owners.get(sighting.key)

    def rename(self, old: TrackId, new: TrackId) -> None:
        """Give the live track `old` the name `new`.

        Raises
        ------
        StanielError
            No live track is named `old`, or another one is named `new`.
        """
        k = self._index(old)
        if new != old and new in self._roll.names:
            raise StanielError(f"rename: {new!r} is the name of another live track")
        self._roll.rename(k, new)
        self.estimates[k] = self.estimates[k]._replace(id=new)
        self._doubles.forget(old)
        self._owners = {key: new if id == old else id for key, id in self._owners.items()}
        self._memory.forget({new})

    def _index(self, track: TrackId) -> int:
        if track not in self._roll.names:
            raise StanielError(f"no live track is named {track!r}")
        return self._roll.names.index(track)

    def _checked(self, time: float) -> float:
        now = float(time)
        if not math.isfinite(now):
            raise StanielError(f"step: time = {time}: expected a finite number of seconds")
        if self._time is not None and now < self._time:
            raise StanielError(
                f"step: time = {now:g}: expected {self._time:g}, the last step's, or later"
            )
        return now

    def _describe(
        self, rows: Floats, now: float, existence: list[float], seen: list[bool]
    ) -> list[TrackEstimate]:
        rows.flags.writeable = False
        roll, turns = self._roll, self._bank.habits[: len(rows), 1].tolist()
        fields = zip(
            roll.names, repeat(now), rows[:, :2], rows[:, 2:4], rows[:, 4:8].reshape(-1, 2, 2),
            existence, roll.last_seen.tolist(), turns,
        )  # fmt: skip
        estimates = list(map(TrackEstimate._make, fields))
        for k, sure in enumerate(seen):
            if sure:
                roll.known[k] = estimates[k]
        return estimates

    def _delete(
        self, covariances: Floats, existence: Floats, doubles: list[tuple[int, int]], now: float
    ) -> None:
        """Delete doubles, and what dispersed or was unseen for too long."""
        c, roll = self.config, self._roll
        self.merged = [(roll.names[k], roll.names[older]) for k, older in doubles]
        for k, older in doubles:
            if self._inherit(k, older):
                covariances[older], existence[older] = covariances[k], existence[k]
        over = lives.ended(
            roll.unseen, existence, covariances, c.unseen_limit, c.least_existence,
            c.dispersion_limit,
        )  # fmt: skip
        self.lost = []
        if not doubles and not over.any():
            return
        dropped = [k for k, _ in doubles]
        expired = [k for k in np.flatnonzero(over).tolist() if k not in dropped]
        self.lost = [roll.known[k] for k in expired]
        for k in expired:
            # Nobody comes back who hardly was there.
            if existence[k] >= c.least_existence:
                self._memory.store(roll.names[k], self._bank, k, now)
        self._keep([k for k in range(len(roll)) if k not in dropped and k not in expired])

    def _keep(self, kept: list[int]) -> None:
        """Keep only the tracks with these numbers."""
        self._roll.keep(kept)
        self.estimates = [self.estimates[k] for k in kept]
        self._bank.keep(kept)

    def _inherit(self, younger: int, older: int) -> bool:
        """The older name lives on with all that was seen of both, and with the better cloud.

        Returns whether that is the younger one's.
        """
        estimates = self.estimates
        better = dispersion(estimates[younger].covariance) < dispersion(estimates[older].covariance)
        if better:
            self._bank.overwrite(older, younger)
            estimates[older] = estimates[younger]._replace(id=self._roll.names[older])
        self._roll.inherit(older, younger)
        return better

    def _give_birth(self, free: Floats, now: float) -> None:
        """Confirmed candidates become tracks, under an old name where a lost target returns."""
        self.returned = []
        newborn = self._nursery.step(free, now)
        newborn = [born for born in newborn if not self._occupied(born[0][:, 0].tolist())]
        strangers = []
        for place, last_seen in newborn:
            missed = self._missed_at(place)
            if missed is None:
                strangers.append((place, last_seen))
            else:
                self._start_again(missed, place, last_seen, now)
        names = self._memory.claim([place for place, _ in strangers], now)
        for (place, last_seen), name in zip(strangers, names, strict=True):
            # Of two candidates at one place the first is a track by now.
            if not self._occupied(place[:, 0].tolist()):
                self._launch(place, last_seen, now, name)

    def _missed_at(self, place: Floats) -> int | None:
        """The live track that has been missed since before a newborn was first seen, and may be it.

        A target that suddenly drove off, say, left its particles behind.
        """
        c = self.config
        unseen = self._roll.unseen.tolist()
        missed = [k for k, steps in enumerate(unseen) if steps >= c.confirmations]
        gains = [gain_of(self._bank, k, place, c.newcomers, _SURPRISE * unseen[k]) for k in missed]
        best = max(zip(gains, missed, strict=True), default=(0.0, -1))
        return best[1] if best[0] > 0.0 else None

    def _start_again(self, k: int, place: Floats, last_seen: float, now: float) -> None:
        """A newborn takes over the name of the live track `k`, whose particles are given up."""
        name = self._roll.names[k]
        self._keep([j for j in range(len(self._roll)) if j != k])
        self._launch(place, last_seen, now, name)

    def _occupied(self, place: list[float]) -> bool:
        return any(
            math.dist(place, estimate.position.tolist()) < self.config.birth_distance
            for estimate in self.estimates
        )

    def _launch(self, place: Floats, last_seen: float, now: float, name: TrackId | None) -> None:
        if name is None:
            self._born += 1
            name = TrackId(now, self._founder, self._born)
        else:
            self.returned.append(name)
        estimate = TrackEstimate(
            name,
            now,
            place[:, 0],
            place[:, 1],
            np.diag(place[:, 2]),
            self.config.birth_existence,
            last_seen,
        )
        self._roll.enter(estimate)
        self.estimates.append(estimate)
        self._bank.launch(place)
