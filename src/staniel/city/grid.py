"""A city's outlines from a Moving AI ``.map`` grid (Sturtevant 2012)."""

from os import PathLike
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.trace import MOST_CELLS, outlines_of_cells
from staniel.errors import CityError

__all__ = ["grid_outlines"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_FREE = b".GS"
_BUILDING = b"@OTW"
_HEADER_LINES = 4


def grid_outlines(
    path: str | PathLike[str], cell: float, heights: tuple[float, float], seed: int
) -> tuple[tuple[shapely.Polygon, ...], Floats, tuple[float, float]]:
    """Outlines, roof heights and size of the city in a grid; see `City.from_grid`."""
    return outlines_of_cells(_building_cells(Path(path)), cell, heights, seed, path)


def _building_cells(path: Path) -> Bools:
    """(rows, columns) which cells are building, row 0 the north edge."""
    if not path.is_file():
        raise CityError(f"{path}: expected a Moving AI .map grid, found no such file")
    # Two bytes of line end a row at the most, and a row has at least one cell.
    most_bytes = 3 * MOST_CELLS + 1000
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except OSError as error:
        raise CityError(f"{path}: expected a Moving AI .map grid, cannot read: {error}") from error
    if len(data) > most_bytes:
        raise CityError(f"{path}: expected a grid of at most {MOST_CELLS} cells, got a larger file")
    lines = data.splitlines()
    rows, columns = _header(path, lines)
    while len(lines) > _HEADER_LINES and not lines[-1].strip():
        lines.pop()
    body = lines[_HEADER_LINES:]
    for k, line in enumerate(body[:rows]):
        if len(line) != columns:
            raise CityError(
                f"{path}: line {k + _HEADER_LINES + 1}: expected {columns} cells (the header's "
                f"width), got {len(line)}"
            )
    if len(body) != rows:
        raise CityError(
            f"{path}: line {len(lines)}: expected {rows} rows of cells (the header's height), "
            f"got {len(body)}"
        )
    cells = np.frombuffer(b"".join(body), dtype=np.uint8).reshape(rows, columns)
    building = np.isin(cells, np.frombuffer(_BUILDING, dtype=np.uint8))
    unknown = ~building & ~np.isin(cells, np.frombuffer(_FREE, dtype=np.uint8))
    if unknown.any():
        row, column = (int(n) for n in np.argwhere(unknown)[0])
        raise CityError(
            f"{path}: line {row + _HEADER_LINES + 1}: expected cells . G S (free) or @ O T W "
            f"(building), got {chr(cells[row, column])!r} in column {column + 1}"
        )
    return building


def _header(path: Path, lines: list[bytes]) -> tuple[int, int]:
    """Rows and columns from the four lines of the header."""
    extents = []
    for k, name in enumerate(("type", "height", "width", "map")):
        got = lines[k][:60].decode("latin-1") if k < len(lines) else "the end of the file"
        words = got.split()
        wanted = {"type": "type octile", "map": "map"}.get(name)
        if wanted is not None:
            if words != wanted.split():
                raise CityError(f"{path}: line {k + 1}: expected {wanted!r}, got {got!r}")
            continue
        if len(words) != 2 or words[0] != name or not words[1].isascii() or not words[1].isdigit():
            raise CityError(f"{path}: line {k + 1}: expected '{name} N', got {got!r}")
        extents.append(int(words[1]))
        if extents[-1] < 1:
            raise CityError(f"{path}: line {k + 1}: expected a {name} of at least 1, got {got!r}")
    if extents[0] * extents[1] > MOST_CELLS:
        raise CityError(
            f"{path}: line 3: expected at most {MOST_CELLS} cells, got {extents[1]} x {extents[0]}"
        )
    return extents[0], extents[1]
