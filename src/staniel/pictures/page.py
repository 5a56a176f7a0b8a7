"""The page around the movie's map: title, clock and legend."""

import math
from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from staniel.pictures import style
from staniel.record import Record

__all__ = ["MAP_SIDE", "SMOOTH", "draw_clock", "draw_page", "draw_triangle"]

SMOOTH: Final = 2
"""How many times larger than shown everything is drawn."""

MAP_SIDE: Final = 640
"""Longer side of the map as shown [pixel]."""

_MARGIN: Final = 10
_HEADER: Final = 32
_LINE: Final = 22
_NARROWEST: Final = 480
_TRIANGLE: Final = np.array([[9.5, 0.0], [-6.5, 6.0], [-3.5, 0.0], [-6.5, -6.0]])

Place = tuple[float, float]
Symbol = Callable[[ImageDraw.ImageDraw, Place], None]


def draw_page(record: Record, map_size: tuple[int, int]) -> tuple[Image.Image, tuple[int, int]]:
    """Draw what stays the same, and leave room for the map.

    Parameters
    ----------
    record : Record
    map_size : (int, int)
        Width and height as shown [pixel].

    Returns
    -------
    page : Image
    corner : (int, int)
        Where the map's upper left corner goes.
    """
    width = max(map_size[0], _NARROWEST) + 2 * _MARGIN
    left = (width - map_size[0]) // 2
    rows = _legend_rows(record.aircraft.shape[1], width - 2 * _MARGIN)
    height = _HEADER + map_size[1] + 6 + _LINE * len(rows) + 6
    large = Image.new("RGB", (width * SMOOTH, height * SMOOTH), style.PAPER)
    draw = ImageDraw.Draw(large)
    place = (left * SMOOTH, _HEADER * SMOOTH // 2)
    draw.text(place, _title(record), fill=style.INK, font=_font(15 * SMOOTH), anchor="lm")
    for row, entries in enumerate(rows):
        y = (_HEADER + map_size[1] + 6 + (row + 0.5) * _LINE) * SMOOTH
        _draw_row(draw, entries, left * SMOOTH, y)
    return large.reduce(SMOOTH), (left, _HEADER)


def draw_clock(page: Image.Image, right: int, seconds: float) -> None:
    """Write the mission's time at the upper right."""
    minutes, rest = divmod(int(seconds + 1e-6), 60)
    draw = ImageDraw.Draw(page)
    place = (right, _HEADER // 2)
    draw.text(place, f"{minutes:02d}:{rest:02d}", fill=style.INK, font=_font(17), anchor="rm")


def draw_triangle(
    draw: ImageDraw.ImageDraw, place: Place, heading: float, color: style.Rgb
) -> None:
    """Draw an aircraft that points along `heading` [rad] at a place on the large picture."""
    s, c = math.sin(heading), math.cos(heading)
    # Pixels count downwards, north is up: the second column is turned over.
    corners = SMOOTH * _TRIANGLE @ np.array([[c, -s], [-s, -c]]) + place
    points = [(x, y) for x, y in corners.tolist()]
    draw.polygon(points, fill=color)
    draw.line([*points, points[0]], fill=style.PAPER, width=SMOOTH)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _title(record: Record) -> str:
    parts = [str(record.scenario.get("name", "mission"))[:40]]
    if "seed" in record.scenario:
        parts.append(f"seed {record.scenario['seed']}"[:30])
    return "  ·  ".join(parts)


def _legend_rows(n_aircraft: int, width: int) -> list[list[tuple[str, Symbol]]]:
    """Entries of the legend, as many in a row as fit."""
    shown = min(n_aircraft, len(style.TEAM))
    entries: list[tuple[str, Symbol]] = [
        (f"aircraft {k}", _aircraft_symbol(style.of_aircraft(k))) for k in range(shown)
    ]
    if n_aircraft > shown:
        entries.append((f"and {n_aircraft - shown} more", lambda draw, place: None))
    entries += [
        ("camera footprint", _footprint_symbol),
        ("vehicle", _vehicle_symbol),
        ("estimate, 2 sigma", _track_symbol),
        ("detection", _detection_symbol),
    ]
    rows: list[list[tuple[str, Symbol]]] = [[]]
    used = 0.0
    for entry in entries:
        needed = _width(entry[0])
        if used + needed > width and rows[-1]:
            rows.append([])
            used = 0.0
        rows[-1].append(entry)
        used += needed
    return rows


def _width(label: str) -> float:
    """Width of a legend's entry as shown [pixel]."""
    return 22.0 + _font(12).getlength(label) + 16.0


def _draw_row(
    draw: ImageDraw.ImageDraw, entries: list[tuple[str, Symbol]], x: float, y: float
) -> None:
    for label, symbol in entries:
        symbol(draw, (x + 8 * SMOOTH, y))
        place = (x + 22 * SMOOTH, y)
        draw.text(place, label, fill=style.INK, font=_font(12 * SMOOTH), anchor="lm")
        x += _width(label) * SMOOTH


def _aircraft_symbol(color: style.Rgb) -> Symbol:
    return lambda draw, place: draw_triangle(draw, place, 0.0, color)


def _box(place: Place, half: float) -> tuple[float, float, float, float]:
    x, y = place
    return x - half, y - half, x + half, y + half


def _footprint_symbol(draw: ImageDraw.ImageDraw, place: Place) -> None:
    pale, line = (214, 230, 240), (100, 160, 200)
    draw.ellipse(_box(place, 7 * SMOOTH), fill=pale, outline=line, width=SMOOTH)


def _vehicle_symbol(draw: ImageDraw.ImageDraw, place: Place) -> None:
    draw.rectangle(_box(place, 3 * SMOOTH), fill=style.VEHICLE)


def _track_symbol(draw: ImageDraw.ImageDraw, place: Place) -> None:
    x, y = place
    draw.ellipse(_box(place, 7 * SMOOTH), outline=style.TRACK, width=2 * SMOOTH - 1)
    arm = 3 * SMOOTH
    draw.line((x - arm, y, x + arm, y), fill=style.TRACK, width=SMOOTH)
    draw.line((x, y - arm, x, y + arm), fill=style.TRACK, width=SMOOTH)


def _detection_symbol(draw: ImageDraw.ImageDraw, place: Place) -> None:
    draw.ellipse(_box(place, 2.5 * SMOOTH), fill=style.INK)
