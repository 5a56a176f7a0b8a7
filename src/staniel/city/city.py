"""The city: a rectangle of ground with extruded buildings on it."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from staniel.city.checks import check_heights, check_outlines, check_size, straightened
from staniel.city.features import Origin
from staniel.city.generate import generate_outlines
from staniel.city.geojson import NO_REPAIRS, CityWarning, Repairs, read_buildings
from staniel.city.grid import grid_outlines
from staniel.city.image import image_outlines
from staniel.city.index import build_walls
from staniel.city.plain import dict_parts, parts_dict, write_geojson
from staniel.city.roads import RoadNetwork
from staniel.city.statistics import CityStatistics, city_statistics
from staniel.kernels import walls as sight
from staniel.kernels.walls import Walls

__all__ = ["City"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class City:
    """A rectangle of flat ground with buildings, frozen and indexed for sight.

    Made by `generate`, `from_image`, `from_grid`, `from_geojson`, `from_outlines`, `from_dict` or
    `open`, which check what they are given. East-north metres from the south-west corner; the
    ground is at 0.

    Attributes
    ----------
    size : (float, float) [m]
        East and north extent of the rectangle.
    outlines : tuple of n shapely.Polygon
        Inside the rectangle, interiors disjoint, counter-clockwise shells, holes (courtyards) kept,
        no corner on a straight wall.
    heights : (n,) float array [m]
        Roof heights.
    walls : Walls
        The index that kernels walk.
    origin : Origin, optional
        Where the south-west corner lies on Earth, or in the plane of the file it came from.
    repairs : Repairs
        What was mended in that file, counted.
    roads : RoadNetwork, optional
        All that were read, also those that cross buildings or leave the rectangle.

    Examples
    --------
    A wall of a house between an aircraft at 50 m and a point on the street.

    >>> house = shapely.box(40.0, 40.0, 60.0, 60.0)
    >>> city = City.from_outlines([house], heights=[20.0], size=(100.0, 100.0))
    >>> city.visible([[10.0, 50.0, 50.0]], [[62.0, 50.0, 0.0], [99.0, 50.0, 0.0]])
    array([[False,  True]])
    """

    size: tuple[float, float]
    outlines: tuple[shapely.Polygon, ...]
    heights: Floats
    walls: Walls = field(init=False, repr=False)
    origin: Origin | None = None
    repairs: Repairs = NO_REPAIRS
    roads: RoadNetwork | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "walls", build_walls(self.outlines, self.heights, self.size))

    @classmethod
    def open(cls, size: tuple[float, float]) -> "City":
        """A city without buildings.

        Parameters
        ----------
        size : (float, float) [m]
            East and north extent, greater than 0.

        Raises
        ------
        CityError
            A size that is not two positive finite numbers.

        Examples
        --------
        >>> City.open((100.0, 50.0)).density
        0.0
        """
        return cls(check_size(size), (), np.zeros(0))

    @classmethod
    def from_outlines(
        cls, outlines: Sequence[shapely.Polygon], heights: ArrayLike, size: tuple[float, float]
    ) -> "City":
        """A city from building outlines.

        Parameters
        ----------
        outlines : sequence of n shapely.Polygon [m]
            Valid, inside the rectangle; they may touch but not overlap.
        heights : (n,) array_like [m]
            Roof heights, greater than 0.
        size : (float, float) [m]
            East and north extent of the rectangle, greater than 0.

        Raises
        ------
        CityError
            Anything of the above does not hold; the message names the building by its index.

        Examples
        --------
        >>> ring = shapely.box(10, 10, 40, 40) - shapely.box(20, 20, 30, 30)
        >>> City.from_outlines([ring], [12.0], (50.0, 50.0)).density
        0.32
        """
        extent = check_size(size)
        polygons = check_outlines(outlines, extent)
        return cls(extent, straightened(polygons), check_heights(heights, len(polygons)))

    @classmethod
    def generate(
        cls,
        *,
        size: tuple[float, float] = (600.0, 600.0),
        density: float = 0.42,
        block: tuple[float, float] = (40.0, 60.0),
        heights: tuple[float, float] = (10.0, 40.0),
        seed: int = 0,
    ) -> "City":
        """A dense city of irregular blocks: streets, alleys, courtyards, wings.

        Parameters
        ----------
        size : (float, float) [m]
            East and north extent.
        density : float [-]
            Built share of the rectangle, in (0, 0.8]; met within 0.01.
        block : (float, float) [m]
            Shortest and longest side of a block between streets.
        heights : (float, float) [m]
            Lowest and tallest roof.
        seed : int
            At least 0. Same arguments, same city.

        Raises
        ------
        CityError
            A value out of its range, or a density that the block size leaves no room for: every
            street, also the one all round the edge, is at least 6 m wide.

        Examples
        --------
        >>> city = City.generate(density=0.3, seed=1)
        >>> abs(city.density - 0.3) <= 0.01
        True
        """
        extent = check_size(size)
        outlines, roofs = generate_outlines(extent, density, block, heights, seed)
        return cls(extent, straightened(outlines), roofs)

    @classmethod
    def from_image(
        cls,
        path: str | PathLike[str],
        *,
        cell: float,
        heights: tuple[float, float],
        seed: int = 0,
        threshold: float | None = None,
    ) -> "City":
        """A city from a black-and-white picture: dark is building, light is street.

        Outlines follow the pixels' edges exactly, holes are kept (thesis algorithm 4.1, with true
        outlines in place of convex hulls). Pixels that only share a corner belong to different
        buildings. The first row is the north edge.

        Parameters
        ----------
        path : path
            Anything that Pillow reads, of any mode, up to 16 million pixels.
        cell : float [m]
            Side of a pixel on the ground.
        heights : (float, float) [m]
            One roof height for each building is drawn uniformly between these.
        seed : int
            Of the heights.
        threshold : float, optional
            Grey levels (0 to 255) at or below it are building. Not given: Otsu's threshold, which
            parts the picture's grey levels into the two most distinct classes.

        Raises
        ------
        CityError
            A file that is missing, damaged, no picture or too large; a picture without free space;
            a value out of its range.
        """
        outlines, roofs, extent = image_outlines(path, cell, heights, seed, threshold)
        return cls(extent, outlines, roofs)

    @classmethod
    def from_grid(
        cls,
        path: str | PathLike[str],
        *,
        cell: float,
        heights: tuple[float, float],
        seed: int = 0,
    ) -> "City":
        """A city from a Moving AI ``.map`` grid.

        ``.``, ``G`` and ``S`` are free, ``@``, ``O``, ``T`` and ``W`` are building; outlines as in
        `from_image`. The first row is the north edge.

        Parameters
        ----------
        path : path
            The ``.map`` file, up to 16 million cells.
        cell : float [m]
            Side of a cell on the ground.
        heights : (float, float) [m]
            One roof height for each building is drawn uniformly between these.
        seed : int
            Of the heights.

        Raises
        ------
        CityError
            A file that is missing, malformed (with the line) or too large; a grid without free
            space; a value out of its range.
        """
        outlines, roofs, extent = grid_outlines(path, cell, heights, seed)
        return cls(extent, outlines, roofs)

    @classmethod
    def from_geojson(
        cls,
        path: str | PathLike[str],
        *,
        heights: tuple[float, float],
        seed: int = 0,
        frame: str = "auto",
        origin: tuple[float, float] | None = None,
        size: tuple[float, float] | None = None,
        roads: str | PathLike[str] | None = None,
    ) -> "City":
        """A city from the building footprints of a GeoJSON file.

        Polygons and MultiPolygons with courtyards, also in collections. What is wrong is mended
        and counted in `repairs`: rings that cross themselves, are not closed, have no area or
        coordinates that are not finite; outlines under 1 m²; outlines that overlap, of which the
        taller building keeps the ground.

        Parameters
        ----------
        path : path
            At most 256 MB, 500 000 features and 20 million positions.
        heights : (float, float) [m]
            A roof is at the feature's `height` (a number, or a text such as "12 m"), else at 3 m
            for each of its `levels`, `building:levels` or `Floor`, else drawn uniformly between
            these.
        seed : int
            Of the heights that are drawn.
        frame : {"auto", "wgs84", "metres"}
            Of the coordinates: longitude and latitude, or a plane. "auto" decides by their range;
            the city's `origin` says which it was.
        origin : (float, float), optional
            Place of the south-west corner in that frame. Not given: 10 m south and west of all.
        size : (float, float), optional [m]
            Not given: up to 10 m north and east of all. With either, what is outside is cut off.
        roads : path, optional
            Another file, with roads in the same frame: see `RoadNetwork.from_geojson`.

        Raises
        ------
        CityError
            A file that is missing, too large or malformed (with the feature's number); no building
            in it, or a city larger than 100 km; a value out of its range.

        Warns
        -----
        CityWarning
            What was mended, counted.
        """
        found = read_buildings(path, heights, seed, frame, origin, size)
        if found.repairs.mended:
            warnings.warn(f"{path}: mended {found.repairs}", CityWarning, stacklevel=2)
        city = cls(
            found.size, found.outlines, found.roofs, origin=found.origin, repairs=found.repairs
        )
        if roads is not None:
            object.__setattr__(city, "roads", RoadNetwork.from_geojson(roads, city=city))
        return city

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "City":
        """The city that `to_dict` wrote.

        Raises
        ------
        CityError
            Keys or values that `to_dict` does not write.
        """
        outlines, heights, size, origin = dict_parts(data)
        city = cls.from_outlines(outlines, heights, size)
        return city if origin is None else replace(city, origin=origin)

    def to_dict(self) -> dict[str, Any]:
        """A JSON-able copy, exact to the last bit; whole numbers are written as integers.

        Examples
        --------
        >>> City.from_outlines([shapely.box(1, 1, 3, 2)], [4.5], (9.0, 5.0)).to_dict()
        {'size': [9, 5],
         'buildings': [{'height': 4.5, 'outline': [[3, 1], [3, 2], [1, 2], [1, 1]]}]}
        """
        return parts_dict(self.outlines, self.heights, self.size, self.origin)

    def to_geojson(self, path: str | PathLike[str]) -> None:
        """Write the buildings as GeoJSON, each with its `height`.

        Longitude and latitude where the city's origin is known in them, else metres. Read back
        with `from_geojson(path, origin=(origin.x, origin.y), size=size)` it is the same city.

        Parameters
        ----------
        path : path
            Written over where it exists.

        Raises
        ------
        OutputError
            The file cannot be written.
        """
        write_geojson(path, self.outlines, self.heights, self.origin)

    def statistics(self, altitude: float | None = None) -> CityStatistics:
        """How dense and how tall the city is.

        Parameters
        ----------
        altitude : float, optional [m]
            Height of flight above the ground, greater than 0; given, its ratio to the mean roof is
            told, which decides how much buildings hide.

        Raises
        ------
        CityError
            An altitude that is not greater than 0.

        Examples
        --------
        >>> houses = [shapely.box(0, 0, 10, 10), shapely.box(20, 0, 30, 30)]
        >>> figures = City.from_outlines(houses, [10.0, 20.0], (40.0, 40.0)).statistics(57.0)
        >>> figures.density, figures.mean, figures.mean_roof, figures.height_ratio
        (0.25, 15.0, 17.5, 3.257142857142857)
        """
        return city_statistics(self.outlines, self.heights, self.size, altitude)

    @property
    def density(self) -> float:
        """Built share of the rectangle."""
        return math.fsum(outline.area for outline in self.outlines) / (self.size[0] * self.size[1])

    @property
    def tallest(self) -> float:
        """Height of the tallest roof [m]; 0 without buildings."""
        return self.walls.tallest

    def visible(self, observers: ArrayLike, points: ArrayLike) -> Bools:
        """Which points are seen from which observers: free line of sight, at any distance.

        Parameters
        ----------
        observers : (n, 3) array_like [m]
            East, north, height; also outside the city.
        points : (m, 3) array_like [m]

        Returns
        -------
        (n, m) bool array
            False where the open segment between the two meets the inside of a building, or either
            is inside one. Touching a wall, a corner or a roof is visible.

        Raises
        ------
        ValueError
            Wrong shape or a value that is not finite.
        """
        return sight.visible_matrix(
            self.walls, _rows("observers", observers, 3), _rows("points", points, 3)
        )

    def visible_pairs(self, a: ArrayLike, b: ArrayLike) -> Bools:
        """Free line of sight between a[k] and b[k]; as `visible`.

        Parameters
        ----------
        a, b : (n, 3) array_like [m]
            East, north, height.

        Returns
        -------
        (n,) bool array

        Raises
        ------
        ValueError
            Wrong shape, different lengths, or a value that is not finite.

        Examples
        --------
        >>> City.open((9.0, 9.0)).visible_pairs([[1.0, 1.0, 5.0]], [[8.0, 8.0, 0.0]])
        array([ True])
        """
        starts, ends = _rows("a", a, 3), _rows("b", b, 3)
        if len(starts) != len(ends):
            raise ValueError(f"a and b must have one row a pair, got {len(starts)} and {len(ends)}")
        return sight.visible_pairs(self.walls, starts, ends)

    def inside(self, points: ArrayLike) -> Bools:
        """Which points on the ground are inside a building; on a wall is not inside.

        Parameters
        ----------
        points : (n, 2) array_like [m]

        Returns
        -------
        (n,) bool array

        Raises
        ------
        ValueError
            Wrong shape or a value that is not finite.

        Examples
        --------
        >>> city = City.from_outlines([shapely.box(1, 1, 3, 2)], [4.5], (9.0, 5.0))
        >>> city.inside([[2.0, 1.5], [1.0, 1.5], [8.0, 1.5]])
        array([ True, False, False])
        """
        return sight.inside_points(self.walls, _rows("points", points, 2))


def _rows(name: str, values: ArrayLike, columns: int) -> Floats:
    """The argument as a C-contiguous (n, columns) float64 array, or a ValueError that names it."""
    try:
        rows = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be an (n, {columns}) array of numbers: {error}") from error
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise ValueError(f"{name} must have shape (n, {columns}), got {rows.shape}")
    if not np.isfinite(rows).all():
        bad = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise ValueError(f"{name} must be finite, got {rows[bad].tolist()} in row {bad}")
    return rows
