"""Draw the picture of the page `following.md`: lines, orbits, waypoints and Dubins legs, as flown.

    python docs/gallery/make_guidance.py

writes `guidance_following.png` beside this file. Every flown way comes from the flight kernel.
"""

import math
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import Command, FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.guidance import Path as FlightPath
from staniel.guidance import (
    PathState,
    dubins_path,
    follow,
    line_course,
    orbit_course,
    waypoint_path,
)
from staniel.kernels.flight import fly
from staniel.pictures import style

HERE = Path(__file__).resolve().parent

Floats = NDArray[np.float64]

AIRFRAME = Airframe()
WIND = (0.0, -7.5)  # half the airspeed, blowing to the south
ORBIT = 90.0
LAWS = {"carrot": "--", "vector-field": "-"}


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


BLUE, ORANGE, GREEN, PINK = (color(rgb) for rgb in style.TEAM[:4])
INK, EDGE, PAPER = color(style.INK), color(style.EDGE), color(style.GROUND)
STREAM = (0.78, 0.80, 0.84)


# What is flown.


def flown(command: Command, start: Floats, law: str, seconds: float) -> Floats:
    """States every 0.1 s of an aircraft with a law, in the wind."""
    steps = round(10 * seconds)
    air = np.empty((steps, 1, 2))
    air[:] = WIND
    rows = limits([AIRFRAME], law)
    path, _ = fly(start[None], np.zeros(1), encode([command]), rows, air, 0.1, steps)
    return np.vstack([start, path[:, 0]])


def managed(path: FlightPath) -> Floats:
    """States every 0.1 s of an aircraft that the path manager leads along a path, in calm air."""
    first, second = path.places(1.0)[:2]
    course = math.atan2(second[1] - first[1], second[0] - first[0])
    aircraft = np.array([[*first, course, 0.0, AIRFRAME.speed]])
    climbs, state, ways = np.zeros(1), PathState(), [aircraft]
    while True:
        command, state = follow(path, Pose(*aircraft[0].tolist()), state)
        if state.leg == len(path.legs):
            return np.concatenate(ways)
        steps, climbs = fly(
            aircraft, climbs, encode([command]), limits([AIRFRAME]), np.zeros((10, 1, 2)), 0.1, 10
        )
        aircraft = steps[-1].copy()
        ways.append(steps[:, 0])


def line_starts() -> list[Floats]:
    return [
        np.array([0.0, 200.0, 80.0, 0.0, 0.0, 15.0]),
        np.array([60.0, -150.0, 80.0, 2.6, 0.0, 15.0]),
    ]


def orbit_starts() -> list[Floats]:
    return [
        np.array([-215.0, 185.0, 80.0, -1.2, 0.0, 15.0]),
        np.array([15.0, -10.0, 80.0, 2.6, 0.0, 15.0]),
    ]


def line_ways() -> dict[str, list[Floats]]:
    command = FlyLine((0.0, 0.0), (1.0, 0.0), 15.0, 80.0)
    return {law: [flown(command, start, law, 40.0) for start in line_starts()] for law in LAWS}


def orbit_ways() -> dict[str, list[Floats]]:
    command = FlyOrbit((0.0, 0.0), ORBIT, 1, 15.0, 80.0)
    return {law: [flown(command, start, law, 45.0) for start in orbit_starts()] for law in LAWS}


# How it is drawn.


def plan(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=10.5, loc="left", color=INK)
    axes.set(aspect="equal", xlabel="east [m]", ylabel="north [m]")
    tidy(axes)


def tidy(axes: Axes) -> None:
    axes.set_facecolor(PAPER)
    axes.tick_params(labelsize=8, color=EDGE)
    for side in axes.spines.values():
        side.set_color(EDGE)


def draw_streams(axes: Axes, east: Floats, north: Floats, courses: Floats) -> None:
    courses = courses.reshape(len(north), len(east))
    axes.streamplot(
        east, north, np.cos(courses), np.sin(courses), color=STREAM, density=0.9,
        linewidth=0.7, arrowsize=0.7, zorder=1,
    )  # fmt: skip


def grid(east: Floats, north: Floats) -> Floats:
    return np.stack(np.meshgrid(east, north), axis=-1).reshape(-1, 2)


def draw_ways(axes: Axes, ways: dict[str, list[Floats]]) -> None:
    for law, look in LAWS.items():
        for way, paint in zip(ways[law], (BLUE, ORANGE), strict=True):
            axes.plot(way[:, 0], way[:, 1], look, color=paint, lw=1.8, zorder=4)
    for way, paint in zip(ways["carrot"], (BLUE, ORANGE), strict=True):
        draw_aircraft(axes, way[0], 22.0, paint)


def draw_aircraft(axes: Axes, state: Floats, size: float, paint: tuple[float, ...]) -> None:
    """A kite, its nose where the aircraft heads."""
    shape = size * np.array([[0.6, 0.0], [-0.4, 0.35], [-0.2, 0.0], [-0.4, -0.35]])
    cosine, sine = math.cos(state[3]), math.sin(state[3])
    corners = state[:2] + shape @ np.array([[cosine, sine], [-sine, cosine]])
    axes.add_patch(plt.Polygon(corners, facecolor=paint, edgecolor="white", lw=0.9, zorder=7))


def draw_wind(axes: Axes, x: float, y: float) -> None:
    axes.annotate(
        "", (x, y - 52.0), (x, y), arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.6}
    )
    axes.annotate(
        "7.5 m/s", (x, y - 26.0), (-6, 0), textcoords="offset points", ha="right", va="center",
        fontsize=8, color=INK, bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip


def draw_errors(axes: Axes, errors: dict[str, list[Floats]], label: str) -> None:
    for law, look in LAWS.items():
        for error, paint in zip(errors[law], (BLUE, ORANGE), strict=True):
            axes.plot(0.1 * np.arange(len(error)), error, look, color=paint, lw=1.8)
    axes.axhline(0.0, color=INK, lw=0.8)
    axes.set(xlabel="time [s]", ylabel=label)
    axes.margins(x=0.0)
    axes.grid(alpha=0.3)
    tidy(axes)


def draw_line(field: Axes, error: Axes) -> None:
    ways = line_ways()
    east, north = np.linspace(-60.0, 420.0, 41), np.linspace(-240.0, 240.0, 41)
    courses = line_course(grid(east, north), [0.0, 0.0], [1.0, 0.0], gain=0.06)
    draw_streams(field, east, north, courses)
    field.axhline(0.0, color=INK, lw=1.4, zorder=3)
    draw_ways(field, ways)
    draw_wind(field, 395.0, 228.0)
    field.set(xlim=(-60, 420), ylim=(-240, 240))
    plan(field, "A line")
    draw_errors(
        error, {law: [way[:, 1] for way in ways[law]] for law in LAWS}, "cross-track error [m]"
    )
    error.legend(
        handles=[
            plt.Line2D([], [], color=INK, ls=look, label=law.replace("-", " "))
            for law, look in LAWS.items()
        ],
        fontsize=8.5, framealpha=1.0,
    )  # fmt: skip


def draw_orbit(field: Axes, error: Axes) -> None:
    ways = orbit_ways()
    side = np.linspace(-240.0, 240.0, 41)
    courses = orbit_course(grid(side, side), [0.0, 0.0], radius=ORBIT, turn=1, gain=2.0)
    draw_streams(field, side, side, courses)
    field.add_patch(plt.Circle((0, 0), ORBIT, fill=False, color=INK, lw=1.4, zorder=3))
    draw_ways(field, ways)
    draw_wind(field, 215.0, 228.0)
    field.set(xlim=(-240, 240), ylim=(-240, 240))
    plan(field, "An orbit")
    off = {law: [np.hypot(way[:, 0], way[:, 1]) - ORBIT for way in ways[law]] for law in LAWS}
    draw_errors(error, off, "distance from the orbit [m]")


def draw_waypoints(axes: Axes) -> None:
    route = np.array(
        [[0, 0], [260, 30], [330, 240], [110, 300], [150, 150], [-60, 120], [-90, 290]], dtype=float
    )
    over = managed(waypoint_path(route, AIRFRAME))
    rounded = waypoint_path(route, AIRFRAME, radius=55.0)
    axes.plot(route[:, 0], route[:, 1], color=EDGE, lw=1.0, ls=(0, (4, 3)), zorder=2)
    axes.plot(over[:, 0], over[:, 1], color=PINK, lw=1.6, zorder=3, label="flown over")
    drawn = rounded.places(1.0)
    axes.plot(drawn[:, 0], drawn[:, 1], color=BLUE, lw=5.0, alpha=0.22, zorder=3)
    way = managed(rounded)
    axes.plot(way[:, 0], way[:, 1], color=BLUE, lw=1.6, zorder=4, label="with fillets")
    axes.plot(route[:, 0], route[:, 1], "o", color="white", mec=INK, mew=1.2, ms=6.5, zorder=5)
    draw_aircraft(axes, way[0], 26.0, BLUE)
    axes.legend(fontsize=8.5, loc="lower left", framealpha=1.0)
    axes.set(xlim=(-150, 390), ylim=(-125, 415))
    plan(axes, "Waypoints")


def draw_dubins(axes: Axes) -> None:
    poses = np.array(
        [[0, 0, 0.3], [240, 60, 2.4], [300, 230, -2.9], [60, 290, 2.0], [20, 120, 2.9]]
    )
    path = dubins_path(poses, AIRFRAME, radius=45.0)
    drawn, way = path.places(1.0), managed(path)
    axes.plot(drawn[:, 0], drawn[:, 1], color=GREEN, lw=5.0, alpha=0.25, zorder=2, label="path")
    axes.plot(way[:, 0], way[:, 1], color=GREEN, lw=1.6, zorder=4, label="flown")
    for x, y, course in poses:
        axes.annotate(
            "", (x + 46.0 * math.cos(course), y + 46.0 * math.sin(course)), (x, y),
            arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.4, "shrinkA": 0}, zorder=5,
        )  # fmt: skip
        axes.plot(x, y, "o", color="white", mec=INK, mew=1.2, ms=6.5, zorder=6)
    axes.legend(fontsize=8.5, loc="lower right", framealpha=1.0)
    axes.set(xlim=(-150, 390), ylim=(-125, 415))
    plan(axes, "Poses, by Dubins legs")


def draw_following() -> Figure:
    figure, panels = plt.subplots(
        2, 3, figsize=(12.6, 8.0), layout="constrained", height_ratios=(1.0, 1.0)
    )
    draw_line(panels[0, 0], panels[1, 0])
    draw_orbit(panels[0, 1], panels[1, 1])
    draw_waypoints(panels[0, 2])
    draw_dubins(panels[1, 2])
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
    return figure


def draw_all(folder: Path) -> None:
    """Into a folder, as a PNG of few colours without the time and the tool that made it."""
    figure, picture = draw_following(), BytesIO()
    figure.savefig(picture, dpi=100)
    plt.close(figure)
    with Image.open(picture) as drawn:
        few = drawn.convert("RGB").quantize(128, dither=Image.Dither.NONE)
        few.save(folder / "guidance_following.png", optimize=True)


if __name__ == "__main__":
    draw_all(HERE)
