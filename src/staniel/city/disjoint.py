"""Outlines that overlap or meet themselves, cut until a city can hold them."""

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.checks import straightened
from staniel.errors import CityError

__all__ = ["LEAST_AREA", "made_disjoint", "polygon_parts", "sound_outlines"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Outlines = NDArray[np.object_]

LEAST_AREA = 1.0
"""What is smaller is no building [m²]."""

_ROUNDING = 5e-7  # neighbours may share so much by rounding; `check_outlines` allows more [m^2]
# Corners of cut outlines lie on a grid so fine, and exact in binary: without one, overlays of
# outlines that all but touch themselves can go wrong by any amount.
_GRID = 2.0**-30  # [m]
_MOST_PAIRS = 5_000_000
_ROUNDS = 3
_OPENING = 1e-3  # taken off an outline that touches itself, to part it there [m]
_AT_ONCE = 64  # outlines looked up together: bounds the memory, however many lie in one place


def polygon_parts(geometries: Outlines) -> tuple[Outlines, Ints]:
    """The polygons in each geometry, and from which one each came; lines and points are dropped."""
    parts, source = shapely.get_parts(geometries, return_index=True)
    inner, outer = shapely.get_parts(parts, return_index=True)  # of what was a collection
    polygons = (shapely.get_type_id(inner) == shapely.GeometryType.POLYGON) & ~shapely.is_empty(
        inner
    )
    return np.asarray(inner)[polygons], np.asarray(source[outer][polygons], dtype=np.int64)


def made_disjoint(outlines: Outlines, roofs: Floats) -> tuple[Outlines, Ints, int]:
    """The same bodies without a place in two of them.

    Where two outlines overlap the taller building keeps the ground, of equals the earlier one: the
    bodies together stay what they were.

    Parameters
    ----------
    outlines : (n,) array of shapely.Polygon [m]
        Valid.
    roofs : (n,) float array [m]

    Returns
    -------
    pieces : (k,) array of shapely.Polygon
        In the order of the outlines; a cut one may be none or several. Of what was cut, pieces
        smaller than `LEAST_AREA` are dropped.
    source : (k,) int array
        Which outline each is of.
    cut : int
        How many outlines were cut.

    Raises
    ------
    CityError
        Too many outlines in one place.
    """
    order = np.argsort(-roofs, kind="stable")
    bodies = outlines[order].copy()
    touched: set[int] = set()
    # A cut wall's corners are rounded: what that leaves in common is cut again.
    for _ in range(_ROUNDS):
        pairs = _overlapping(bodies)
        for second, first in pairs:
            bodies[second] = _large_parts(
                shapely.difference(bodies[second], bodies[first], grid_size=_GRID)
            )
            touched.add(second)
        if not pairs:
            break
    back = np.empty_like(bodies)
    back[order] = bodies
    pieces, source = polygon_parts(back)
    return pieces, source, len(touched)


def sound_outlines(outlines: Outlines) -> tuple[list[shapely.Polygon], Ints, int]:
    """Outlines as a city holds them: straightened, and valid after that, too.

    Where a ring touches itself, or a courtyard is thinner than a hair, dropping a corner on a
    straight wall may let it cross itself by rounding: such an outline is drawn in by a millimetre.

    Parameters
    ----------
    outlines : (n,) array of shapely.Polygon [m]
        Valid.

    Returns
    -------
    sound : list of k shapely.Polygon
    source : (k,) int array
        Which outline each is of.
    opened : int
        How many outlines had to be drawn in.
    """
    sound: list[shapely.Polygon] = []
    source: list[int] = []
    opened = 0
    for k, outline in enumerate(outlines.tolist()):
        whole = _straight(outline)
        pieces = [whole]
        if whole is None:
            opened += 1
            inner = np.array([outline.buffer(-_OPENING, join_style="mitre")], dtype=object)
            pieces = [_straight(piece) for piece in polygon_parts(inner)[0]]
        good = [piece for piece in pieces if piece is not None and piece.area >= LEAST_AREA]
        sound += good
        source += [k] * len(good)
    return sound, np.asarray(source, dtype=np.int64), opened


def _straight(outline: shapely.Polygon) -> shapely.Polygon | None:
    try:
        straight = straightened([outline])[0]
    except ValueError:  # of a courtyard that is all but a line, no three corners are left
        return None
    return straight if straight.is_valid else None


def _overlapping(bodies: Outlines) -> list[tuple[int, int]]:
    """(later, earlier) of all pairs with an area in common, the later ones in order."""
    tree = shapely.STRtree(bodies)
    found: list[tuple[int, int]] = []
    n_pairs = 0
    for start in range(0, len(bodies), _AT_ONCE):
        later, earlier = tree.query(bodies[start : start + _AT_ONCE])
        later += start
        ahead = earlier < later
        later, earlier = later[ahead], earlier[ahead]
        n_pairs += len(later)
        if n_pairs > _MOST_PAIRS:
            raise CityError(
                f"expected buildings that mostly lie apart, got {_MOST_PAIRS:,} overlaps"
            )
        common = shapely.intersection(bodies[later], bodies[earlier], grid_size=_GRID)
        shared = shapely.area(common) > _ROUNDING
        found += zip(later[shared].tolist(), earlier[shared].tolist(), strict=True)
    return sorted(found)


def _large_parts(geometry: shapely.Geometry) -> shapely.Geometry:
    parts = polygon_parts(np.array([geometry], dtype=object))[0]
    return shapely.MultiPolygon(parts[shapely.area(parts) >= LEAST_AREA].tolist())
