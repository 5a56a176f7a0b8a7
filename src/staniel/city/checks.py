"""What a city must hold: checks at its doors, and outlines in one canonical form."""

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from staniel.errors import CityError

__all__ = [
    "check_cell",
    "check_height_range",
    "check_heights",
    "check_outlines",
    "check_seed",
    "check_size",
    "number_pair",
    "straightened",
]

Floats = NDArray[np.float64]

_LARGEST = 100_000.0  # beyond, a float no longer tells nanometres apart [m]
_OVERLAP = 1e-6  # two walls that were computed to coincide may overlap by rounding [m^2]
_STRAIGHT = 1e-9  # a corner this near to the line through its neighbours is none [m]


def number_pair(name: str, values: Any, expected: str) -> tuple[float, float]:  # noqa: ANN401
    """Two finite numbers, or a CityError that says what was expected."""
    pair = tuple(values) if isinstance(values, Sequence | np.ndarray) else ()
    if len(pair) != 2 or not all(
        isinstance(v, Real) and not isinstance(v, bool) and math.isfinite(v) for v in pair
    ):
        raise CityError(f"{name}: expected {expected}, got {values!r}")
    return float(pair[0]), float(pair[1])


def check_size(size: Any) -> tuple[float, float]:  # noqa: ANN401
    """East and north extent, both greater than 0 and at most 100 km [m]."""
    expected = f"two numbers greater than 0 and at most {_LARGEST:g} (metres east, metres north)"
    pair = number_pair("size", size, expected)
    if min(pair) <= 0.0 or max(pair) > _LARGEST:
        raise CityError(f"size: expected {expected}, got {size!r}")
    return pair


def check_height_range(heights: Any) -> tuple[float, float]:  # noqa: ANN401
    """Lowest and tallest roof, 0 < low <= high [m]."""
    expected = "two numbers 0 < lowest <= tallest roof (metres)"
    low, high = number_pair("heights", heights, expected)
    if not 0.0 < low <= high:
        raise CityError(f"heights: expected {expected}, got {heights!r}")
    return low, high


def check_cell(cell: Any) -> float:  # noqa: ANN401
    """Side of a pixel or grid cell, greater than 0 [m]."""
    if not isinstance(cell, Real) or isinstance(cell, bool) or not 0.0 < float(cell) < math.inf:
        raise CityError(f"cell: expected a number of metres greater than 0, got {cell!r}")
    return float(cell)


def check_seed(seed: Any) -> int:  # noqa: ANN401
    """A seed of numpy's generators: an integer that is not negative."""
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise CityError(f"seed: expected an integer of at least 0, got {seed!r}")
    return int(seed)


def check_heights(heights: ArrayLike, n: int) -> Floats:
    """(n,) roof heights, all finite and greater than 0 [m]."""
    try:
        roofs = np.array(heights, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CityError(f"heights: expected {n} numbers, got {heights!r}") from error
    if roofs.shape != (n,):
        raise CityError(
            f"heights: expected one for each of the {n} outlines, got shape {roofs.shape}"
        )
    bad = np.flatnonzero(~(np.isfinite(roofs) & (roofs > 0.0)))
    if bad.size:
        raise CityError(
            f"heights[{bad[0]}]: expected metres greater than 0, got {float(roofs[bad[0]])!r}"
        )
    return roofs


def check_outlines(
    outlines: Sequence[shapely.Polygon], size: tuple[float, float]
) -> list[shapely.Polygon]:
    """Valid polygons in the rectangle whose interiors are disjoint."""
    polygons = list(outlines)
    for k, outline in enumerate(polygons):
        if not isinstance(outline, shapely.Polygon):
            raise CityError(
                f"outlines[{k}]: expected a shapely Polygon, got {type(outline).__name__}"
            )
        if outline.is_empty:
            raise CityError(f"outlines[{k}]: expected a polygon with an area, got an empty one")
        if not outline.is_valid:
            reason = shapely.is_valid_reason(outline)
            raise CityError(f"outlines[{k}]: expected a valid polygon, got {reason}")
        west, south, east, north = outline.bounds
        if west < 0.0 or south < 0.0 or east > size[0] or north > size[1]:
            raise CityError(
                f"outlines[{k}]: expected to lie in the city's rectangle 0..{size[0]:g} x "
                f"0..{size[1]:g} m, got {west:g}..{east:g} x {south:g}..{north:g}"
            )
    _check_disjoint(polygons)
    return polygons


def _check_disjoint(polygons: list[shapely.Polygon]) -> None:
    array = np.array(polygons, dtype=object)
    first, second = shapely.STRtree(array).query(array, predicate="intersects")
    ahead = first < second
    first, second = first[ahead], second[ahead]
    meet = shapely.relate_pattern(array[first], array[second], "T********")
    for i, j in zip(first[meet].tolist(), second[meet].tolist(), strict=True):
        area = polygons[i].intersection(polygons[j]).area
        if area > _OVERLAP:
            raise CityError(
                f"outlines[{i}] and outlines[{j}]: expected buildings that do not overlap, "
                f"got {area:g} m2 in common"
            )


def straightened(polygons: Sequence[shapely.Polygon]) -> tuple[shapely.Polygon, ...]:
    """The same outlines with counter-clockwise shells and no corner on a straight wall."""
    return tuple(
        shapely.geometry.polygon.orient(
            shapely.Polygon(
                _corners(outline.exterior), [_corners(hole) for hole in outline.interiors]
            )
        )
        for outline in polygons
    )


def _corners(ring: shapely.LinearRing) -> Floats:
    """(n, 2) corners of a ring where it really turns."""
    points = shapely.get_coordinates(ring)[:-1]
    points = points[np.any(points != np.roll(points, 1, axis=0), axis=1)]
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    chord = after - before
    arm = points - before
    off = np.abs(chord[:, 0] * arm[:, 1] - chord[:, 1] * arm[:, 0])
    turns = off > _STRAIGHT * np.hypot(chord[:, 0], chord[:, 1])
    corners = points[turns]
    if turns.all() or (len(corners) >= 3 and _near(points[~turns], corners)):
        return corners
    # Two corners within rounding of each other hide each other: drop one after another.
    kept = shapely.get_coordinates(ring.simplify(_STRAIGHT, preserve_topology=False))[:-1]
    return kept if len(kept) >= 3 else points


def _near(points: Floats, corners: Floats) -> bool:
    """Whether points that were dropped lie on the ring that is left."""
    far = shapely.distance(shapely.points(points), shapely.LinearRing(corners))
    return bool((far <= 4.0 * _STRAIGHT).all())
