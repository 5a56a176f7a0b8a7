"""Runs per core-hour of a study, how well two processes share the work, and memory by run count.

``python benchmarks/studies.py``. The pairs of one and two processes alternate, so a busy machine
disturbs both alike; processor time of a run is taken in its worker.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

CONSOLE = Console(highlight=False)
GOAL_EFFICIENCY = 0.9

PROGRAM = """
import resource, sys
from staniel import studies
if __name__ == "__main__":
    study, out, workers, seeds, minutes = sys.argv[1:]
    studies.run(study, out, workers=int(workers), seeds=int(seeds), minutes=float(minutes))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def run(study: str, workers: int, seeds: int, minutes: float) -> tuple[float, int, list[float]]:
    """Wall seconds of the flying part, the parent's peak memory [kB], processor seconds a run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        numbers = [str(workers), str(seeds), str(minutes)]
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM, study, str(out), *numbers],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        lines = [json.loads(line) for line in (out / "times.jsonl").read_text().splitlines()]
        ends = sorted(line["at"] for line in lines)
        # From the first outcome on, so that starting the processes does not count.
        share = (len(ends) - 1) / len(ends)
        return (ends[-1] - ends[0]) / share, int(done.stdout), [line["seconds"] for line in lines]


def efficiency(pairs: int = 3) -> None:
    """Two processes against one on the same study."""
    ratios, seconds = [], []
    for _ in range(pairs):
        alone, _, one = run("3-density", 1, 4, 10.0)
        together, _, two = run("3-density", 2, 4, 10.0)
        ratios.append(alone / together / 2.0)
        seconds += one
        CONSOLE.print(
            f"32 runs: {alone:.1f} s alone, {together:.1f} s by two; processor seconds a run "
            f"{statistics.median(one):.2f} and {statistics.median(two):.2f}"
        )
    CONSOLE.print(
        f"{3600.0 / statistics.mean(seconds):.0f} ten-minute runs of one aircraft and one vehicle "
        f"a core-hour; efficiency of two processes {statistics.median(ratios):.2f} "
        f"(goal {GOAL_EFFICIENCY})"
    )


def memory() -> None:
    """Peak memory of the process that runs the study, by the number of runs."""
    for seeds in (50, 500, 2000):
        before = time.perf_counter()
        _, peak, _ = run("2-partner", 2, seeds, 0.05)
        CONSOLE.print(
            f"{2 * seeds} runs of 3 s: peak {peak / 1024:.0f} MB, "
            f"{time.perf_counter() - before:.0f} s"
        )


if __name__ == "__main__":
    efficiency()
    memory()
