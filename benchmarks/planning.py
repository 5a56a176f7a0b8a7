"""Planners compared: success, length over the best known, time, on the same random questions.

Run as ``python benchmarks/planning.py``. One thread, compile excluded. The cities are the maps and
footprints of ``../shared/data`` (1 km² each), or where these are missing a generated one. Starts
and goals are random poses in free cells of 4 m, the courses random as well: many cannot be left or
reached in a turn. Success counts among the questions that any of the planners answered.
"""

import argparse
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from staniel.city import City
from staniel.guidance.planning import NoPath, Obstacles, Plan, Problem, plan, planner_names
from staniel.kernels.cache import drop_stale

CONSOLE = Console(width=110)
SHARED = Path(__file__).parents[2] / "shared/data"
CLEARANCE, CELL = 4.0, 4.0

GOALS = {"median": 50.0, "95 %": 300.0, "no path": 1000.0}
"""Of A* over 1 km² [ms]."""


@dataclass(frozen=True)
class Setting:
    """At which height and how tightly one flies."""

    name: str
    share: float
    """Of the tallest roof's height; 0: every building is in the way."""
    radius: float
    """Of the tightest turn [m]."""


SETTINGS = (
    Setting("among all buildings, 15 m", 0.0, 15.0),
    Setting("among all buildings, 33 m", 0.0, 33.0),
    Setting("half the tallest roof, 33 m", 0.5, 33.0),
    Setting("0.9 of the tallest roof, 33 m", 0.9, 33.0),
)


def cities() -> Iterator[tuple[str, City]]:
    """Real districts of about 1 km², or a generated one."""
    maps = [SHARED / f"maps/{name}_0_512.map" for name in ("Boston", "Milan")]
    footprints = SHARED / "footprints/helsinki_centre_buildings.geojson"
    heights = (10.0, 40.0)
    for path in maps:
        if path.is_file():
            yield path.stem.split("_")[0], City.from_grid(path, cell=2.0, heights=heights, seed=1)
    if footprints.is_file():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield "Helsinki", City.from_geojson(footprints, heights=heights, size=(1000.0, 1000.0))
    if not footprints.is_file() and not maps[0].is_file():
        yield "generated", City.generate(size=(1000.0, 1000.0), density=0.35, heights=heights)


def questions(city: City, setting: Setting, count: int) -> list[Problem]:
    """Random poses in free cells."""
    obstacles = Obstacles.from_city(
        city, altitude=setting.share * city.tallest, clearance=CLEARANCE, cell=CELL
    )
    rng = np.random.default_rng(0)
    free = obstacles.middles[~obstacles.blocked]
    asked = []
    for _ in range(count):
        (ax, ay), (bx, by) = free[rng.integers(len(free), size=2)].tolist()
        a, b = rng.uniform(-np.pi, np.pi, 2).tolist()
        asked.append(Problem((ax, ay, a), (bx, by, b), setting.radius, obstacles))
    return asked


def answered(name: str, asked: list[Problem]) -> tuple[list[Plan | NoPath], np.ndarray]:
    """What a planner answers, and in how many milliseconds of the processor each."""
    answers, times = [], []
    for number, problem in enumerate(asked):
        rng = np.random.default_rng(number)
        started = time.process_time()
        answers.append(plan(problem, name, rng))
        times.append(1e3 * (time.process_time() - started))
    return answers, np.array(times)


def compare(names: list[str], count: int) -> None:
    """Every planner on every city and setting."""
    drop_stale()
    square = Obstacles.open((200.0, 200.0), altitude=9.0, clearance=4.0)
    for name in names:
        plan(Problem((50.0, 50.0, 0.0), (150.0, 150.0, 0.0), 15.0, square), name)
    loaded = list(cities())
    for setting in SETTINGS:
        sums: dict[str, list[tuple[list[Plan | NoPath], np.ndarray]]] = {n: [] for n in names}
        for place, city in loaded:
            asked = questions(city, setting, count)
            blocked = 100.0 * asked[0].obstacles.blocked.mean()
            for name in names:
                sums[name].append(answered(name, asked))
            CONSOLE.print(f"{setting.name}: {place}, {blocked:.0f} % of the cells blocked")
        report(setting, {name: merged(parts) for name, parts in sums.items()})


def merged(
    parts: list[tuple[list[Plan | NoPath], np.ndarray]],
) -> tuple[list[Plan | NoPath], np.ndarray]:
    """Of all cities together."""
    return [a for answers, _ in parts for a in answers], np.concatenate([t for _, t in parts])


def report(setting: Setting, results: dict[str, tuple[list[Plan | NoPath], np.ndarray]]) -> None:
    """One table."""
    lengths = np.array(
        [[a.length if a else np.inf for a in answers] for answers, _ in results.values()]
    )
    best = lengths.min(axis=0)
    open_ones = np.isfinite(best)
    table = Table(
        *("planner", "success", "length / best: median", "95 %"),
        *("found: median ms", "95 % ms", "no path: most ms"),
        title=f"{setting.name}: {open_ones.sum()} of {len(best)} questions have an answer",
    )
    for (name, (_, times)), row in zip(results.items(), lengths, strict=True):
        found = np.isfinite(row)
        ratios = row[found] / best[found] if found.any() else np.array([np.nan])
        took = times[found] if found.any() else np.array([np.nan])
        table.add_row(
            name,
            f"{100.0 * found.sum() / max(open_ones.sum(), 1):.0f} %",
            f"{np.median(ratios):.3f}",
            f"{np.percentile(ratios, 95):.3f}",
            f"{np.median(took):.1f}",
            f"{np.percentile(took, 95):.0f}",
            f"{times[~found].max(initial=0.0):.0f}",
        )
    CONSOLE.print(table)
    CONSOLE.print("goals of astar: " + ", ".join(f"{k} {v:g} ms" for k, v in GOALS.items()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40, help="questions a city and setting")
    parser.add_argument("--planners", nargs="*", default=None, help="by name; all if not given")
    given = parser.parse_args()
    compare(given.planners or planner_names(), given.count)
