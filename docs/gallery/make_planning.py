"""Draw the picture of the page `planning.md`: planners in one city, and a flight without a map.

    python docs/gallery/make_planning.py

writes it beside this file, all from a city that the script makes itself.
"""

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.lidar import LidarScan
from staniel.guidance.planning import Chart, Explorer, Obstacles, Problem, plan
from staniel.kernels.lidar import sweep
from staniel.pictures import style
from staniel.world.lidar import build_facades

HERE = Path(__file__).resolve().parent

ALTITUDE, CLEARANCE, RADIUS = 26.0, 4.0, 15.0
SIZE = (500.0, 500.0)
START, GOAL = (30.0, 470.0, -1.2), (470.0, 30.0, -0.8)
RANGE, STEP = 120.0, math.radians(1.0)
PLANNERS = ("astar", "rrt", "rrt-star", "voronoi", "visibility", "spline")
LOW, TALL, UNSEEN = "#e3e3e3", "#8a8a8a", "#31446e"


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


def town() -> City:
    return City.generate(size=SIZE, density=0.35, heights=(10.0, 40.0), seed=8)


def buildings(axes: Axes, city: City, highest: float) -> None:
    """Those that are higher dark, those that are flown over light."""
    for outline, height in zip(city.outlines, city.heights.tolist(), strict=True):
        shade = TALL if height > highest else LOW
        axes.add_patch(Polygon(np.array(outline.exterior.coords), facecolor=shade, linewidth=0.0))
        for hole in outline.interiors:
            axes.add_patch(Polygon(np.array(hole.coords), facecolor="white", linewidth=0.0))
    axes.set(xlim=(0.0, SIZE[0]), ylim=(0.0, SIZE[1]), aspect="equal", xticks=[], yticks=[])


def draw_rivals(axes: Axes, city: City) -> None:
    buildings(axes, city, ALTITUDE - CLEARANCE)
    obstacles = Obstacles.from_city(city, altitude=ALTITUDE, clearance=CLEARANCE)
    problem = Problem(START, GOAL, RADIUS, obstacles)
    for number, name in enumerate(PLANNERS):
        found = plan(problem, name)
        shade = color(style.TEAM[number])
        label = f"{name}: no path"
        if found:
            way = found.poses(1.0)
            label = f"{name}: {found.length:.0f} m"
            axes.plot(way[:, 0], way[:, 1], color=shade, linewidth=2.6 if number == 0 else 1.4)
        axes.plot([], [], color=shade, label=label)
    axes.legend(loc="upper right", fontsize=8)
    axes.set_title("One question, six planners; a turn has 15 m", fontsize=10)


def flight(city: City) -> tuple[np.ndarray, Chart, str]:
    """What is flown, what is known at its end, and how it ended."""
    facades = build_facades(city)
    angles = STEP * np.arange(-179.5, 180.0)
    fan = np.column_stack((np.cos(angles), np.sin(angles)))
    chart = Chart(Obstacles.open(SIZE, altitude=ALTITUDE, clearance=CLEARANCE), RANGE)
    explorer = Explorer(chart, GOAL[:2], turn_radius=RADIUS, home=1)
    pose, flown, outcome = START, [], "flying"
    for tick in range(400):
        seat = Pose(pose[0], pose[1], ALTITUDE, pose[2], 0.0, 15.0)
        path = np.array([[[*seat]]])
        ranges = sweep(facades, city.walls, path, fan, STEP, RANGE, 0.1, np.uint64(1), tick)
        leg = explorer.step(pose, LidarScan(float(tick), seat, angles, ranges[0, 0], 0.1))
        outcome = leg.outcome
        if outcome in ("arrived", "no path"):
            break
        flown.append(leg.path.poses(1.0)[:, :2])
        pose = leg.path.end
    return np.concatenate(flown), chart, f"{outcome}, {explorer.plans} plans"


def draw_flight(axes: Axes, city: City) -> None:
    buildings(axes, city, ALTITUDE)  # a level beam meets no roof that is lower
    flown, chart, ended = flight(city)
    unseen = np.where(chart.known, np.nan, 1.0)
    shade = mpl.colors.ListedColormap([UNSEEN])
    axes.imshow(unseen, origin="lower", extent=(0.0, SIZE[0], 0.0, SIZE[1]), cmap=shade, alpha=0.55)
    blocked = np.where(chart.obstacles.blocked, 1.0, np.nan)
    walls = mpl.colors.ListedColormap([color(style.TRACK)])
    axes.imshow(blocked, origin="lower", extent=(0.0, SIZE[0], 0.0, SIZE[1]), cmap=walls, alpha=0.4)
    length = np.hypot(*np.diff(flown, axis=0).T).sum()
    axes.plot(flown[:, 0], flown[:, 1], color=color(style.TEAM[0]), linewidth=2.0)
    axes.plot(*GOAL[:2], "x", color="black")
    axes.set_title(f"Without a map: {ended}, {length:.0f} m; blue was never seen", fontsize=10)


def main(folder: Path = HERE) -> Path:
    """Draw the picture into a folder."""
    mpl.use("Agg")
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 6.2), layout="constrained")
    city = town()
    draw_rivals(left, city)
    draw_flight(right, city)
    path = folder / "guidance_planning.png"
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path


if __name__ == "__main__":
    print(main())
