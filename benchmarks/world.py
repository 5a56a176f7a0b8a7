"""Cost of one world tick as vehicles grow: traffic, aircraft, sensing of every pair, radio.

Run with ``make bench``, or alone as ``python benchmarks/world.py``. One process, one thread,
compile excluded, medians. The city is the Suzhou footprints of ``../shared/data``, or where these
are missing a generated one of about as many buildings.
"""

import argparse
import statistics
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.equipment import Airframe, Camera, RadioSet
from staniel.datatypes.message import Heartbeat, Message
from staniel.datatypes.truth import Truth
from staniel.world import Cameras, Radio, Traffic, World

CONSOLE = Console()
SUZHOU = Path(__file__).parents[2] / "shared/data/footprints/suzhou_old_town_buildings.geojson"


def suzhou() -> tuple[str, City]:
    """The city and what to call it."""
    if SUZHOU.is_file():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return "Suzhou", City.from_geojson(SUZHOU, heights=(9.0, 9.0))
    size = (1960.0, 2250.0)
    city = City.generate(size=size, density=0.28, block=(20.0, 37.0), heights=(3.0, 84.0))
    return "a generated city", city


def heartbeats(truth: Truth) -> list[list[Message]]:
    """What every aircraft says at every tick at least."""
    return [
        [Heartbeat(i, truth.tick, truth.time, Pose(*row), "search", (0.0, 0.0), None, None, 0.0)]
        for i, row in enumerate(truth.aircraft.tolist())
    ]


def tick_costs(city: City, vehicles: int, aircraft: int, ticks: int) -> dict[str, float]:
    """Median milliseconds of each stage of a tick, and of the tick."""
    seed = np.random.SeedSequence(0)
    clock, airframe = Clock(), Airframe(altitude=max(100.0, city.tallest + 20.0))
    world = World(city, airframe, aircraft, Traffic(count=vehicles), clock, seed)
    cameras = Cameras(city, Camera(), airframe.altitude, seed)
    radio = Radio(RadioSet(), np.uint64(1))
    # Orbits all over the city, so that the team sees as much of it as it can.
    columns = int(np.ceil(np.sqrt(aircraft)))
    commands = [
        FlyOrbit(
            (
                (i % columns + 0.5) * city.size[0] / columns,
                (i // columns + 0.5) * city.size[1] / columns,
            ),
            60.0,
            1,
            airframe.speed,
            airframe.altitude,
        )
        for i in range(aircraft)
    ]
    spent: dict[str, list[float]] = {"world": [], "cameras": [], "radio": [], "tick": []}
    truth = world.start()
    for tick in range(-60, ticks):  # a minute to get to the orbits
        marks = [time.perf_counter()]
        truth = world.advance(truth, commands)
        marks.append(time.perf_counter())
        if tick >= 0:
            cameras.sense(truth)
            marks.append(time.perf_counter())
            radio.deliver(heartbeats(truth), truth)
            marks.append(time.perf_counter())
            steps = np.diff(marks)
            for name, step in zip(spent, (*steps, marks[-1] - marks[0]), strict=True):
                spent[name].append(1e3 * float(step))
    return {name: statistics.median(values) for name, values in spent.items()}


def world_tick(counts: Sequence[int], aircraft: int = 100, ticks: int = 30) -> None:
    """Cost of a tick against the number of vehicles, and the power that fits it."""
    name, city = suzhou()
    tick_costs(city, 10, 2, 2)
    table = Table(
        "vehicles", "world ms", "cameras ms", "radio ms", "tick ms", "x real time",
        title=f"one world tick: {aircraft} aircraft over {name}, {len(city.outlines)} buildings",
    )  # fmt: skip
    costs = []
    for count in counts:
        cost = tick_costs(city, count, aircraft, ticks)
        costs.append(cost["tick"])
        row = [f"{cost[key]:.1f}" for key in ("world", "cameras", "radio", "tick")]
        table.add_row(str(count), *row, f"{1e3 / cost['tick']:.0f}")
    CONSOLE.print(table)
    power = np.polyfit(np.log(counts), np.log(costs), 1)[0]
    CONSOLE.print(
        f"cost per tick grows as the power [bold]{power:.2f}[/] of the number of vehicles "
        "(target: 10 x real time at 1000, near 1)\n"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer ticks")
    quick = parser.parse_args().quick
    world_tick([1000, 3000, 10_000], ticks=10 if quick else 30)
