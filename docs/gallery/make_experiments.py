"""Write the page `experiments.md` and its pictures from studies that were flown.

    for n in 1 2 3 4 5 6; do staniel study run $n --out flown/$n; done
    python docs/gallery/make_experiments.py flown

What the page says in words of each finding stands here; figures, intervals and verdicts come from
the studies. Where a verdict is not the one that the words are about, the script stops: the words
have to be written anew.
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from staniel.studies import Results, read_results
from staniel.studies.catalogue import CATALOGUE
from staniel.studies.plots import curves_of, draw, draw_why, render
from staniel.studies.tables import summary

HERE = Path(__file__).resolve().parent

WORDS: dict[str, tuple[Sequence[str], str]] = {}
"""By study: the verdicts of its claims that the words are about, and the words."""

VERDICTS = {"supported": "**supported**", "contradicted": "**contradicted**", "open": "*open*"}

INTRODUCTION = """# The six experiments of the source, repeated

The thesis that staniel starts from shows one run of each of its experiments (its table 8.1). Here each is flown {seeds} times at every point, {minutes:g} minutes
each, with the thesis' own pursuit (`carrot`), no explicit cooperation, and the defaults of `downtown` otherwise: {runs} runs. Means are
over runs, with 95 % bootstrap intervals; differences are taken seed by seed. The page is made by

```text
for n in 1 2 3 4 5 6; do staniel study run $n --out flown/$n; done
python docs/gallery/make_experiments.py flown
```

{cost} How studies work is on [their page](../studies.md), what the metrics mean on [theirs](../metrics.md).
"""


def page(flown: Sequence[Results]) -> str:
    """The page's text."""
    seeds = max(len(set(results.table["seed"].to_pylist())) for results in flown)
    runs = sum(len(set(zip(*pairs(results), strict=True))) for results in flown)
    parts = [
        INTRODUCTION.format(
            seeds=seeds, minutes=flown[0].duration[0] / 60.0, runs=runs, cost=cost(flown)
        )
    ]
    parts += [section(results) for results in flown]
    return "\n".join(parts)


def pairs(results: Results) -> tuple[list[int], list[int]]:
    """Point and seed of every row."""
    return results.table["point"].to_pylist(), results.table["seed"].to_pylist()


def cost(flown: Sequence[Results]) -> str:
    """What all runs together took, from what each worker measured."""
    import json

    seconds = [
        json.loads(line)["seconds"]
        for results in flown
        for line in (results.folder / "times.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    hours = math.fsum(seconds) / 3600.0
    return (
        f"All of it took {60.0 * hours:.0f} minutes of processor time, "
        f"{len(seconds) / hours:.0f} runs a core-hour."
    )


def section(results: Results) -> str:
    """One experiment: its question, the claims, the words, a table and its pictures."""
    study, about = results.study, summary(results)
    answers = [claim["answer"] for claim in about["claims"]]
    expected, words = WORDS[study.name]
    if answers != list(expected):
        raise SystemExit(f"{study.name}: the claims are {answers}, the words are about {expected}")
    lines = [f"## {study.title}", "", f"*{study.question}* (`staniel study run {study.name}`)", ""]
    lines += ["| claim | found | |", "|---|---|---|"]
    lines += [
        f"| {claim['claim']} | {CATALOGUE[claim['metric']].label} {claim['text']}, expected "
        f"{claim['expected']} (n = {claim['n']}) | {VERDICTS[claim['answer']]} |"
        for claim in about["claims"]
    ]
    lines += ["", words, ""]
    lines += table(about)
    for name in pictures(results):
        lines += ["", f"![{study.title}]({name})"]
    failed = len(results.failures)
    if failed:
        lines += ["", f"{failed} runs could not be flown and count nowhere."]
    return "\n".join(lines) + "\n"


def table(about: dict) -> list[str]:
    """The points with their means and intervals, as Markdown."""
    factors = list(about["points"][0]["levels"])
    heads = [*factors, *about["headings"].values()]
    rows = [
        [*point["levels"].values(), *(point["metrics"][m]["text"] for m in about["headings"])]
        for point in about["points"]
    ]
    return ["| " + " | ".join(row) + " |" for row in (heads, ["---"] * len(heads), *rows)]


def pictures(results: Results) -> dict[str, bytes]:
    """The study's main metric over its factors, and why its vehicles went unseen."""
    name = results.study.name
    drawn = {
        f"experiment_{name}_{group}.png": render(
            draw(results, curves, results.study.metrics[0]), "png"
        )
        for group, curves in enumerate(curves_of(results.study))
    }
    return {**drawn, f"experiment_{name}_why.png": render(draw_why(results), "png")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="holds a study in each of its folders 1 to 6")
    folder = parser.parse_args().folder
    flown = [read_results(folder / str(number)) for number in range(1, 7)]
    text = page(flown)
    for results in flown:
        for name, data in pictures(results).items():
            (HERE / name).write_bytes(data)
    (HERE / "experiments.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
