"""The whole run on one page: the city, who flew and drove where, what was seen, who got it."""

import io
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from staniel.pictures import style
from staniel.pictures.files import write_picture
from staniel.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_overview"]

_DPI: Final = 130
_MAP: Final = 8.0
"""Longer side of the map [inch]."""

_SIDE: Final = 2.3
"""Width of the legend's column [inch]."""

_DETECTIONS: Final = 20_000
"""More detections than these are thinned out evenly."""


def draw_overview(record: Record, path: str | os.PathLike[str]) -> None:
    """Draw a run as a PNG picture.

    Parameters
    ----------
    record : Record
    path : path
        Of the picture; one that exists is replaced.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    figure, axes = _page(record)
    _draw_city(axes, record)
    _draw_risk(axes, record)
    weight = float(np.interp(max(record.city.size), (400.0, 3000.0), (0.8, 1.1)))
    _draw_flown(axes, record, weight)
    _draw_detections(axes, record)
    _draw_driven(axes, record)
    _draw_awards(axes, record)
    _draw_scale(axes, record.city.size)
    _draw_legend(figure, axes, record)
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=_DPI, format="png", metadata={"Software": None})
    write_picture(path, buffer.getvalue())


def _page(record: Record) -> tuple["Figure", "Axes"]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    east, north = record.city.size
    scale = _MAP / max(east, north)
    width, height = max(east * scale, 2.0), max(north * scale, 3.6)
    page = (width + _SIDE + 0.75, height + 0.85)
    figure = Figure(figsize=page, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.55 / page[0], 0.4 / page[1], width / page[0], height / page[1]))
    axes.set_xlim(0.0, east)
    axes.set_ylim(0.0, north)
    axes.set_aspect("equal")
    axes.set_facecolor(_rgb(style.GROUND))
    axes.tick_params(labelsize=7, color=_rgb(style.EDGE), labelcolor=_rgb(style.INK), length=2)
    for spine in axes.spines.values():
        spine.set_color(_rgb(style.EDGE))
    axes.set_xlabel("east [m]", fontsize=7, color=_rgb(style.INK), loc="right", labelpad=1.0)
    axes.set_ylabel("north [m]", fontsize=7, color=_rgb(style.INK), loc="top", labelpad=1.0)
    axes.set_title(_title(record), fontsize=11, loc="left", color=_rgb(style.INK))
    return figure, axes


def _title(record: Record) -> str:
    parts = [str(record.scenario.get("name", "mission"))]
    if "seed" in record.scenario:
        parts.append(f"seed {record.scenario['seed']}")
    parts.append(f"{record.times[-1] / 60.0:.1f} min")
    if not record.complete:
        parts.append("cut short")
    return "  ·  ".join(parts)


def _rgb(color: style.Rgb, alpha: float = 1.0) -> tuple[float, float, float, float]:
    red, green, blue = color
    return red / 255.0, green / 255.0, blue / 255.0, alpha


def _roof_map() -> Any:  # noqa: ANN401 - a matplotlib colour map, imported late
    from matplotlib.colors import LinearSegmentedColormap

    ends = [_rgb(style.ROOF_LOW), _rgb(style.ROOF_HIGH)]
    return LinearSegmentedColormap.from_list("roofs", ends)


def _draw_city(axes: "Axes", record: Record) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    patches = []
    for outline in record.city.outlines:
        rings = [shapely.get_coordinates(r) for r in (outline.exterior, *outline.interiors)]
        patches.append(
            PathPatch(Outline.make_compound_path(*(Outline(r, closed=True) for r in rings)))
        )
    if patches:
        collection = PatchCollection(patches, cmap=_roof_map(), linewidths=0.3, zorder=1)
        collection.set_edgecolor(_rgb(style.EDGE))
        collection.set_array(np.asarray(record.city.heights))
        axes.add_collection(collection, autolim=False)


def _draw_risk(axes: "Axes", record: Record) -> None:
    from matplotlib.patches import Circle, Patch, Polygon

    for region in record.risk.regions:
        look = _risk_look(region.kind)
        shape: Patch
        if region.polygon is not None:
            shape = Polygon(region.polygon, closed=True, zorder=2, **look)
        else:
            shape = Circle(region.center or (0.0, 0.0), region.radius or 0.0, zorder=2, **look)
        axes.add_patch(shape)


def _risk_look(kind: str) -> dict[str, Any]:
    color = style.NO_FLY if kind == "no-fly" else style.THREAT
    hatch = "///" if kind == "no-fly" else None
    edge = _rgb(color, 0.7)
    return {"facecolor": _rgb(color, 0.13), "edgecolor": edge, "hatch": hatch, "linewidth": 1.0}


def _draw_flown(axes: "Axes", record: Record, weight: float) -> None:
    paths = record.fine_aircraft if len(record.fine_aircraft) else record.aircraft
    for identity in range(record.aircraft.shape[1]):
        color = _rgb(style.of_aircraft(identity))
        axes.plot(
            paths[:, identity, 0],
            paths[:, identity, 1],
            color=color,
            lw=weight,
            alpha=0.75,
            zorder=3,
        )
        x, y, _, heading = paths[0, identity, :4].tolist()
        axes.plot(
            [x], [y], marker=(3, 0, np.rad2deg(heading) - 90.0), ms=11, mfc=color, mec="white",
            mew=1.0, ls="none", zorder=8,
        )  # fmt: skip


def _draw_detections(axes: "Axes", record: Record) -> None:
    sightings = record.sightings
    seen = sightings[:: max(1, -(-len(sightings) // _DETECTIONS))]
    colors = [_rgb(style.of_aircraft(reporter), 0.8) for reporter in seen["reporter"].tolist()]
    axes.scatter(seen["x"], seen["y"], s=2.2, c=colors, linewidths=0, zorder=4)


def _draw_driven(axes: "Axes", record: Record) -> None:
    width = float(np.interp(max(record.city.size), (600.0, 3000.0), (3.2, 1.8)))
    paths = record.fine_vehicles if len(record.fine_vehicles) else record.vehicles
    for vehicle in range(record.vehicles.shape[1]):
        x, y = paths[:, vehicle, 0], paths[:, vehicle, 1]
        axes.plot(x, y, color="white", lw=width + 1.4, solid_capstyle="round", zorder=5)
        axes.plot(x, y, color=_rgb(style.VEHICLE), lw=width, solid_capstyle="round", zorder=5)
        axes.plot(
            x[:1], y[:1], marker="s", ms=6.5, mfc=_rgb(style.VEHICLE), mec="white", mew=1.0,
            ls="none", zorder=8,
        )  # fmt: skip
    for line in style.track_lines(record):
        axes.plot(line[:, 0], line[:, 1], color=_rgb(style.TRACK), lw=0.35 * width, zorder=6)


def _draw_awards(axes: "Axes", record: Record) -> None:
    won = style.awards(record)
    colors = [_rgb(style.of_aircraft(winner)) for winner in won["winner"].tolist()]
    axes.scatter(
        won["x"], won["y"], s=110, marker="*", c=colors, edgecolors="white",
        linewidths=0.9, zorder=9,
    )  # fmt: skip


def _draw_scale(axes: "Axes", size: tuple[float, float]) -> None:
    """Draw a bar of a round length in the lower left corner, about a sixth of the map."""
    wanted = size[0] / 6.0
    power = 10.0 ** np.floor(np.log10(wanted))
    length = float(max(step * power for step in (1, 2, 5) if step * power <= wanted))
    x, y = 0.025 * size[0], 0.025 * max(size)
    label = f"{length:g} m" if length < 1000.0 else f"{length / 1000.0:g} km"
    axes.plot([x, x + length], [y, y], color="white", lw=6, solid_capstyle="butt", zorder=10)
    axes.plot(
        [x, x + length], [y, y], color=_rgb(style.INK), lw=3, solid_capstyle="butt", zorder=10
    )
    text = axes.text(
        x + length / 2, y + 0.008 * max(size), label, ha="center", va="bottom", zorder=10
    )
    text.set(fontsize=8, color=_rgb(style.INK))
    text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0})


def _draw_legend(figure: "Figure", axes: "Axes", record: Record) -> None:
    box = axes.get_position()
    width, height = figure.get_size_inches()
    left = box.x1 + 0.15 / width
    legend = figure.legend(
        handles=_handles(record), loc="upper left", bbox_to_anchor=(left, box.y1), frameon=False,
        fontsize=8, borderaxespad=0.0, labelspacing=0.7, labelcolor=_rgb(style.INK),
    )  # fmt: skip
    legend.set_zorder(10)
    roofs = axes.collections[0] if len(record.city.heights) else None
    if roofs is not None and np.ptp(record.city.heights) > 0.0:
        place = (left + 0.08 / width, box.y0 + 0.1 / height, 0.14 / width, 1.0 / height)
        bar = figure.colorbar(roofs, cax=figure.add_axes(place))
        bar.set_label("roof [m]", fontsize=7, color=_rgb(style.INK))
        bar.ax.tick_params(labelsize=7, labelcolor=_rgb(style.INK), length=2)
        bar.outline.set_edgecolor(_rgb(style.EDGE))


def _handles(record: Record) -> Sequence[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def handle(label: str, color: style.Rgb, **look: Any) -> Line2D:  # noqa: ANN401
        return Line2D([], [], label=label, color=_rgb(color), **look)

    n_aircraft = record.aircraft.shape[1]
    shown = min(n_aircraft, len(style.TEAM))
    handles = [
        handle(f"aircraft {k}", style.of_aircraft(k), lw=2, marker=(3, 0, 0), ms=8, mec="white")
        for k in range(shown)
    ]
    if n_aircraft > shown:
        handles.append(handle(f"and {n_aircraft - shown} more", style.INK, ls="none"))
    ink = style.INK
    return [
        *handles,
        handle("vehicle, driven", style.VEHICLE, lw=3.2, marker="s", ms=6, mec="white"),
        handle("vehicle, estimated", style.TRACK, lw=1.6),
        handle("detection", ink, marker="o", ms=2.2, ls="none"),
        handle("award, in the winner's colour", ink, marker="*", ms=10, mec="white", ls="none"),
        handle("start", ink, marker=(3, 0, 0), ms=7, mfc="none", ls="none"),
        *(
            Patch(label=kind, **_risk_look(kind))
            for kind in ("threat", "no-fly")
            if any(region.kind == kind for region in record.risk.regions)
        ),
    ]
