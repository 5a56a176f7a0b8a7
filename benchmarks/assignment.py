"""Assignment: how fast against scipy, lap and lapjv; how good and how soon over a poor radio.

Alone: ``python benchmarks/assignment.py``; ``--quick`` for a glance. Rivals that are not there are
left out (``pip install lap lapjv``; the second builds from source). Times are the process's own, so
another one on the machine disturbs them less; contestants take turns.
"""

import argparse
import importlib
import importlib.util
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.optimize import linear_sum_assignment

from staniel.cooperation import Allocation, CooperationConfig, Goal, Price, Task, assign
from staniel.cooperation.bundles import Bundles, Path, Score
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import Bundle
from staniel.guidance import shortest
from staniel.kernels import auction
from staniel.studies.statistics import estimate

Floats = NDArray[np.float64]

CONSOLE = Console(width=110)
RADIUS = 30.0  # m, of the tightest turn
SIDE = 2000.0  # m, of the square
SMALL = 20_000  # matrices of 3 by 3
LOSSES = (0.0, 0.1, 0.3, 0.5, 0.7)
LIMIT = 300  # rounds
POSE = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0)


def places(n: int, m: int, rng: np.random.Generator) -> Floats:
    """(n, m) Dubins distances between aircraft and targets that are uniform in a square."""
    ends = [
        np.column_stack([rng.uniform(0.0, SIDE, (k, 2)), rng.uniform(-np.pi, np.pi, k)])
        for k in (n, m)
    ]
    starts, goals = np.repeat(ends[0], m, axis=0), np.tile(ends[1], (n, 1))
    return shortest(starts, goals, RADIUS).length.reshape(n, m)


KINDS: dict[str, Callable[[int, np.random.Generator], Floats]] = {
    "uniform": lambda n, rng: rng.random((n, n)),
    "integers below 100": lambda n, rng: rng.integers(0, 100, (n, n)).astype(np.float64),
    "Dubins distances": lambda n, rng: places(n, n, rng),
}


@njit(error_model="numpy")
def many(costs: Floats) -> int:
    """The exact method on one small matrix after the other, from a compiled loop."""
    last = 0
    for k in range(costs.shape[0]):
        last += auction.optimal(costs[k])[0][0]
    return last


def race(rivals: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median processor seconds of each, in turns, after one call that does not count."""
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for call in rivals.values():
        call()
    for _ in range(repeats):
        for name, call in rivals.items():
            started = time.process_time()
            call()
            times[name].append(time.process_time() - started)
    return {name: statistics.median(values) for name, values in times.items()}


def small(repeats: int) -> None:
    """Three aircraft, three targets."""
    costs = np.random.default_rng(0).random((SMALL, 3, 3))
    medians = race(
        {
            "kernel": lambda: many(costs),
            "scipy": lambda: [linear_sum_assignment(cost) for cost in costs],
            "assign": lambda: [assign(cost) for cost in costs],
        },
        repeats,
    )
    table = Table("n = 3", "µs each", "of the kernel's", title="small matrices, uniform")
    for name, seconds in medians.items():
        ratio = seconds / medians["kernel"]
        table.add_row(name, f"{1e6 * seconds / SMALL:.2f}", f"{ratio:.1f}")
    CONSOLE.print(table)


def large(sizes: Sequence[int], repeats: int) -> None:
    """Squares of many rows."""
    for kind, make in KINDS.items():
        table = Table("n", "who", "ms", "of the best other", title=f"large matrices, {kind}")
        for n in sizes:
            cost = make(n, np.random.default_rng(n))
            rivals: dict[str, Callable[[], Any]] = {
                "assign": lambda cost=cost: assign(cost),
                "scipy": lambda cost=cost: linear_sum_assignment(cost),
            }
            for name in ("lap", "lapjv"):
                if importlib.util.find_spec(name) is not None:
                    call = importlib.import_module(name).lapjv
                    rivals[name] = lambda cost=cost, call=call: call(cost)
            least = cost[linear_sum_assignment(cost)].sum()
            assert abs(assign(cost).cost - least) <= 1e-9 * least
            medians = race(rivals, repeats if n > 200 else 20 * repeats)
            best = min(seconds for name, seconds in medians.items() if name != "assign")
            for name, seconds in medians.items():
                ratio = f"{seconds / best:.2f}" if name == "assign" else ""
                table.add_row(str(n), name, f"{1e3 * seconds:.3f}", ratio)
        CONSOLE.print(table)


@dataclass(slots=True)
class Air:
    """Broadcasts of one round, each lost to each receiver by itself, heard in the next round."""

    team: int
    loss: float
    rng: np.random.Generator
    messages: int = 0
    beats: int = 0  # of them heartbeats, which a team says anyway
    inboxes: list[list[Any]] = field(default_factory=list)

    def carry(self, said: Sequence[tuple[int, Any]]) -> None:
        """Take what (sender, message) pairs were said; `inboxes` are the next round's."""
        self.messages += len(said)
        heard = self.rng.random((len(said), self.team)) >= self.loss
        self.inboxes = [
            [message for k, (sender, message) in enumerate(said) if heard[k, i] and sender != i]
            for i in range(self.team)
        ]


@dataclass(frozen=True, slots=True)
class Outcome:
    """Column of each row, and the rounds until all agreed; None where they did not."""

    columns: tuple[int, ...]
    rounds: int | None


Mode = Callable[[Floats, Air], Outcome]
"""A way to agree on who takes what, each agent knowing its row of the costs alone."""


def batch(cost: Floats, air: Air) -> Outcome:
    """Agent 0 gathers the rows and assigns; rows and answer are said again until heard."""
    n = len(cost)
    rows: set[int] = {0}
    told: set[int] = set()
    columns: tuple[int, ...] = ()
    air.carry([])
    for k in range(LIMIT):
        rows |= {sender for kind, sender in air.inboxes[0] if kind == "row"}
        told |= {i for i in range(1, n) if any(kind == "answer" for kind, _ in air.inboxes[i])}
        if len(rows) == n and not columns:
            columns = tuple(assign(cost).columns.tolist())
        if columns and len(told) == n - 1:
            return Outcome(columns, k)
        said = [(i, ("row", i)) for i in range(1, n) if i not in told]
        air.carry([*said, (0, ("answer", 0))] if columns else said)
    return Outcome(columns, None)


def bundles(cost: Floats, air: Air) -> Outcome:
    """Consensus on bundles of one target each."""
    n, m = cost.shape
    targets = [TrackId(0.0, 0, j) for j in range(m)]
    worth = 1.0 + float(cost.max())

    def scored(row: list[float]) -> Score:
        def score(path: Path) -> float:
            return sum(worth - row[target.serial] for target in path)

        return score

    team = [Bundles(i, 1) for i in range(n)]
    scores = [scored(row) for row in cost.tolist()]
    air.carry([])
    for k in range(LIMIT):
        said: list[tuple[int, Bundle]] = []
        for i, agent in enumerate(team):
            words = agent.step(float(k), scores[i], targets, air.inboxes[i])
            said += [(i, word) for word in words]
        claims = [agent.claims for agent in team]
        if all(c == claims[0] for c in claims) and sum(len(a.path) for a in team) == min(n, m):
            return Outcome(tuple(a.path[0].serial if a.path else -1 for a in team), k)
        air.carry(said)
    return Outcome((), None)


def auctions(rule: str) -> Mode:
    """The team's own protocol: agent i finds target i, and tracks what it holds; no hand-overs."""
    config = CooperationConfig(award=rule, handover_margin=1e9, unheld_memory=1e9)

    def mode(cost: Floats, air: Air) -> Outcome:
        n = len(cost)
        rows, far = cost.tolist(), 1000.0  # m between two targets, of which no two are one
        names = [TrackId(0.0, i, 1) for i in range(n)]
        team = [Allocation(i, config, step=1.0) for i in range(n)]

        def priced(row: list[float]) -> Callable[[Sequence[Goal]], list[Price]]:
            return lambda goals: [Price(row[round(goal.position[0] / far)]) for goal in goals]

        air.carry([])
        for k in range(LIMIT):
            now, said = float(k), []
            for i, agent in enumerate(team):
                holding = agent.holding
                known = {i} if holding is None else {i, holding.id.founder}
                tasks = [
                    Task(names[j], (far * j, 0.0), 0.0, rows[i][j], j == i, last_seen=now)
                    for j in known
                ]
                words = agent.step(now, POSE, tasks, air.inboxes[i], priced(rows[i]))
                beat = agent.heartbeat("search", (0.0, 0.0))
                said += [(i, word) for word in words]
                air.beats += 1
                said.append((i, beat))
            held = [None if a.holding is None else a.holding.id.founder for a in team]
            if None not in held and len(set(held)) == n:
                return Outcome(tuple(held), k)
            air.carry(said)
        return Outcome((), None)

    return mode


MODES: dict[str, Mode] = {
    "batch": batch,
    "joint auctions": auctions("joint"),
    "single auctions": auctions("lowest"),
    "bundles": bundles,
}


def spread(values: Sequence[float], digits: int) -> str:
    """Mean and its 95 % interval."""
    found = estimate(values)
    return f"{found.mean:.{digits}f} ({found.low:.{digits}f}–{found.high:.{digits}f})"


def poor_radio(sizes: Sequence[int], seeds: int) -> None:
    """Cost ratio to the optimum, messages and rounds of each mode."""
    table = Table(
        *("n", "loss", "mode", "agreed", "cost of the least", "messages", "rounds"),
        title=f"who takes what over a poor radio, {seeds} seeds, Dubins distances",
    )
    for n in sizes:
        for loss in LOSSES:
            for name, mode in MODES.items():
                ratios, messages, rounds = [], [], []
                for seed in range(seeds):
                    cost = places(n, n, np.random.default_rng([seed, n]))
                    air = Air(n, loss, np.random.default_rng([seed, n, 1]))
                    outcome = mode(cost, air)
                    if outcome.rounds is None:
                        continue
                    summed = sum(cost[i, j] for i, j in enumerate(outcome.columns))
                    ratios.append(summed / assign(cost).cost)
                    messages.append(air.messages - air.beats)
                    rounds.append(outcome.rounds)
                table.add_row(
                    *(str(n), f"{loss:g}", name, f"{len(rounds)}/{seeds}"),
                    *(spread(ratios, 3), spread(messages, 0), spread(rounds, 1)),
                )
    CONSOLE.print(table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="of the teams")
    parser.add_argument("--quick", action="store_true", help="small sizes, few repeats")
    parser.add_argument("--only", choices=["speed", "radio"], help="one half of it")
    asked = parser.parse_args()
    if asked.only != "radio":
        small(3 if asked.quick else 9)
        large((100, 500) if asked.quick else (100, 500, 1000, 2000), 3 if asked.quick else 5)
    if asked.only != "speed":
        poor_radio((20,) if asked.quick else (20, 100), asked.seeds)
