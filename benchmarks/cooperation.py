"""Cooperation in missions: how soon a lost holder is replaced, and what a team is worth.

    python benchmarks/cooperation.py takeover --seeds 40
    python benchmarks/cooperation.py team --seeds 20
    python benchmarks/cooperation.py crowd --seeds 20
    python benchmarks/cooperation.py help --seeds 20
    python benchmarks/cooperation.py round --seeds 5

`takeover` kills aircraft 0 after two minutes, and says how long each vehicle that it held waited
for another holder. `team` flies the same cities with auctions, with a ground station, with nobody
sharing out, and with one aircraft. `crowd` has six vehicles for two aircraft, with and without
patrols. `help` has two vehicles for four aircraft that look ahead: nobody helps, who is asked does,
or whoever is free. `round` times 100 agents that share out 100 new targets.
"""

import argparse
import gc
import math
import sys
import time
from collections.abc import Callable

import numpy as np

import staniel
from staniel.city import City
from staniel.cooperation import (
    Allocation,
    CooperationConfig,
    CostConfig,
    CostModel,
    Gate,
    Goal,
    Situation,
    Task,
    assign,
)
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Message
from staniel.datatypes.wire import wire_size
from staniel.metrics.custody import custody, takeover_times
from staniel.studies.statistics import estimate

KILLED_AT = 120.0
ROUND = 4  # ticks: announce, bid, award, acknowledge


def takeover(seeds: int) -> None:
    """Time until another aircraft holds what the lost one held."""
    print("| loss | vehicles | never in 3 min | median | 90 % | longest |")
    print("|---:|---:|---:|---:|---:|---:|")
    for loss in (0.0, 0.5, 0.9):
        waits = []
        for seed in range(seeds):
            scenario = staniel.load_scenario(
                "downtown",
                seed=3000 + seed,
                minutes=(KILLED_AT + 180.0) / 60.0,
                vehicles={"count": 3},
                guidance={"pursuit": "carrot"},
                radio={"loss": loss},
                faults={"schedule": [{"kind": "lost", "aircraft": 0, "time": KILLED_AT}]},
            )
            record = staniel.fly(scenario).record
            waits += takeover_times(record, custody(record), KILLED_AT, 0)
        there = np.array(waits)
        quantiles = (
            np.quantile(there, [0.5, 0.9], method="higher") if len(there) else [math.nan] * 2
        )
        found = there[np.isfinite(there)]
        print(
            f"| {loss:g} | {len(there)} | {np.isinf(there).sum()} | {quantiles[0]:.0f} s "
            f"| {quantiles[1]:.0f} s | {found.max(initial=0.0):.0f} s |",
            flush=True,
        )


def _compare(cases: dict[str, dict[str, object]], seeds: int, first: int) -> None:
    """Share in sight and longest time out of sight of each case, paired with the first case."""
    rows: dict[str, np.ndarray] = {}
    for name, changes in cases.items():
        found = []
        for seed in range(first, first + seeds):
            scenario = staniel.load_scenario("downtown", seed=seed, **changes)
            targets = staniel.fly(scenario).metrics["targets"]
            gaps = [target["longest_gap"] for target in targets]
            shares = [target["visible_fraction_fine"] or 0.0 for target in targets]
            whole = 60.0 * scenario.minutes
            found.append((np.mean(shares), max(whole if gap is None else gap for gap in gaps)))
        rows[name] = np.array(found)
    base = rows[next(iter(cases))]
    print(
        "| case | in sight | longest gap of all | in sight, less the first | gap, less the first |"
    )
    print("|---|---:|---:|---:|---:|")
    for name, values in rows.items():
        cells = [estimate(values[:, 0] * 100.0), estimate(values[:, 1])]
        cells += [estimate((values - base)[:, 0] * 100.0), estimate((values - base)[:, 1])]
        words = [
            f"{cell.mean:.1f} [{cell.low:.1f}, {cell.high:.1f}] {unit}"
            for cell, unit in zip(cells, ("%", "s", "points", "s"), strict=True)
        ]
        print(f"| {name} | {' | '.join(words)} |", flush=True)


def team(seeds: int) -> None:
    """The same cities: auctions, a station, none, one aircraft."""
    common = {"minutes": 10.0, "guidance": {"pursuit": "carrot"}}
    _compare(
        {
            "auctions": common,
            "ground station": common | {"cooperation": {"mode": "centralised"}},
            "none": common | {"cooperation": {"mode": "none"}},
            "one aircraft": common | {"aircraft": {"count": 1}},
        },
        seeds,
        4000,
    )


def crowd(seeds: int) -> None:
    """Six vehicles, two aircraft."""
    common = {
        "minutes": 10.0,
        "guidance": {"pursuit": "carrot"},
        "aircraft": {"count": 2},
        "vehicles": {"count": 6},
    }
    _compare(
        {
            "no patrols": common,
            "patrols": common | {"cooperation": {"revisit_after": 60.0}},
            "ground station": common | {"cooperation": {"mode": "centralised"}},
        },
        seeds,
        5000,
    )


def help_(seeds: int) -> None:
    """Two vehicles, four aircraft, one plan for those that watch the same one."""
    common = {"minutes": 10.0, "vehicles": {"count": 2}}
    _compare(
        {
            f"help: {name}": common | {"cooperation": {"assistance": name}}
            for name in ("none", "asked", "always")
        },
        seeds,
        6000,
    )


def _spread(n: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Places in a square, no two of which could be one target."""
    side = 150.0 * math.sqrt(n)
    places: list[tuple[float, float]] = []
    while len(places) < n:
        place = tuple(rng.uniform(0.0, side, 2).tolist())
        if all(math.dist(place, other) > 40.0 for other in places):
            places.append(place)
    return places


def one_round(n: int, seed: int, award: str) -> dict[str, float]:
    """N agents each find a target at once: what it takes until each target has one holder."""
    rng = np.random.default_rng(seed)
    places = _spread(n, rng)
    poses = [
        Pose(*place, 80.0, float(rng.uniform(-3.0, 3.0)), 0.0, 15.0) for place in _spread(n, rng)
    ]
    side = 150.0 * math.sqrt(n)
    model = CostModel(CostConfig(), Airframe(), Camera(), City.open((side, side)))
    goals = [Goal(place, 0.0) for place in places]
    costs = np.array([[p.cost for p in model.prices(Situation(pose), goals)] for pose in poses])
    agents = [Allocation(i, CooperationConfig(award=award), step=1.0) for i in range(n)]
    gates = [Gate(i) for i in range(n)]
    inboxes: list[list[Message]] = [[] for _ in range(n)]
    spent = spoken = bytes_said = 0.0
    gc.collect()  # what was made before is not the agents' to clear away
    for tick in range(1, 40):
        now, said = float(tick), []
        started = time.process_time()
        for i, agent in enumerate(agents):
            situation = Situation(poses[i])
            task = Task(TrackId(0.0, i, 1), places[i], 0.0, costs[i, i], True, last_seen=now)
            words = agent.step(
                now,
                poses[i],
                [task],
                gates[i].admit(now, inboxes[i]),
                lambda asked, situation=situation: model.prices(situation, asked),
            )
            said.append([*words, agent.heartbeat("search", (0.0, 0.0))])
        spent += time.process_time() - started
        spoken += sum(map(len, said)) - n
        bytes_said += sum(wire_size(word) for words in said for word in words)
        held = [agent.holding.id.founder for agent in agents if agent.holding is not None]
        if len(held) == len(set(held)) == n:
            break
        inboxes = [[m for j in range(n) if j != i for m in said[j]] for i in range(n)]
    holders = {agent.holding.id.founder: i for i, agent in enumerate(agents) if agent.holding}
    total = sum(costs[i, k] for k, i in holders.items())
    return {
        "ticks": tick,
        "ms": 1e3 * spent,
        "messages an award": spoken / n,
        "bytes an aircraft and second": bytes_said / n / tick,
        "cost ratio": total / assign(costs).cost if len(holders) == n else math.nan,
    }


def round_(seeds: int) -> None:
    """Growth with the team."""
    print("| award | team | rounds | compute | messages an award | B/aircraft·s | cost ratio |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    one_round(4, 0, "joint")
    for award in ("joint", "lowest"):
        for n in (10, 30, 100):
            found = [list(one_round(n, seed, award).values()) for seed in range(seeds)]
            ticks, ms, words, size, ratio = np.median(np.array(found), axis=0)
            print(
                f"| {award} | {n} | {ticks:.0f} | {ms:.0f} ms | {words:.1f} | {size:.0f} "
                f"| {ratio:.3f} |",
                flush=True,
            )


PARTS: dict[str, Callable[[int], None]] = {
    "takeover": takeover,
    "team": team,
    "crowd": crowd,
    "help": help_,
    "round": round_,
}


def main(arguments: list[str] | None = None) -> int:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--seeds", type=int, default=20)
    options = parser.parse_args(arguments)
    PARTS[options.part](options.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
