"""Draw the pictures of the page `tracking.md`: scenes as in the thesis' section 6.4, and clouds.

    python docs/gallery/make_tracking.py [SEEDS]

writes them beside this file and prints the figures, over 200 seeds where nothing else is said.
One process, some minutes. All sightings are made here: noise of 1.5 m, nine in ten are reported.
"""

import math
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
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
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray
from PIL import Image
from scipy.stats import binomtest

from staniel.city import City
from staniel.datatypes.belief import Sighting, TrackEstimate
from staniel.metrics import identity_scores
from staniel.pictures import style
from staniel.studies.statistics import estimate
from staniel.tracking import Tracker, TrackingConfig

HERE = Path(__file__).resolve().parent

Floats = NDArray[np.float64]

SIGMA, DETECTION = 1.5, 0.9
R = SIGMA**2 * np.eye(2)
STEPS, BEGIN = 70, 6  # of a scene; scored from then on
UNSEEN = 17  # steps of pure prediction
GATE = 10.0


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


BLUE, ORANGE, GREEN, PINK = (color(rgb) for rgb in style.TEAM[:4])
RED, INK, EDGE = color(style.TRACK), color(style.INK), color(style.EDGE)
PAPER, ROOF = color(style.GROUND), color(style.ROOF_LOW)
GREY = (0.62, 0.63, 0.67)


# Scenes.


class Look(NamedTuple):
    """What one step shows: sightings of targets, echoes around them, and false alarms."""

    true: Floats
    echoes: Floats
    false: Floats

    def all(self) -> Floats:
        return np.concatenate([self.true, self.echoes, self.false])


@dataclass(frozen=True)
class Scene:
    """Two targets in the box of (east, north) [m], and how they are seen.

    `view` is the center of the disc in view at each step, (steps, 2), None: everything is;
    `echoes` are further returns around a target, `clutter` false alarms in the box, each a mean of
    a step.
    """

    name: str
    title: str
    path: Floats
    box: tuple[float, float]
    view: Floats | None = None
    reach: float = 0.0
    echoes: float = 0.0
    clutter: float = 0.0

    @property
    def area(self) -> float:
        return self.box[0] * self.box[1]

    def look(self, k: int, g: np.random.Generator) -> Look:
        true, echoes = [], []
        for place in self.path[k]:
            if self.view is not None and math.dist(place, self.view[k]) > self.reach:
                continue
            if g.random() < DETECTION:
                true.append(place + g.normal(0.0, SIGMA, 2))
            echoes += [place + g.normal(0.0, 4.0, 2) for _ in range(g.poisson(self.echoes))]
        false = [g.uniform(0.0, self.box) for _ in range(g.poisson(self.clutter))]
        return Look(*(np.reshape(part, (-1, 2)) for part in (true, echoes, false)))


def driven(start: tuple[float, float], course: float, bends: Callable[[int], float]) -> Floats:
    """Places every second at 2.5 m/s, the course changing by `bends(k)` a second."""
    place, places = np.array(start), []
    for k in range(STEPS):
        places.append(place)
        course += bends(k)
        place = place + 2.5 * np.array([math.cos(course), math.sin(course)])
    return np.array(places)


def scenes() -> list[Scene]:
    a = driven((15.0, 28.0), 0.25, lambda k: -0.045 * math.sin(k / 8.0 + 0.9))
    b = driven((15.0, 88.0), -0.05, lambda k: 0.04 * math.cos(k / 7.0))
    apart = np.stack([a, b], axis=1)
    turn = np.arange(STEPS) * 2.0 * math.pi / 28.0
    middle = apart.mean(axis=1) + 28.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    c = driven((15.0, 36.0), 0.25, lambda k: 0.006 * math.cos(k / 8.0))
    d = driven((15.0, 80.0), -0.25, lambda k: -0.006 * math.cos(k / 9.0))
    crossing = np.stack([c, d], axis=1)
    box = (200.0, 115.0)
    return [
        Scene("apart", "Two targets apart, a sensor that circles", apart, box, middle, 55.0),
        Scene("crossing", "Two targets that cross", crossing, box),
        Scene("clutter", "Echoes and false alarms", apart, box, echoes=0.4, clutter=0.5),
    ]


# Runs.


@dataclass(frozen=True)
class Variant:
    name: str
    keys: dict[str, object]
    color: tuple[float, ...]
    mark: str


VARIANTS = [
    Variant(f"{rule}{'' if kernel else ', kernel 0'}",
            {"association": rule} | ({} if kernel else {"kernel": 0.0}), paint,
            "o" if kernel else "s")
    for kernel in (True, False)
    for rule, paint in (("nearest", BLUE), ("likeliest", ORANGE), ("soft", GREEN))
]  # fmt: skip


@dataclass(frozen=True)
class Flight:
    """Sightings and tracks of one run, step by step."""

    looks: list[Look]
    tracks: list[list[TrackEstimate]]


def config_of(scene: Scene, variant: Variant) -> TrackingConfig:
    """The defaults, what the variant changes, and how dense false alarms are, where there are."""
    told = {"clutter_density": scene.clutter / scene.area} if scene.clutter else {}
    return TrackingConfig(**(told | variant.keys))


def follow(scene: Scene, variant: Variant, seed: int) -> Flight:
    g, tracker = np.random.default_rng(seed), Tracker(config_of(scene, variant), seed)
    looks, tracks = [], []
    for k in range(STEPS):
        look = scene.look(k, g)
        looks.append(look)
        tracks.append(tracker.step(k, [Sighting(k, place, R) for place in look.all()]))
    return Flight(looks, tracks)


class Score(NamedTuple):
    clean: bool  # exactly two tracks, ever, and no switch
    false: float  # tracks that were near no target for most of their life
    rmse: float


def score(scene: Scene, flight: Flight) -> Score:
    seen = [
        ([t.id for t in tracks], np.reshape([t.position for t in tracks], (-1, 2)))
        for tracks in flight.tracks
    ]
    truth = [((0, 1), places) for places in scene.path]
    near: dict[object, list[bool]] = {}
    squares = []
    for places, (names, positions) in zip(scene.path, seen, strict=True):
        if not names:
            continue
        apart = np.hypot(*(positions[:, None] - places).transpose(2, 0, 1))
        for name, row in zip(names, apart.min(axis=1), strict=True):
            near.setdefault(name, []).append(bool(row < GATE))
        squares += [d * d for d in apart.min(axis=0).tolist() if d < GATE]
    found = identity_scores(truth[BEGIN:], seen[BEGIN:], gate=GATE)
    false = sum(2 * sum(lives) < len(lives) for lives in near.values())
    clean = len(near) == 2 and false == 0 and found.switches == 0
    return Score(clean, float(false), math.sqrt(np.mean(squares)) if squares else math.nan)


Interval = tuple[float, float, float]


def share(hits: Iterable[bool]) -> Interval:
    """Share and its 95 % Wilson interval."""
    values = list(hits)
    bounds = binomtest(sum(values), len(values)).proportion_ci(method="wilson")
    return sum(values) / len(values), bounds.low, bounds.high


def mean(values: Iterable[float]) -> Interval:
    """Mean and its 95 % bootstrap interval."""
    found = estimate(list(values))
    return found.mean, found.low, found.high


def count(scene: Scene, seeds: int) -> list[tuple[Variant, Interval, Interval, Interval]]:
    """Of each variant clean runs, false tracks a run and position RMSE."""
    rows = []
    for variant in VARIANTS:
        scores = [score(scene, follow(scene, variant, seed)) for seed in range(seeds)]
        rows.append(
            (
                variant,
                share(s.clean for s in scores),
                mean(s.false for s in scores),
                mean(s.rmse for s in scores),
            )
        )
    return rows


# How a scene is drawn.


def tidy(axes: Axes) -> None:
    axes.set_facecolor(PAPER)
    axes.tick_params(labelsize=8, color=EDGE)
    for side in axes.spines.values():
        side.set_color(EDGE)


def draw_map(axes: Axes, scene: Scene, flight: Flight) -> None:
    if scene.view is not None:
        for k in (10, 31, 52):
            axes.add_patch(Circle(scene.view[k], scene.reach, color=BLUE, alpha=0.06, lw=0))
            axes.add_patch(Circle(scene.view[k], scene.reach, fill=False, color=BLUE, alpha=0.35))
            rim = scene.view[k] + (0.0, 0.5 * scene.box[1] - scene.view[k, 1])
            axes.annotate(f"{k} s", rim, color=BLUE, fontsize=8, ha="center", va="center")
    for mark, part in (("x", "false"), (".", "echoes"), (".", "true")):
        places = np.concatenate([getattr(look, part) for look in flight.looks])
        ink = {"x": (0.75, 0.6, 0.6), ".": GREY}[mark] if part != "echoes" else ORANGE
        axes.plot(*places.T, mark, color=ink, ms=3.5, mew=0.8, zorder=2)
    for i in range(2):
        axes.plot(*scene.path[:, i].T, color=INK, lw=1.0, ls="--", zorder=3)
    lines: dict[object, list[Floats]] = {}
    for tracks in flight.tracks:
        for track in tracks:
            lines.setdefault(track.id, []).append(track.position)
    for (name, places), paint in zip(lines.items(), (RED, GREEN, PINK, BLUE) * 5, strict=False):
        way = np.array(places)
        axes.plot(*way.T, color=paint, lw=2.0, zorder=4)
        axes.plot(*way[0], "o", color="white", mec=paint, mew=1.6, ms=7, zorder=5)
        axes.annotate(
            str(name), way[0], (0, 9), textcoords="offset points", fontsize=8.5, color=paint,
            ha="center", weight="bold",
        )  # fmt: skip
    axes.set(xlim=(0, scene.box[0]), ylim=(0, scene.box[1]), aspect="equal")
    axes.set(xlabel="east [m]", ylabel="north [m]")
    axes.set_title(scene.title, fontsize=10.5, loc="left", color=INK)
    tidy(axes)


def legend_of(scene: Scene) -> list[Line2D]:
    marks = [
        Line2D([], [], color=INK, lw=1.0, ls="--", label="true way"),
        Line2D([], [], color=RED, lw=2.0, marker="o", mfc="white", label="track, from its birth"),
        Line2D([], [], color=GREY, marker=".", ls="", label="sighting of a target"),
    ]
    if scene.echoes:
        marks += [
            Line2D([], [], color=ORANGE, marker=".", ls="", label="echo"),
            Line2D([], [], color=(0.75, 0.6, 0.6), marker="x", ls="", label="false alarm"),
        ]
    if scene.view is not None:
        marks.append(Line2D([], [], color=BLUE, alpha=0.4, label="ground in view, three times"))
    return marks


def draw_counts(
    panels: list[Axes], rows: list[tuple[Variant, Interval, Interval, Interval]]
) -> None:
    titles = ("clean runs [%]", "false tracks a run", "position RMSE [m]")
    for column, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        scale = 100.0 if column == 0 else 1.0
        for place, (variant, *values) in enumerate(rows):
            middle, low, high = (scale * value for value in values[column])
            if not math.isnan(low):
                axes.plot([low, high], [place, place], color=variant.color, lw=2.4, zorder=3)
            axes.plot(
                middle, place, variant.mark, color=variant.color, ms=5, mec="white", mew=0.6,
                zorder=4,
            )  # fmt: skip
        axes.set_title(title, fontsize=9.5, loc="left", color=INK)
        axes.set_yticks(range(len(rows)), [row[0].name for row in rows], fontsize=8.5)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(axis="x", alpha=0.3)
        axes.axhline(2.5, color=EDGE, lw=0.6)
        tidy(axes)
    panels[0].set_xlim(-3, 103)
    widest = max(panels[1].get_xlim()[1], 0.3)
    panels[1].set_xlim(-0.03 * widest, widest)
    low, high = panels[2].get_xlim()
    panels[2].set_xlim(min(low, 1.0), max(high + 0.1, 2.2))
    panels[2].axvline(math.sqrt(2.0) * SIGMA, color=INK, lw=0.8, ls=":")


def draw_scene(scene: Scene, seeds: int, seed: int) -> Figure:
    figure, panels = plt.subplot_mosaic(
        "m0;m1;m2", figsize=(11.4, 5.4), layout="constrained", width_ratios=(2.0, 1.0)
    )
    draw_map(panels["m"], scene, follow(scene, VARIANTS[0], seed))
    panels["m"].legend(handles=legend_of(scene), fontsize=8, ncols=3, framealpha=1.0,
                       loc="upper center", bbox_to_anchor=(0.5, -0.12))  # fmt: skip
    rows = count(scene, seeds)
    print(f"{scene.name}, {seeds} seeds")
    for variant, *values in rows:
        print(f"  {variant.name:20}", *(f"{m:7.3f} [{a:.3f}, {b:.3f}]" for m, a, b in values))
    draw_counts([panels[key] for key in "012"], rows)
    return figure


# Clouds of what is not seen.


class Blind(NamedTuple):
    """Steps 0 to UNSEEN without a sighting: clouds with weights, truth, error and spread."""

    clouds: list[Floats]
    weights: list[Floats]
    truth: Floats
    error: Floats
    spread: Floats
    near: Floats  # weight within 10 m of the true place


def blind(path: Floats, seed: int, keys: dict[str, object], chart: City | None = None) -> Blind:
    """Seen until UNSEEN steps before the end of its way, then not."""
    g = np.random.default_rng(seed)
    config = TrackingConfig(**({"unseen_limit": UNSEEN + 5} | keys))
    tracker = Tracker(config, seed, chart=chart)
    last = len(path) - UNSEEN - 1
    clouds, weights, error, spread, near = [], [], [], [], []
    for k, place in enumerate(path):
        seen = [Sighting(k, place + g.normal(0.0, SIGMA, 2), R)] if k <= last else []
        tracks = tracker.step(k, seen)
        if k < last:
            continue
        track = min(tracks, key=lambda t: math.dist(t.position, place))
        cloud, own = tracker.particles(track.id), tracker.weights(track.id)
        clouds.append(cloud[:, :2])
        weights.append(own)
        error.append(math.dist(track.position, place))
        spread.append(math.sqrt(np.trace(track.covariance)))
        near.append(own[np.hypot(*(cloud[:, :2] - place).T) < GATE].sum())
    return Blind(clouds, weights, path[last:], np.array(error), np.array(spread), np.array(near))


def straight(seed: int) -> Floats:
    """A vehicle at 2 m/s, straight on."""
    course = np.random.default_rng(10_000 + seed).uniform(-math.pi, math.pi)
    way = 2.0 * np.arange(30 + UNSEEN)[:, None]
    return way * np.array([math.cos(course), math.sin(course)])


def band(axes: Axes, runs: list[Floats], paint: tuple[float, ...], label: str) -> None:
    """Median and the middle nine tenths."""
    table, steps = np.array(runs), np.arange(UNSEEN + 1)
    low, middle, high = np.percentile(table, [5, 50, 95], axis=0)
    axes.fill_between(steps, low, high, color=paint, alpha=0.16, lw=0)
    axes.plot(steps, middle, color=paint, lw=2.0, label=label)


def draw_cloud(axes: Axes, run: Blind, step: int, paint: tuple[float, ...]) -> None:
    g = np.random.default_rng(step)
    chosen = g.choice(len(run.clouds[step]), 600, p=run.weights[step] / run.weights[step].sum())
    axes.plot(*run.clouds[step][chosen].T, ".", color=paint, ms=2.6, alpha=0.55, zorder=3)


def draw_blind(seeds: int) -> Figure:
    figure, panels = plt.subplot_mosaic(
        "cce;ccs", figsize=(11.4, 5.0), layout="constrained", width_ratios=(1.0, 1.0, 1.1)
    )
    east = np.stack([2.0 * np.arange(30 + UNSEEN), np.zeros(30 + UNSEEN)], axis=1)
    run, field = blind(east, 1, {}), panels["c"]
    for step, paint in ((17, PINK), (11, GREEN), (6, ORANGE), (0, BLUE)):
        draw_cloud(field, run, step, paint)
        field.plot(*run.truth[step], "*", color=paint, mec=INK, ms=15, mew=0.9, zorder=6)
        field.plot([], [], ".", color=paint, ms=9, label=f"after {step} s")
    field.plot(*run.truth.T, color=INK, lw=1.0, ls="--", zorder=5)
    field.set(xlim=(20, 130), ylim=(-42, 42), aspect="equal")
    field.set(xlabel="east [m]", ylabel="north [m]")
    field.set_title("What may have become of it; stars: the true place", fontsize=10.5, loc="left")
    field.legend(fontsize=8.5, framealpha=1.0, loc="upper left")
    kinds = {"learned": BLUE, "random-controls": ORANGE, "constant-velocity": GREEN}
    for dynamics, paint in kinds.items():
        runs = [blind(straight(s), s, {"dynamics": dynamics}) for s in range(seeds)]
        band(panels["e"], [run.error for run in runs], paint, dynamics)
        band(panels["s"], [run.spread for run in runs], paint, dynamics)
        errors, spreads = (np.array([getattr(r, n)[-1] for r in runs]) for n in ("error", "spread"))
        print(f"blind {dynamics}: after {UNSEEN} steps error {mean(errors)}, median "
              f"{np.median(errors):.1f}; spread {mean(spreads)}")  # fmt: skip
    for key, title in (("e", "error of the mean [m]"), ("s", "spread, 1 sigma [m]")):
        panels[key].set_title(title, fontsize=9.5, loc="left")
        panels[key].set_xlim(0, UNSEEN)
        panels[key].set_ylim(bottom=0.0)
        panels[key].grid(alpha=0.3)
    panels["e"].set_ylim(0.0, 36.0)
    panels["s"].set_xlabel("steps without a sighting")
    panels["e"].plot([0, UNSEEN], [0, 2 * UNSEEN], color=INK, lw=0.8, ls=":", label="way driven")
    panels["e"].legend(fontsize=8, framealpha=1.0, loc="upper left")
    for axes in panels.values():
        tidy(axes)
    return figure


BLOCK, STREET, ROWS, COLUMNS = 11, 3, 5, 6  # cells of 4 m, blocks
CELL = 4.0
PITCH = CELL * (BLOCK + STREET)


def town() -> City:
    """Blocks of 44 m between streets of 12 m."""
    cells = np.full((ROWS * (BLOCK + STREET) + STREET, COLUMNS * (BLOCK + STREET) + STREET), ".")
    for row in range(ROWS):
        for column in range(COLUMNS):
            north, east = row * (BLOCK + STREET) + STREET, column * (BLOCK + STREET) + STREET
            cells[north : north + BLOCK, east : east + BLOCK] = "@"
    size = f"height {cells.shape[0]}\nwidth {cells.shape[1]}"
    text = "\n".join(["type octile", size, "map", *("".join(row) for row in cells)])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "town.map"
        file.write_text(text + "\n", encoding="utf-8")
        return City.from_grid(file, cell=CELL, heights=(10.0, 10.0), seed=0)


def driven_in_town(seed: int) -> Floats:
    """A vehicle at 5 m/s along the middles of streets; at a crossing it turns as often as not."""
    g = np.random.default_rng(20_000 + seed)
    middle = 0.5 * CELL * STREET
    place = np.array([1.0, 2.0]) * PITCH + middle
    heading, places, left = np.array([1.0, 0.0]), [], PITCH
    for _ in range(18 + UNSEEN):
        places.append(place.copy())
        way = 5.0
        while way > 0.0:
            gone = min(way, left)
            place, way, left = place + gone * heading, way - gone, left - gone
            if left <= 0.0:
                left = PITCH
                ways = [heading, heading, np.array([-heading[1], heading[0]])]
                ways.append(-ways[2])
                free = [w for w in ways if _inside(place + PITCH * w)]
                heading = free[g.integers(len(free))]
    return np.array(places)


def _inside(place: Floats) -> bool:
    size = np.array([COLUMNS, ROWS]) * PITCH + CELL * STREET
    return bool((place > 0.0).all() and (place < size).all())


def draw_streets(seeds: int) -> Figure:
    city = town()
    figure, panels = plt.subplot_mosaic(
        "ab;ne", figsize=(11.4, 8.0), layout="constrained", height_ratios=(1.35, 1.0)
    )
    kinds = (("a", "with the chart", city, BLUE), ("b", "without", None, ORANGE))
    for key, name, chart, paint in kinds:
        run, axes = blind(driven_in_town(3), 3, {}, chart), panels[key]
        houses = [Polygon(np.asarray(o.exterior.coords)) for o in city.outlines]
        axes.add_collection(PatchCollection(houses, facecolor=ROOF, edgecolor=EDGE, lw=0.5))
        for step, ink in ((UNSEEN, paint), (8, INK)):
            draw_cloud(axes, run, step, ink)
            axes.plot(*run.truth[step], "*", color=ink, mec="white", ms=17, mew=1.0, zorder=7)
            axes.plot([], [], ".", color=ink, ms=9, label=f"after {step} s")
        axes.plot(*run.truth.T, color=RED, lw=1.6, ls="--", zorder=5)
        axes.set(xlim=(0, city.size[0]), ylim=(0, city.size[1]), aspect="equal")
        axes.set_title(f"Particles {name}; stars: the true place", fontsize=10.5, loc="left")
        axes.legend(fontsize=8.5, framealpha=1.0, loc="upper right")
        runs = [blind(driven_in_town(s), s, {}, chart) for s in range(seeds)]
        band(panels["e"], [run.error for run in runs], paint, name)
        near = np.array([run.near for run in runs])
        bounds = np.array([mean(column) for column in near.T])
        panels["n"].fill_between(range(UNSEEN + 1), *(100.0 * bounds[:, 1:]).T, color=paint,
                                 alpha=0.25, lw=0)  # fmt: skip
        panels["n"].plot(100.0 * bounds[:, 0], color=paint, lw=2.0, label=name)
        for step in (8, UNSEEN):
            print(f"streets, {name}: after {step} steps weight within {GATE:g} m "
                  f"{mean(near[:, step])}, error {mean(r.error[step] for r in runs)}")  # fmt: skip
    panels["n"].set_title("weight within 10 m of the true place [%], mean and 95 % interval",
                          fontsize=9.5, loc="left")  # fmt: skip
    panels["e"].set_title("error of the mean [m], median and nine tenths", fontsize=9.5, loc="left")
    for key in "ne":
        panels[key].set_xlim(0, UNSEEN)
        panels[key].set_ylim(bottom=0.0)
        panels[key].set_xlabel("steps without a sighting")
        panels[key].grid(alpha=0.3)
        panels[key].legend(fontsize=8.5, framealpha=1.0)
    for axes in panels.values():
        tidy(axes)
    return figure


# All of them.

SHOWN = {"apart": 0, "crossing": 0, "clutter": 0}
"""Seed of the run that each scene's picture shows."""


def save(figure: Figure, path: Path) -> None:
    """As a PNG of few colours, without the time and the tool that made it."""
    picture = BytesIO()
    figure.savefig(picture, dpi=100)
    plt.close(figure)
    with Image.open(picture) as drawn:
        few = drawn.convert("RGB").quantize(128, dither=Image.Dither.NONE)
        few.save(path, optimize=True)


def draw_all(folder: Path, seeds: int = 200) -> None:
    for scene in scenes():
        save(draw_scene(scene, seeds, SHOWN[scene.name]), folder / f"tracking_{scene.name}.png")
    save(draw_blind(seeds), folder / "tracking_blind.png")
    save(draw_streets(seeds), folder / "tracking_streets.png")


if __name__ == "__main__":
    mpl.use("Agg")
    draw_all(HERE, *map(int, sys.argv[1:2]))
