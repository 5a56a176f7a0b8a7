"""One frame of the movie: the map, drawn at twice its size and reduced to smooth every edge."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from staniel.city.coverage import footprint
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Camera
from staniel.errors import RecordError
from staniel.kernels.footprint import camera_axes
from staniel.pictures import style
from staniel.pictures.page import MAP_SIDE, SMOOTH, draw_clock, draw_page, draw_triangle
from staniel.record import Record

__all__ = ["Canvas"]

Floats = NDArray[np.float64]
Points = list[tuple[float, float]]

_TRAIL: Final = 40.0
"""How long a trail lasts [s]."""

_DEVIATIONS: Final = 2.0
"""Half axes of an estimate's ellipse, in standard deviations."""

_SMALLEST: Final = 6.5
"""Half axis that an ellipse has at least [pixel]: a sure estimate still rings its vehicle."""

_CIRCLE: Final = np.array([(math.cos(a), math.sin(a)) for a in np.linspace(0.0, math.tau, 33)[:-1]])


class Canvas:
    """Draws single frames of a record; what does not move is drawn once.

    Parameters
    ----------
    record : Record
    """

    def __init__(self, record: Record) -> None:
        self._record = record
        east, north = record.city.size
        self._scale = MAP_SIDE * SMOOTH / max(east, north)
        shown = (max(1, round(east * self._scale)), max(1, round(north * self._scale)))
        self._north = shown[1]
        self._cameras = _cameras(record)
        self._paths = _paths(record)
        self._rows = {
            name: _by_tick(getattr(record, name), record.times)
            for name in ("tracks", "decisions", "sightings")
        }
        self._city = self._draw_city(shown)
        map_size = (-(-shown[0] // SMOOTH), -(-shown[1] // SMOOTH))
        self._page, self._corner = draw_page(record, map_size)

    def draw(self, tick: int) -> Image.Image:
        """Draw the frame at one decision instant.

        Parameters
        ----------
        tick : int
            Row of `record.times`.

        Returns
        -------
        Image
            RGB, the same size for every tick.
        """
        city = self._city.copy()
        draw = ImageDraw.Draw(city, "RGBA")
        self._draw_footprints(draw, tick)
        self._draw_trails(draw, tick)
        self._draw_detections(draw, tick)
        self._draw_tracks(draw, tick)
        self._draw_vehicles(draw, tick)
        self._draw_aircraft(draw, tick)
        draw.rectangle((0, 0, city.width - 1, city.height - 1), outline=style.EDGE, width=SMOOTH)
        page = self._page.copy()
        page.paste(city.reduce(SMOOTH), self._corner)
        draw_clock(page, self._corner[0] + city.width // SMOOTH, float(self._record.times[tick]))
        return page

    def _pixels(self, points: Floats) -> Points:
        """Places on the large map of (n, 2) points, east and north [m]."""
        x = points[:, 0] * self._scale
        y = self._north - points[:, 1] * self._scale
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def _draw_city(self, size: tuple[int, int]) -> Image.Image:
        picture = Image.new("RGB", size, style.GROUND)
        draw = ImageDraw.Draw(picture)
        city = self._record.city
        low, high = np.array(style.ROOF_LOW), np.array(style.ROOF_HIGH)
        for outline, shade in zip(city.outlines, style.roof_shade(city.heights), strict=True):
            red, green, blue = np.rint(low + shade * (high - low)).astype(int).tolist()
            rings = [self._pixels(shapely.get_coordinates(outline.exterior))]
            rings += [self._pixels(shapely.get_coordinates(hole)) for hole in outline.interiors]
            for ring, fill in zip(
                rings, [(red, green, blue)] + [style.GROUND] * (len(rings) - 1), strict=True
            ):
                draw.polygon(ring, fill=fill, outline=style.EDGE)
        return picture

    def _draw_footprints(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        cameras = self._cameras
        if cameras is None:
            return
        poses = np.ascontiguousarray(self._record.aircraft[tick])
        looks = self._record.looks(self._record.times[tick : tick + 1])[0]
        for identity, (pose, camera) in enumerate(zip(poses.tolist(), cameras, strict=True)):
            own = slice(identity, identity + 1)
            (axis,) = camera_axes(poses[own], looks[own], camera.mounting)
            if np.isnan(axis[0]):
                continue
            seen = footprint(Pose(*pose), camera.half_aperture, camera.range, axis=axis)
            corners = seen.polygon
            if len(corners) >= 3:
                color = style.of_aircraft(identity)
                points = self._pixels(corners)
                draw.polygon(points, fill=(*color, 34))
                draw.line([*points, points[0]], fill=(*color, 150), width=SMOOTH)

    def _draw_trails(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        times, aircraft, vehicles = self._paths
        now = float(self._record.times[tick])
        first, middle, last = np.searchsorted(
            times, [now - _TRAIL, now - 0.4 * _TRAIL, now + 1e-6]
        ).tolist()
        for paths, color_of, width in (
            (vehicles, lambda _: style.VEHICLE, 2),
            (aircraft, style.of_aircraft, 2),
        ):
            for k in range(paths.shape[1]):
                old = self._pixels(paths[first : middle + 1, k, :2])
                new = self._pixels(paths[middle:last, k, :2])
                if len(old) > 1:
                    draw.line(old, fill=(*color_of(k), 110), width=width)
                if len(new) > 1:
                    draw.line(new, fill=color_of(k), width=width * 3 // 2 + 1)

    def _draw_detections(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        seen = self._rows["sightings"][tick]
        places = self._pixels(np.stack([seen["x"], seen["y"]], axis=1))
        for (x, y), reporter in zip(places, seen["reporter"].tolist(), strict=True):
            draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=style.of_aircraft(reporter))

    def _draw_vehicles(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        half = 3 * SMOOTH
        for x, y in self._pixels(self._record.vehicles[tick, :, :2]):
            box = (x - half, y - half, x + half, y + half)
            draw.rectangle(box, fill=style.VEHICLE, outline=style.PAPER, width=SMOOTH)

    def _draw_tracks(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        """Draw each track once: as its pursuer believes it, or else the first who holds it."""
        decisions = self._rows["decisions"][tick]
        pursuers = dict(zip(decisions["target"].tolist(), decisions["agent"].tolist(), strict=True))
        drawn: dict[str, np.void] = {}
        for row in self._rows["tracks"][tick]:
            identity = str(row["id"])
            if identity not in drawn or pursuers.get(identity) == row["agent"]:
                drawn[identity] = row
        for row in drawn.values():
            points = self._pixels(_ellipse(row, _SMALLEST * SMOOTH / self._scale))
            draw.line([*points, points[0]], fill=style.TRACK, width=2 * SMOOTH - 1)
            ((x, y),) = self._pixels(np.array([[row["x"], row["y"]]]))
            arm = 3 * SMOOTH
            draw.line((x - arm, y, x + arm, y), fill=style.TRACK, width=SMOOTH)
            draw.line((x, y - arm, x, y + arm), fill=style.TRACK, width=SMOOTH)

    def _draw_aircraft(self, draw: ImageDraw.ImageDraw, tick: int) -> None:
        poses = self._record.aircraft[tick]
        for identity, place in enumerate(self._pixels(poses[:, :2])):
            draw_triangle(draw, place, float(poses[identity, 3]), style.of_aircraft(identity))


def _cameras(record: Record) -> tuple[Camera, ...] | None:
    """Each aircraft's camera; None where the scenario does not say its cone and range."""
    camera = record.scenario.get("camera")
    if not isinstance(camera, Mapping) or not {"half_aperture_deg", "range"} <= camera.keys():
        return None
    try:
        return record.cameras
    except RecordError:
        return None


def _paths(record: Record) -> tuple[Floats, Floats, Floats]:
    """Times, aircraft and vehicles, as finely as they were recorded."""
    if len(record.fine_times):
        return record.fine_times, record.fine_aircraft, record.fine_vehicles
    return record.times, record.aircraft, record.vehicles


def _by_tick(table: NDArray[np.void], times: Floats) -> list[NDArray[np.void]]:
    """Rows of each decision step, by their time: from after the step before up to this one."""
    rows = table[np.argsort(table["time"], kind="stable")]
    ends = np.searchsorted(rows["time"], times + 1e-6)
    return np.split(rows, ends)[: len(times)]


def _ellipse(row: np.void, smallest: float) -> Floats:
    """Corners of a track's ellipse of uncertainty [m]; no half axis is below `smallest`."""
    covariance = np.array([[row["cxx"], row["cxy"]], [row["cxy"], row["cyy"]]])
    values, vectors = np.linalg.eigh(covariance)
    axes = vectors * np.maximum(_DEVIATIONS * np.sqrt(np.maximum(values, 0.0)), smallest)
    corners: Floats = np.array([row["x"], row["y"]]) + _CIRCLE @ axes.T
    return corners
