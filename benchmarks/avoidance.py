"""Random missions below the roofs: who flies into what, and how often.

``python benchmarks/avoidance.py`` flies 1000 missions of two minutes in generated cities at 0.9 x
the tallest roof, buildings known by lidar alone. Half of them lose every second message, and half
of them have all aircraft at one height, without layers. Each mission is named by its number, so one
that went wrong can be flown again: ``--first 17 --missions 1``.
"""

import argparse
import json
import multiprocessing
import statistics
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import stats

from staniel.kernels.warm import warm_all
from staniel.scenario import Scenario, build_city, load_scenario
from staniel.scenario.assemble import assemble
from staniel.world import Hazards

CONSOLE = Console(width=130)
REACH = 140.0  # of the lidar [m]: at least four turn radii
SEPARATION = 10.0  # [m]
LAYER = 15.0  # [m]
STARTS = 130.0  # no-fly regions keep so far away from where aircraft begin [m]


@dataclass(frozen=True)
class Outcome:
    """What became of one mission."""

    number: int
    group: str
    aircraft: int
    strikes: int
    nearest: float
    entries: int
    avoided: float
    stuck: float
    high: float
    low: float


def layered(number: int) -> bool:
    """Whether the aircraft of the mission of this number fly in layers: every other two do."""
    return number // 2 % 2 == 1


def scenario_of(number: int, policy: str, minutes: float, pursuit: str = "carrot") -> Scenario:
    """The mission of this number: its city, team, radio and no-fly regions are drawn by it."""
    rng = np.random.default_rng([number, 4711])
    size = float(rng.choice([400.0, 500.0, 600.0]))
    loss, spacing = 0.5 * (number % 2), LAYER if layered(number) else 0.0
    density = float(rng.choice([0.2, 0.35, 0.5]))
    changes: dict[str, Any] = {
        "name": "avoidance",
        "seed": number,
        "minutes": minutes,
        "chart": "blank",
        "city": {
            "size": [size, size],
            "density": density,
            "heights": [10.0, float(rng.choice([25.0, 40.0, 60.0]))],
        },
        "vehicles.count": 3,
        "lidar": {
            "mount": "scanner",
            "range": REACH,
            "aperture_deg": float(rng.choice([180.0, 270.0, 360.0])),
        },
        "radio.loss": loss,
        "guidance": {"avoidance": policy, "layer_spacing": spacing, "pursuit": pursuit},
        "aircraft": {"count": int(rng.integers(2, 7))},
    }
    first = load_scenario("downtown", **changes, **{"aircraft.altitude": 500.0})
    tallest = build_city(first.city, number).tallest
    changes["aircraft"]["altitude"] = 0.9 * tallest
    ready = load_scenario("downtown", **changes)
    starts = assemble(ready, build_city(ready.city, number)).start.aircraft[:, :2]
    regions = _regions(rng, size, starts)
    return load_scenario("downtown", **changes, risk={"regions": regions, "sensor": SENSOR})


SENSOR = {"range": REACH}


def _regions(rng: np.random.Generator, size: float, starts: np.ndarray) -> list[dict[str, Any]]:
    """Up to three no-fly discs and squares, away from the starts; every other one is briefed."""
    regions: list[dict[str, Any]] = []
    for k in range(int(rng.integers(0, 4))):
        middle, radius = rng.uniform(0.2, 0.8, 2) * size, float(rng.uniform(25.0, 60.0))
        if np.linalg.norm(starts - middle, axis=1).min() < STARTS + radius:
            continue
        x, y = middle.tolist()
        corners = [
            (x + radius * a, y + radius * b) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        shape = {"center": (x, y), "radius": radius} if k % 2 else {"polygon": corners}
        regions.append({"kind": "no-fly", "briefed": bool(rng.random() < 0.5), **shape})
    return regions


def fly(number: int, policy: str, minutes: float, pursuit: str = "carrot") -> Outcome:
    """Fly one mission and count, at every dynamics step of the true paths."""
    scenario = scenario_of(number, policy, minutes, pursuit)
    city = build_city(scenario.city, number)
    mission = assemble(scenario, city)
    paths, guards = [], []
    for frame in mission.frames():
        paths.append(frame.truth.aircraft_path)
        guards += [belief.guard for belief in frame.beliefs]
    path = np.concatenate(paths)
    count = path.shape[1]
    places = path[:, :, :3]
    blocked = ~city.visible_pairs(places[:-1].reshape(-1, 3), places[1:].reshape(-1, 3))
    blocked = blocked.reshape(-1, count)
    strikes = int((blocked & ~np.vstack([np.zeros((1, count), bool), blocked[:-1]])).sum())
    gaps = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    gaps[:, np.arange(count), np.arange(count)] = np.inf
    exposure = Hazards(scenario.risk).exposure(
        path, np.zeros((len(path), 0, 4)), scenario.clock.dynamics_step
    )
    layer = np.array([airframe.altitude for airframe in scenario.airframes])
    return Outcome(
        number,
        f"loss {scenario.radio.loss:g}, layers {scenario.guidance.layers:g} m",
        count,
        strikes,
        float(gaps.min()),
        int(exposure.violations.sum()),
        guards.count("avoid") / len(guards),
        guards.count("loiter") / len(guards),
        float((places[:, :, 2] > layer + 2.0).mean()),
        float((places[:, :, 2] < city.tallest).mean()),
    )


def _fly(task: tuple[int, str, float, str]) -> Outcome:
    return fly(*task)


def report(outcomes: Sequence[Outcome]) -> None:
    """Counts by group, with the upper end of a 95 % interval for the share of missions."""
    table = Table(
        "group", "missions", "strikes", "below 10 m", "entries", "nearest [m]", "avoiding",
        "no safe command", "above its height", "below the tallest roof",
    )  # fmt: skip
    groups = sorted({outcome.group for outcome in outcomes})
    for group in [*groups, "all"]:
        rows = [outcome for outcome in outcomes if group in (outcome.group, "all")]
        table.add_row(
            group,
            str(len(rows)),
            _share([row.strikes > 0 for row in rows]),
            _share([row.nearest < SEPARATION for row in rows]),
            _share([row.entries > 0 for row in rows]),
            f"{min(row.nearest for row in rows):.1f}",
            f"{statistics.fmean(row.avoided for row in rows):.1%}",
            f"{statistics.fmean(row.stuck for row in rows):.2%}",
            f"{statistics.fmean(row.high for row in rows):.1%}",
            f"{statistics.fmean(row.low for row in rows):.1%}",
        )
    CONSOLE.print(table)
    for outcome in outcomes:
        if outcome.strikes or outcome.entries or outcome.nearest < SEPARATION:
            CONSOLE.print(asdict(outcome))


def _share(bad: Sequence[bool]) -> str:
    count = sum(bad)
    upper = float(stats.beta.ppf(0.95, count + 1, len(bad) - count)) if count < len(bad) else 1.0
    return f"{count} (< {upper:.2%})"


def main() -> None:
    """Fly them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument(
        "--policy", default="predictive", choices=["predictive", "saunders", "none"]
    )
    parser.add_argument("--pursuit", default="carrot", help="pursuit policy")
    parser.add_argument("--layered", action="store_true", help="only those with layers")
    parser.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
    parser.add_argument("--log", type=Path, help="each outcome, as a line of JSON")
    arguments = parser.parse_args()
    kernels = ["lidar", "risk", "threats", "occupancy", "avoidance", "outlook", "lookahead"]
    warm_all(lambda done, total: None, kernels)
    started = time.perf_counter()
    tasks = [
        (number, arguments.policy, arguments.minutes, arguments.pursuit)
        for number in range(arguments.first, arguments.first + arguments.missions)
        if layered(number) or not arguments.layered
    ]
    with multiprocessing.get_context("fork").Pool(arguments.processes) as pool:
        outcomes = []
        for outcome in pool.imap(_fly, tasks, chunksize=1):
            outcomes.append(outcome)
            if arguments.log is not None:
                with arguments.log.open("a") as log:
                    log.write(json.dumps(asdict(outcome)) + "\n")
    report(outcomes)
    CONSOLE.print(f"{len(outcomes)} missions in {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
