"""Line of sight against ray tracers and shapely, on the same segments and the same buildings.

Run by ``make bench``, or alone with ``python benchmarks/sight.py``. The peers are the extra
``bench``; one that is not installed is left out. Every coordinate is a multiple of 1/1024 m: exact
in the float32 that the ray tracers take, and small enough for a decision of every segment in whole
numbers, with which all answers are compared. Times are the process's own, so another one on the
machine disturbs them less.
"""

import importlib.util
import math
import os
import statistics
import time
from collections.abc import Callable

# Before the ray tracers are loaded: one thread each.
os.environ["OMP_NUM_THREADS"] = os.environ["TBB_NUM_THREADS"] = "1"

import numpy as np
import shapely
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from staniel.city import City
from staniel.kernels.walls import visible_pairs

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

CONSOLE = Console()
UNIT = 1.0 / 1024.0
LOT = 40.0
REACH = 250.0
COUNT = 100_000
GOALS = {"embreex": 1.7, "Open3D": 2.0, "shapely STRtree": 30.0}
"""Ratios to reach or exceed."""

Rival = Callable[[], Bools]


def on_lattice(values: Floats) -> Floats:
    """The nearest multiples of `UNIT`."""
    return np.round(np.asarray(values) / UNIT) * UNIT


def scene(n: int, seed: int = 0) -> City:
    """A square city of n buildings, one turned at random in each lot, three tenths of the ground.

    Half are boxes; the others are L-shaped, have a courtyard, or are round towers.
    """
    rng = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(n))
    outlines = []
    for lot in rng.permutation(side * side)[:n]:
        w, h = rng.uniform(9.0, 13.5, 2)
        kind = rng.random()
        holes = []
        shell = np.array([(-w, -h), (w, -h), (w, h), (-w, h)])
        if kind < 0.2:
            shell = np.array([(-w, -h), (w, -h), (w, 0), (0, 0), (0, h), (-w, h)])
        elif kind < 0.4:
            holes = [0.45 * shell[::-1]]
        elif kind < 0.5:
            turns = np.arange(12) * math.pi / 6.0
            shell = np.column_stack([w * np.cos(turns), w * np.sin(turns)])
        turn = rng.uniform(0.0, math.tau)
        spin = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        middle = LOT * (np.array(divmod(lot, side)) + 0.5)
        shell, *holes = (on_lattice(ring @ spin + middle) for ring in (shell, *holes))
        outlines.append(shapely.Polygon(shell, holes))
    heights = on_lattice(rng.uniform(10.0, 40.0, n))
    return City.from_outlines(outlines, heights, (LOT * side, LOT * side))


def open_ground(city: City, rng: np.random.Generator, middle: Floats, reach: float) -> Floats:
    """One place in the open and in the city within `reach` of each of `middle` (n, 2)."""
    places = np.empty_like(middle)
    todo = np.arange(len(middle))
    while len(todo):
        bearing = rng.uniform(0.0, math.tau, len(todo))
        far = reach * np.sqrt(rng.random(len(todo)))
        step = np.column_stack([far * np.cos(bearing), far * np.sin(bearing)])
        places[todo] = on_lattice(middle[todo] + step)
        outside = ((places[todo] < 0.0) | (places[todo] > city.size)).any(axis=1)
        todo = todo[outside | city.inside(places[todo])]
    return places


def segments(city: City, n: int, seed: int = 1) -> tuple[Floats, Floats]:
    """(n, 3) upper and lower ends: four of five look down from 50-120 m to a vehicle, one level."""
    rng = np.random.default_rng(seed)
    a, b = np.empty((n, 3)), np.empty((n, 3))
    level = rng.random(n) < 0.2
    a[:, :2] = on_lattice(rng.uniform(0.0, city.size, (n, 2)))
    a[level, :2] = open_ground(city, rng, a[level, :2], 40.0)
    b[:, :2] = open_ground(city, rng, a[:, :2], REACH)
    a[:, 2] = on_lattice(np.where(level, rng.uniform(1.5, 30.0, n), rng.uniform(50.0, 120.0, n)))
    b[:, 2] = np.where(level, a[:, 2], 1.0)
    return a, b


def meshed(city: City) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices and triangles of all walls and roofs."""
    vertices, faces, used = [], [], 0
    for outline, roof in zip(city.outlines, city.heights, strict=True):
        for ring in (outline.exterior, *outline.interiors):
            ground = shapely.get_coordinates(ring)[:-1]
            n = len(ground)
            i, j = np.arange(n), np.roll(np.arange(n), -1)
            vertices += [np.insert(ground, 2, z, axis=1) for z in (0.0, roof)]
            faces += [
                used + np.column_stack([i, j, j + n]),
                used + np.column_stack([i, j + n, i + n]),
            ]
            used += 2 * n
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(outline)):
            vertices.append(np.insert(shapely.get_coordinates(triangle)[:3], 2, roof, axis=1))
            faces.append(used + np.array([[0, 1, 2]]))
            used += 3
    return np.vstack(vertices).astype(np.float32), np.vstack(faces).astype(np.int32)


def by_embreex(city: City, a: Floats, b: Floats) -> Rival:
    """Occlusion by Embree 4 through embreex, ray by ray."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    space = EmbreeScene()
    mesh = TriangleMesh(space, *meshed(city))
    start, way = a.astype(np.float32), (b - a).astype(np.float32)
    whole = np.ones(len(a), dtype=np.float32)

    def run(_: object = mesh) -> Bools:
        return np.asarray(space.run(start, way, whole, query="OCCLUDED") == -1)

    return run


def by_open3d(city: City, a: Floats, b: Floats) -> Rival:
    """Occlusion by Embree 4 through Open3D, one thread."""
    from open3d.core import Tensor
    from open3d.t.geometry import RaycastingScene

    space = RaycastingScene(nthreads=1)
    vertices, faces = meshed(city)
    space.add_triangles(Tensor(vertices), Tensor(faces.astype(np.uint32)))
    rays = Tensor(np.hstack([a, b - a]).astype(np.float32))
    return lambda: ~space.test_occlusions(rays, tfar=1.0, nthreads=1).numpy()


def walls_of(city: City) -> tuple[Floats, Floats]:
    """(w, 2, 2) ends of all walls, and their (w,) roofs."""
    rings, building = shapely.get_rings(np.asarray(city.outlines, dtype=object), return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    same = np.flatnonzero(ring[1:] == ring[:-1])
    roofs = np.asarray(city.heights)[building[ring[same]]]
    return np.stack([points[same], points[same + 1]], axis=1), roofs


def ground_lines(a: Floats, b: Floats) -> NDArray[np.object_]:
    """The ground lines of segments."""
    lines: NDArray[np.object_] = shapely.linestrings(np.stack([a[:, :2], b[:, :2]], axis=1))
    return lines


def by_tree(city: City, a: Floats, b: Floats) -> Rival:
    """Candidates by shapely's tree of walls, under the part below the tallest roof; then NumPy."""
    walls, roofs = walls_of(city)
    tree = shapely.STRtree(shapely.linestrings(walls))

    def run() -> Bools:
        way = a - b
        climb = np.where(way[:, 2] > 0.0, way[:, 2], 1.0)
        share = np.where(way[:, 2] > 0.0, np.clip((city.tallest - b[:, 2]) / climb, 0.0, 1.0), 1.0)
        top = b + share[:, None] * way
        segment, wall = tree.query(ground_lines(b, top))
        start, ray, roof = b[segment], way[segment], roofs[wall]
        u, v = walls[wall, 0] - start[:, :2], walls[wall, 1] - start[:, :2]
        of_u = ray[:, 0] * u[:, 1] - ray[:, 1] * u[:, 0]
        of_v = ray[:, 0] * v[:, 1] - ray[:, 1] * v[:, 0]
        of_b = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            met = of_b / (of_v - of_u)
        below = start[:, 2] + met * ray[:, 2] < roof
        clear = np.ones(len(a), dtype=bool)
        clear[segment[(of_u * of_v < 0.0) & (met > 0.0) & (met < 1.0) & below]] = False
        return clear

    return run


def exactly(city: City, a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """What is visible, in whole numbers of `UNIT`, and which segments only touch something.

    A segment that ends low in the open is hidden if it passes through a wall below its roof. Sides
    are products of two differences and heights of three, all below 2**63: nothing is rounded. A
    product of zero is a touch, which this test leaves undecided.
    """
    walls, roofs = walls_of(city)
    segment, wall = shapely.STRtree(shapely.linestrings(walls)).query(ground_lines(a, b))
    p, q, u, v = (
        np.rint(ends / UNIT).astype(np.int64)
        for ends in (b[segment], a[segment], walls[wall, 0], walls[wall, 1])
    )
    roof = np.rint(roofs / UNIT).astype(np.int64)[wall]

    def side(o: NDArray[np.int64], w: NDArray[np.int64], x: NDArray[np.int64]) -> NDArray[np.int64]:
        """Positive where x is left of the line from o to w."""
        return (w[:, 0] - o[:, 0]) * (x[:, 1] - o[:, 1]) - (w[:, 1] - o[:, 1]) * (x[:, 0] - o[:, 0])

    of_u, of_v, of_p, of_q = side(p, q, u), side(p, q, v), side(u, v, p), side(u, v, q)
    # The wall's line is met at the share of_p / (of_p - of_q) of the way from p up to q.
    whole = of_p - of_q
    room = ((roof - p[:, 2]) * whole - (q[:, 2] - p[:, 2]) * of_p) * np.sign(whole)
    meets = (
        (np.sign(of_u) * np.sign(of_v) <= 0) & (np.sign(of_p) * np.sign(of_q) <= 0) & (room >= 0)
    )
    touches = meets & ((of_u == 0) | (of_v == 0) | (of_p == 0) | (of_q == 0) | (room == 0))
    visible, touching = np.ones(len(a), dtype=bool), np.zeros(len(a), dtype=bool)
    visible[segment[meets & ~touches]] = False
    touching[segment[touches]] = True
    return visible, touching & visible


def race(rivals: dict[str, Rival], repeats: int) -> dict[str, float]:
    """Median processor seconds of each rival, in turns; those over a second take three turns."""
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for turn in range(repeats):
        for name, call in rivals.items():
            if turn < 3 or times[name][0] < 1.0:
                started = time.process_time()
                call()
                times[name].append(time.process_time() - started)
    return {name: statistics.median(values) for name, values in times.items()}


def compare(buildings: tuple[int, ...] = (100, 1_000, 10_000), repeats: int = 15) -> None:
    """Race on every scene; print times, ratios, and the answers that differ from the exact ones."""
    table = Table(
        *("buildings", "", "ns per segment", "M/s", "ratio", "goal", "wrong"),
        title=f"line of sight, {COUNT} segments up to {REACH:.0f} m, one thread",
    )
    peers = {"embreex": by_embreex, "Open3D": by_open3d, "shapely STRtree": by_tree}
    modules = {"embreex": "embreex", "Open3D": "open3d", "shapely STRtree": "shapely"}
    for n in buildings:
        city = scene(n)
        a, b = segments(city, COUNT)
        rivals: dict[str, Rival] = {
            "staniel": lambda w=city.walls, s=a, e=b: visible_pairs(w, s, e),
            "staniel, checked": lambda c=city, s=a, e=b: c.visible_pairs(s, e),
        }
        for name, make in peers.items():
            if importlib.util.find_spec(modules[name]) is None:
                continue
            try:
                rivals[name] = make(city, a, b)
            except ImportError as problem:
                CONSOLE.print(f"{name} does not load and is left out: {problem}")
        visible, touching = exactly(city, a, b)
        wrong = {
            name: np.count_nonzero((call() != visible) & ~touching) for name, call in rivals.items()
        }
        medians = race(rivals, repeats)
        for name, seconds in medians.items():
            ratio, goal = seconds / medians["staniel"], GOALS.get(name)
            table.add_row(
                str(n),
                name,
                f"{1e9 * seconds / COUNT:.0f}",
                f"{1e-6 * COUNT / seconds:.2f}",
                f"{ratio:.2f}",
                f"{goal:g}" if goal else "",
                str(wrong[name]),
            )
        CONSOLE.print(
            f"{n} buildings, {100 * city.density:.0f} % built, {100 * visible.mean():.0f} % of the "
            f"segments visible; {np.count_nonzero(touching)} undecided touches left out"
        )
    CONSOLE.print(table)


if __name__ == "__main__":
    compare()
