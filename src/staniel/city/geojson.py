"""Buildings from GeoJSON: outlines mended where they can be, roofs from what the file says."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.checks import check_height_range, check_seed, check_size, number_pair
from staniel.city.disjoint import LEAST_AREA, made_disjoint, polygon_parts, sound_outlines
from staniel.city.features import MOST_POSITIONS, Feature, Origin, frame_of, positions
from staniel.city.features import read_features as read
from staniel.errors import CityError

__all__ = ["NO_REPAIRS", "Buildings", "CityWarning", "Repairs", "read_buildings"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MARGIN = 10.0
"""Free ground between the outermost walls and the edge of the city, to drive round [m]."""

_STOREY = 3.0  # [m]
_TALLEST = 1000.0  # more is a mistake in the file [m]
_MOST_CROSSED = 2000  # corners of an outline that crosses itself: repair grows with their square
_NUMBER = re.compile(r"\s*(\d{1,6}(?:[.,]\d{1,20})?)\s*(?:m|metres?|meters?)?\s*", re.ASCII)
_STOREYS = ("levels", "building:levels", "Floor")


class CityWarning(UserWarning):
    """A map was mended before it could be used."""


@dataclass(frozen=True)
class Repairs:
    """What was mended in a map, counted."""

    self_intersecting: int = 0
    """Outlines whose rings crossed or met each other or themselves: repaired."""
    unclosed: int = 0
    """Rings that did not end where they began: closed."""
    not_finite: int = 0
    """Outlines with a coordinate that is not finite: left out."""
    empty: int = 0
    """Outlines and courtyards without an area: left out."""
    tiny: int = 0
    """Outlines and courtyards of less than 1 m²: left out."""
    overlapping: int = 0
    """Outlines that lay partly or wholly in another building, at least as tall: cut by it."""
    outside: int = 0
    """Outlines that lay partly or wholly outside a given rectangle: cut by it."""
    bad_heights: int = 0
    """Features with a height or storeys that are no sensible number: the next rule was taken."""
    heights_drawn: int = 0
    """Buildings of which the file tells no height: drawn from the given range. No mistake."""

    @property
    def mended(self) -> int:
        """How many mistakes were found in all."""
        return sum(n for name, n in self._counts() if name != "heights_drawn")

    def __str__(self) -> str:
        counts = [f"{n} {name.replace('_', ' ')}" for name, n in self._counts() if n]
        return ", ".join(counts) or "nothing"

    def _counts(self) -> list[tuple[str, int]]:
        return [(field.name, getattr(self, field.name)) for field in fields(self)]


NO_REPAIRS = Repairs()


class Buildings(NamedTuple):
    """What a file holds, placed and mended."""

    outlines: tuple[shapely.Polygon, ...]
    roofs: Floats
    """(n,) [m]"""
    size: tuple[float, float]
    """East and north extent of the city's rectangle [m]."""
    origin: Origin
    repairs: Repairs


class _Rings(NamedTuple):
    """All rings of all outlines as they stand in the file, without their closing points."""

    points: Floats
    """(p, 2) corners of all rings in turn, in the file's frame."""
    counts: list[int]
    """Corners of each ring."""
    parts: list[int]
    """Of each ring its outline; the first ring of an outline is its shell."""
    features: list[int]
    """Of each outline the number of its feature."""


def read_buildings(
    path: str | PathLike[str],
    heights: tuple[float, float],
    seed: int,
    frame: str,
    origin: tuple[float, float] | None,
    size: tuple[float, float] | None,
) -> Buildings:
    """Outlines, roofs, rectangle, origin and repairs of a file; see `City.from_geojson`."""
    low, high = check_height_range(heights)
    rng = np.random.default_rng(check_seed(seed))
    count: dict[str, int] = {field.name: 0 for field in fields(Repairs)}
    features = read(path, "GeoJSON with buildings as Polygons")
    # One draw for each feature, used or not: a height more in the file changes no other one.
    drawn = rng.uniform(low, high, features[-1].number if features else 0)
    rings = _rings(features, path, count)
    try:
        place, extent = _placed(rings.points, frame, origin, size)
        outlines, part = _outlines(rings, place, count)
    except CityError as error:
        raise CityError(f"{path}: {error}") from None
    feature = np.asarray(rings.features, dtype=np.int64)[part]
    told = _told_heights(features, set(feature.tolist()), count)
    roofs = np.array([told.get(k, drawn[k - 1]) for k in feature.tolist()])
    if origin is not None or size is not None:
        outlines, kept = _within(outlines, extent, count)
        feature, roofs = feature[kept], roofs[kept]
    try:
        outlines, kept, count["overlapping"] = made_disjoint(outlines, roofs)
    except CityError as error:
        raise CityError(f"{path}: {error}") from None
    sound, source, opened = sound_outlines(outlines)
    kept = kept[source]
    count["self_intersecting"] += opened
    if not sound:
        raise CityError(
            f"{path}: expected buildings of at least {LEAST_AREA:g} m2, got none, with the "
            f"coordinates taken as {place.frame} and {Repairs(**count)}"
        )
    count["heights_drawn"] = sum(k not in told for k in feature[kept].tolist())
    return Buildings(tuple(sound), roofs[kept], extent, place, Repairs(**count))


def _rings(features: Sequence[Feature], path: str | PathLike[str], count: dict[str, int]) -> _Rings:
    """Every ring that has an area, and its outline's feature."""
    points: list[Floats] = []
    counts: list[int] = []
    parts: list[int] = []
    owners: list[int] = []
    n_points, polygons = 0, 0
    for feature in features:
        try:
            for polygon in feature.parts(("Polygon", "MultiPolygon")):
                polygons += 1
                if not isinstance(polygon, list):
                    raise CityError("expected a polygon as a list of rings")
                rings = [positions(ring) for ring in polygon]
                n_points += sum(map(len, rings))
                if n_points > MOST_POSITIONS:
                    raise CityError(f"expected at most {MOST_POSITIONS:,} positions in a file")
                rings = _whole(rings, count)
                if rings:
                    points += rings
                    counts += map(len, rings)
                    parts += [len(owners)] * len(rings)
                    owners.append(feature.number)
        except CityError as error:
            raise CityError(f"{path}: feature {feature.number}: {error}") from None
    if not polygons:
        found = sorted({str(feature.geometry.get("type")) for feature in features})
        raise CityError(
            f"{path}: expected buildings as Polygons, got {', '.join(found) or 'no features'}"
        )
    return _Rings(np.concatenate(points or [np.zeros((0, 2))]), counts, parts, owners)


def _whole(rings: list[Floats], count: dict[str, int]) -> list[Floats]:
    """The rings of one outline without their closing points; none, if its shell is none."""
    if not all(np.isfinite(ring).all() for ring in rings):
        count["not_finite"] += 1
        return []
    whole: list[Floats] = []
    for k, ring in enumerate(rings):
        closed = len(ring) > 1 and bool((ring[0] == ring[-1]).all())
        corners = ring[:-1] if closed else ring
        if len(corners) < 3:
            count["empty"] += 1
            if k == 0:
                return []
            continue
        count["unclosed"] += not closed
        whole.append(corners)
    if not rings:
        count["empty"] += 1
    return whole


def _placed(
    points: Floats,
    frame: str,
    origin: tuple[float, float] | None,
    size: tuple[float, float] | None,
) -> tuple[Origin, tuple[float, float]]:
    """Where the city's south-west corner lies in the file's frame, and the city's extent."""
    found = frame_of(points, frame)
    low, high = np.zeros(2), np.zeros(2)
    if len(points):
        low, high = points.min(axis=0), points.max(axis=0)
    if origin is None:
        place = Origin(found, float(low[0]), float(low[1])).moved(-MARGIN, -MARGIN)
    else:
        place = Origin(found, *number_pair("origin", origin, f"two numbers in {found}"))
    if size is not None:
        return place, check_size(size)
    east, north = (place.to_local(high[None])[0] + MARGIN).tolist()
    return place, check_size((east, north))


def _outlines(
    rings: _Rings, place: Origin, count: dict[str, int]
) -> tuple[NDArray[np.object_], Ints]:
    """Valid polygons of at least the least area [m], and of each the part that it came from."""
    if not rings.parts:
        return np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    ring = np.repeat(np.arange(len(rings.counts)), rings.counts)
    linear = np.asarray(shapely.linearrings(place.to_local(rings.points), indices=ring))
    polygons = np.asarray(shapely.polygons(linear, indices=np.asarray(rings.parts)))
    crossed = np.flatnonzero(~shapely.is_valid(polygons))
    corners = shapely.get_num_coordinates(polygons[crossed])
    if corners.max(initial=0) > _MOST_CROSSED:
        number = rings.features[int(crossed[corners.argmax()])]
        raise CityError(
            f"feature {number}: expected an outline that does not cross itself, or has at most "
            f"{_MOST_CROSSED:,} corners, got one with {corners.max():,}"
        )
    mended = shapely.make_valid(polygons[crossed], method="structure", keep_collapsed=False)
    lost = int(shapely.is_empty(mended).sum())
    count["empty"] += lost
    count["self_intersecting"] += len(crossed) - lost
    polygons[crossed] = mended
    parts, part = polygon_parts(polygons)
    large = shapely.area(parts) >= LEAST_AREA
    count["tiny"] += int((~large).sum())
    parts, part = parts[large], part[large]
    for k in np.flatnonzero(shapely.get_num_interior_rings(parts)).tolist():
        holes = [hole for hole in parts[k].interiors if shapely.Polygon(hole).area >= LEAST_AREA]
        if len(holes) < len(parts[k].interiors):
            count["tiny"] += len(parts[k].interiors) - len(holes)
            parts[k] = shapely.Polygon(parts[k].exterior, holes)
    return parts, part


def _within(
    outlines: NDArray[np.object_], size: tuple[float, float], count: dict[str, int]
) -> tuple[NDArray[np.object_], Ints]:
    """What of the outlines lies in the rectangle, and from which one each piece came."""
    bounds = shapely.bounds(outlines)
    out = np.flatnonzero((bounds[:, :2] < 0.0).any(axis=1) | (bounds[:, 2:] > size).any(axis=1))
    count["outside"] += len(out)
    cut = shapely.intersection(outlines[out], shapely.box(0.0, 0.0, *size))
    # The cut's corners are computed and may stick out by rounding.
    outlines[out] = shapely.transform(cut, lambda points: np.clip(points, 0.0, size))
    pieces, source = polygon_parts(outlines)
    large = (shapely.area(pieces) >= LEAST_AREA) & shapely.is_valid(pieces)
    return pieces[large], source[large]


def _told_heights(
    features: Sequence[Feature], used: set[int], count: dict[str, int]
) -> dict[int, float]:
    """Roof heights that the file tells, by number of feature [m]."""
    told: dict[int, float] = {}
    for feature in features:
        if feature.number not in used:
            continue
        properties = feature.properties
        height, wrong = _number(properties.get("height"), _TALLEST)
        for key in _STOREYS:
            if height is None:
                storeys, bad = _number(properties.get(key), _TALLEST / _STOREY)
                height = None if storeys is None else storeys * _STOREY
                wrong = wrong or bad
        count["bad_heights"] += wrong
        if height is not None:
            told[feature.number] = height
    return told


def _number(value: Any, largest: float) -> tuple[float | None, bool]:  # noqa: ANN401
    """The number in (0, largest] that a property tells, if any, and whether it tells nonsense."""
    if value is None or (isinstance(value, str) and not value.strip()):
        return None, False
    if isinstance(value, str):
        match = _NUMBER.fullmatch(value[:40])
        value = float(match[1].replace(",", ".")) if match and len(value) <= 40 else None
    good = isinstance(value, int | float) and not isinstance(value, bool) and 0 < value <= largest
    return (float(value), False) if good else (None, True)
