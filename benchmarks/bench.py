"""Speed of every stage, of the mission, and of the kernels against plain alternatives.

Run with ``make bench``. Everything in one process on one thread, compile excluded, rivals
interleaved, medians of repeats. ``--quick`` runs fewer repeats and leaves out the largest team.
"""

import argparse
import itertools
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

# Before NumPy is loaded: one thread each.
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from rich.console import Console
from rich.table import Table

import dubins
import sight
import tracking
from staniel.agent import Agent
from staniel.city import City
from staniel.kernels.random import normals
from staniel.kernels.warm import warm_all
from staniel.mission import Mission
from staniel.recording import Recorder
from staniel.scenario import Scenario, build_city, load_scenario
from staniel.scenario.assemble import assemble
from staniel.tracking import Tracker, TrackingConfig
from world import world_tick

CONSOLE = Console()
SPEED_TARGETS = {"lookahead": 80, "carrot": 300}
"""Real-time factor of the default mission that each pursuit policy should reach."""


def fly(scenario: Scenario, city: City, recorded: bool = True) -> tuple[float, Mission]:
    """Fly; seconds of processor time from the first tick to the finished file, or the last tick."""
    mission = assemble(scenario, city)
    if not recorded:
        frames = mission.frames()
        next(frames)
        started = time.process_time()
        for _ in frames:
            pass
        return time.process_time() - started, mission
    with tempfile.TemporaryDirectory() as folder:
        settings = scenario.model_dump(mode="json")
        path = Path(folder) / "mission.mcap"
        with Recorder(
            path, scenario=settings, version="bench", city=city, clock=scenario.clock
        ) as recorder:
            frames = mission.frames()
            recorder.write(next(frames))
            started = time.process_time()
            for frame in frames:
                recorder.write(frame)
            recorder.finish(complete=True)
            return time.process_time() - started, mission


def mission_speed(repeats: int) -> None:
    """Real-time factor of the default mission, by its own pursuit and by the carrot."""
    for (policy, target), recorded in itertools.product(SPEED_TARGETS.items(), (True, False)):
        factors = []
        for seed in range(repeats):
            scenario = load_scenario("downtown", seed=seed, guidance={"pursuit": policy})
            seconds, mission = fly(scenario, build_city(scenario.city, seed), recorded)
            factors.append(mission.ticks * scenario.clock.decision_step / seconds)
        CONSOLE.print(
            f"default mission by {policy}, recording {'on' if recorded else 'off'}, "
            f"seeds 0-{repeats - 1}: real-time factor median "
            f"[bold]{statistics.median(factors):.0f}[/], least {min(factors):.0f}, "
            f"greatest {max(factors):.0f} (target {target})"
        )
    CONSOLE.print()


class Stopwatch:
    """Adds up what wrapped calls take; nested calls count for the outer one too."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}

    def wrap(self, owner: Any, method: str, name: str) -> None:
        """Time every call of ``owner.method`` under `name`."""
        plain = getattr(owner, method)

        def timed(*args: Any, **kwargs: Any) -> Any:
            started = time.perf_counter()
            try:
                return plain(*args, **kwargs)
            finally:
                self.spent[name] = self.spent.get(name, 0.0) + time.perf_counter() - started

        setattr(owner, method, timed)


def stage_times(repeats: int) -> None:
    """Time per tick of each stage of the default mission."""
    rows: dict[str, list[float]] = {}
    plain = {name: getattr(Agent, name) for name in ("_track", "_allocate", "_fly", "step")}
    for seed in range(repeats):
        scenario = load_scenario("downtown", seed=seed)
        city = build_city(scenario.city, scenario.seed)
        mission, watch = assemble(scenario, city), Stopwatch()
        watch.wrap(mission.world, "advance", "world: vehicles and aircraft")
        watch.wrap(mission.cameras, "sense", "cameras")
        watch.wrap(mission.radio, "deliver", "radio")
        watch.wrap(Agent, "_track", "agents: tracking")
        watch.wrap(Agent, "_allocate", "agents: auctions")
        watch.wrap(Agent, "_fly", "agents: search map and guidance")
        watch.wrap(Agent, "step", "agents, all of it")
        with tempfile.TemporaryDirectory() as folder:
            recorder = Recorder(
                Path(folder) / "mission.mcap",
                scenario=scenario.model_dump(mode="json"),
                version="bench",
                city=city,
                clock=scenario.clock,
            )
            watch.wrap(recorder, "write", "recording")
            with recorder:
                for frame in mission.frames():
                    recorder.write(frame)
                recorder.finish(complete=True)
        for name, method in plain.items():
            setattr(Agent, name, method)
        for name, spent in watch.spent.items():
            rows.setdefault(name, []).append(1e6 * spent / mission.ticks)
    table = Table("stage", "µs per tick", title="default mission: 4 aircraft, 4 vehicles")
    for name, values in rows.items():
        table.add_row(name, f"{statistics.median(values):.0f}")
    CONSOLE.print(table)


def scaling(counts: Sequence[int], ticks: int) -> None:
    """Cost per tick as aircraft and vehicles grow together, and the power that fits it."""
    table = Table("aircraft = vehicles", "ms per tick", title="growth in the default city")
    costs = []
    for count in counts:
        scenario = load_scenario(
            "downtown",
            minutes=ticks / 60.0,
            aircraft={"count": count},
            vehicles={"count": count},
        )
        seconds, mission = fly(scenario, build_city(scenario.city, scenario.seed))
        costs.append(1e3 * seconds / mission.ticks)
        table.add_row(str(count), f"{costs[-1]:.2f}")
    CONSOLE.print(table)
    power = np.polyfit(np.log(counts), np.log(costs), 1)[0]
    CONSOLE.print(f"cost per tick grows as the power [bold]{power:.2f}[/] of the team's size\n")


def race(title: str, unit: str, per: float, rivals: dict[str, Callable[[], Any]], n: int) -> None:
    """Interleave the rivals, print medians and the ratio to the first."""
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for call in rivals.values():
        call()
    for _ in range(n):
        for name, call in rivals.items():
            started = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - started)
    medians = {name: statistics.median(values) for name, values in times.items()}
    first = next(iter(medians.values()))
    table = Table("", unit, "ratio", title=title)
    for name, median in medians.items():
        table.add_row(name, f"{median / per:.4g}", f"{median / first:.1f}")
    CONSOLE.print(table)


def particle_step(n: int) -> None:
    """The tracker's step against the same filter in NumPy."""
    tracks, size = 4, 1000
    rng = np.random.default_rng(0)
    tracker = Tracker(TrackingConfig(particles=size), rng=0)
    from staniel.datatypes.belief import Sighting

    clock = iter(range(10**9))

    def places(k: int) -> list[Sighting]:
        return [
            Sighting(k, [300.0 * t + 2.0 * k, 50.0], np.eye(2) * 2.25, reporter=0)
            for t in range(tracks)
        ]

    for _ in range(5):
        k = next(clock)
        tracker.step(k, places(k))
    assert len(tracker.estimates) == tracks

    def ours() -> None:
        k = next(clock)
        tracker.step(k, places(k))

    state = rng.normal(0, 2, (tracks, size, 4))

    def by_numpy() -> None:
        for t in range(tracks):
            x = state[t]
            course = np.arctan2(x[:, 3], x[:, 2]) + 0.3 * rng.standard_normal(size)
            speed = np.abs(np.hypot(x[:, 2], x[:, 3]) + 0.3 * rng.standard_normal(size))
            x[:, 2], x[:, 3] = speed * np.cos(course), speed * np.sin(course)
            x[:, :2] += x[:, 2:] + 0.1 * rng.standard_normal((size, 2))
            log_w = -0.5 * np.sum((x[:, :2] - x[:, :2].mean(axis=0)) ** 2, axis=1) / 2.25
            w = np.exp(log_w - log_w.max())
            w /= w.sum()
            places = (np.arange(size) + rng.random()) / size
            state[t] = x[np.minimum(np.searchsorted(np.cumsum(w), places), size - 1)]
            np.cov(state[t][:, :2].T)

    rivals = {"staniel Tracker.step, births and all": ours, "NumPy, the filter alone": by_numpy}
    race(f"{tracks} tracks x {size} particles", "ns per particle", 1e-9 * tracks * size, rivals, n)


def small_kernels(n: int) -> None:
    """Random normals."""
    out, generator = np.empty(8000, dtype=np.float32), np.random.default_rng(0)
    key = np.uint64(7)
    race(
        "standard normals, float32",
        "ns per draw",
        8000e-9,
        {
            "staniel": lambda: normals(key, 0, out),
            "numpy Generator": lambda: generator.standard_normal(out=out, dtype=np.float32),
        },
        10 * n,
    )


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer repeats, smaller teams")
    quick = parser.parse_args().quick
    started = time.perf_counter()
    warm_all(lambda done, total: None)
    CONSOLE.print(f"kernels ready in {time.perf_counter() - started:.1f} s\n")
    fly(scenario := load_scenario("village"), build_city(scenario.city, scenario.seed))
    mission_speed(3 if quick else 10)
    stage_times(1 if quick else 5)
    particle_step(50 if quick else 300)
    tracking.compare(quick=quick)
    sight.compare((100, 1_000) if quick else (100, 1_000, 10_000), 3 if quick else 15)
    small_kernels(5 if quick else 20)
    dubins.compare(repeats=3 if quick else 9)
    world_tick([1000, 3000, 10_000], ticks=10 if quick else 30)
    scaling([4, 16, 64] if quick else [4, 16, 64, 128], 20 if quick else 60)


if __name__ == "__main__":
    main()
