"""Outlines of the dark cells of a grid, exactly along the cells' edges."""

from os import PathLike

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.checks import check_cell, check_height_range, check_seed
from staniel.errors import CityError

__all__ = ["MOST_CELLS", "outlines_of_cells"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MOST_CELLS = 16_000_000
"""A larger picture or grid is refused before its cells are read."""

_MOST_CORNERS = 1_000_000

# Directions of travel along an outline, the building always on the left.
_EAST, _NORTH, _WEST, _SOUTH = range(4)
# Around a corner point: which two cells tell that an outline leaves in (or arrives from) each
# direction; the first must be building, the second free. Cells in the order SW, SE, NW, NE.
_SW, _SE, _NW, _NE = range(4)
_LEAVES = {_EAST: (_NE, _SE), _NORTH: (_NW, _NE), _WEST: (_SW, _NW), _SOUTH: (_SE, _SW)}
_ARRIVES = {_EAST: (_NW, _SW), _NORTH: (_SW, _SE), _WEST: (_SE, _NE), _SOUTH: (_NE, _NW)}


def outlines_of_cells(
    building: Bools,
    cell: float,
    heights: tuple[float, float],
    seed: int,
    source: str | PathLike[str],
) -> tuple[tuple[shapely.Polygon, ...], Floats, tuple[float, float]]:
    """Buildings of a grid: outlines, roof heights and the city's size.

    Parameters
    ----------
    building : (rows, columns) bool array
        Row 0 is the north edge.
    cell, heights, seed
        As in `City.from_image`.
    source : path
        Named in errors.

    Returns
    -------
    outlines : tuple of n shapely.Polygon [m]
        One for each group of cells that share sides.
    roofs : (n,) float array [m]
    size : (float, float) [m]

    Raises
    ------
    CityError
        No free cell, or more than a million corners.
    """
    side = check_cell(cell)
    low, high = check_height_range(heights)
    rng = np.random.default_rng(check_seed(seed))
    rows, columns = building.shape
    if building.all():
        raise CityError(
            f"{source}: expected some free space, got {columns} x {rows} building cells"
        )
    outlines = _traced(building[::-1], side, source)
    return outlines, rng.uniform(low, high, len(outlines)), (columns * side, rows * side)


def _traced(
    building: Bools, side: float, source: str | PathLike[str]
) -> tuple[shapely.Polygon, ...]:
    """Polygons of the cells, row 0 the south edge."""
    from scipy import ndimage  # takes a while to import, and most cities need no tracing

    padded = np.pad(building, 1)
    around = (padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:])
    # A point is a corner unless its four cells are alike or part along a straight line.
    turns = (around[_SW] ^ around[_SE] ^ around[_NW] ^ around[_NE]) | (
        (around[_SW] == around[_NE]) & (around[_SE] == around[_NW]) & (around[_SW] != around[_SE])
    )
    i, j = np.nonzero(turns)
    if len(i) > _MOST_CORNERS:
        raise CityError(
            f"{source}: expected buildings with at most {_MOST_CORNERS} corners in all, "
            f"got {len(i)}: too noisy for a map"
        )
    cells = np.stack([a[turns] for a in around])
    labels, n = ndimage.label(padded)
    owners = np.stack(
        [labels[i, j], labels[i, j + 1], labels[i + 1, j], labels[i + 1, j + 1]], dtype=np.int64
    )
    point, arrives, leaves = _corners(cells, owners)
    ring, start_of_ring = _rings(_next_corner(i[point], j[point], arrives, leaves))

    corners = np.column_stack([j[point], i[point]])[ring] * side
    ring_number = np.repeat(np.arange(len(start_of_ring)), np.diff([*start_of_ring, len(ring)]))
    first = ring[start_of_ring]
    on_left = np.array([_LEAVES[d][0] for d in range(4)])
    owner = owners[on_left[leaves[first]], point[first]]
    linear = np.asarray(shapely.linearrings(corners, indices=ring_number))
    # Of each building, first its shell and then its holes.
    order = np.lexsort([~shapely.is_ccw(linear), owner])
    polygons = np.empty(n, dtype=object)
    shapely.polygons(linear[order], indices=owner[order] - 1, out=polygons)
    return tuple(polygons)


def _corners(cells: Bools, owners: Ints) -> tuple[Ints, Ints, Ints]:
    """Every turn of an outline: its point, the direction it arrives in and the one it leaves in.

    Where two buildings touch at a corner each outline turns left, around its own cell. Where it is
    one building (that meets itself around a court) they turn right, around the free cells: so no
    ring touches itself, and the court becomes a hole.
    """
    crossed = (cells[_SW] == cells[_NE]) & (cells[_SE] == cells[_NW])
    own = np.where(cells[_SW], owners[_SW] == owners[_NE], owners[_SE] == owners[_NW])
    found = []
    for arrive in range(4):
        for turn, allowed in ((1, ~crossed | ~own), (-1, ~crossed | own)):
            leave = (arrive + turn) % 4
            (full_a, free_a), (full_l, free_l) = _ARRIVES[arrive], _LEAVES[leave]
            here = cells[full_a] & ~cells[free_a] & cells[full_l] & ~cells[free_l] & allowed
            points = np.flatnonzero(here)
            found.append((points, np.full(len(points), arrive), np.full(len(points), leave)))
    point, arrives, leaves = (np.concatenate(part) for part in zip(*found, strict=True))
    return point, arrives, leaves


def _next_corner(i: Ints, j: Ints, arrives: Ints, leaves: Ints) -> Ints:
    """The corner that follows each along its outline.

    Along one line of the grid the walls of one direction do not overlap, so in order of place the
    k-th that leaves is the partner of the k-th that arrives.
    """
    following = np.empty(len(i), dtype=np.int64)
    for direction in range(4):
        line, place = (i, j) if direction in (_EAST, _WEST) else (j, i)
        out, into = np.flatnonzero(leaves == direction), np.flatnonzero(arrives == direction)
        out = out[np.lexsort([place[out], line[out]])]
        into = into[np.lexsort([place[into], line[into]])]
        following[out] = into
    return following


def _rings(following: Ints) -> tuple[Ints, list[int]]:
    """Corners ring by ring, and where each ring starts."""
    after = following.tolist()
    seen = bytearray(len(after))
    ring: list[int] = []
    starts: list[int] = []
    for first in range(len(after)):
        if seen[first]:
            continue
        starts.append(len(ring))
        corner = first
        while not seen[corner]:
            seen[corner] = 1
            ring.append(corner)
            corner = after[corner]
    return np.array(ring, dtype=np.int64), starts
