"""What a GeoJSON file holds, read with bounds, and where its coordinates lie in the scenario."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.errors import CityError

__all__ = ["Feature", "Origin", "frame_of", "positions", "read_features"]

Floats = NDArray[np.float64]

MOST_BYTES = 256 * 2**20
MOST_FEATURES = 500_000
MOST_POSITIONS = 20_000_000

_EAST_DEGREE = 111_320.0  # of longitude at the equator [m]
_NORTH_DEGREE = 111_132.0  # of latitude [m]
_GEOMETRIES = frozenset(
    {
        "Point",
        "MultiPoint",
        "LineString",
        "MultiLineString",
        "Polygon",
        "MultiPolygon",
        "GeometryCollection",
    }
)
_MOST_NESTED = 8  # collections in collections


@dataclass(frozen=True)
class Origin:
    """Where the scenario's origin lies in the coordinates of the file that the map came from.

    Attributes
    ----------
    frame : {"wgs84", "metres"}
        Longitude and latitude in degrees, or a plane of east and north metres.
    x, y : float [deg] or [m]
        Longitude and latitude, or east and north, of the scenario's origin.
    """

    frame: Literal["wgs84", "metres"]
    x: float
    y: float

    def to_local(self, points: Floats) -> Floats:
        """East and north of the scenario (n, 2) [m] for places in the file's frame (n, 2).

        For longitude and latitude a plane that touches the ground at the origin:
        x = (lon - lon0) 111320 cos(lat0), y = (lat - lat0) 111132.

        Examples
        --------
        >>> Origin("wgs84", 25.0, 60.0).to_local(np.array([[25.001, 60.001]]))
        array([[ 55.66 , 111.132]])
        """
        local: Floats = (points - (self.x, self.y)) * self._scale()
        return local

    def to_file(self, points: Floats) -> Floats:
        """The inverse of `to_local`."""
        placed: Floats = points / self._scale() + (self.x, self.y)
        return placed

    def moved(self, east: float, north: float) -> "Origin":
        """An origin that lies so many metres further east and north."""
        scale = self._scale()
        return Origin(self.frame, self.x + east / scale[0], self.y + north / scale[1])

    def _scale(self) -> tuple[float, float]:
        """Metres in one unit of the file's two coordinates."""
        if self.frame == "metres":
            return 1.0, 1.0
        return _EAST_DEGREE * math.cos(math.radians(self.y)), _NORTH_DEGREE


class Feature(NamedTuple):
    """One feature of a file."""

    number: int
    """Its place in the file, from 1."""
    geometry: dict[str, Any]
    properties: dict[str, Any]

    def parts(self, kinds: tuple[str, str]) -> Iterator[Any]:
        """Coordinates of each part of one kind, such as ("Polygon", "MultiPolygon").

        Also those in collections; parts of other kinds are passed over.

        Raises
        ------
        CityError
            A geometry that is none; the message starts with what is wrong, not with the file.
        """
        yield from _parts(self.geometry, kinds, 0)


def read_features(path: str | PathLike[str], expected: str) -> list[Feature]:
    """Every feature of a GeoJSON file that has a geometry.

    Parameters
    ----------
    path : path
        A feature collection, a feature or a bare geometry; at most 256 MB and 500 000 features.
    expected : str
        What the file should hold, for messages.

    Raises
    ------
    CityError
        A file that is missing, too large or not GeoJSON.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            raw = stream.read(MOST_BYTES + 1)
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        raise CityError(f"{file}: expected {expected}, found no such file") from None
    except (OSError, ValueError) as error:
        raise CityError(f"{file}: expected {expected}, got: {error}") from None
    if len(raw) > MOST_BYTES:
        raise CityError(f"{file}: expected {expected} of at most {MOST_BYTES:,} bytes, got more")
    try:
        data = json.loads(raw)
    except RecursionError:
        raise CityError(f"{file}: expected {expected}, got JSON nested too deeply") from None
    except ValueError as error:  # also what is not UTF-8
        raise CityError(f"{file}: expected {expected}, got no JSON: {error}") from None
    return list(_features(data, file, expected))


def _features(data: Any, file: Path, expected: str) -> Iterator[Feature]:  # noqa: ANN401
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "FeatureCollection":
        members = data.get("features")
        if not isinstance(members, list):
            raise CityError(f"{file}: expected {expected}, got a collection without features")
    elif kind == "Feature":
        members = [data]
    elif isinstance(kind, str) and kind in _GEOMETRIES:
        members = [{"type": "Feature", "geometry": data}]
    else:
        raise CityError(f"{file}: expected {expected}, got JSON without a GeoJSON type")
    if len(members) > MOST_FEATURES:
        raise CityError(
            f"{file}: expected at most {MOST_FEATURES:,} features, got {len(members):,}"
        )
    for number, member in enumerate(members, start=1):
        if not isinstance(member, dict) or member.get("type") != "Feature":
            raise CityError(f"{file}: feature {number}: expected a GeoJSON feature")
        geometry, properties = member.get("geometry"), member.get("properties")
        if geometry is None:
            continue  # allowed: a feature without a place
        if not isinstance(geometry, dict):
            raise CityError(f"{file}: feature {number}: expected a geometry")
        if properties is not None and not isinstance(properties, dict):
            raise CityError(f"{file}: feature {number}: expected properties as a JSON object")
        yield Feature(number, geometry, properties or {})


def _parts(geometry: Any, kinds: tuple[str, str], depth: int) -> Iterator[Any]:  # noqa: ANN401
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if not isinstance(kind, str) or kind not in _GEOMETRIES:
        raise CityError(f"expected a GeoJSON geometry, got the type {str(kind)[:40]!r}")
    if kind == "GeometryCollection":
        members = geometry.get("geometries")
        if not isinstance(members, list) or depth >= _MOST_NESTED:
            raise CityError("expected a collection of geometries, not nested deeply")
        for member in members:
            yield from _parts(member, kinds, depth + 1)
    elif kind in kinds:
        coordinates = geometry.get("coordinates")
        if not isinstance(coordinates, list):
            raise CityError("expected coordinates as a list")
        if kind == kinds[0]:
            yield coordinates
        else:
            yield from coordinates


def positions(coordinates: Any) -> Floats:  # noqa: ANN401
    """(n, 2) float array of a list of GeoJSON positions; a third coordinate is left out.

    Raises
    ------
    CityError
        Anything but a list of lists of two or more numbers.
    """
    expected = "expected positions as lists of two or more numbers"
    if not isinstance(coordinates, list):
        raise CityError(expected)
    if not coordinates:
        return np.zeros((0, 2))
    try:
        points = np.array(coordinates)
        if points.ndim != 2 or points.shape[1] < 2:
            raise CityError(expected)
    except ValueError:  # some positions have a height, some have none
        try:
            points = np.array([position[:2] for position in coordinates])
        except (TypeError, ValueError):
            raise CityError(expected) from None
    if points.dtype.kind not in "fiu" or points.ndim != 2 or points.shape[1] < 2:
        raise CityError(expected)
    return np.ascontiguousarray(points[:, :2], dtype=np.float64)


def frame_of(points: Floats, frame: str) -> Literal["wgs84", "metres"]:
    """The frame of a file's coordinates (n, 2), all finite.

    "auto" takes them for longitude and latitude when they can be and span less than one degree
    each way: a city in metres is larger than a metre, and one in degrees never spans 100 km.

    Raises
    ------
    CityError
        Another word than "auto", "wgs84" or "metres"; degrees out of range.
    """
    if frame not in ("auto", "wgs84", "metres"):
        raise CityError(f'frame: expected "auto", "wgs84" or "metres", got {frame!r}')
    if frame == "metres" or not len(points):
        return "metres"
    low, high = points.min(axis=0), points.max(axis=0)
    on_earth = min(low[0], -high[0]) >= -180.0 and min(low[1], -high[1]) >= -90.0
    if frame == "wgs84":
        if not on_earth:
            raise CityError(
                f"expected longitude and latitude in degrees, got {low.tolist()} to {high.tolist()}"
            )
        return "wgs84"
    return "wgs84" if on_earth and bool((high - low < 1.0).all()) else "metres"
