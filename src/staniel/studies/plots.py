"""Figures of a study: one metric over a factor, with the interval of every point as a band."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from staniel.pictures import draw_causes
from staniel.studies.catalogue import CATALOGUE, CAUSES
from staniel.studies.model import Factor, Study
from staniel.studies.results import Results
from staniel.studies.statistics import Estimate, estimate, run_values

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Curve", "curves_of", "draw", "draw_why", "render"]

COLORS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#737373")
"""Okabe and Ito's palette, told apart with any colour vision."""

_SIZE: Final = (6.4, 3.6)  # inches
_MOST_LINES: Final = 7


@dataclass(frozen=True)
class Curve:
    """Points of a study that differ in one factor only.

    Attributes
    ----------
    factor : Factor
        On the axis.
    points : tuple of int
        In the order of the factor's levels.
    steps : tuple of int
        The level of each.
    label : str
        The levels of the other factors, empty where there are none.
    """

    factor: Factor
    points: tuple[int, ...]
    steps: tuple[int, ...]
    label: str


def curves_of(study: Study) -> list[list[Curve]]:
    """The figures that a study makes: for each the curves in it.

    Of a full grid one figure, over the first factor, a curve for each setting of the others. Of
    several grids one figure each, over the factor that has the most levels in it.
    """
    combinations = study.combinations()
    if not study.factors:
        return []
    grids: list[set[tuple[int, ...]]] = [set(combinations)]
    if study.grids:
        grids = []
        for grid in study.grids:
            chosen = [
                {factor.find(level) for level in grid[factor.name]} for factor in study.factors
            ]
            grids.append(
                {
                    steps
                    for steps in combinations
                    if all(step in levels for step, levels in zip(steps, chosen, strict=True))
                }
            )
    return [_curves(study, combinations, grid) for grid in grids]


def draw(results: Results, curves: Sequence[Curve], metric: str) -> "Figure":
    """One metric over the factor of the curves.

    Parameters
    ----------
    results : Results
    curves : sequence of Curve
        Over the same factor.
    metric : str
        A column of `CATALOGUE`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.subplots()
    values = run_values(results, metric)
    factor = curves[0].factor
    many = len(curves) > 1
    for number, curve in enumerate(curves[:_MOST_LINES]):
        estimates = [estimate(list(values[point].values())) for point in curve.points]
        shift = 0.12 * (number - 0.5 * (min(len(curves), _MOST_LINES) - 1))
        _draw_curve(axes, curve, estimates, COLORS[number % len(COLORS)], shift)
    about = CATALOGUE[metric]
    unit = "" if about.unit in ("", "%") else f" [{about.unit}]"
    axes.set_ylabel(about.label + unit)
    axes.set_xlabel(factor.label or factor.name)
    if about.unit == "%":
        from matplotlib.ticker import PercentFormatter

        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        axes.set_ylim(bottom=0.0)
    if not factor.numeric:
        axes.set_xticks(range(len(factor.steps)), [step.label for step in factor.steps])
    if many:
        axes.legend(frameon=False, fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    return figure


def draw_why(results: Results) -> "Figure":
    """Why vehicles went unwatched: a bar a point, of all its runs and vehicles."""
    from matplotlib.figure import Figure

    study, table = results.study, results.table
    combinations = study.combinations()
    totals = np.zeros((len(combinations), len(CAUSES)))
    for column, name in enumerate(CAUSES):
        seconds = np.nan_to_num(table[name].to_numpy(zero_copy_only=False).astype(np.float64))
        totals[:, column] = np.bincount(table["point"].to_numpy(), seconds, len(combinations))
    labels = [
        ", ".join(
            f"{factor.name} {factor.steps[step].label}"
            for factor, step in zip(study.factors, steps, strict=True)
        )
        or study.name
        for steps in combinations
    ]
    figure = Figure(figsize=(_SIZE[0], 1.1 + 0.24 * len(labels)), layout="constrained")
    draw_causes(figure.subplots(), labels, totals)
    return figure


def render(figure: "Figure", kind: str) -> bytes:
    """A figure as a file's contents, the same bytes for the same figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    kind : {"png", "svg"}
    """
    import matplotlib as mpl

    buffer = io.BytesIO()
    metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {"Software": None}
    with mpl.rc_context({"svg.hashsalt": "staniel", "svg.fonttype": "path"}):
        figure.savefig(buffer, format=kind, dpi=150, metadata=metadata)
    return buffer.getvalue()


def _curves(
    study: Study, combinations: Sequence[tuple[int, ...]], grid: set[tuple[int, ...]]
) -> list[Curve]:
    sizes = [len({steps[axis] for steps in grid}) for axis in range(len(study.factors))]
    axis = int(np.argmax(sizes)) if study.grids else 0
    families: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for point, steps in enumerate(combinations):
        if steps in grid:
            rest = (*steps[:axis], *steps[axis + 1 :])
            families.setdefault(rest, []).append((steps[axis], point))
    others = [factor for number, factor in enumerate(study.factors) if number != axis]
    curves = []
    for rest, members in families.items():
        members.sort()
        label = ", ".join(
            f"{factor.label or factor.name} {factor.steps[step].label}"
            for factor, step in zip(others, rest, strict=True)
        )
        curves.append(
            Curve(
                study.factors[axis],
                tuple(point for _, point in members),
                tuple(step for step, _ in members),
                label,
            )
        )
    return curves


def _draw_curve(
    axes: "Axes", curve: Curve, estimates: Sequence[Estimate], color: str, shift: float
) -> None:
    mean = np.array([one.mean for one in estimates])
    low = np.array([one.low for one in estimates])
    high = np.array([one.high for one in estimates])
    label = curve.label or None
    if curve.factor.numeric:
        x = np.array([curve.factor.steps[step].x for step in curve.steps], dtype=np.float64)
        order = np.argsort(x, kind="stable")
        axes.fill_between(x[order], low[order], high[order], color=color, alpha=0.18, linewidth=0)
        axes.plot(x[order], mean[order], "o-", color=color, markersize=4, label=label)
    else:
        x = np.array(curve.steps) + shift
        bars = np.vstack([mean - low, high - mean])
        axes.errorbar(x, mean, np.nan_to_num(bars), fmt="o", color=color, capsize=3, label=label)
