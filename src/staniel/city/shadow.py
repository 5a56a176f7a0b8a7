"""The ground that an aircraft really sees: its footprint without the buildings' shadows."""

import math
from collections.abc import Iterable

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from staniel.city.city import City
from staniel.city.coverage import footprint
from staniel.datatypes.belief import Pose

__all__ = ["shadows", "visible_ground", "visible_share"]

Floats = NDArray[np.float64]

_ROUNDING = 1e-6
"""A smaller patch is what rounding leaves between two shadows with a common edge [m²]."""

_GRID = 1e-8
"""Areas are joined on a grid of this size [m]. Without one, GEOS now and then loses whole areas
where many nearly meet, without a word; with one it snaps what is nearer than that, and is safe."""

_LONGEST = 1e7
"""A shadow is drawn out to at most this many times the distance of its wall."""


def visible_ground(
    city: City,
    pose: Pose,
    half_aperture: float,
    range_: float,
    height: float = 0.0,
    *,
    axis: ArrayLike | None = None,
    points: int = 64,
) -> shapely.MultiPolygon:
    """The part of a camera's footprint from which the camera is in free line of sight.

    Parameters
    ----------
    city : City
    pose : Pose
        Of the camera.
    half_aperture : float [rad]
        In (0, pi/2).
    range_ : float [m]
        Greatest slant range, greater than 0.
    height : float [m]
        Of the level on which it is wanted, such as that at which vehicles are seen. Buildings that
        do not rise above it hide nothing there.
    axis : (3,) array_like, optional
        Direction in which the camera looks; that of a camera fixed in the belly if not given.
    points : int
        Corners of the footprint before the shadows are cut out, at least 3.

    Returns
    -------
    shapely.MultiPolygon [m]
        Empty where nothing is seen, as from inside a building. Not cut at the city's edge.

    Raises
    ------
    ValueError
        A value out of its range, or not finite.

    Examples
    --------
    Above a street of 20 m between two rows of houses of half the flight height.

    >>> walls = [shapely.box(0, 0, 40, 100), shapely.box(60, 0, 100, 100)]
    >>> city = City.from_outlines(walls, [25.0, 25.0], (100.0, 100.0))
    >>> seen = visible_ground(city, Pose(50.0, 50.0, 50.0, 0.0, 0.0, 15.0), 0.5, 90.0)
    >>> [round(side, 6) for side in seen.bounds[::2]]
    [40.0, 60.0]
    """
    corners = footprint(pose, half_aperture, range_, height=height, axis=axis, points=points)
    if len(corners.polygon) == 0:
        return shapely.MultiPolygon()
    eye = np.array(pose[:3], dtype=np.float64)
    if not city.visible(eye[None], eye[None])[0, 0]:
        return shapely.MultiPolygon()
    covered = shapely.Polygon(corners.polygon)
    # Within the footprint's box no number is so large that the grid would be finer than its digits.
    cast = shapely.intersection(shadows(city, eye, covered, height), shapely.box(*covered.bounds))
    cast = shapely.get_parts(cast)
    # What only touches the box is a point or a line there, and hides nothing.
    dark = shapely.union_all(cast[shapely.get_dimensions(cast) == 2], grid_size=_GRID)
    lit = shapely.get_parts(shapely.difference(covered, dark))
    return shapely.MultiPolygon(lit[shapely.area(lit) > _ROUNDING].tolist())


def visible_share(city: City, grounds: Iterable[BaseGeometry]) -> float:
    """Share of the city's open ground that at least one of some areas covers.

    Parameters
    ----------
    city : City
    grounds : iterable of shapely.Polygon or shapely.MultiPolygon
        As `visible_ground` gives them, for height 0.

    Returns
    -------
    float
        In [0, 1]; 0 in a city without open ground.

    Examples
    --------
    >>> city = City.from_outlines([shapely.box(0, 0, 50, 100)], [9.0], (100.0, 100.0))
    >>> visible_share(city, [shapely.box(50, 0, 75, 100), shapely.box(60, 0, 75, 300)])
    0.5
    """
    open_ground = (1.0 - city.density) * city.size[0] * city.size[1]
    joined = shapely.union_all(list(grounds), grid_size=_GRID)
    seen = joined.intersection(shapely.box(0.0, 0.0, *city.size))
    return min(seen.area / open_ground, 1.0) if open_ground > 0.0 else 0.0


def shadows(city: City, eye: Floats, area: shapely.Polygon, height: float) -> NDArray[np.object_]:
    r"""Polygons whose union, within an area, is what buildings hide of a level from an eye.

    Parameters
    ----------
    city : City
    eye : (3,) float array [m]
        East, north, height; above `height` and not inside a building.
    area : shapely.Polygon
        Only shadows that reach it are needed.
    height : float [m]
        Of the level.

    Returns
    -------
    (k,) object array of shapely.Polygon
        They overlap.

    Notes
    -----
    From the eye o at z, a point of the level is hidden by a building with roof H and outline P if
    and only if it is in :math:`o + s (P - o)` for some s in [1, S), with
    :math:`S = (z - h)/(z - H)`, or any s where the roof is not below the eye. The union of these is
    P and, behind each wall that faces away from the eye, the quadrilateral between the wall and its
    S-fold: on the way from a hidden point to the eye the first wall met faces away from the eye.
    The walls around a courtyard are no different, and leave its lit part open.
    """
    flat = eye[:2]
    tall = np.flatnonzero(city.heights > height)
    outlines = np.array(city.outlines, dtype=object)[tall]
    between = shapely.union(area, shapely.Point(flat)).convex_hull
    west, south, east, north = between.bounds
    box = shapely.bounds(outlines)
    near = (box[:, 0] < east) & (box[:, 2] > west) & (box[:, 1] < north) & (box[:, 3] > south)
    near[near] = shapely.intersects(outlines[near], between)
    outlines, roofs = outlines[near], city.heights[tall[near]]
    reach = float(np.hypot(*(shapely.get_coordinates(area) - flat).T).max())
    drop = eye[2] - roofs
    stretch = np.full(len(roofs), math.inf)
    stretch[drop > 0.0] = (eye[2] - height) / drop[drop > 0.0]
    return np.append(outlines, _behind(outlines, stretch, flat, reach))


def _behind(
    outlines: NDArray[np.object_], stretch: Floats, flat: Floats, reach: float
) -> NDArray[np.object_]:
    """The quadrilateral behind each wall that faces away from an eye at `flat`."""
    rings, owner = shapely.get_rings(shapely.orient_polygons(outlines), return_index=True)
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    first = np.flatnonzero(ring[1:] == ring[:-1])
    a, b = corners[first] - flat, corners[first + 1] - flat
    # Buildings are on the left of their walls.
    away = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0.0
    first, a, b = first[away], a[away], b[away]
    # Beyond the reach a shadow's end does not matter, and infinity cannot be drawn.
    way = shapely.distance(shapely.linestrings(np.stack([a, b], axis=1)), shapely.Point(0.0, 0.0))
    limit = np.clip(reach / np.maximum(way, reach / _LONGEST), 1.0, None)
    scale = np.minimum(stretch[owner[ring[first]]], limit)[:, None]
    # The near ends keep the outline's own numbers: between a wall and its shadow is no slit.
    quads = [corners[first], corners[first + 1], flat + scale * b, flat + scale * a]
    return np.asarray(shapely.polygons(np.stack(quads, axis=1)))
