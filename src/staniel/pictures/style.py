"""Colours and the few facts of a record that both pictures draw."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from staniel.record import Record

__all__ = [
    "CAUSES",
    "EDGE",
    "GROUND",
    "INK",
    "NO_FLY",
    "PAPER",
    "ROOF_HIGH",
    "ROOF_LOW",
    "TEAM",
    "THREAT",
    "TRACK",
    "VEHICLE",
    "Rgb",
    "awards",
    "of_aircraft",
    "roof_shade",
    "track_lines",
]

Rgb = tuple[int, int, int]

TEAM: Final[tuple[Rgb, ...]] = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (213, 94, 0),
    (240, 228, 66),
    (115, 115, 115),
)
"""Of the aircraft in turn: the palette of Okabe and Ito, told apart with any colour vision."""

VEHICLE: Final[Rgb] = (24, 24, 27)
TRACK: Final[Rgb] = (220, 20, 60)
INK: Final[Rgb] = (40, 40, 44)
NO_FLY: Final[Rgb] = (200, 30, 30)
THREAT: Final[Rgb] = (240, 130, 20)
PAPER: Final[Rgb] = (255, 255, 255)
GROUND: Final[Rgb] = (250, 249, 245)
EDGE: Final[Rgb] = (140, 140, 146)
ROOF_LOW: Final[Rgb] = (226, 226, 226)
ROOF_HIGH: Final[Rgb] = (150, 150, 158)

CAUSES: Final[dict[str, Rgb]] = {
    "watched": (0, 158, 115),
    "aircraft lost": (64, 64, 70),
    "nobody assigned": (168, 168, 174),
    "out of range": (190, 220, 240),
    "outside footprint": (100, 172, 220),
    "building": (0, 92, 152),
    "missed detection": (253, 218, 140),
    "message lost": (238, 150, 50),
    "track lost": (176, 72, 0),
}
"""Of what a second of a vehicle was, in the order of `staniel.metrics.Cause`: what the team lacks
in greys, what hides in blues, what was perceived and lost again in ambers."""

_LONGEST_STEP: Final = 40.0
"""A track estimate that moves further in one step [m] has jumped: no line is drawn."""


def of_aircraft(identity: int) -> Rgb:
    """Colour of an aircraft, the same in every picture."""
    return TEAM[identity % len(TEAM)]


def roof_shade(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where each roof stands between the lowest (0) and the tallest (1)."""
    if len(heights) == 0:
        return np.zeros(0)
    low, high = float(heights.min()), float(heights.max())
    return (heights - low) / (high - low) if high > low else np.full(len(heights), 0.5)


def awards(record: Record) -> NDArray[np.void]:
    """Rows of the messages that gave a target to a winner."""
    given = (record.messages["kind"] == "award") & np.isfinite(record.messages["x"])
    rows: NDArray[np.void] = record.messages[given]
    return rows


def track_lines(record: Record) -> Iterator[NDArray[np.float64]]:
    """Estimated paths, (n, 2) east and north [m], one for each unbroken stretch of a track.

    Where several agents hold a track, the one with the lowest number is drawn.
    """
    tracks = record.tracks
    if len(tracks) == 0:
        return
    order = np.lexsort((tracks["agent"], tracks["time"], tracks["id"]))
    rows = tracks[order]
    first = np.ones(len(rows), dtype=bool)
    first[1:] = (rows["id"][1:] != rows["id"][:-1]) | (rows["time"][1:] != rows["time"][:-1])
    rows = rows[first]
    step = 1.5 * float(np.diff(record.times).max(initial=0.0))
    places = np.stack([rows["x"], rows["y"]], axis=1)
    broken = rows["id"][1:] != rows["id"][:-1]
    broken |= np.diff(rows["time"]) > step
    broken |= np.hypot(*np.diff(places, axis=0).T) > _LONGEST_STEP
    yield from np.split(places, np.flatnonzero(broken) + 1)
