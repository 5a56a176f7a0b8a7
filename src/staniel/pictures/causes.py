"""How much was watched, and why the rest was not: a stacked bar for each vehicle or study point."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.pictures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_causes"]

_LABELLED: Final = 5.0
"""A narrower piece has no number in it [%]."""

_BELOW: Final = 30.0
"""From the axis down to the legend [point]."""

_BRIGHT: Final = 140.0
"""Luminance from which on dark figures read better than white ones, of 255."""


def draw_causes(axes: "Axes", labels: Sequence[str], totals: ArrayLike) -> None:
    """Draw a horizontal bar for each row: the share that was watched, then that of each cause.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Empty; its size, title and place are the caller's. The legend goes below it.
    labels : sequence of n str
        One a bar, the first on top.
    totals : (n, 9) array_like
        Seconds, or any share of them, in the order of `staniel.metrics.Cause`, such as
        ``unwatched(record).totals``. A row of zeros is an empty bar.

    Raises
    ------
    ValueError
        Wrong shape, or a number that is negative or not finite.
    """
    shares = _shares(labels, totals)
    places = np.arange(len(shares))
    left = np.zeros(len(shares))
    for (name, color), share in zip(style.CAUSES.items(), shares.T, strict=True):
        paint = _paint(color)
        if share.any():
            axes.barh(
                places, share, 0.72, left, color=paint, edgecolor="white", linewidth=0.6, label=name
            )
        for place, start, width in zip(places.tolist(), left.tolist(), share.tolist(), strict=True):
            if width >= _LABELLED:
                axes.text(
                    start + 0.5 * width,
                    place,
                    f"{width:.0f}",
                    fontsize=7,
                    color=_figures_on(color),
                    ha="center",
                    va="center_baseline",
                )
        left += share
    _frame(axes, labels)


def _shares(labels: Sequence[str], totals: ArrayLike) -> NDArray[np.float64]:
    """Percent of each row's sum."""
    values: NDArray[Any] = np.asarray(totals, dtype=np.float64)
    expected = (len(labels), len(style.CAUSES))
    if values.shape != expected:
        raise ValueError(f"totals has shape {values.shape}: expected {expected}, a row a label")
    if not (np.isfinite(values).all() and (values >= 0.0).all()):
        raise ValueError(f"totals = {values.tolist()}: expected finite numbers from 0 on")
    sums = values.sum(axis=1, keepdims=True)
    shares: NDArray[np.float64] = 100.0 * values / np.where(sums > 0.0, sums, 1.0)
    return shares


def _paint(color: style.Rgb) -> tuple[float, float, float]:
    red, green, blue = color
    return red / 255.0, green / 255.0, blue / 255.0


def _figures_on(color: style.Rgb) -> str:
    red, green, blue = color
    return "#28282c" if 0.299 * red + 0.587 * green + 0.114 * blue >= _BRIGHT else "white"


def _frame(axes: "Axes", labels: Sequence[str]) -> None:
    ink, edge = _paint(style.INK), _paint(style.EDGE)
    axes.set_xlim(0.0, 100.0)
    axes.set_ylim(max(len(labels), 1) - 0.5, -0.5)
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(labelsize=8, color=edge, labelcolor=ink, length=2)
    axes.tick_params(axis="y", length=0)
    for side, spine in axes.spines.items():
        spine.set_visible(side == "bottom")
        spine.set_color(edge)
    axes.set_xlabel("share of the time [%]", fontsize=8, color=ink, loc="right", labelpad=1.0)
    _draw_legend(axes)


def _draw_legend(axes: "Axes") -> None:
    """Only what occurs, below the axis and its figures, however tall the bars are."""
    from matplotlib.transforms import ScaledTranslation

    handles, names = axes.get_legend_handles_labels()
    if not handles:
        return
    down = ScaledTranslation(0.0, -_BELOW / 72.0, axes.figure.dpi_scale_trans)
    axes.legend(
        handles,
        names,
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=axes.transAxes + down,
        borderaxespad=0.0,
        borderpad=0.0,
        ncols=3,
        fontsize=8,
        frameon=False,
        labelcolor=_paint(style.INK),
        handlelength=1.0,
        handleheight=1.0,
        columnspacing=1.6,
    )
