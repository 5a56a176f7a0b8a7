"""How long streets wait for the next look, and targets for the first: one version against another.

``python benchmarks/search.py after.jsonl`` flies each case of the table in docs/search.md with 20
seeds and writes a line a mission. With ``--against before.jsonl``, made by the same command with
another version of the package, it also prints the paired differences and their 95 % bootstrap
intervals. Nothing is flown for a case and seed that the file has already.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from staniel import fly, load_scenario

FIRST = 4000
"""Of the seeds that the table is made of."""

CASES: dict[str, dict[str, Any]] = {
    "search": {"vehicles": {"count": 0}},
    "search, 70 % lost": {"vehicles": {"count": 0}, "radio": {"loss": 0.7}},
    "wide": {"vehicles": {"count": 0}, "city": {"size": (1200.0, 1200.0)}},
    "wide, 70 % lost": {
        "vehicles": {"count": 0},
        "city": {"size": (1200.0, 1200.0)},
        "radio": {"loss": 0.7},
    },
    "find": {"city": {"size": (1200.0, 1200.0)}},
    "find, 70 % lost": {"city": {"size": (1200.0, 1200.0)}, "radio": {"loss": 0.7}},
}
"""What is other than in the packaged mission ``downtown``: 4 aircraft, 600 m, 4 vehicles."""

FIGURES = ("age_mean", "revisit_mean", "revisit_longest", "never_seen_share", "found_at", "watched")
"""Of a mission; what is undefined counts as the whole mission, and so does a target not found."""


def flight(case: str, seed: int, minutes: float, changes: dict[str, Any]) -> dict[str, Any]:
    """The figures of one mission."""
    scenario = load_scenario("downtown", seed=seed, minutes=minutes, **{**CASES[case], **changes})
    with tempfile.TemporaryDirectory() as folder:
        metrics = fly(scenario, out=Path(folder) / "run").metrics
    team, targets = metrics["team"], metrics["targets"]
    figures: dict[str, Any] = {"case": case, "seed": seed, "minutes": minutes}
    for name in FIGURES[:4]:
        figures[name] = metrics["duration"] if team[name] is None else team[name]
    found = [target["found_at"] for target in targets]
    if targets:
        figures["found_at"] = sum(minutes * 60.0 if t is None else t for t in found) / len(found)
        figures["watched"] = team["watched"] / len(targets)
    return figures


def flown(file: Path) -> list[dict[str, Any]]:
    """The lines of a file; none of one that is not there."""
    return list(map(json.loads, file.read_text().splitlines())) if file.exists() else []


def table(after: list[dict[str, Any]], before: list[dict[str, Any]]) -> None:
    """Print means, and differences over the missions that both have."""
    draws = np.random.default_rng(0)
    for case in dict.fromkeys(line["case"] for line in after):
        ours = {line["seed"]: line for line in after if line["case"] == case}
        theirs = {line["seed"]: line for line in before if line["case"] == case}
        seeds = [seed for seed in ours if seed in theirs] if before else list(ours)
        print(f"{case}, {len(seeds)} missions")
        for name in FIGURES:
            new = np.array([ours[seed].get(name, np.nan) for seed in seeds])
            if not len(seeds) or np.isnan(new).any():
                continue
            text = f"  {name:18s} {new.mean():8.3f}"
            if before:
                old = np.array([theirs[seed][name] for seed in seeds])
                picked = draws.integers(0, len(seeds), (10_000, len(seeds)))
                low, high = np.quantile((new - old)[picked].mean(axis=1), (0.025, 0.975))
                text += f", before {old.mean():8.3f}: {(new - old).mean():+.3f}"
                text += f" [{low:+.3f}, {high:+.3f}]"
            print(text)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="JSON lines, a line a mission")
    parser.add_argument("--against", type=Path, help="such a file of another version")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--change", type=json.loads, default={}, help="more of the scenario, JSON")
    options = parser.parse_args()
    done = {(line["case"], line["seed"], line["minutes"]) for line in flown(options.out)}
    for case in options.cases:
        for seed in range(options.first, options.first + options.seeds):
            if (case, seed, options.minutes) not in done:
                line = flight(case, seed, options.minutes, options.change)
                with options.out.open("a") as file:
                    file.write(json.dumps(line) + "\n")
    table(flown(options.out), flown(options.against) if options.against else [])


if __name__ == "__main__":
    main()
