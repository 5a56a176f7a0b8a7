"""Draw the pictures of the page `following.md`: the thesis' figures 8.1 to 8.6 as flown here.

    python docs/gallery/make_following.py [SEEDS]

writes them beside this file and prints the figures, over 20 seeds where nothing else is said.
One process, about three minutes. Every way comes from the record of a mission that was flown.
"""

import itertools
import math
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray
from PIL import Image

from staniel import fly, load_scenario
from staniel.metrics import GATE, team_picture
from staniel.pictures import style
from staniel.record import Record
from staniel.studies.statistics import estimate

HERE = Path(__file__).resolve().parent

Floats = NDArray[np.float64]
Interval = tuple[float, float, float]

# The missions of the figures were chosen as flown without second looks at what a search saw.
ALONE = {
    "guidance.pursuit": "carrot",
    "guidance.glimpse_time": 0.0,
    "aircraft.count": 1,
    "vehicles.count": 1,
}
DYNAMICS = ("random-controls", "learned", "constant-velocity")


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


BLUE, ORANGE, GREEN, PINK = (color(rgb) for rgb in style.TEAM[:4])
RED, INK, EDGE = color(style.TRACK), color(style.INK), color(style.EDGE)
PAPER, ROOF = color(style.GROUND), color(style.ROOF_LOW)
PAINT = {"random-controls": ORANGE, "learned": GREEN}
STEP = 0.1  # of a recorded track [s]


# Vehicles on open ground, for figures 8.1 and 8.3.


@dataclass(frozen=True)
class Ground:
    """Open ground of a size [m], and how fast a vehicle drives on it for how long.

    `court` is the rectangle whose walls reflect it (west, south, width, height) [m]; without one it
    drives straight to the east, within 3°. `shown` is what the map shows, from, to [s].
    """

    name: str
    size: tuple[float, float]
    court: tuple[float, float, float, float] | None = None
    shown: tuple[float, float] = (0.0, 240.0)
    speed: float = 3.0
    minutes: float = 4.0

    def way(self, seed: int) -> Floats:
        """Places every `STEP` seconds, (n, 2)."""
        g = np.random.default_rng(seed)
        gone = self.speed * STEP * np.arange(round(60.0 * self.minutes / STEP) + 1)[:, None]
        if self.court is None:
            start, course = (60.0, g.uniform(65.0, 95.0)), g.uniform(-0.05, 0.05)
            return start + gone * np.array([math.cos(course), math.sin(course)])
        corner, sides = np.array(self.court[:2]), np.array(self.court[2:])
        start, course = g.uniform(0.0, sides), g.uniform(-math.pi, math.pi)
        # A wall reflects: the way is a straight one, folded at every wall.
        folded = np.mod(start + gone * np.array([math.cos(course), math.sin(course)]), 2.0 * sides)
        return corner + np.minimum(folded, 2.0 * sides - folded)

    def fly(self, dynamics: str, seed: int) -> Record:
        """One aircraft after the vehicle of a seed, which drives as a recorded track."""
        rows = [f"0,{STEP * k:.1f},{x:.4f},{y:.4f}" for k, (x, y) in enumerate(self.way(seed))]
        with tempfile.TemporaryDirectory() as folder:
            track = Path(folder) / "track.csv"
            track.write_text("\n".join(["id,time,x,y", *rows, ""]), encoding="utf-8")
            return flown(
                seed,
                ALONE
                | {
                    "city": {"source": "open", "size": list(self.size)},
                    "vehicles": {"kind": "replay", "replay": str(track), "replay_knots": STEP},
                    "minutes": self.minutes,
                    "tracking.dynamics": dynamics,
                },
            )


STRAIGHT = Ground("straight", (820.0, 160.0))
BALL = Ground("ball", (160.0, 140.0), (50.0, 50.0, 60.0, 40.0), (60.0, 125.0))
TIGHT = replace(BALL, name="tight", court=(65.0, 60.0, 30.0, 20.0))


# Missions in a city, for figures 8.2 and 8.4 to 8.6.


@dataclass(frozen=True)
class Town:
    """A mission over a generated city: what differs from `downtown`, and what is shown of it."""

    name: str
    keys: dict[str, object]
    seed: int
    shown: tuple[float, float]  # from, to [s]

    def fly(self) -> Record:
        return flown(self.seed, ALONE | self.keys)


SWITCH = Town("switch", {"city.density": 0.6, "minutes": 5.0}, 37, (70.0, 150.0))
DENSE = Town("dense", {"city.density": 0.6, "minutes": 5.0}, 11, (50.0, 300.0))
LONG = Town("long", {"minutes": 15.0}, 8, (0.0, 900.0))
PAIR = Town(
    "pair",
    {
        "aircraft.count": 2,
        "cooperation.assistance": "always",
        "cooperation.helpers": 1,
        "minutes": 5.0,
    },
    1,
    (100.0, 220.0),
)
TOWNS = (SWITCH, DENSE, LONG, PAIR)


def flown(seed: int, keys: dict[str, object]) -> Record:
    """The record of a mission of the packaged scenario `downtown` with other keys."""
    with tempfile.TemporaryDirectory() as folder:
        return fly(load_scenario("downtown", **keys), seed=seed, out=Path(folder) / "run").record


# What a record tells.


def errors(record: Record) -> Floats:
    """Of each second how far the nearest track is from the vehicle [m]; NaN without a track."""
    rows = record.tracks[team_picture(record.tracks)]
    places = record.vehicles[np.searchsorted(record.times, rows["time"] - 1e-6), 0]
    apart = np.hypot(rows["x"] - places[:, 0], rows["y"] - places[:, 1])
    found = np.full(len(record.times), np.inf)
    np.minimum.at(found, np.searchsorted(record.times, rows["time"] - 1e-6), apart)
    return np.where(np.isfinite(found), found, np.nan)


def sighted(record: Record) -> NDArray[np.bool_]:
    """Of each second whether a camera reported the vehicle."""
    times = record.sightings["time"][record.sightings["origin"] == 0]
    found = np.zeros(len(record.times), dtype=bool)
    found[np.searchsorted(record.times, times - 1e-6)] = True
    return found


def roles(record: Record, agent: int = 0) -> NDArray[np.str_]:
    """What an aircraft did from each second on."""
    return record.decisions["role"][record.decisions["agent"] == agent]


def stretches(names: Iterable[object]) -> Iterator[tuple[object, int, int]]:
    """Each unbroken stretch of one name, with its first place and the one after its last."""
    end = 0
    for name, group in itertools.groupby(names):
        begin, end = end, end + len(list(group))
        yield name, begin, end


def switches(record: Record) -> list[tuple[float, float, float]]:
    """When it was last seen, lost and followed again [s], of each loiter that brought it back."""
    found, seen = [], record.times[sighted(record)]
    parts = list(stretches(roles(record)))
    for before, (name, begin, end), after in zip(parts, parts[1:], parts[2:], strict=False):
        if (before[0], name, after[0]) == ("pursue", "recover", "pursue"):
            lost, again = record.times[[begin, end]].tolist()
            found.append((float(seen[seen < lost].max()), lost, again))
    return found


class Score(NamedTuple):
    rmse: float  # of the nearest track, from when the vehicle was found on [m]
    seen: float  # in the seconds with a sighting [m]
    unseen: float  # in the others [m]
    near: float  # share of all seconds with a track within 10 m


def score(record: Record) -> Score:
    error, seen = errors(record), sighted(record)
    found = np.flatnonzero(error < GATE)
    if not len(found):
        return Score(math.nan, math.nan, math.nan, 0.0)
    error, seen = error[found[0] :], seen[found[0] :]
    return Score(rms(error), rms(error[seen]), rms(error[~seen]), float((error < GATE).mean()))


def rms(values: Floats) -> float:
    squares = values[np.isfinite(values)] ** 2
    return math.sqrt(squares.mean()) if len(squares) else math.nan


def mean(values: Iterable[float]) -> Interval:
    """Mean and its 95 % bootstrap interval."""
    found = estimate([value for value in values if math.isfinite(value)])
    return found.mean, found.low, found.high


def said(interval: Interval, digits: int = 2) -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in interval)
    return f"{middle} [{low}, {high}]"


def count(ground: Ground, seeds: int) -> dict[str, list[Score]]:
    """Fly all dynamics over the same vehicles, and print what they differ by."""
    scores = {name: [score(ground.fly(name, s)) for s in range(seeds)] for name in DYNAMICS}
    print(f"{ground.name}, {seeds} seeds")
    for name in DYNAMICS:
        rmse, seen, unseen, near = (mean(column) for column in zip(*scores[name], strict=True))
        print(
            f"  {name:18} RMSE {said(rmse)} m, seen {said(seen)}, unseen {said(unseen)}, "
            f"within {GATE:g} m {said(tuple(100.0 * value for value in near), 1)} %"
        )
    for name in DYNAMICS[1:]:
        pairs = list(zip(scores[name], scores[DYNAMICS[0]], strict=True))
        print(
            f"  {name} less {DYNAMICS[0]}: RMSE {said(mean(a.rmse - b.rmse for a, b in pairs))} m, "
            f"unseen {said(mean(a.unseen - b.unseen for a, b in pairs))} m, "
            f"within {GATE:g} m {said(mean(100.0 * (a.near - b.near) for a, b in pairs), 1)} points"
        )
    return scores


# How it is drawn.


def tidy(axes: Axes) -> None:
    axes.set_facecolor(PAPER)
    axes.tick_params(labelsize=8, color=EDGE)
    for side in axes.spines.values():
        side.set_color(EDGE)


def field(axes: Axes, title: str) -> None:
    axes.set(aspect="equal", xlabel="east [m]", ylabel="north [m]")
    axes.set_title(title, fontsize=10.5, loc="left", color=INK)
    tidy(axes)


def draw_houses(axes: Axes, record: Record) -> None:
    houses = [Polygon(np.asarray(o.exterior.coords)) for o in record.city.outlines]
    axes.add_collection(PatchCollection(houses, facecolor=ROOF, edgecolor=EDGE, lw=0.5, zorder=1))


def during(record: Record, shown: tuple[float, float]) -> slice:
    """Rows of the fine samples from one time to another [s]."""
    return slice(*np.searchsorted(record.fine_times, (shown[0] - 1e-6, shown[1] + 1e-6)))


def draw_true(axes: Axes, record: Record, shown: tuple[float, float]) -> None:
    way = record.fine_vehicles[during(record, shown), 0, :2]
    axes.plot(*way.T, color="white", lw=3.4, zorder=4)
    axes.plot(*way.T, color=INK, lw=1.7, zorder=5)
    axes.plot(*way[-1], "s", color=INK, mec="white", mew=1.2, ms=8, zorder=8)


def draw_estimate(axes: Axes, record: Record, shown: tuple[float, float]) -> None:
    times = record.tracks["time"]
    inside = (times >= shown[0]) & (times <= shown[1])
    for line in style.track_lines(replace(record, tracks=record.tracks[inside])):
        if len(line) > 1:
            axes.plot(*line.T, color=RED, lw=1.3, zorder=6)


def draw_aircraft(
    axes: Axes, record: Record, shown: tuple[float, float], paint: tuple[float, ...],
    number: int = 0, lw: float = 1.2, size: float = 15.0,
) -> None:  # fmt: skip
    way = record.fine_aircraft[during(record, shown), number]
    axes.plot(*way[:, :2].T, color=paint, lw=lw, alpha=0.8, zorder=3)
    kite(axes, way[-1], size, paint)


def kite(axes: Axes, state: Floats, size: float, paint: tuple[float, ...]) -> None:
    """An aircraft, its nose where it heads."""
    shape = size * np.array([[0.6, 0.0], [-0.4, 0.35], [-0.2, 0.0], [-0.4, -0.35]])
    cosine, sine = math.cos(state[3]), math.sin(state[3])
    corners = state[:2] + shape @ np.array([[cosine, sine], [-sine, cosine]])
    axes.add_patch(Polygon(corners, facecolor=paint, edgecolor="white", lw=0.9, zorder=9))


def legend_of(*aircraft: tuple[str, tuple[float, ...]]) -> list[Line2D]:
    return [
        *(Line2D([], [], color=paint, lw=2.0, label=name) for name, paint in aircraft),
        Line2D([], [], color=INK, lw=1.7, label="true way of the vehicle"),
        Line2D([], [], color=RED, lw=1.5, label="estimate"),
    ]


def below(figure: Figure, handles: list[Line2D], columns: int) -> None:
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.08)
    figure.legend(handles=handles, fontsize=9, ncols=columns, frameon=False,
                  loc="outside lower center")  # fmt: skip


def around(axes: Axes, ways: list[Floats], margin: float) -> None:
    places = np.concatenate(ways)
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def time_axes(axes: Axes, title: str, shown: tuple[float, float]) -> None:
    axes.set(xlim=shown, xlabel="time [s]")
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.grid(alpha=0.3)
    tidy(axes)


def draw_ground(ground: Ground, records: dict[str, Record]) -> Figure:
    """Figures 8.1 and 8.3: two dynamics behind the same vehicle."""
    if ground.court is None:
        layout, shape, ratios = [["a"], ["b"], ["e"]], (11.4, 7.0), (1.0, 1.0, 0.75)
    else:
        layout, shape, ratios = [["a", "b"], ["e", "e"]], (11.4, 7.4), (1.0, 0.36)
    figure, panels = plt.subplot_mosaic(
        layout, figsize=shape, layout="constrained", height_ratios=ratios
    )
    ways = [run.fine_aircraft[during(run, ground.shown), 0, :2] for run in records.values()]
    for key, (name, record) in zip("ab", records.items(), strict=True):
        axes, found = panels[key], score(record)
        if ground.court is not None:
            west, south, width, height = ground.court
            axes.add_patch(Rectangle((west - 0.6, south - 0.6), width + 1.2, height + 1.2,
                                     fill=False, ec=EDGE, lw=4.0, zorder=2))  # fmt: skip
        draw_aircraft(axes, record, ground.shown, BLUE, size=9.0 if ground.court else 18.0)
        draw_true(axes, record, ground.shown)
        draw_estimate(axes, record, ground.shown)
        figure_of = {"random-controls": "8.1", "learned": "8.3"}[name]
        when = "" if ground.court is None else f"; {ground.shown[0]:g} to {ground.shown[1]:g} s"
        field(axes, f"{name}, as figure {figure_of}{when}")
        around(axes, ways, 12.0)
        panels["e"].plot(record.times, errors(record), color=PAINT[name], lw=1.5,
                         label=f"{name}: RMSE {found.rmse:.1f} m")  # fmt: skip
    time_axes(panels["e"], "position error [m]", (0.0, 60.0 * ground.minutes))
    most = max(float(np.nanmax(errors(record))) for record in records.values())
    panels["e"].set_ylim(0.0, 1.3 * most)
    if ground.court is not None:
        panels["e"].axvspan(*ground.shown, color=INK, alpha=0.06, lw=0)
    panels["e"].legend(fontsize=8.5, framealpha=1.0, loc="upper right", ncols=2, edgecolor=EDGE)
    handles = legend_of(("aircraft", BLUE))
    if ground.court is not None:
        handles.append(Line2D([], [], color=EDGE, lw=4.0, label="walls of the court"))
    below(figure, handles, 4)
    return figure


PHASES = {
    "pursue": ("follows, sees the vehicle", BLUE),
    "unseen": ("follows the prediction", PINK),
    "recover": ("circles the last known place", ORANGE),
}


def phases(record: Record) -> list[str]:
    """Of each second the role; `unseen` where it pursues what it has not seen for 2 s."""
    seen = sighted(record)
    times = np.where(seen, record.times, -np.inf)
    age = record.times - np.maximum.accumulate(times)
    return [
        "unseen" if role == "pursue" and old > 2.0 else str(role)
        for role, old in zip(roles(record), age, strict=True)
    ]


def draw_switch(town: Town, record: Record) -> Figure:
    """Figure 8.2: following, loitering over the last known place, following."""
    figure, panels = plt.subplot_mosaic(
        "mt;me", figsize=(11.4, 6.0), layout="constrained", width_ratios=(1.35, 1.0)
    )
    axes, names = panels["m"], phases(record)
    draw_houses(axes, record)
    for name, begin, end in stretches(names):
        span = (max(record.times[begin], town.shown[0]), record.times[min(end, len(names) - 1)])
        span = (span[0], min(span[1], town.shown[1]))
        if span[0] >= span[1]:
            continue
        paint = PHASES[str(name)][1]
        axes.plot(*record.fine_aircraft[during(record, span), 0, :2].T, color=paint, lw=1.8,
                  zorder=3)  # fmt: skip
        for key in "te":
            panels[key].axvspan(*span, color=paint, alpha=0.22, lw=0)
        if name == "recover":
            place = last_place(record, begin)
            axes.plot(*place, "X", color=ORANGE, mec=INK, ms=12, mew=1.0, zorder=8)
    draw_true(axes, record, town.shown)
    draw_estimate(axes, record, town.shown)
    end = np.searchsorted(record.fine_times, town.shown[1])
    kite(axes, record.fine_aircraft[end, 0], 9.0, PHASES[names[int(town.shown[1])]][1])
    field(axes, "From following to loitering and back")
    around(axes, [record.fine_aircraft[during(record, town.shown), 0, :2]], 10.0)
    handles = [Line2D([], [], color=paint, lw=2.0, label=name) for name, paint in PHASES.values()]
    handles += legend_of()
    handles.append(Line2D([], [], color=ORANGE, marker="X", mec=INK, ms=9, ls="",
                          label="last known place"))  # fmt: skip
    below(figure, handles, 4)
    apart = np.hypot(*(record.aircraft[:, 0, :2] - record.vehicles[:, 0, :2]).T)
    panels["t"].plot(record.times, apart, color=BLUE, lw=1.5)
    seen = sighted(record)
    panels["t"].plot(record.times[seen], apart[seen], ".", color=INK, ms=6, label="sighting")
    panels["t"].legend(fontsize=8.5, framealpha=1.0, loc="upper left", edgecolor=EDGE)
    panels["t"].set_ylim(0.0, 100.0)
    time_axes(panels["t"], "distance from aircraft to vehicle [m]", town.shown)
    panels["e"].plot(record.times, errors(record), color=RED, lw=1.6)
    panels["e"].set_ylim(bottom=0.0)
    time_axes(panels["e"], "position error [m]; none: no track", town.shown)
    return figure


def last_place(record: Record, tick: int) -> Floats:
    """Where the aircraft took the vehicle to be when it began to circle."""
    row = record.decisions[record.decisions["agent"] == 0][tick]
    return np.array([row["goal_x"], row["goal_y"]])


def draw_town(town: Town, record: Record, title: str, height: float) -> Figure:
    """Figures 8.4 and 8.5: one aircraft, one vehicle, the buildings, and the error over time."""
    figure, panels = plt.subplot_mosaic(
        "m;e", figsize=(9.0, height), layout="constrained", height_ratios=(height - 2.2, 1.6)
    )
    axes = panels["m"]
    draw_houses(axes, record)
    draw_aircraft(axes, record, town.shown, BLUE, lw=1.0)
    draw_true(axes, record, town.shown)
    draw_estimate(axes, record, town.shown)
    field(axes, title)
    around(axes, [record.fine_aircraft[during(record, town.shown), 0, :2]], 10.0)
    below(figure, legend_of(("aircraft", BLUE)), 3)
    panels["e"].plot(record.times, errors(record), color=RED, lw=1.3)
    panels["e"].set_ylim(bottom=0.0)
    time_axes(panels["e"], "position error [m]; none: no track", town.shown)
    return figure


def midway(record: Record) -> Floats:
    """Of each second in which aircraft help: time, helper, and the place that it circles."""
    rows = record.decisions[record.decisions["role"] == "help"]
    return np.stack([rows["time"], rows["agent"], rows["goal_x"], rows["goal_y"]], axis=1)


def draw_pair(town: Town, record: Record) -> Figure:
    """Figure 8.6: one holds the vehicle, the other circles midway."""
    figure, panels = plt.subplot_mosaic(
        "md;ms", figsize=(11.4, 6.4), layout="constrained", width_ratios=(1.0, 1.0)
    )
    axes, rows = panels["m"], midway(record)
    rows = rows[(rows[:, 0] >= town.shown[0]) & (rows[:, 0] <= town.shown[1])]
    helper = int(rows[0, 1])
    draw_houses(axes, record)
    draw_aircraft(axes, record, town.shown, BLUE, number=1 - helper, lw=1.4, size=11.0)
    draw_aircraft(axes, record, town.shown, ORANGE, number=helper, lw=1.4, size=11.0)
    axes.plot(*rows[:, 2:].T, ".", color=GREEN, ms=5, zorder=4)
    draw_true(axes, record, town.shown)
    draw_estimate(axes, record, town.shown)
    field(axes, "Master and helper")
    around(axes, [record.fine_aircraft[during(record, town.shown), k, :2] for k in (0, 1)], 10.0)
    handles = legend_of(("master", BLUE), ("helper", ORANGE))
    handles.append(Line2D([], [], color=GREEN, marker=".", ms=8, ls="", label="midway, circled"))
    below(figure, handles, 5)
    ticks = np.searchsorted(record.times, rows[:, 0] - 1e-6)
    apart = np.hypot(*(record.aircraft[ticks, helper, :2] - rows[:, 2:]).T)
    panels["d"].plot(rows[:, 0], apart, color=ORANGE, lw=1.6)
    panels["d"].set_ylim(0.0, max(100.0, 1.1 * apart.max()))
    time_axes(panels["d"], "helper to midway [m]", town.shown)
    sights = record.sightings[record.sightings["origin"] == 0]
    for line, (name, number, paint) in enumerate(
        (("master", 1 - helper, BLUE), ("helper", helper, ORANGE))
    ):
        times = sights["time"][sights["reporter"] == number]
        panels["s"].plot(times, np.full(len(times), line), "|", color=paint, ms=16, mew=1.6)
        panels["s"].annotate(name, (town.shown[0], line), (4, 14), textcoords="offset points",
                             fontsize=8.5, color=paint)  # fmt: skip
    either = np.unique(sights["time"])
    panels["s"].plot(either, np.full(len(either), 2), "|", color=INK, ms=16, mew=1.6)
    panels["s"].annotate("either", (town.shown[0], 2), (4, 14), textcoords="offset points",
                         fontsize=8.5, color=INK)  # fmt: skip
    panels["s"].set(ylim=(2.7, -0.7), yticks=[])
    time_axes(panels["s"], "who sees the vehicle", town.shown)
    return figure


# All of them.

SHOWN = {"straight": 0, "ball": 0}
"""Seed of the vehicle that figures 8.1 and 8.3 show."""


def save(figure: Figure, path: Path) -> None:
    """As a PNG of few colours, without the time and the tool that made it."""
    picture = BytesIO()
    figure.savefig(picture, dpi=100)
    plt.close(figure)
    with Image.open(picture) as drawn:
        few = drawn.convert("RGB").quantize(128, dither=Image.Dither.NONE)
        few.save(path, optimize=True)


def tell(town: Town, record: Record) -> None:
    found, names = score(record), roles(record)
    counted = {name: int((names == name).sum()) for name in sorted(set(names.tolist()))}
    print(f"{town.name}, seed {town.seed}: RMSE {found.rmse:.1f} m, seen {found.seen:.1f}, "
          f"within {GATE:g} m {100 * found.near:.1f} %, seconds by role {counted}")  # fmt: skip
    for last, lost, again in switches(record):
        print(f"  last seen at {last:g} s, circled from {lost:g} s, followed from {again:g} s")
    rows = midway(record)
    if len(rows):
        begin, helper = rows[0, 0], int(rows[0, 1])
        sights = record.sightings[record.sightings["origin"] == 0]
        sights = sights[sights["time"] >= begin]
        seconds = int((record.times >= begin).sum())
        for name, of in (("master", sights["reporter"] != helper), ("either", sights["time"] > 0)):
            share = 100.0 * len(np.unique(sights["time"][of])) / seconds
            print(f"  from {begin:g} s on sighted by {name} in {share:.0f} % of the seconds")


def draw_all(folder: Path, seeds: int = 20) -> dict[str, Record]:
    """Draw every picture, and return the records of the missions over cities."""
    for ground in (STRAIGHT, BALL):
        shown = {name: ground.fly(name, SHOWN[ground.name]) for name in DYNAMICS[:2]}
        save(draw_ground(ground, shown), folder / f"following_{ground.name}.png")
    for ground in (STRAIGHT, BALL, TIGHT):
        count(ground, seeds)
    records = {town.name: town.fly() for town in TOWNS}
    for town in TOWNS:
        tell(town, records[town.name])
    figures = {
        "switch": draw_switch(SWITCH, records["switch"]),
        "dense": draw_town(DENSE, records["dense"], "Where 60 % of the ground is built over", 8.4),
        "long": draw_town(LONG, records["long"], "A quarter of an hour", 10.4),
        "pair": draw_pair(PAIR, records["pair"]),
    }
    for name, figure in figures.items():
        save(figure, folder / f"following_{name}.png")
    return records


if __name__ == "__main__":
    mpl.use("Agg")
    draw_all(HERE, *map(int, sys.argv[1:2]))
