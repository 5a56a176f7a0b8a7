"""How long a target stays out of sight under each pursuit policy, on the same cities and drivers.

``python benchmarks/pursuit.py`` flies a few seeds; the figures of docs/pursuit.md are those of
``--seeds 20 --tuning-seeds 8``. The classics are tuned first, on seeds of their own; ``--bound``
plans with the target's true future, ``--speed`` times decisions. Whole missions: tracker, radio,
messages. It counts from when an aircraft first holds the target, until when all policies fly alike.
"""

import argparse
import dataclasses
import itertools
import json
import math
import statistics
import time
from collections.abc import Iterable, Sequence
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.guidance import lookahead
from staniel.guidance import pursuit as policies
from staniel.guidance.config import LookaheadConfig
from staniel.guidance.lookahead import new_search
from staniel.kernels.lookahead import plan
from staniel.kernels.lookout import Eye, no_regions, roll_out
from staniel.kernels.sightlines import new_sightlines
from staniel.kernels.visibility import seen_by
from staniel.kernels.walls import inside
from staniel.metrics.visible import gaps
from staniel.mission import Mission
from staniel.scenario import Scenario, build_city, load_scenario
from staniel.scenario.assemble import assemble

HELD_OUT, TUNING = 2000, 1000  # first seeds: no policy was tuned on the former
FINE = 0.2  # between two samples of visibility [s]
FOUND = 60.0  # so long before the end the target has to be found, or a mission says nothing [s]
DISTANCE = 25.0  # of the aircraft from the target at the start [m]


class Case(NamedTuple):
    """One row of a study: how many fly how high over which vehicle, with which radio."""

    aircraft: int
    height: float
    speed: float
    loss: float

    @property
    def title(self) -> str:
        """For tables."""
        who = f"{self.aircraft} aircraft at {self.height:g} x the tallest roof"
        return f"{who}, target {self.speed:g} m/s, {self.loss:.0%} of the messages lost"


class Flown(NamedTuple):
    """What one mission gave."""

    hidden: float
    """Share of the time out of sight, sampled every 0.2 s."""
    hidden_whole: float
    """The same, sampled every second."""
    longest: float
    """Gap [s]."""
    strikes: int
    seconds: float
    """From when an aircraft first held the target."""


CARROTS = [
    {"pursuit": "carrot", "loiter_radius": r, "loiter_entry": e, "prediction_steps": p}
    for r, e in ((1.0, 1.0), (20.0, 1.0), (33.0, 1.0), (33.0, 1.5), (45.0, 1.5))
    for p in (0, 2, 4)
]
ORBITS = [
    {"pursuit": "orbit", "prediction_steps": p, **radius}
    for radius in ({}, {"orbit_radius": 33.0}, {"orbit_radius": 45.0})
    for p in (0, 2, 4)
]


def scenario_of(case: Case, guidance: dict[str, Any], seed: int, minutes: float) -> Scenario:
    """City, traffic and team of the study; a tracker that is patient with what is out of sight."""
    if case.height < 1.0:  # Whatever they pursue by, nobody flies into buildings.
        guidance = {**guidance, "avoidance": "predictive"}
    fast = {"max_speed": 1.5 * case.speed, "speed_noise": 0.05 * case.speed}
    return load_scenario(
        "downtown",
        seed=seed,
        minutes=minutes,
        city={"density": 0.6, "block": (45.0, 95.0), "heights": (10.0, 40.0)},
        vehicles={"count": 1, "speed": case.speed},
        aircraft={"count": case.aircraft},
        tracking={
            "particles": 300,
            "unseen_limit": 40,
            "dispersion_limit": 60.0,
            **(fast if case.speed > 2.0 else {}),
        },
        radio={"loss": case.loss},
        cooperation={"assistance": "always", "helpers": case.aircraft - 1},
        guidance=guidance,
    )


def begin(case: Case, guidance: dict[str, Any], seed: int, minutes: float) -> tuple[Mission, City]:
    """A mission whose aircraft start beside the target, at a multiple of the tallest roof."""
    scenario = scenario_of(case, guidance, seed, minutes)
    city = build_city(scenario.city, seed)
    height = round(case.height * city.tallest, 3)
    team = scenario.aircraft.model_copy(update={"altitude": height})
    scenario = scenario.model_copy(update={"aircraft": team})
    mission = assemble(scenario, city)
    start, rng = mission.start, np.random.default_rng(seed)
    aircraft = start.aircraft.copy()
    for row in aircraft:
        heading = rng.uniform(-math.pi, math.pi)
        row[:2] = start.vehicles[0, :2] - DISTANCE * np.array(
            [math.cos(heading), math.sin(heading)]
        )
        row[3] = heading
    mission.start = dataclasses.replace(start, aircraft=aircraft, aircraft_path=aircraft[None])
    return mission, city


def paths_of(mission: Mission, step: float = 0.1) -> tuple[NDArray[Any], NDArray[Any]]:
    """Aircraft and vehicles every 0.2 s, from when an aircraft first holds the target."""
    aircraft, vehicles, held = [], [], False
    for frame in mission.frames():
        if held:
            aircraft.append(frame.truth.aircraft_path)
            vehicles.append(frame.truth.vehicle_path)
        held = held or any(belief.target is not None for belief in frame.beliefs)
    if not aircraft:
        return np.zeros((0, 1, 6)), np.zeros((0, 1, 4))
    every = round(FINE / step)
    return (
        np.ascontiguousarray(np.concatenate(aircraft)[every - 1 :: every]),
        np.ascontiguousarray(np.concatenate(vehicles)[every - 1 :: every]),
    )


def judged(city: City, camera: Any, aircraft: NDArray[Any], vehicles: NDArray[Any]) -> Flown:
    """The truth about a mission's sight of its one vehicle."""
    counts = seen_by(
        city.walls, aircraft, vehicles, camera.target_height, camera.half_aperture, camera.range,
        camera.mounting, np.full((*aircraft.shape[:2], 2), np.nan),
    )  # fmt: skip
    seen = counts[:, 0] > 0
    if not seen.size:
        return Flown(math.nan, math.nan, math.nan, 0, 0.0)  # Never found, whatever the policy.
    strikes = 0
    if aircraft[..., 2].min() < city.tallest:
        for x, y, z in aircraft[..., :3].reshape(-1, 3):
            building = inside(city.walls, x, y)
            strikes += building >= 0 and z < city.heights[building]
    longest = max(gaps(seen, FINE), default=0.0)
    hidden, whole = 1.0 - seen.mean(), 1.0 - seen[4::5].mean()
    return Flown(hidden, whole, longest, strikes, FINE * len(seen))


def fly(case: Case, guidance: dict[str, Any], minutes: float, seed: int) -> Flown:
    """One mission."""
    mission, city = begin(case, guidance, seed, minutes)
    camera = scenario_of(case, guidance, seed, minutes).camera
    return judged(city, camera, *paths_of(mission))


def fly_knowing(case: Case, minutes: float, seed: int) -> Flown:
    """No mission: a wide search that knows where the target will be, 30 s ahead.

    Of several aircraft each in turn plans for what the plans of the others leave unseen, twice.
    """
    mission, city = begin(case, CARROTS[0], seed, minutes)
    aircraft, vehicles = paths_of(mission)
    scenario = scenario_of(case, CARROTS[0], seed, minutes)
    camera = scenario.camera
    if not len(aircraft):
        return judged(city, camera, aircraft, vehicles)
    horizon, commit, step = 30, 3, 0.5
    config = LookaheadConfig(horizon=horizon, banks=9, width=400, polish=2)
    team = [Knowing(city, scenario, pose.copy(), config) for pose in aircraft[0]]
    for second in range(0, round(len(vehicles) * FINE), commit):
        samples = np.round((second + step * np.arange(2 * horizon + 1)) / FINE).astype(int)
        future = np.ascontiguousarray(vehicles[np.minimum(samples, len(vehicles) - 1)])
        for one in team * (1 if len(team) == 1 else 2):
            unseen = np.ones((len(future), 1))
            for other in team:
                if other is not one:
                    unseen[other.sees(future, step)] = 0.0
            one.decide(future, unseen)
        for one in team:
            one.fly(commit)
    path = np.stack([np.concatenate(one.flown)[: len(vehicles)] for one in team], axis=1)
    return judged(city, camera, np.ascontiguousarray(path), vehicles)


class Knowing:
    """An aircraft that plans with the target's future."""

    def __init__(
        self, city: City, scenario: Scenario, pose: NDArray[Any], config: LookaheadConfig
    ) -> None:
        camera = scenario.camera
        self._city, self._height = city, camera.target_height
        self._eye = Eye(camera.mounting, camera.half_aperture, camera.range)
        self._pose = pose
        self._frame = scenario.airframes[0].model_copy(update={"altitude": float(pose[2])})
        self._search = new_search(city, self._frame, self._eye, camera.target_height, config)
        self._memory = new_sightlines(pose[2], camera.target_height)
        self._plan = np.zeros(config.horizon)
        self.flown: list[NDArray[Any]] = []

    def decide(self, future: NDArray[Any], weights: NDArray[Any]) -> None:
        """Plan for the target's (t, 1, 4) future, a sight of which is worth its weight."""
        banks, _ = plan(
            self._city.walls, self._memory, self._eye, self._search, *no_regions(), self._pose,
            np.ascontiguousarray(future[:, :, :2]), weights, self._plan,
        )  # fmt: skip
        self._plan = banks if len(banks) else self._plan

    def sees(self, future: NDArray[Any], step: float) -> NDArray[np.bool_]:
        """At which instants of the future its plan has the target in sight."""
        eye, way = self._eye, self._way(len(future) - 1, step)
        seen: NDArray[np.bool_] = seen_by(
            self._city.walls, way[:, None], future, self._height, eye.half_aperture, eye.reach,
            eye.mount, np.full((len(way), 1, 2), np.nan),
        )[:, 0] > 0  # fmt: skip
        return seen

    def fly(self, seconds: int) -> None:
        """Fly the first seconds of the plan."""
        way = self._way(round(seconds / FINE), FINE)
        self.flown.append(way[:-1])
        self._pose = way[-1].copy()
        self._plan = np.concatenate((self._plan[seconds:], np.zeros(seconds)))

    def _way(self, steps: int, step: float) -> NDArray[Any]:
        frame = self._frame
        gain, rate = frame.roll_gain, math.radians(frame.max_roll_rate_deg)
        way: NDArray[Any] = roll_out(self._pose, self._plan, 1.0, 0.0, steps, step, gain, rate)
        return way


def mean(flights: Iterable[Flown], figure: str = "hidden") -> float:
    """Over the seeds."""
    return statistics.fmean(getattr(flight, figure) for flight in flights)


def interval(ours: Sequence[Flown], theirs: Sequence[Flown], figure: str) -> tuple[float, ...]:
    """Relative change of a mean, and its 95 % bootstrap interval over pairs of one seed."""
    a, b = (np.array([getattr(flight, figure) for flight in f]) for f in (ours, theirs))
    draws = np.random.default_rng(0).integers(0, len(a), (10_000, len(a)))
    change = a[draws].mean(axis=1) / b[draws].mean(axis=1) - 1.0
    return (a.mean() / b.mean() - 1.0, *np.quantile(change, (0.025, 0.975)))


def tuned(case: Case, kind: list[dict[str, Any]], seeds: int, minutes: float, pool: Any) -> Any:
    """The settings of a classic that hide the target least, on seeds of their own."""
    best, least = kind[0], math.inf
    for guidance in kind:
        job = partial(fly, case._replace(loss=0.0), guidance, minutes)
        flights = pool.map(job, range(TUNING, TUNING + seeds))
        hidden = mean(flight for flight in flights if flight.seconds >= FOUND)
        if hidden < least:
            best, least = guidance, hidden
    return best


def row(name: str, flights: Sequence[Flown]) -> str:
    """A line of the table."""
    return (
        f"  {name:12s} hidden {mean(flights):6.1%} (1 s: {mean(flights, 'hidden_whole'):6.1%})"
        f"  longest gap {mean(flights, 'longest'):5.1f} s,"
        f" worst {max(flight.longest for flight in flights):5.1f} s"
        f"  strikes {sum(f.strikes for f in flights)}"
    )


def study(case: Case, options: argparse.Namespace, pool: Any) -> dict[str, Any]:
    """All policies on the held-out seeds, one after the other."""
    seeds, minutes = range(HELD_OUT, HELD_OUT + options.seeds), options.minutes
    chosen = {
        name: tuned(case, kind, options.tuning_seeds, minutes, pool)
        for name, kind in (("carrot", CARROTS), ("orbit", ORBITS))
    }
    chosen["lookahead"] = {"pursuit": "lookahead"}
    print(case.title, flush=True)
    flights = {
        name: pool.map(partial(fly, case, guidance, minutes), seeds)
        for name, guidance in chosen.items()
    }
    if options.bound:
        flights["known future"] = pool.map(partial(fly_knowing, case, minutes), seeds)
    found = [flight.seconds >= FOUND for flight in flights["carrot"]]
    flights = {name: list(itertools.compress(flown, found)) for name, flown in flights.items()}
    print(
        f"  {sum(found)} of {len(found)} missions, in the others it was found too late, if at all"
    )
    for name, flown in flights.items():
        print(row(name, flown), {k: v for k, v in chosen.get(name, {}).items() if k != "pursuit"})
    classic = min(("carrot", "orbit"), key=lambda name: mean(flights[name]))
    changes = {}
    for name in [name for name in flights if name not in chosen or name == "lookahead"]:
        for figure in ("hidden", "hidden_whole", "longest"):
            change, low, high = interval(flights[name], flights[classic], figure)
            changes[f"{name} {figure}"] = (change, low, high)
            print(
                f"    {name}, {figure} against {classic}: {change:+.1%} [{low:+.1%}, {high:+.1%}]"
            )
    print(flush=True)
    return {"case": case._asdict(), "chosen": chosen, "flights": flights, "changes": changes}


def decision_times(seed: int = 3000) -> None:
    """Milliseconds of CPU of a decision, with 300 particles."""
    spent: list[float] = []

    def timed(pursuit: policies.Pursuit) -> Any:
        started = time.thread_time()
        command = lookahead(pursuit)
        spent.append(time.thread_time() - started)
        return command

    with patch.dict(policies.POLICIES._rivals, lookahead=timed):
        for aircraft, height in ((1, 2.0), (1, 1.25), (1, 2.0), (2, 1.25), (2, 2.0)):
            spent.clear()
            fly(Case(aircraft, height, 2.0, 0.0), {"pursuit": "lookahead"}, 3.0, seed)
            times = 1e3 * np.array(spent[aircraft:])  # The first of each makes its tables.
            print(
                f"{aircraft} aircraft, {height:g} x roof: {np.median(times):.1f} ms a decision, "
                f"mean {times.mean():.1f}, 99 % below {np.quantile(times, 0.99):.1f}"
            )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4, help="held-out seeds")
    parser.add_argument("--tuning-seeds", type=int, default=4, help="to tune the classics on")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--aircraft", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--heights", type=float, nargs="+", default=[1.25, 2.0])
    parser.add_argument(
        "--speeds", type=float, nargs="+", default=[2.0], help="of the target [m/s]"
    )
    parser.add_argument("--loss", type=float, nargs="+", default=[0.0], help="of messages")
    parser.add_argument("--bound", action="store_true", help="also with the known future")
    parser.add_argument("--speed", action="store_true", help="only time decisions")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON lines, a line a case")
    options = parser.parse_args()
    if options.speed:
        decision_times()
        return
    grid = itertools.product(options.aircraft, options.heights, options.speeds, options.loss)
    with Pool(options.processes) as pool:
        for case in itertools.starmap(Case, grid):
            result = study(case, options, pool)
            if options.out:
                with options.out.open("a") as file:
                    file.write(json.dumps(result, default=float) + "\n")


if __name__ == "__main__":
    main()
