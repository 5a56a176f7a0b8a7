"""Draw the picture of the page `pursuit.md`: how long each policy leaves its target out of sight.

    python benchmarks/pursuit.py --seeds 20 --tuning-seeds 8 --bound --out pursuit.jsonl
    python docs/gallery/make_pursuit.py pursuit.jsonl

writes it beside this file. Every line of the file is a case, with every mission that was flown.
"""

import json
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from staniel.pictures import style
from staniel.studies.statistics import estimate

HERE = Path(__file__).resolve().parent
PICTURE = "guidance_pursuit.png"
POLICIES = ("carrot", "orbit", "lookahead", "known future")
HIDDEN, LONGEST, SECONDS = 0, 2, 4  # columns of a mission
ENOUGH = 60.0  # missions that found their target later say nothing [s]


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


def title(case: dict[str, Any]) -> str:
    who = "one aircraft" if case["aircraft"] == 1 else f"{case['aircraft']} aircraft"
    words = [f"{who}, {case['height']:g} × roof"]
    if case["speed"] != 2.0:
        words.append(f"target {case['speed']:g} m/s")
    if case["loss"]:
        words.append(f"{case['loss']:.0%} of messages lost")
    return "\n".join(words)


def draw(axes: Axes, cases: list[dict[str, Any]], column: int, scale: float, label: str) -> None:
    """Bars of the means, one group a case, with 95 % intervals over the seeds."""
    height = 0.8 / len(POLICIES)
    for number, policy in enumerate(POLICIES):
        places, means, lows, highs = [], [], [], []
        for row, case in enumerate(cases):
            flights = np.array(case["flights"].get(policy, []), dtype=np.float64)
            if not len(flights):
                continue
            values = scale * flights[flights[:, SECONDS] >= ENOUGH, column]
            found = estimate(values)
            places.append(row + (number - 0.5 * (len(POLICIES) - 1)) * height)
            means.append(found.mean)
            lows.append(found.mean - found.low)
            highs.append(found.high - found.mean)
        axes.barh(
            places, means, height, xerr=(lows, highs), label=policy,
            color=color(style.TEAM[number]), ecolor="black", error_kw={"linewidth": 0.8},
        )  # fmt: skip
    axes.set_yticks(range(len(cases)), [title(case["case"]) for case in cases], fontsize=9)
    axes.set_ylim(len(cases) - 0.5, -0.5)
    axes.set_xlim(left=0.0)
    axes.set_xlabel(label)
    axes.spines[["top", "right"]].set_visible(False)


def main(source: Path, folder: Path = HERE) -> Path:
    """Draw the picture of a file of results into a folder."""
    mpl.use("Agg")
    cases = [json.loads(line) for line in source.read_text(encoding="utf-8").splitlines()]
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11.0, 1.2 + 0.75 * len(cases)), layout="constrained", sharey=True
    )
    draw(left, cases, HIDDEN, 100.0, "out of sight [% of the time]")
    draw(right, cases, LONGEST, 1.0, "longest gap of a mission [s]")
    right.set_xscale("log")
    right.set_xlim(left=3.0)
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(POLICIES), frameon=False)
    figure.suptitle("Means over the seeds, 95 % intervals; carrot and orbit at their best settings")
    path = folder / PICTURE
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


if __name__ == "__main__":
    print(main(Path(sys.argv[1])))
