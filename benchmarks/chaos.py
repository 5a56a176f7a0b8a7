"""Chaos: short missions with messages lost and doubled, aircraft killed and the radio cut in two.

    python benchmarks/chaos.py --seeds 21          # 48 cells, 1008 missions
    python benchmarks/chaos.py --seeds 1 --cells 6

For each cell the longest time that two aircraft which could hear each other held one vehicle, and
the longest that a known vehicle went unheld with a free aircraft in reach, against the bound that
is worked out beforehand: a heartbeat gets through with probability 1 - 10⁻⁶, plus the lease, plus
one auction.
"""

import argparse
import itertools
import math
import multiprocessing
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import staniel
from staniel.cooperation import CooperationConfig
from staniel.metrics.custody import custody, longest_run
from staniel.record import Record
from staniel.recording import Recorder, read_record
from staniel.scenario.assemble import assemble
from staniel.scenario.build import build_city

LOSSES = (0.0, 0.3, 0.6, 0.9)
KILLED = (0.0, 0.25, 0.5)
DOUBLED = (0.0, 0.3)
AIRCRAFT, VEHICLES = 4, 3


class Cell(NamedTuple):
    """One setting of the matrix."""

    loss: float
    killed: float
    partition: bool
    duplication: float


def cells() -> list[Cell]:
    """All settings."""
    return [Cell(*cell) for cell in itertools.product(LOSSES, KILLED, (False, True), DOUBLED)]


def bound(loss: float, config: CooperationConfig | None = None, step: float = 1.0) -> float:
    """The time within which a double holder or an orphan has to end [s].

    A heartbeat passes with probability 1 - 10⁻⁶; a lease ends; one auction: what a free agent waits
    before it opens it, the time for bids, and its award as often as it is said.
    """
    config = config or CooperationConfig()
    beats = 1 if loss == 0.0 else math.ceil(math.log(1e-6) / math.log(loss))
    auction = (2 * config.bid_wait + 1) + config.bid_wait + config.award_tries * config.bid_wait
    return (beats + auction) * step + config.lease


def minutes(loss: float) -> float:
    """Long enough to break the bound in."""
    return max(3.0, 2.0 * bound(loss) / 60.0)


def scenario(cell: Cell, seed: int) -> staniel.Scenario:
    """A small town; who dies and when is drawn from the seed."""
    rng = np.random.default_rng(seed)
    seconds = 60.0 * minutes(cell.loss)
    dead = rng.permutation(AIRCRAFT)[: round(cell.killed * AIRCRAFT)].tolist()
    schedule = [
        {"kind": "lost", "aircraft": int(k), "time": float(rng.uniform(0.2, 0.6) * seconds)}
        for k in sorted(dead)
    ]
    third = seconds / 3.0
    halves = [[0, 1], [2, 3]]
    partitions = [{"start": third, "end": 1.5 * third, "groups": halves}] if cell.partition else []
    return staniel.load_scenario(
        "downtown",
        seed=seed,
        minutes=minutes(cell.loss),
        city={"size": [400.0, 400.0]},
        vehicles={"count": VEHICLES},
        aircraft={"count": AIRCRAFT},
        guidance={"pursuit": "carrot"},
        tracking={"particles": 300},
        faults={"schedule": schedule},
        radio={
            "sigma": 1e6, "range": 5000.0, "loss": cell.loss, "duplication": cell.duplication,
            "partitions": partitions,
        },
    )  # fmt: skip


def _record(scenario: staniel.Scenario) -> Record:
    """Fly, without pictures and figures that nobody looks at here."""
    city = build_city(scenario.city, scenario.seed)
    mission = assemble(scenario, city)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mission.mcap"
        content, version = scenario.model_dump(mode="json"), staniel.__version__
        with Recorder(
            file, scenario=content, version=version, city=city, clock=scenario.clock
        ) as recorder:
            for frame in mission.frames():
                recorder.write(frame)
            recorder.finish(True)
        return read_record(file)


def fly(job: tuple[Cell, int]) -> tuple[Cell, int, float, float, str]:
    """Longest double holding and orphan of one mission [s], and what it raised, if it did."""
    cell, seed = job
    try:
        kept = custody(_record(scenario(cell, seed)))
    except Exception as error:
        return cell, seed, math.nan, math.nan, f"{type(error).__name__}: {error}"
    return cell, seed, longest_run(kept.doubled, 1.0), longest_run(kept.orphaned, 1.0), ""


def main(arguments: list[str] | None = None) -> int:
    """Fly the matrix and print it; 1 where a bound is broken or a mission raised."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=21, help="missions a cell")
    parser.add_argument("--cells", type=int, default=0, help="only so many cells, spread evenly")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    chosen = cells()
    if options.cells:
        chosen = chosen[:: max(len(chosen) // options.cells, 1)][: options.cells]
    # One of each cell after the other, so that a run cut short by Ctrl-C has flown all alike; no
    # two missions have a city, traffic or bad luck in common.
    jobs = [(cell, 1000 + k) for k, cell in enumerate(chosen * options.seeds)]
    started = time.monotonic()
    found: dict[Cell, list[Any]] = {cell: [] for cell in chosen}
    with multiprocessing.get_context("spawn").Pool(options.workers, _leave_stopping) as pool:
        try:
            for done, (cell, *rest) in enumerate(pool.imap_unordered(fly, jobs), 1):
                found[cell].append(rest)
                left = (time.monotonic() - started) / done * (len(jobs) - done)
                line = f"\r{done}/{len(jobs)} missions, {left:.0f} s left "
                print(line, end="", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.terminate()
    print(file=sys.stderr)
    return _report({k: v for k, v in found.items() if v}, time.monotonic() - started)


def _leave_stopping() -> None:
    """A Ctrl-C is the parent's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _report(found: dict[Cell, list[Any]], seconds: float) -> int:
    print("| loss | killed | partition | doubled | bound | two holders | orphan | over |")
    print("|---:|---:|---|---:|---:|---:|---:|---:|")
    over = failures = missions = 0
    for cell, runs in found.items():
        limit = bound(cell.loss)
        double, orphan = (max(run[k] for run in runs) for k in (1, 2))
        broken = sum(not (run[1] <= limit and run[2] <= limit) for run in runs)
        over, missions = over + broken, missions + len(runs)
        print(
            f"| {cell.loss:g} | {cell.killed:.0%} | {'yes' if cell.partition else 'no'} "
            f"| {cell.duplication:.0%} | {limit:.0f} s | {double:.0f} s | {orphan:.0f} s "
            f"| {broken} |"
        )
        for seed, *_, error in runs:
            if error:
                failures += 1
                print(f"  seed {seed}: {error}", file=sys.stderr)
        worst = [run[0] for run in runs if not (run[1] <= limit and run[2] <= limit)]
        if worst:
            print(f"  {cell}: over the bound in seeds {worst}", file=sys.stderr)
    print(f"\n{missions} missions in {seconds:.0f} s: {over} over their bound, {failures} raised")
    return int(over > 0 or failures > 0)


if __name__ == "__main__":
    sys.exit(main())
