"""How near to a vehicle a track can be: the tracker in missions against one that knows the drivers.

``python benchmarks/accuracy.py`` flies `downtown`. A second filter is given what the trackers of
the aircraft are given, which sighting is whose, and the simulator itself for its prediction: every
particle is a driver in the true city, with the true habits and the true speed. What is left is what
it takes to learn of a drift when it has begun. The figures of docs/tracking.md are those of
``--seeds 8``. Errors are in the plane, while the aircraft's own camera reports the vehicle.
"""

import argparse
from collections import defaultdict
from collections.abc import Sequence
from multiprocessing import Pool
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import Sighting, TrackEstimate
from staniel.kernels.random import fold
from staniel.kernels.traffic import DRIFT, MEMORY_WIDTH, ROOM, WAY, drive
from staniel.kernels.walls import Walls
from staniel.scenario import Scenario, build_city, load_scenario
from staniel.scenario.assemble import assemble
from staniel.studies.statistics import estimate
from staniel.tracking import Tracker
from staniel.world.traffic import habits

Floats = NDArray[np.float64]

NEAR = 10.0
"""A track this near to a vehicle is the vehicle's [m]."""
GATE = 4.0
"""A sighting within so many sigmas of a vehicle, and of none nearer, is the vehicle's."""
TICK = 1.0  # [s]
JITTER = (0.15, 0.02, 0.3)
"""Of copied particles: place [m], heading [rad] and what is left of a stretch [m]."""
FALSE_ALARM = -12.0
"""Log likelihood, beside the best one's, below which no sighting takes weight."""


class Step(NamedTuple):
    """What one tracker was given at one time, and what it gave."""

    time: float
    sightings: list[Sighting]
    tracks: Floats


class Errors(NamedTuple):
    """[m] at the same times of the same vehicles."""

    single: list[float]
    tracker: list[float]
    knowing: list[float]


def fly(
    seed: int, minutes: float
) -> tuple[City, Scenario, dict[float, Floats], dict[int, list[Step]]]:
    """A mission: city, scenario, vehicles by time, and the steps of each aircraft's tracker."""
    steps: dict[int, list[Step]] = defaultdict(list)
    plain = Tracker.step

    def step(self: Any, time: float, sightings: Sequence[Sighting], *rest: Any, **more: Any) -> Any:
        tracks: list[TrackEstimate] = plain(self, time, sightings, *rest, **more)
        places = np.reshape([track.position for track in tracks], (-1, 2))
        steps[self._founder].append(Step(time, list(sightings), places))
        return tracks

    scenario = load_scenario("downtown", seed=seed, minutes=minutes)
    city = build_city(scenario.city, seed)
    with patch.object(Tracker, "step", step):
        mission = assemble(scenario, city)
        truth = {round(f.truth.time, 3): f.truth.vehicles.copy() for f in mission.frames()}
    return city, scenario, truth, steps


def owners(truth: dict[float, Floats], step: Step) -> dict[int, list[Sighting]]:
    """The sightings of a step by the vehicle that they are of."""
    found: dict[int, list[Sighting]] = defaultdict(list)
    for sighting in step.sightings:
        off = truth[round(sighting.time, 3)][:, :2] - sighting.position
        apart = np.einsum("ki,ij,kj->k", off, np.linalg.inv(sighting.covariance), off)
        if apart.min() < GATE**2:
            found[int(apart.argmin())].append(sighting)
    return found


@njit(cache=False, error_model="numpy")
def _drive_apart(
    walls: Walls, vehicles: Floats, memory: Floats, habit: Floats, speed: Floats, key: np.uint64,
    tick: int, dt: float, substeps: int,
) -> None:  # fmt: skip
    """Drive each by itself, in place: they are guesses of one vehicle and cannot meet."""
    for i in range(len(vehicles)):
        path, kept = drive(
            walls, vehicles[i : i + 1], memory[i : i + 1], habit, speed, fold(key, i), tick, dt,
            substeps,
        )  # fmt: skip
        vehicles[i], memory[i] = path[-1, 0], kept[0]


class Knowing:
    """A bootstrap filter on one vehicle that predicts with the simulator's own drivers."""

    def __init__(
        self,
        city: City,
        scenario: Scenario,
        truth: dict[float, Floats],
        time: float,
        vehicle: int,
        particles: int,
    ) -> None:
        self._rng = rng = np.random.default_rng([scenario.seed, vehicle])
        self.time, start = time, truth[round(time, 3)][vehicle]
        self._walls, self._clock = city.walls, scenario.clock
        self._habits = habits(scenario.vehicles)
        self._speed = np.full(1, scenario.vehicles.speed)
        self._key, self._tick = np.uint64(rng.integers(1 << 62)), 0
        self._vehicles = np.repeat(start[None], particles, axis=0)
        self._vehicles[:, :2] += rng.normal(0.0, 3.0, (particles, 2))
        self._vehicles[:, 2] += rng.normal(0.0, 1.0, particles)
        self._memory = np.zeros((particles, MEMORY_WIDTH))
        self._memory[:, WAY] = rng.uniform(0.0, 1.5, particles) * self._habits[5]
        self._memory[:, ROOM] = -1.0
        self._logs = np.zeros(particles)

    def copy(self) -> "Knowing":
        """One that may go on by itself."""
        other = object.__new__(Knowing)
        other.__dict__.update(self.__dict__)
        other._vehicles, other._memory = self._vehicles.copy(), self._memory.copy()
        other._logs = self._logs.copy()
        return other

    def predict(self) -> None:
        """A tick."""
        self._tick += 1
        self.time += TICK
        _drive_apart(
            self._walls, self._vehicles, self._memory, self._habits, self._speed, self._key,
            self._tick, self._clock.dynamics_step, self._clock.substeps,
        )  # fmt: skip

    def correct(self, sightings: Sequence[Sighting]) -> None:
        """Of now."""
        for sighting in sightings:
            off = self._vehicles[:, :2] - sighting.position
            apart = np.einsum("ki,ij,kj->k", off, np.linalg.inv(sighting.covariance), off)
            self._logs = np.logaddexp(self._logs - 0.5 * apart, self._logs + FALSE_ALARM)

    def resample(self) -> None:
        """Where less than half of the particles bear the weight."""
        weights, n, rng = self._weights, len(self._logs), self._rng
        if 1.0 / np.sum(weights**2) > 0.5 * n:
            return
        ladder = (np.arange(n) + rng.uniform()) / n
        chosen = np.searchsorted(np.cumsum(weights), ladder).clip(0, n - 1)
        self._vehicles, self._memory = self._vehicles[chosen], self._memory[chosen]
        self._logs = np.zeros(n)
        place, heading, way = JITTER
        self._vehicles[:, :2] += rng.normal(0.0, place, (n, 2))
        self._vehicles[:, 2] += rng.normal(0.0, heading, n)
        self._memory[:, WAY] += rng.normal(0.0, way, n)
        kept = self._memory[:, [DRIFT, WAY]].copy()
        self._memory[:] = 0.0
        self._memory[:, [DRIFT, WAY]], self._memory[:, ROOM] = kept, -1.0

    @property
    def _weights(self) -> Floats:
        weights = np.exp(self._logs - self._logs.max())
        normalised: Floats = weights / weights.sum()
        return normalised

    @property
    def position(self) -> Floats:
        """Mean [m]."""
        mean: Floats = self._weights @ self._vehicles[:, :2]
        return mean


def judged(seed: int, minutes: float, particles: int) -> Errors:
    """Aircraft 0's errors of one mission."""
    city, scenario, truth, steps = fly(seed, minutes)
    errors = Errors([], [], [])
    given = [(step, owners(truth, step)) for step in steps[0]]
    for vehicle in sorted({vehicle for _, found in given for vehicle in found}):
        behind: Knowing | None = None  # A tick behind: what others saw then has come by now.
        waiting: dict[float, list[Sighting]] = defaultdict(list)
        for step, found in given:
            for sighting in found.get(vehicle, ()):
                waiting[sighting.time].append(sighting)
            if behind is None:
                if waiting:
                    behind = Knowing(city, scenario, truth, min(waiting), vehicle, particles)
                continue
            while True:
                behind.correct(waiting.pop(behind.time, []))
                behind.resample()
                if behind.time > step.time - 1.5 * TICK:
                    break
                behind.predict()
            now = behind.copy()
            now.predict()
            own = waiting.get(step.time, [])
            now.correct(own)
            true = truth[round(step.time, 3)][vehicle, :2]
            off = np.hypot(*(step.tracks - true).T)
            if own and off.size and off.min() < NEAR:
                errors.single.append(float(np.hypot(*(own[0].position - true))))
                errors.tracker.append(float(off.min()))
                errors.knowing.append(float(np.hypot(*(now.position - true))))
    return errors


def rms(errors: Sequence[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(errors))))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=6.0)
    parser.add_argument("--particles", type=int, default=2000, help="of who knows the drivers")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    jobs = [(seed, options.minutes, options.particles) for seed in range(options.seeds)]
    with Pool(options.processes) as pool:
        found = pool.starmap(judged, jobs, chunksize=1)
    print(f"{sum(len(errors.single) for errors in found)} s of sight in {len(found)} missions")
    for name in Errors._fields:
        every = [getattr(errors, name) for errors in found]
        figure = estimate([rms(errors) for errors in every])
        middle = np.median(np.concatenate(every))
        print(
            f"{name:8s} RMSE {figure.mean:.2f} m [{figure.low:.2f}, {figure.high:.2f}], "
            f"median {middle:.2f} m"
        )


if __name__ == "__main__":
    main()
