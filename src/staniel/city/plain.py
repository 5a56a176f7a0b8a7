"""A city as plain JSON: the exact copy of a record, and GeoJSON for other programs."""

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.features import Origin
from staniel.errors import CityError, OutputError

__all__ = ["dict_parts", "parts_dict", "write_geojson"]

Floats = NDArray[np.float64]


def dict_parts(
    data: Mapping[str, Any],
) -> tuple[list[shapely.Polygon], list[float], tuple[float, float], Origin | None]:
    """Outlines, heights, size and origin of what `parts_dict` wrote; CityError for all else."""
    try:
        buildings = list(data["buildings"])
        outlines = [shapely.Polygon(b["outline"], b.get("holes", [])) for b in buildings]
        heights = [float(b["height"]) for b in buildings]
        size = (float(data["size"][0]), float(data["size"][1]))
        origin = None
        if "origin" in data:
            place = data["origin"]
            origin = Origin(place["frame"], float(place["x"]), float(place["y"]))
            if origin.frame not in ("wgs84", "metres"):
                raise ValueError(f"frame {origin.frame!r}")
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise CityError(
            "city: expected a mapping with 'size' [east, north] and 'buildings', each with "
            f"'height', 'outline' and optional 'holes', got {_shortened(data)} ({error})"
        ) from error
    return outlines, heights, size, origin


def parts_dict(
    outlines: Sequence[shapely.Polygon],
    heights: Floats,
    size: tuple[float, float],
    origin: Origin | None,
) -> dict[str, Any]:
    """A JSON-able copy; see `City.to_dict`."""
    buildings: list[dict[str, Any]] = []
    for outline, height in zip(outlines, heights.tolist(), strict=True):
        building: dict[str, Any] = {"height": _short(height), "outline": _ring(outline.exterior)}
        if outline.interiors:
            building["holes"] = [_ring(hole) for hole in outline.interiors]
        buildings.append(building)
    data: dict[str, Any] = {"size": [_short(size[0]), _short(size[1])], "buildings": buildings}
    if origin is not None:
        data["origin"] = {"frame": origin.frame, "x": origin.x, "y": origin.y}
    return data


def write_geojson(
    path: str | PathLike[str],
    outlines: Sequence[shapely.Polygon],
    heights: Floats,
    origin: Origin | None,
) -> None:
    """Write a feature collection of the buildings; see `City.to_geojson`."""
    place = Origin("metres", 0.0, 0.0) if origin is None else origin
    features = [
        {
            "type": "Feature",
            "properties": {"height": height},
            "geometry": {
                "type": "Polygon",
                "coordinates": [
                    place.to_file(shapely.get_coordinates(ring)).tolist()
                    for ring in (outline.exterior, *outline.interiors)
                ],
            },
        }
        for outline, height in zip(outlines, heights.tolist(), strict=True)
    ]
    text = json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False)
    try:
        Path(path).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"{path}: expected a file that can be written, got: {reason}") from None


def _short(value: float) -> float | int:
    return int(value) if value.is_integer() else value


def _ring(ring: shapely.LinearRing) -> list[list[float | int]]:
    """Corners of a ring; the first is not repeated at the end."""
    return [[_short(x), _short(y)] for x, y in shapely.get_coordinates(ring)[:-1].tolist()]


def _shortened(data: object) -> str:
    try:
        text = json.dumps(data)
    except (TypeError, ValueError):
        text = repr(data)
    return text if len(text) <= 60 else text[:57] + "..."
