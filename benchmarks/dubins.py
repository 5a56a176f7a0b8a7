"""Shortest Dubins paths against OMPL and the C core of the package ``dubins``, on the same poses.

Run by ``make bench``, or alone with ``python benchmarks/dubins.py``; a peer that is not there is
left out. OMPL comes with ``pip install ompl`` and is asked through its Python binding, state by
state, the states made and filled beforehand. The package ``dubins`` no longer builds for new
Pythons, but its C core does: compile ``dubins/src/dubins.c`` of its source distribution with
``gcc -O3 -shared -fPIC`` and hand the library in with ``--core``; it is called from a compiled
loop. Times are the process's own, so another one on the machine disturbs them less.
"""

import argparse
import ctypes
import importlib.util
import statistics
import time
from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from staniel.guidance import shortest
from staniel.kernels import dubins

Floats = NDArray[np.float64]
Rival = tuple[Callable[[], Floats], int]
"""What gives the lengths of the first so many pairs."""

CONSOLE = Console()
RADIUS = 30.0
COUNT = 1_000_000
GOALS = {"OMPL, preset states": 15.0, "C core": 8.0}
"""Ratios to reach or exceed."""


def poses(n: int, reach: float, seed: int) -> Floats:
    """(n, 3) poses, uniform in a square of twice the reach."""
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-reach, reach, (n, 2)), rng.uniform(-np.pi, np.pi, n)])


def by_ompl(starts: Floats, goals: Floats) -> Rival:
    """OMPL's distance between states that are there already."""
    from ompl import base

    space, count = base.DubinsStateSpace(RADIUS), len(starts) // 20

    def states(rows: Floats) -> list[object]:
        made = [space.allocState() for _ in rows]
        for state, (x, y, yaw) in zip(made, rows.tolist(), strict=True):
            state.setX(x)
            state.setY(y)
            state.setYaw(yaw)
        return made

    pairs = list(zip(states(starts[:count]), states(goals[:count]), strict=True))
    distance = space.distance
    return lambda: np.array([distance(a, b) for a, b in pairs]), count


def by_core(library: str, starts: Floats, goals: Floats) -> Rival:
    """The C core of ``dubins``, called pair by pair from a compiled loop."""
    call = ctypes.CDLL(library).dubins_shortest_path
    call.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
    call.restype = ctypes.c_int

    @njit(error_model="numpy")
    def run(a: Floats, b: Floats, radius: float) -> Floats:
        out = np.empty(a.shape[0])
        path = np.zeros(8)  # Start, three pieces in radii, the radius, the word.
        for i in range(a.shape[0]):
            call(path.ctypes.data, a[i].ctypes.data, b[i].ctypes.data, radius)
            out[i] = radius * (path[3] + path[4] + path[5])
        return out

    return lambda: run(starts, goals, RADIUS), len(starts)


def race(rivals: dict[str, Rival], repeats: int) -> dict[str, float]:
    """Median processor seconds per query of each rival, in turns."""
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for _ in range(repeats):
        for name, (call, count) in rivals.items():
            started = time.process_time()
            call()
            times[name].append((time.process_time() - started) / count)
    return {name: statistics.median(values) for name, values in times.items()}


def compare(core: str | None = None, repeats: int = 9) -> None:
    """Race on close, mixed and distant poses; print times, ratios, and how far lengths differ."""
    table = Table(
        *("poses within", "three turns", "", "ns per query", "ratio", "goal", "apart"),
        title=f"shortest Dubins path, radius {RADIUS:.0f} m, batches of {COUNT}, one thread",
    )
    for reach in (60.0, 150.0, 300.0):
        a, b = poses(COUNT, reach, 0), poses(COUNT, reach, 1)
        rivals: dict[str, Rival] = {
            "staniel": (lambda a=a, b=b: shortest(a, b, RADIUS).length, COUNT),
            "its kernel": (lambda a=a, b=b: dubins.shortest(a, b, RADIUS)[0], COUNT),
        }
        if importlib.util.find_spec("ompl") is not None:
            rivals["OMPL, preset states"] = by_ompl(a, b)
        if core is not None:
            rivals["C core"] = by_core(core, a, b)
        lengths = {name: call() for name, (call, _) in rivals.items()}
        ours = lengths["staniel"]
        close = np.mean(shortest(a, b, RADIUS).word >= dubins.RLR)
        medians = race(rivals, repeats)
        for name, seconds in medians.items():
            ratio, goal = seconds / medians["staniel"], GOALS.get(name)
            apart = np.abs(lengths[name] / ours[: len(lengths[name])] - 1.0).max()
            table.add_row(
                f"{reach:.0f} m",
                f"{100 * close:.0f} %",
                name,
                f"{1e9 * seconds:.0f}",
                f"{ratio:.1f}",
                f"{goal:g}" if goal else "",
                f"{apart:.0e}",
            )
    CONSOLE.print(table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--core", help="shared library of the C core of the package dubins")
    compare(parser.parse_args().core)
