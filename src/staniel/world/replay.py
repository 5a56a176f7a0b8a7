"""Recorded tracks from a CSV file, driven again."""

import csv
import math
from collections.abc import Iterator
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.errors import ScenarioError
from staniel.kernels import replay as kernel
from staniel.world.config import Traffic

__all__ = ["MARGIN", "Replayed", "read_tracks"]

Floats = NDArray[np.float64]

MARGIN = 50.0
"""Kept west and south of tracks in degrees, where the city does not say where it lies [m]."""

_MOST_BYTES = 1_000_000_000
_MOST_ROWS = 10_000_000
_MOST_TRACKS = 10_000
_TIMES = ("time", "frame")
_PLACES = (("x", "y"), ("lon", "lat"))
_EAST_DEGREE, _NORTH_DEGREE = 111_320.0, 111_132.0  # metres, as in `staniel.city`
_HEADED = 0.3  # a slower vehicle keeps its heading [m/s]


class Replayed:
    """Vehicles that go where they were recorded, at the times when they were.

    Time begins with the earliest row of the file. A vehicle stands at its first recorded place
    until its track begins, and at its last when it has ended. Recorded places are taken as they
    are: unlike others, these vehicles may touch each other, or a wall of a map that is a metre off.

    Parameters
    ----------
    city : City
        Places in degrees are put in its frame where it has an origin in degrees; else the tracks'
        south-west corner is put `MARGIN` from the city's.
    traffic : Traffic
        Its `replay` names the file.
    clock : Clock

    Raises
    ------
    ScenarioError
        A file that cannot be read, see `read_tracks`, or a place outside the city's rectangle.
    """

    def __init__(self, city: City, traffic: Traffic, clock: Clock) -> None:
        path = Path(traffic.replay or "")
        tracks, degrees = read_tracks(path)
        if degrees:
            tracks = _in_metres(tracks, city)
        for name, rows in tracks.items():
            low, high = rows[:, 1:].min(axis=0), rows[:, 1:].max(axis=0)
            if (low < 0.0).any() or (high > city.size).any():
                raise ScenarioError(
                    f"vehicles.replay = {str(path)!r}: track {name!r} covers east "
                    f"{low[0]:.0f} to {high[0]:.0f} m, north {low[1]:.0f} to {high[1]:.0f} m: "
                    f"expected inside the city's {city.size[0]:g} m x {city.size[1]:g} m"
                )
        begin = min(rows[0, 0] for rows in tracks.values())
        parts = [_knots(rows - (begin, 0.0, 0.0), traffic.replay_knots) for rows in tracks.values()]
        self._knots = np.ascontiguousarray(np.concatenate(parts))
        self._first = np.cumsum([0, *map(len, parts)]).astype(np.int64)
        self._clock = clock

    def begin(self) -> tuple[Floats, Floats]:
        """Each vehicle at its first place, heading where its track leads; nothing to remember."""
        kernel.warm()  # here: few missions replay tracks
        vehicles = np.zeros((len(self._first) - 1, 4))
        for i, (begin, end) in enumerate(zip(self._first[:-1], self._first[1:], strict=True)):
            knots = self._knots[begin:end]
            vehicles[i, :2] = knots[0, 1:3]
            moving = np.flatnonzero(np.hypot(knots[:, 3], knots[:, 4]) >= _HEADED)
            if len(moving):
                vehicles[i, 2] = math.atan2(knots[moving[0], 4], knots[moving[0], 3])
        return vehicles, np.zeros((len(vehicles), 0))

    def drive(self, vehicles: Floats, memory: Floats, tick: int) -> tuple[Floats, Floats]:
        """See `staniel.kernels.replay.replay`."""
        clock = self._clock
        start = tick * clock.decision_step
        path = kernel.replay(
            self._knots, self._first, vehicles, start, clock.dynamics_step, clock.substeps
        )
        return path, memory


def read_tracks(path: str | PathLike[str]) -> tuple[dict[str, Floats], bool]:
    """Read recorded tracks.

    The first line names the columns; of these `id`, a time [s] (`time` or `frame`) and a place
    (`x` and `y` [m], or `lon` and `lat` [deg]) are used. Recorded speeds are not: positions tell
    them better.

    Parameters
    ----------
    path : path
        A CSV file of at most 1 GB, ten million rows and 10 000 tracks.

    Returns
    -------
    tracks : dict of str to (n, 3) float array
        Time and place of each id, in the order in which they first appear.
    degrees : bool
        Whether places are longitude and latitude.

    Raises
    ------
    ScenarioError
        A file that is missing, too large or no such table; a value that is no finite number or out
        of range; times of one id that do not increase. With the line.
    """
    rows: dict[str, list[tuple[float, float, float]]] = {}
    path = Path(path)
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ScenarioError(f"vehicles.replay = {str(path)!r}: longer than 1 GB")
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = csv.reader(file)
            columns, degrees = _columns(path, next(lines, []))
            for line, values in _values(path, lines, columns, degrees):
                name, row = values
                track = rows.setdefault(name, [])
                if track and track[-1][0] >= row[0]:
                    raise _wrong(path, line, f"time {row[0]:g} s of id {name!r}", "a later one")
                if len(rows) > _MOST_TRACKS:
                    raise _wrong(path, line, f"id {name!r}", f"at most {_MOST_TRACKS:,} of them")
                track.append(row)
    except OSError as error:
        raise ScenarioError(
            f"vehicles.replay = {str(path)!r} cannot be read: {error.strerror or error}"
        ) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ScenarioError(f"vehicles.replay = {str(path)!r}: not a CSV table: {error}") from None
    if not rows:
        raise ScenarioError(f"{path}: expected recorded places, got none")
    return {name: np.array(track) for name, track in rows.items()}, degrees


def _columns(path: Path, header: list[str]) -> tuple[tuple[int, int, int, int], bool]:
    """Columns of id, time and the two coordinates, and whether these are degrees."""
    names = [name.strip().lower() for name in header]
    time = next((name for name in _TIMES if name in names), None)
    place = next((pair for pair in _PLACES if set(pair) <= set(names)), None)
    if "id" not in names or time is None or place is None:
        got = ", ".join(names)[:80]
        raise _wrong(path, 1, f"columns {got!r}", "id, time (or frame), x and y (or lon and lat)")
    return (
        names.index("id"),
        names.index(time),
        names.index(place[0]),
        names.index(place[1]),
    ), place == ("lon", "lat")


def _values(
    path: Path,
    lines: Iterator[list[str]],
    columns: tuple[int, int, int, int],
    degrees: bool,
) -> Iterator[tuple[int, tuple[str, tuple[float, float, float]]]]:
    """Line number, id, time and place of each row."""
    limits = (1e7, 180.0, 90.0) if degrees else (1e7, 1e6, 1e6)
    for line, cells in enumerate(lines, start=2):
        if not cells:
            continue
        if line > _MOST_ROWS:
            raise _wrong(path, line, "another row", f"at most {_MOST_ROWS:,}")
        if len(cells) <= max(columns):
            raise _wrong(path, line, f"{len(cells)} values", f"at least {max(columns) + 1}")
        numbers = []
        for column, limit in zip(columns[1:], limits, strict=True):
            try:
                number = float(cells[column])
            except ValueError:
                number = math.nan
            if not abs(number) <= limit:
                raise _wrong(
                    path, line, f"{cells[column][:40]!r}", f"a number from -{limit:g} to {limit:g}"
                )
            numbers.append(number)
        yield line, (cells[columns[0]].strip()[:64], (numbers[0], numbers[1], numbers[2]))


def _wrong(path: Path, line: int, got: str, expected: str) -> ScenarioError:
    return ScenarioError(f"{path}, line {line}: got {got}, expected {expected}")


def _in_metres(tracks: dict[str, Floats], city: City) -> dict[str, Floats]:
    """Longitude and latitude as east and north of the city's origin, or of their own corner."""
    origin = getattr(city, "origin", None)
    if origin is not None and origin.frame == "wgs84":
        return {
            name: np.column_stack([rows[:, 0], origin.to_local(rows[:, 1:])])
            for name, rows in tracks.items()
        }
    corner = np.min([rows[:, 1:].min(axis=0) for rows in tracks.values()], axis=0)
    scale = _EAST_DEGREE * math.cos(math.radians(corner[1])), _NORTH_DEGREE
    return {
        name: np.column_stack([rows[:, 0], (rows[:, 1:] - corner) * scale + MARGIN])
        for name, rows in tracks.items()
    }


def _knots(rows: Floats, window: float) -> Floats:
    """Knots of a cubic: means over windows of time, which keep still what only trembles.

    The first and the last recorded place are kept. Slopes are those of the parabola through three
    neighbours.
    """
    number = np.floor((rows[:, 0] - rows[0, 0]) / window)
    starts = np.flatnonzero(np.diff(number, prepend=-1.0))
    counts = np.diff(np.append(starts, len(rows)))
    means = np.add.reduceat(rows, starts, axis=0) / counts[:, None]
    ends = rows[:1] if len(rows) == 1 else rows[[0, -1]]
    # Not so near to an end that the noise of two places becomes a speed.
    close = 0.4 * window
    inner = means[(means[:, 0] > ends[0, 0] + close) & (means[:, 0] < ends[-1, 0] - close)]
    knots = np.concatenate([ends[:1], inner, ends[1:]])
    slopes = np.zeros((len(knots), 2))
    if len(knots) > 2:
        slopes = np.column_stack([np.gradient(knots[:, column], knots[:, 0]) for column in (1, 2)])
    elif len(knots) == 2:
        slopes += (knots[1, 1:] - knots[0, 1:]) / (knots[1, 0] - knots[0, 0])
    return np.column_stack([knots, slopes])
