"""Draw the pictures of the page `world.md`: cities, footprints, shadows, radio, lidar, visibility.

    python docs/gallery/make_world.py [--maps FOLDER]

writes its pictures beside this file, all from what it makes itself. With a folder of maps
(``.map``, pictures and ``.geojson``, also in subfolders) it draws each of them, too, into
``local/``, which is not part of the project: maps have licences of their own.
"""

import argparse
import json
import math
import tempfile
import warnings
from collections.abc import Iterable
from pathlib import Path

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from staniel.city import City, footprint, visible_ground, visible_share
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.equipment import Camera, Lidar, RadioSet
from staniel.datatypes.truth import Truth
from staniel.guidance.walls import fit_walls
from staniel.kernels.footprint import camera_axis
from staniel.pictures import style
from staniel.world.lidar import Lidars

HERE = Path(__file__).resolve().parent

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FLIGHT_HEIGHT = 80.0
SEEN, HIDDEN = "#ffd34d", "#31446e"


def color(rgb: style.Rgb) -> tuple[float, ...]:
    return tuple(part / 255.0 for part in rgb)


BLUE, ORANGE, GREEN, PINK = (color(rgb) for rgb in style.TEAM[:4])
RED, INK = color(style.TRACK), color(style.INK)


# Cities.


def example_picture(path: Path) -> None:
    """A round town of rings and rays, drawn as an image: dark is building."""
    image = Image.new("L", (160, 120), 255)
    draw = ImageDraw.Draw(image)
    for radius, grey in ((56, 0), (44, 255), (38, 0), (26, 255), (20, 0), (10, 255)):
        draw.ellipse((80 - radius, 60 - radius, 80 + radius, 60 + radius), fill=grey)
    for angle in np.arange(8) * math.pi / 4.0 + 0.2:
        end = (80 + 80 * math.cos(angle), 60 + 80 * math.sin(angle))
        draw.line([(80, 60), end], fill=255, width=5)
    for corner in ((6, 6), (136, 6), (6, 96), (136, 96)):
        draw.rectangle((*corner, corner[0] + 18, corner[1] + 18), fill=0)
    image.save(path)


def example_grid(path: Path) -> None:
    """A small map of blocks in the text format of the Moving AI benchmarks."""
    rng = np.random.default_rng(7)
    cells = np.full((48, 64), ".")
    for row in range(2, 44, 11):
        for column in range(2, 60, 10):
            tall, wide = rng.integers(6, 10), rng.integers(5, 9)
            cells[row : row + tall, column : column + wide] = "@"
            if tall > 7 and wide > 6:
                cells[row + 2 : row + tall - 2, column + 2 : column + wide - 2] = "."
    rows = ["".join(line) for line in cells]
    text = "\n".join(["type octile", "height 48", "width 64", "map", *rows])
    path.write_text(text + "\n", encoding="utf-8")


def example_geojson(path: Path) -> None:
    """Turned houses, one with a court, one of two parts: heights as metres and as storeys."""
    rng = np.random.default_rng(3)
    features = []
    for k, (x, y) in enumerate((x, y) for x in range(30, 300, 48) for y in range(30, 220, 46)):
        house = shapely.box(x - rng.uniform(13, 20), y - rng.uniform(11, 18), x + 17, y + 15)
        if k % 4 == 0:
            house = house - house.buffer(-8.0)
        if k % 5 == 2:
            house = house - shapely.box(x - 3, y - 40, x + 3, y + 40)
        house = shapely.affinity.rotate(house, 14.0, origin=(150.0, 120.0))
        facts = {"height": round(rng.uniform(8, 35), 1)} if k % 2 else {"levels": 3 + k % 7}
        features.append(
            {
                "type": "Feature",
                "properties": facts,
                "geometry": json.loads(shapely.to_geojson(house)),
            }
        )
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def example_cities(folder: Path) -> dict[str, City]:
    """One city from each kind of source; files are written into `folder`."""
    picture, grid, outlines = (folder / f"town{end}" for end in (".png", ".map", ".geojson"))
    example_picture(picture)
    example_grid(grid)
    example_geojson(outlines)
    return {
        "City.generate": City.generate(seed=0),
        "City.from_image": City.from_image(picture, cell=2.5, heights=(8.0, 40.0), seed=1),
        "City.from_grid": City.from_grid(grid, cell=5.0, heights=(8.0, 40.0), seed=1),
        "City.from_geojson": City.from_geojson(outlines, heights=(8.0, 30.0), frame="metres"),
    }


def patch_of(polygon: shapely.Polygon) -> PathPatch:
    rings = [polygon.exterior, *polygon.interiors]
    paths = [Outline(shapely.get_coordinates(ring), closed=True) for ring in rings]
    return PathPatch(Outline.make_compound_path(*paths))


def draw_areas(axes: Axes, areas: Iterable[shapely.Polygon], **look: object) -> PatchCollection:
    collection = PatchCollection([patch_of(area) for area in areas], **look)
    axes.add_collection(collection)
    return collection


def draw_city(axes: Axes, city: City, *, tallest: float = 40.0) -> PatchCollection:
    """Buildings, darker the taller they are."""
    shades = mpl.colors.LinearSegmentedColormap.from_list(
        "roofs", [color(style.ROOF_LOW), (0.33, 0.35, 0.4)]
    )
    roofs = draw_areas(axes, city.outlines, cmap=shades, edgecolor=color(style.EDGE), linewidth=0.4)
    roofs.set_array(city.heights)
    roofs.set_clim(0.0, tallest)
    axes.set_facecolor(color(style.GROUND))
    axes.set(xlim=(0, city.size[0]), ylim=(0, city.size[1]), aspect="equal")
    axes.tick_params(labelsize=8)
    return roofs


def draw_aircraft(axes: Axes, pose: Pose, size: float) -> None:
    """A kite of `size` metres, its nose where the aircraft heads."""
    shape = size * np.array([[0.6, 0.0], [-0.4, 0.35], [-0.2, 0.0], [-0.4, -0.35]])
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    corners = (pose.x, pose.y) + shape @ np.array([[cosine, sine], [-sine, cosine]])
    axes.add_patch(plt.Polygon(corners, facecolor=BLUE, edgecolor="white", lw=1.0, zorder=5))


def draw_cities(cities: dict[str, City]) -> Figure:
    figure, panels = plt.subplots(2, 2, figsize=(8.6, 7.6), layout="constrained")
    for axes, (name, city) in zip(panels.flat, cities.items(), strict=True):
        roofs = draw_city(axes, city)
        axes.set_title(f"{name}: {len(city.outlines)} buildings, {city.density:.0%} built", size=10)
    figure.get_layout_engine().set(w_pad=0.12)
    figure.colorbar(roofs, ax=panels, label="roof height [m]", shrink=0.5, aspect=35)
    return figure


# Footprints.


def draw_footprints() -> Figure:
    """A banked camera whose cone meets the ground in an ellipse, a parabola and a hyperbola."""
    figure, panels = plt.subplots(1, 3, figsize=(10.0, 3.7), layout="constrained")
    reach, half = 190.0, math.radians(45.0)
    for axes, bank_deg in zip(panels, (15.0, 45.0, 60.0), strict=True):
        pose = Pose(0.0, 0.0, FLIGHT_HEIGHT, math.pi / 2.0, math.radians(bank_deg), 15.0)
        found = footprint(pose, half, reach, points=200)
        east, north = np.meshgrid(np.linspace(-190, 300, 491), np.linspace(-220, 220, 441))
        p = np.stack([east, north, np.ones_like(east)])
        form = np.einsum("iyx,ij,jyx->yx", p, found.conic, p)
        # Of the double cone only the sheet in front of the camera.
        axis = camera_axis(pose.heading, pose.bank)
        ahead = east * axis[0] + north * axis[1] - pose.z * axis[2] > 0.0
        axes.contour(
            east, north, np.where(ahead, form, np.nan), [0.0], colors=[BLUE], linestyles="--"
        )
        axes.add_patch(plt.Polygon(found.polygon, facecolor=(*BLUE, 0.18), edgecolor=BLUE, lw=2))
        ground = math.sqrt(reach**2 - pose.z**2)
        axes.add_patch(Circle((0, 0), ground, fill=False, color=INK, lw=0.8, ls=":"))
        if axis[2] < 0.0:
            hit = -pose.z / axis[2]
            axes.plot([0, hit * axis[0]], [0, hit * axis[1]], color=ORANGE, lw=1.2, marker=".")
        if found.mean is not None:
            axes.plot(*found.mean, "+", color=BLUE, ms=9)
        draw_aircraft(axes, pose, 34.0)
        axes.set_title(f"bank {bank_deg:g}°: {found.kind}", size=11)
        axes.set(xlim=(-190, 300), ylim=(-220, 220), aspect="equal", xlabel="east [m]")
        axes.tick_params(labelsize=8)
    panels[0].set_ylabel("north [m]")
    panels[0].legend(
        handles=[
            plt.Line2D([], [], color=BLUE, lw=2, label="footprint"),
            plt.Line2D([], [], color=BLUE, ls="--", label="conic"),
            plt.Line2D([], [], color=INK, lw=0.8, ls=":", label="slant range"),
            plt.Line2D([], [], color=ORANGE, marker=".", label="camera's axis"),
        ],
        loc="lower right", fontsize=7,
    )  # fmt: skip
    return figure


# Shadows.


def draw_shadows(city: City) -> Figure:
    figure, axes = plt.subplots(figsize=(6.6, 6.6), layout="constrained")
    draw_city(axes, city)
    camera = Camera(half_aperture_deg=60.0, range=250.0)
    pose = Pose(300.0, 290.0, FLIGHT_HEIGHT, math.radians(120.0), math.radians(15.0), 15.0)
    found = footprint(pose, camera.half_aperture, camera.range, points=200)
    whole = shapely.Polygon(found.polygon)
    ground = visible_ground(city, pose, camera.half_aperture, camera.range, points=200)
    streets = whole - shapely.union_all(list(city.outlines))
    draw_areas(axes, shapely.get_parts(streets - ground), facecolor=HIDDEN, lw=0)
    draw_areas(axes, shapely.get_parts(ground), facecolor=SEEN, lw=0)
    axes.add_patch(plt.Polygon(found.polygon, fill=False, edgecolor=BLUE, lw=2))
    draw_aircraft(axes, pose, 24.0)
    share = visible_share(city, [ground])
    axes.legend(
        handles=[
            plt.Rectangle((0, 0), 1, 1, facecolor=SEEN, label="seen"),
            plt.Rectangle((0, 0), 1, 1, facecolor=HIDDEN, label="hidden by buildings"),
            plt.Line2D([], [], color=BLUE, lw=2, label="footprint"),
        ],
        loc="upper left", fontsize=8, framealpha=0.95,
    )  # fmt: skip
    axes.set_title(
        f"{ground.area / streets.area:.0%} of the streets in the footprint are seen, "
        f"{share:.0%} of all streets",
        size=10,
    )
    axes.set(xlabel="east [m]", ylabel="north [m]")
    return figure


# Radio.


def draw_radio() -> Figure:
    radio = RadioSet()
    figure, (axes, curve) = plt.subplots(
        1, 2, figsize=(10.0, 4.0), layout="constrained", width_ratios=(1.25, 1.0)
    )
    side = 1.15 * radio.range
    line = np.linspace(-side, side, 301)
    distance = np.hypot(*np.meshgrid(line, line))

    def success(d: Floats) -> Floats:
        return np.where(d <= radio.range, np.exp(-0.5 * (d / radio.sigma) ** 2), 0.0)

    picture = axes.contourf(line, line, success(distance), np.linspace(0, 1, 21), cmap="YlGnBu")
    axes.set_aspect("equal")
    levels = axes.contour(
        line, line, np.exp(-0.5 * (distance / radio.sigma) ** 2), [0.5, 0.75, 0.9], colors="white"
    )
    axes.clabel(levels, fmt=lambda level: f"{level:.0%}", fontsize=8)
    axes.add_patch(Circle((0, 0), radio.range, fill=False, color=INK, lw=1.0, ls=":"))
    axes.plot(0, 0, marker="^", color=RED, ms=9)
    axes.set(xlabel="east of the sender [m]", ylabel="north of the sender [m]")
    figure.colorbar(picture, ax=axes, ticks=np.linspace(0.0, 1.0, 6))
    way = np.linspace(0.0, side, 400)
    curve.plot(way, success(way), color=BLUE, lw=2)
    curve.axvline(radio.range, color=INK, lw=1.0, ls=":")
    curve.annotate("range", (radio.range, 0.95), (-6, 0), textcoords="offset points", ha="right")
    curve.set(
        xlabel="distance [m]", ylabel="probability of delivery", ylim=(0, 1.03), xlim=(0, side)
    )
    curve.grid(alpha=0.3)
    return figure


# Lidar.


def draw_lidar(city: City) -> Figure:
    """An aircraft between the houses, below the lowest roof."""
    lidar = Lidar(mount="scanner", range=110.0, aperture_deg=240.0, step_deg=1.5, noise=0.15)
    pose = open_place(city, 9.0)
    aircraft = np.array([pose])
    none = np.zeros((0, 4))
    truth = Truth(0, 0.0, aircraft, none, none, aircraft[None], none[None])
    seed = np.random.SeedSequence(4)
    [percept] = Lidars(city, lidar, seed).sense(truth, [Percept(0.0, pose, ())])
    scan = percept.lidar
    figure, axes = plt.subplots(figsize=(5.8, 5.3), layout="constrained")
    draw_city(axes, city)
    origins, rays = scan.origins, scan.directions()
    ends = origins + np.minimum(scan.ranges, lidar.range)[:, None] * rays
    fan = mpl.collections.LineCollection(
        np.stack([origins, ends], axis=1), colors=[(*ORANGE, 0.5)], linewidths=0.7
    )
    axes.add_collection(fan)
    axes.plot(*scan.points().T, ".", color=INK, ms=3.5, label="returns")
    lines = fit_walls(scan)
    for k, wall in enumerate(lines):
        axes.plot(
            *zip(wall.start, wall.end, strict=True), color=RED, lw=2.6, solid_capstyle="round",
            label="fitted walls" if k == 0 else None,
        )  # fmt: skip
    draw_aircraft(axes, pose, 9.0)
    axes.set(
        xlim=(pose.x - 95, pose.x + 95), ylim=(pose.y - 80, pose.y + 90),
        xlabel="east [m]", ylabel="north [m]",
    )  # fmt: skip
    widest = max(math.sqrt(wall.covariance[1, 1]) for wall in lines)
    axes.set_title(
        f"{len(lines)} walls from {int(scan.returned.sum())} returns of ± {lidar.noise:g} m; "
        f"their directions are known to {math.degrees(widest):.1f}° or better",
        size=8.5,
    )
    axes.legend(loc="lower right", fontsize=8)
    return figure


def open_place(city: City, height: float) -> Pose:
    """Of many places near the middle, the one farthest from all walls."""
    east, north = city.size
    rng = np.random.default_rng(0)
    places = rng.uniform((0.3 * east, 0.3 * north), (0.7 * east, 0.7 * north), (2000, 2))
    away = shapely.distance(shapely.points(places), shapely.union_all(list(city.outlines)))
    x, y = places[int(np.argmax(away))].tolist()
    return Pose(x, y, height, math.radians(90.0), 0.0, 15.0)


# Visible fraction.


def uniform_pairs(
    city: City, height: float, n: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """(n, 3) observers in the air at one height and (n, 3) targets on the streets, uniform."""

    def free(z: float) -> Floats:
        found = np.zeros((0, 3))
        while len(found) < n:
            places = np.column_stack(
                [rng.uniform((0, 0), city.size, (2 * n, 2)), np.full(2 * n, z)]
            )
            clear = city.visible_pairs(places, places)
            found = np.vstack([found, places[clear]])
        return found[:n]

    return free(height), free(0.0)


def slowly_visible(city: City, observers: Floats, targets: Floats) -> Bools:
    """Line of sight to targets on the ground by cutting each ray's shadow with each outline."""
    outlines = np.array(city.outlines, dtype=object)
    flat = shapely.linestrings(np.stack([observers[:, :2], targets[:, :2]], axis=1))
    pair, house = shapely.STRtree(outlines).query(flat, predicate="intersects")
    # Where the ray comes down to the roof; before that the house is below it.
    share = np.clip((observers[pair, 2] - city.heights[house]) / observers[pair, 2], 0.0, 1.0)
    starts = observers[pair, :2] + share[:, None] * (targets[pair, :2] - observers[pair, :2])
    low = shapely.linestrings(np.stack([starts, targets[pair, :2]], axis=1))
    hidden = shapely.length(shapely.intersection(low, outlines[house])) > 1e-9
    visible = np.ones(len(observers), dtype=np.bool_)
    visible[pair[hidden]] = False
    return visible


def fraction(seen: Bools) -> tuple[float, float]:
    """Share that is seen and its binomial standard error, by Agresti and Coull at 0 and 1."""
    n = len(seen)
    mean = float(seen.mean())
    centre = (seen.sum() + 2.0) / (n + 4.0)
    return mean, math.sqrt(centre * (1.0 - centre) / (n + 4.0))


def draw_visible_fraction(pairs: int, checked: int) -> Figure:
    """Against flight height over mean roof, and against density; the slow answer in rings."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(9.6, 4.3), layout="constrained", sharey=True
    )
    rng = np.random.default_rng(12)
    ratios = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0])
    densities = np.array([0.15, 0.25, 0.35, 0.45, 0.55])

    def point(axes: Axes, x: float, city: City, ratio: float, paint: object) -> float:
        height = ratio * city.statistics().mean_roof
        share, error = fraction(city.visible_pairs(*uniform_pairs(city, height, pairs, rng)))
        axes.errorbar(x, share, 2.0 * error, fmt=".", color=paint, capsize=2)
        slow, wide = fraction(slowly_visible(city, *uniform_pairs(city, height, checked, rng)))
        axes.errorbar(x, slow, 2.0 * wide, fmt="o", mfc="none", color=paint, alpha=0.5, ms=8)
        return share

    for density, paint in ((0.2, GREEN), (0.35, BLUE), (0.5, PINK)):
        city = City.generate(density=density, seed=2)
        shares = [point(left, ratio, city, ratio, paint) for ratio in ratios]
        left.plot(ratios, shares, color=paint, lw=1.2, label=f"{density:.0%} built")
    for ratio, paint in ((1.5, INK), (3.0, ORANGE), (6.0, RED)):
        cities = [City.generate(density=density, seed=2) for density in densities]
        shares = [
            point(right, density, city, ratio, paint)
            for density, city in zip(densities, cities, strict=True)
        ]
        right.plot(densities, shares, color=paint, lw=1.2, label=f"height ratio {ratio:g}")
    left.set(xlabel="flight height / mean roof", ylabel="visible fraction of pairs", ylim=(0, 1))
    right.set(xlabel="built share of the ground")
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    return figure


# All of them.


def save(figure: Figure, path: Path) -> None:
    """As a PNG without the time and the tool that made it."""
    figure.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(figure)


def draw_all(folder: Path, *, pairs: int = 20_000, checked: int = 600) -> None:
    """Every picture of the page, into a folder that exists."""
    with tempfile.TemporaryDirectory() as scratch:
        cities = example_cities(Path(scratch))
    default = cities["City.generate"]
    save(draw_cities(cities), folder / "world_cities.png")
    save(draw_footprints(), folder / "world_footprints.png")
    save(draw_shadows(default), folder / "world_shadows.png")
    save(draw_radio(), folder / "world_radio.png")
    save(draw_lidar(default), folder / "world_lidar.png")
    save(draw_visible_fraction(pairs, checked), folder / "world_visible.png")


def draw_maps(maps: Path, folder: Path) -> None:
    """Each map of a folder as a city, for the reader's own eyes."""
    folder.mkdir(exist_ok=True)
    for path in sorted(maps.rglob("*")):
        try:
            if path.suffix == ".geojson" and "building" in path.name:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    city = City.from_geojson(path, heights=(6.0, 20.0))
            elif path.suffix == ".map":
                city = City.from_grid(path, cell=2.0, heights=(8.0, 40.0))
            elif path.suffix == ".png":
                city = City.from_image(path, cell=2.0, heights=(8.0, 40.0))
            else:
                continue
        except ValueError as error:
            print(error)
            continue
        figure, axes = plt.subplots(figsize=(8.0, 8.0), layout="constrained")
        draw_city(axes, city)
        axes.set_title(f"{path.name}: {len(city.outlines)} buildings, {city.density:.0%} built")
        save(figure, folder / f"{path.stem}{path.suffix.replace('.', '_')}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--maps", type=Path, help="folder of maps to draw into local/")
    chosen = parser.parse_args()
    mpl.use("Agg")
    draw_all(HERE)
    if chosen.maps is not None:
        draw_maps(chosen.maps, HERE / "local")


if __name__ == "__main__":
    main()
