"""The lidars: walls that each aircraft measures at its own height."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.angles import wrap_array
from staniel.city import City
from staniel.datatypes.belief import Percept
from staniel.datatypes.equipment import Lidar
from staniel.datatypes.lidar import LidarScan
from staniel.datatypes.truth import Truth
from staniel.kernels.lidar import Facades, sweep

__all__ = ["Lidars", "build_facades"]

Floats = NDArray[np.float64]

_SMALLEST_CELL = 25.0  # [m]; a street and a house wide


class Lidars:
    """Level fans of laser beams that measure how far the walls ahead are (thesis 4.4.5, fig. 4.9).

    The beams lie in the horizontal plane at the aircraft's height, whatever its bank: a stabilised
    mount. Each measures the first building that reaches above this height, exactly, plus Gaussian
    noise of constant deviation. A scanner measures its whole fan at the decision instant; a
    rangefinder has one beam ahead and measures at the end of every dynamics step of the tick, so
    that a weaving aircraft sweeps with it (thesis 4.5).

    It keeps no state: aircraft, tick and beam name every draw.

    Parameters
    ----------
    city : City
        The true one.
    lidar : Lidar
        Of every aircraft; a mount other than ``"none"``.
    seed : numpy.random.SeedSequence
        Of the lidars' own streams.
    """

    def __init__(self, city: City, lidar: Lidar, seed: np.random.SeedSequence) -> None:
        self._walls = city.walls
        self._facades = build_facades(city)
        self._lidar = lidar
        self._angles = _beams(lidar)
        self._fan = np.column_stack((np.cos(self._angles), np.sin(self._angles)))
        self._key = np.uint64(seed.generate_state(1, np.uint64)[0])

    def sense(self, truth: Truth, percepts: Sequence[Percept]) -> list[Percept]:
        """The same percepts, each with what the aircraft's lidar measured.

        Parameters
        ----------
        truth : Truth
        percepts : sequence of Percept
            One an aircraft. A scan is placed where the aircraft holds itself to be: an error of its
            navigation shifts and turns the scan with it.

        Returns
        -------
        list of Percept
        """
        sweeping = self._lidar.mount == "rangefinder"
        path = truth.aircraft_path if sweeping else truth.aircraft[None]
        ranges = sweep(
            self._facades,
            self._walls,
            np.ascontiguousarray(path),
            self._fan,
            math.radians(self._lidar.step_deg),
            self._lidar.range,
            self._lidar.noise,
            self._key,
            truth.tick,
        )
        if sweeping:
            scans = [
                self._swept(truth.time, percept, path[:, i], ranges[:, i, 0])
                for i, percept in enumerate(percepts)
            ]
        else:
            sigma, origins = self._lidar.noise, np.empty((len(percepts), len(self._angles), 2))
            origins[:] = np.array([percept.pose[:2] for percept in percepts])[:, None]
            scans = [
                LidarScan(truth.time, percept.pose, self._angles, ranges[0, i], sigma, origins[i])
                for i, percept in enumerate(percepts)
            ]
        return [
            dataclasses.replace(percept, lidar=scan)
            for percept, scan in zip(percepts, scans, strict=True)
        ]

    def _swept(self, time: float, percept: Percept, path: Floats, ranges: Floats) -> LidarScan:
        """What one aircraft's single beam measured on its way: (s, k) states and (s,) ranges."""
        pose = percept.pose
        turned = pose.heading - path[-1, 3]
        cos, sin = math.cos(turned), math.sin(turned)
        way = path[:, :2] - path[-1, :2]
        origins = (pose.x, pose.y) + way @ np.array(((cos, sin), (-sin, cos)))
        angles = wrap_array(path[:, 3] - path[-1, 3])
        return LidarScan(time, pose, angles, ranges, self._lidar.noise, origins)


def _beams(lidar: Lidar) -> Floats:
    """(n,) angles of the beams off the heading, even to both sides of one straight ahead [rad]."""
    if lidar.mount == "rangefinder":
        return np.zeros(1)
    half = int(0.5 * lidar.aperture_deg / lidar.step_deg + 1e-9)
    return math.radians(lidar.step_deg) * np.arange(-half, half + 1.0)


def build_facades(city: City) -> Facades:
    """The walls of a city in a grid of cells, as `staniel.kernels.lidar.sweep` reads them.

    Parameters
    ----------
    city : City

    Returns
    -------
    Facades
    """
    edges = _edges(city)
    width, height = city.size
    cell = max(_SMALLEST_CELL, math.sqrt(width * height / (len(edges) + 1)))
    nx, ny = max(1, math.ceil(width / cell)), max(1, math.ceil(height / cell))

    def cells(values: Floats, n: int) -> NDArray[np.int64]:
        # The same quotient and bounds as in the kernel.
        return np.minimum(np.maximum(values / cell, 0.0), n - 1.0).astype(np.int64)

    west, east = np.minimum(edges[:, 0], edges[:, 2]), np.maximum(edges[:, 0], edges[:, 2])
    south, north = np.minimum(edges[:, 1], edges[:, 3]), np.maximum(edges[:, 1], edges[:, 3])
    i0, i1, j0, j1 = cells(west, nx), cells(east, nx), cells(south, ny), cells(north, ny)
    columns = i1 - i0 + 1
    counts = columns * (j1 - j0 + 1)
    wall = np.repeat(np.arange(len(edges)), counts)
    nth = np.arange(len(wall)) - np.repeat(np.cumsum(counts) - counts, counts)
    place = (j0[wall] + nth // columns[wall]) * nx + i0[wall] + nth % columns[wall]
    order = np.argsort(place, kind="stable")
    first = np.searchsorted(place[order], np.arange(nx * ny + 1)).astype(np.int64)
    tallest = float(city.heights.max(initial=0.0))
    roofs = np.ascontiguousarray(city.heights, dtype=np.float64)
    return Facades(tallest, cell, nx, ny, np.ascontiguousarray(edges[wall[order]]), first, roofs)


def _edges(city: City) -> Floats:
    """(w, 5) every wall once: x0, y0, x1, y1, roof [m]; the building on its left."""
    outlines = np.asarray(city.outlines, dtype=object)
    rings, building = shapely.get_rings(outlines, return_index=True)
    outer = np.diff(building, prepend=-1) > 0  # the first ring of each outline is its shell
    wrong = shapely.is_ccw(rings) != outer
    rings[wrong] = shapely.reverse(rings[wrong])
    points, ring = shapely.get_coordinates(rings, return_index=True)
    same = np.flatnonzero(ring[1:] == ring[:-1])
    roofs = np.asarray(city.heights, dtype=np.float64)[building[ring[same]]]
    return np.column_stack((points[same], points[same + 1], roofs))
