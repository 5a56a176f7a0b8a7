"""Write the pages `experiments.md` and `beyond.md` with their pictures, from studies flown before.

    for n in 1 2 3 4 5 6 controls cooperation losses crowd; do
        staniel study run $n --out flown/$n
    done
    python docs/gallery/make_experiments.py flown

What the page says in words of each finding stands here; figures, intervals and verdicts come from
the studies. Where a verdict is not the one that the words are about, the script stops: the words
have to be written anew.
"""

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path

from staniel.studies import Results, read_results
from staniel.studies.catalogue import CATALOGUE
from staniel.studies.plots import curves_of, draw, draw_why, render
from staniel.studies.tables import summary

HERE = Path(__file__).resolve().parent

YES, NO, OPEN = "supported", "contradicted", "open"

WORDS: dict[str, tuple[Sequence[str], str]] = {
    "1-following": (
        (NO, OPEN, YES),
        """
The thesis names an estimation error of 1.5 m, of one run. Here it is twice that. The noise of
1.5 m is that of a look straight down; the body-fixed cone swings out of every turn, so the vehicle
lies near its edge, where a slanting look spreads the same noise over some 3 m across and 6 m along.
A third of the noise brings the error to 2.1 m, so the camera is not all of it. One aircraft takes
two minutes to find one vehicle in 600 m × 600 m, and the longest time out of sight is far beyond
the 17 steps after which a track is dropped: what the thesis concludes from it, that one aircraft is
not enough, holds. Whether it tracks the vehicle for more than nine tenths of the time, 50 flights
do not tell.
""",
    ),
    "2-partner": (
        (YES, YES, YES),
        """
A second aircraft that nobody asks for help, and that searches until it holds a target itself,
still reports what it sees. That is worth four to five points of the time in sight and cuts the
longest time out of sight nearly to half; and two find the vehicle a minute sooner.
""",
    ),
    "3-density": (
        (YES, NO),
        """
That buildings hide the vehicle is confirmed: from a tenth of the ground to seven tenths the time
in sight falls from 59 % to 14 %, and the longest time out of sight grows eightfold. That the
densest city traps the vehicle and so raises the time in sight again is not: from 0.7 to 0.75 it
stays what it is, far below what 0.6 allows.
""",
    ),
    "4-speed": (
        (YES, YES, YES),
        """
A vehicle faster than the aircraft is lost, as the thesis says: at a ratio of 1 it is tracked for a
quarter of the time. It goes step by step: up to 0.3 the vehicle is tracked for seven tenths of the
time and more, at 0.5 for half of it. The time in sight falls from 42 % to 13 %, and the vehicle
changes its name twice or three times a run from 0.7 on, hardly ever up to 0.3.
""",
    ),
    "5-aircraft": (
        (YES, OPEN, OPEN, YES, YES, YES),
        """
Without explicit cooperation every further aircraft adds a little to the time in sight, by what it
happens to see on its own way; that the second adds more than the third is not shown. With it, the
second aircraft joins the one that holds the vehicle, and that is the thesis' picture: the second
cuts the time out of sight from 301 s to 188 s, all the four after it only to 149 s. The same second
aircraft without being asked leaves it at 304 s, for it finds the vehicle sooner and then watches
the rest of the city.
""",
    ),
    "6-ratios": (
        (YES, YES, YES, YES),
        """
Twice as many vehicles as aircraft are each seen less, but for more than half of what one aircraft a
vehicle would see: whoever is nobody's target is still seen by those who watch its neighbours. Twice
as many aircraft as vehicles see each of them more, and find them sooner.
""",
    ),
    "controls": (
        (YES, NO, YES, OPEN),
        """
What the particles are taken to do matters less than the thesis' two pictures suggest. Learned
motion knows the place of a vehicle that drives straight on better than random controls, but by
7 cm: next to a camera that knows it to some 3 m that is nothing. Nor does it cost anything that 50
flights would show where the vehicle turns often. What costs is to take it to drive straight on with
a little noise: a third more error where it really does so, and seven points less of the time on
track where it turns every 10 m.
""",
    ),
    "crowd": (
        (YES, YES, YES, YES),
        """
Without patrols whoever holds a vehicle keeps it, and those that nobody holds are seen by chance:
eight vehicles share two aircraft at 171 s for the longest time out of sight on average, and some
are not seen for the whole ten minutes. Patrols bound it by the age of the streets, so it hardly
depends any more on how many vehicles there are: 107 s with four, 116 s with six, 119 s with eight.
The price is a third to a half of the time in sight, since who patrols sees a vehicle only in
passing. Letting streets wait for two minutes costs somewhat less, and bounds somewhat less.
""",
    ),
}
"""By study: the verdicts of its claims that the words are about, and the words."""

VERDICTS = {"supported": "**supported**", "contradicted": "**contradicted**", "open": "*open*"}

THESIS = ("1", "2", "3", "4", "5", "6")
BEYOND = ("controls", "cooperation", "losses", "crowd")

INTRODUCTION = """# The experiments of the source, repeated

The thesis that staniel starts from shows one run of each of its experiments (its table 8.1). Here
each is flown {seeds} times at every point, {minutes:g} minutes each, with the thesis' own pursuit
(`carrot`) and with the defaults of `downtown` otherwise: {runs} runs. Means are over runs, with
95 % bootstrap intervals; differences are taken seed by seed. What goes beyond the thesis is on
[a page of its own](beyond.md). This page is made by

```text
for n in {names}; do staniel study run $n --out flown/$n; done
python docs/gallery/make_experiments.py flown
```

{cost} How studies work is on [their page](../studies.md), what the metrics mean on
[theirs](../metrics.md).
"""


FURTHER = """# Beyond the experiments of the source

What the [six experiments](experiments.md) leave open, flown in the same way: {seeds} times at every
point, {minutes:g} minutes each, by the carrot: {runs} runs. Made by

```text
for n in {names}; do staniel study run $n --out flown/$n; done
python docs/gallery/make_experiments.py flown
```

{cost}
"""


def page(introduction: str, flown: Sequence[Results]) -> str:
    """A page's text."""
    seeds = max(len(set(results.table["seed"].to_pylist())) for results in flown)
    runs = sum(len(set(zip(*pairs(results), strict=True))) for results in flown)
    head = introduction.format(
        seeds=seeds,
        minutes=flown[0].duration[0] / 60.0,
        runs=runs,
        names=" ".join(results.folder.name for results in flown),
        cost=cost(flown),
    )
    return "\n".join([head, *map(section, flown)])


def pairs(results: Results) -> tuple[list[int], list[int]]:
    """Point and seed of every row."""
    return results.table["point"].to_pylist(), results.table["seed"].to_pylist()


def cost(flown: Sequence[Results]) -> str:
    """What all runs together took, from what each worker measured."""
    seconds = [
        json.loads(line)["seconds"]
        for results in flown
        for line in (results.folder / "times.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    hours = math.fsum(seconds) / 3600.0
    return (
        f"All of it took {60.0 * hours:.0f} minutes of processor time, "
        f"{len(seconds) / hours:.0f} runs a core-hour, on two cores that did other work beside it."
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
    lines += ["", words.strip(), "", *table(about)]
    for name in pictures(results):
        lines += ["", f"![{study.title}]({name})"]
    if results.failures:
        lines += ["", f"{len(results.failures)} runs could not be flown and count nowhere."]
    return "\n".join(lines) + "\n"


def table(about: dict) -> list[str]:
    """The points with their means and intervals, as Markdown."""
    heads = [*about["points"][0]["levels"], *about["headings"].values()]
    rows = [
        [*point["levels"].values(), *(point["metrics"][m]["text"] for m in about["headings"])]
        for point in about["points"]
    ]
    return ["| " + " | ".join(row) + " |" for row in (heads, ["---"] * len(heads), *rows)]


def pictures(results: Results) -> dict[str, bytes]:
    """The study's main metric over its factors, and why its vehicles went unseen."""
    name, metric = results.study.name, results.study.metrics[0]
    drawn = {
        f"experiment_{name}_{group}.png": render(draw(results, curves, metric), "png")
        for group, curves in enumerate(curves_of(results.study))
    }
    return {**drawn, f"experiment_{name}_why.png": render(draw_why(results), "png")}


def main() -> None:
    """Write the pages and their pictures beside this file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="holds studies in folders of their names")
    folder = parser.parse_args().folder
    pages = ("experiments.md", INTRODUCTION, THESIS), ("beyond.md", FURTHER, BEYOND)
    for name, introduction, studies in pages:
        flown = [read_results(folder / study) for study in studies if (folder / study).is_dir()]
        if not flown:
            continue
        text = page(introduction, flown)
        for results in flown:
            for picture, data in pictures(results).items():
                (HERE / picture).write_bytes(data)
        (HERE / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
