"""Cost and accuracy of tracking against Stone Soup, on the same simulated detections.

Run by ``make bench``, or alone as ``python benchmarks/tracking.py``; ``--quick`` takes fewer seeds
and steps. Stone Soup is the extra ``stonesoup``; without it the comparison is left out. One
process, one thread, compile excluded, the rivals in turns of ten steps; detections are made
beforehand in each one's own type. Times are the process's own, so another one on the machine
disturbs them less. Intervals are 95 % over the seeds, of Student's t.
"""

import argparse
import importlib.util
import itertools
import os
import time
from collections.abc import Callable, Sequence
from typing import Any

# Before NumPy is loaded: one thread each.
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import stats

from staniel.datatypes.belief import Sighting, TrackEstimate
from staniel.metrics import gospa, identity_scores
from staniel.tracking import Tracker, TrackingConfig
from swarm import Knowledge, Swarm, simulate

Floats = NDArray[np.float64]

CONSOLE = Console()
KNOWN = Knowledge()
FASTEST = 10.0
"""Greatest speed that trackers are told of [m/s]."""
PATIENCE = 5
"""Steps without a detection after which a track is given up."""
PARTICLES = 1000
FEW = 300
MANY_NAME, FEW_NAME = f"staniel, {PARTICLES}", f"staniel, {FEW}"
"""staniel's tracker with as many particles as its rival, and with few against the Kalman filter."""
TURN = 10
"""Steps that each takes before it is the next one's turn."""
BURN_IN = 10
"""Steps before the second table's GOSPA begins."""
FLOOR = (8.0, 10.0)
"""What one particle's step costs at best [ns]."""
DENSE = 100.0
"""False alarms a step of dense clutter."""
CUTOFF, ORDER = 20.0, 2.0
PARTS = ("distance", "localisation", "missed", "false")
OURS = TrackingConfig(
    particles=PARTICLES,
    dynamics="constant-velocity",
    acceleration_noise=KNOWN.acceleration**0.5,
    kernel=0.5,
    max_speed=FASTEST,
    detection_probability=KNOWN.detection,
    view_probability=1.0,
    clutter_density=KNOWN.density,
    gate=4.0,
    confirmations=3,
    unseen_limit=PATIENCE,
)
"""What staniel's tracker is told: what is true, as its rivals are."""


class Ours:
    """staniel's tracker on a swarm's detections."""

    def __init__(self, swarm: Swarm, known: Knowledge, seed: int, config: TrackingConfig) -> None:
        covariance = known.sigma**2 * np.eye(2)
        self._sightings = [
            (t, [Sighting(t, place, covariance) for place in places])
            for t, places in zip(swarm.times.tolist(), swarm.detections, strict=True)
        ]
        self._tracker = Tracker(config, seed)
        self._k = 0
        self._tracks: list[TrackEstimate] = []

    def step(self) -> None:
        """Take the next step's detections."""
        self._tracks = self._tracker.step(*self._sightings[self._k])
        self._k += 1

    def tracks(self) -> tuple[list[str], Floats]:
        """Names and (m, 2) positions [m] of the live tracks."""
        places = [track.position for track in self._tracks]
        return [str(track.id) for track in self._tracks], np.reshape(places, (-1, 2))


def rivals_of(swarm: Swarm, seed: int) -> dict[str, Callable[[], Any]]:
    """Makers of everyone who runs; Stone Soup's only where it is installed."""
    few = OURS.model_copy(update={"particles": FEW})
    makers: dict[str, Callable[[], Any]] = {
        MANY_NAME: lambda: Ours(swarm, KNOWN, seed, OURS),
        FEW_NAME: lambda: Ours(swarm, KNOWN, seed, few),
    }
    if importlib.util.find_spec("stonesoup") is not None:
        import stonesoup_rivals as theirs

        told = (swarm, KNOWN, FASTEST, PATIENCE)
        makers["Stone Soup, particle GNN"] = lambda: theirs.particle_gnn(*told, PARTICLES)
        makers["Stone Soup, Kalman GNN"] = lambda: theirs.kalman_gnn(*told)
    return makers


def interval(values: Sequence[float]) -> str:
    """Mean and half the width of its 95 % interval."""
    array = np.asarray(values, float)
    if len(array) < 2:
        return f"{array.mean():.3g}"
    half = stats.t.ppf(0.975, len(array) - 1) * array.std(ddof=1) / np.sqrt(len(array))
    return f"{array.mean():.3g} ± {half:.2g}"


def fly(swarm: Swarm, seed: int) -> dict[str, dict[str, float]]:
    """Figures of every rival on one swarm."""
    np.random.seed(seed)  # noqa: NPY002 -- Stone Soup draws from the global generator
    steps, targets = swarm.truth.shape[:2]
    rivals = {name: make() for name, make in rivals_of(swarm, seed).items()}
    spent = {name: np.empty(steps) for name in rivals}
    scores = {name: np.empty((steps, 4)) for name in rivals}
    pictures: dict[str, list[tuple[list[str], Floats]]] = {name: [] for name in rivals}
    for first, (name, rival) in itertools.product(range(0, steps, TURN), rivals.items()):
        for k in range(first, min(first + TURN, steps)):
            started = time.process_time()
            rival.step()
            spent[name][k] = time.process_time() - started
            pictures[name].append(rival.tracks())
            places = pictures[name][-1][1]
            scores[name][k] = gospa(swarm.truth[k], places, cutoff=CUTOFF, order=ORDER)
    truth = [(range(targets), places) for places in swarm.truth]
    return {
        name: {
            "ms": 1e3 * float(np.median(spent[name][BURN_IN:])),
            "all": float(scores[name][:, 0].mean()),
            **dict(zip(PARTS, scores[name][BURN_IN:].mean(axis=0).tolist(), strict=True)),
            "switches": float(identity_scores(truth, pictures[name]).switches),
        }
        for name in rivals
    }


def race(seeds: int, targets: int = 20, steps: int = 100) -> None:
    """Print cost and accuracy of all, and the differences of each rival to staniel's tracker."""
    flown = [fly(simulate(KNOWN, targets, steps, seed), seed) for seed in range(seeds)]
    names = list(flown[0])
    keys = ("all", *PARTS, "switches")
    table = Table(
        "", "ms per step", f"over {PARTICLES}", f"over {FEW}", "GOSPA, all", f"from step {BURN_IN}",
        "localisation", "missed", "false", "switches",
        title=f"{targets} targets, {KNOWN.clutter:g} false alarms a step, {steps} steps, "
        f"{seeds} seeds, one thread; Stone Soup's particles: {PARTICLES}",
    )  # fmt: skip

    def column(name: str, key: str) -> Floats:
        return np.array([figures[name][key] for figures in flown])

    for name in names:
        ratios = [column(name, "ms") / column(ours, "ms") for ours in (MANY_NAME, FEW_NAME)]
        values = [column(name, key) for key in keys]
        table.add_row(name, *map(interval, (column(name, "ms"), *ratios, *values)))
    for ours, name in itertools.product((MANY_NAME, FEW_NAME), names[2:]):
        shares = [column(ours, key) / column(name, key) - 1.0 for key in ("all", "distance")]
        told = [f"{interval(100.0 * share)} %" for share in shares]
        table.add_row(f"{ours} against {name}", "", "", "", *told)
    CONSOLE.print(table)
    if len(names) == 2:
        CONSOLE.print("Stone Soup is not installed: the comparison is left out")


def medians(rivals: Sequence[Ours], steps: int) -> list[float]:
    """Seconds of each rival's step after the burn-in, in turns."""
    spent = np.empty((steps, len(rivals)))
    for k in range(steps):
        for column, rival in enumerate(rivals):
            started = time.process_time()
            rival.step()
            spent[k, column] = time.process_time() - started
    return np.median(spent[BURN_IN:], axis=0).tolist()


def particle_cost(steps: int, targets: int = 20) -> None:
    """What a particle's step costs: how a step's time grows with the number of particles."""
    sizes = (500, 1000, 2000, 4000)
    swarm = simulate(KNOWN, targets, steps, 0)
    configs = [OURS.model_copy(update={"particles": size}) for size in sizes]
    costs = medians([Ours(swarm, KNOWN, 0, config) for config in configs], steps)
    slope, rest = np.polyfit(targets * np.array(sizes), costs, 1)
    share = [100.0 * floor / (1e9 * slope) for floor in FLOOR]
    CONSOLE.print(
        f"staniel's filter alone: [bold]{1e9 * slope:.1f}[/] ns per particle and step; the floor "
        f"of {FLOOR[0]:g}-{FLOOR[1]:g} ns is {share[0]:.0f}-{share[1]:.0f} % of it. "
        f"All the rest of a step: {1e6 * rest:.0f} µs\n"
    )


def growth(counts: Sequence[int], steps: int) -> None:
    """Cost of a step in dense clutter against the number of targets."""
    known = Knowledge(clutter=DENSE)
    config = OURS.model_copy(update={"clutter_density": known.density})
    everyone = (5, 10, *counts)
    swarms = [simulate(known, count, steps, 0) for count in everyone]
    costs = [1e3 * s for s in medians([Ours(s, known, 0, config) for s in swarms], steps)]
    theirs = ["", ""]
    if importlib.util.find_spec("stonesoup") is not None:
        theirs = [jpda_cost(swarm, known, steps) for swarm in swarms[:2]]
    table = Table(
        "targets", "staniel ms", "Stone Soup JPDA ms",
        title=f"a step among {DENSE:g} false alarms, {PARTICLES} particles a target",
    )  # fmt: skip
    for count, cost, other in itertools.zip_longest(everyone, costs, theirs, fillvalue=""):
        table.add_row(str(count), f"{cost:.2f}", other)
    CONSOLE.print(table)
    power = np.polyfit(np.log(counts), np.log(costs[2:]), 1)[0]
    CONSOLE.print(f"cost per step grows as the power [bold]{power:.2f}[/] of the targets\n")


def jpda_cost(swarm: Swarm, known: Knowledge, steps: int, limit: float = 60.0) -> str:
    """Median milliseconds of a step, over half of the steps and within a minute."""
    import stonesoup_rivals

    rival, spent = stonesoup_rivals.jpda(swarm, known, FASTEST, PATIENCE), []
    for _ in range(max(steps // 2, BURN_IN + 5)):
        started = time.process_time()
        rival.step()
        spent.append(time.process_time() - started)
        if sum(spent) > limit:
            return "over a minute"
    return f"{1e3 * float(np.median(spent[BURN_IN:])):.0f}"


def compare(*, quick: bool) -> None:
    """Print everything."""
    medians([Ours(simulate(KNOWN, 2, 2 * BURN_IN, 0), KNOWN, 0, OURS)], 2 * BURN_IN)
    race(3 if quick else 9, steps=40 if quick else 100)
    particle_cost(50 if quick else 200)
    growth((20, 50, 100, 200), 30 if quick else 60)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer seeds and steps")
    compare(quick=parser.parse_args().quick)
