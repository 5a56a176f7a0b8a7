"""The grid of wall pieces that the sight kernels walk."""

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.kernels.pieces import BEGIN, BUILT, END, LANES, ROW, SKIN, Walls

__all__ = ["build_walls"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MARGIN = (
    1e-6  # a wall this near to a cell is listed in it: above rounding, below anything real [m]
)
_WALLS_A_CELL = 3.0  # about as many cells as walls / this: measured best for sight
_FAR, _DEEP = 1e6, 1e30  # where the lanes are that hold no wall [m]
_MOST_CELLS = 1_000_000


def build_walls(
    outlines: Sequence[shapely.Polygon], heights: Floats, size: tuple[float, float]
) -> Walls:
    """The index of a city.

    Parameters
    ----------
    outlines : sequence of n shapely.Polygon
        Valid, with disjoint interiors, inside the rectangle.
    heights : (n,) float array [m]
    size : (float, float) [m]
        East and north extent of the city's rectangle from the origin.

    Returns
    -------
    Walls
    """
    edges = _edges(outlines, heights)
    width, height = float(size[0]), float(size[1])
    n_cells = min(max(1.0, len(edges) / _WALLS_A_CELL), _MOST_CELLS)
    cell = min(max(width, height), math.sqrt(width * height / n_cells))
    nx, ny = max(1, math.ceil(width / cell)), max(1, math.ceil(height / cell))

    wall, touched = _cells_touched(edges, cell, nx, ny)
    order = np.argsort(touched, kind="stable")
    wall, touched = wall[order], touched[order]
    over = _at_corners(edges, cell, nx, ny)
    cells = np.zeros((nx * ny + 1, 4))
    cells[:, 0] = np.searchsorted(touched, np.arange(nx * ny + 1))
    np.maximum.at(cells[:, 1], touched, edges[wall, 4])
    cells[:-1, 2] = over
    # Outlines that overlap by rounding can leave a number that no building has at such a corner.
    known = (over > 0) & (over <= len(heights))
    cells[:-1, 3][known] = heights[over[known] - 1]
    tallest = float(heights.max(initial=0.0))
    pieces = np.ascontiguousarray(edges[wall])
    blocks, span = _blocks(pieces, touched, cells, cell, nx)
    return Walls(width, height, tallest, cell, nx, ny, span, pieces, cells, blocks)


def _edges(outlines: Sequence[shapely.Polygon], heights: Floats) -> Floats:
    """(w, 7) walls of all rings, as in `Walls.pieces`."""
    rings, building = shapely.get_rings(np.asarray(outlines, dtype=object), return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    same = np.flatnonzero(ring[1:] == ring[:-1])
    edges = np.empty((len(same), 7))
    edges[:, :2], edges[:, 2:4] = points[same], points[same + 1]
    edges[:, 5] = SKIN * np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1])
    edges[:, 6] = building[ring[same]]
    edges[:, 4] = heights[building[ring[same]]]
    return edges


def _blocks(
    pieces: Floats, touched: Ints, cells: Floats, cell: float, nx: int
) -> tuple[NDArray[np.float32], float]:
    """`Walls.blocks` and `Walls.span` of pieces sorted by the cell they are listed in."""
    first = cells[:, 0].astype(np.int64)
    counts = np.diff(first)
    more = np.maximum(0, -(-counts // LANES) - 1)
    ends = len(counts) + np.cumsum(more)
    n_blocks = int(ends[-1])
    # Beginning at a cache line.
    store = np.zeros(n_blocks * ROW + 16, dtype=np.float32)
    skip = (-store.ctypes.data // 4) % 16
    blocks = store[skip : skip + n_blocks * ROW].reshape(n_blocks, ROW)
    by_wall = blocks[:, : 5 * LANES].reshape(n_blocks, 5, LANES)
    by_wall[:] = np.array([_FAR, _FAR, 1.0, 0.0, -_DEEP])[:, None]
    blocks[: len(counts), BEGIN] = ends - more
    blocks[: len(counts), END] = ends
    blocks[: len(counts), BUILT] = cells[:-1, 2] > 0.0

    corner = np.column_stack([touched % nx, touched // nx]) * cell
    near = np.hstack([pieces[:, :2] - corner, pieces[:, 2:4] - pieces[:, :2], pieces[:, 4:5]])
    rank = np.arange(len(touched)) - first[touched]
    block = np.where(rank < LANES, touched, (ends - more)[touched] + rank // LANES - 1)
    by_wall[block, :, rank % LANES] = near
    return blocks, float(np.abs(near[:, :4]).max(initial=1.0))


def _expand(first: Ints, last: Ints) -> tuple[Ints, Ints]:
    """Row numbers repeated, and the integers first..last of each row, both included."""
    counts = last - first + 1
    rows = np.repeat(np.arange(len(first)), counts)
    starts = np.cumsum(counts) - counts
    return rows, np.arange(len(rows)) - starts[rows] + first[rows]


def _cells_touched(edges: Floats, cell: float, nx: int, ny: int) -> tuple[Ints, Ints]:
    """Every (wall, cell) of which the wall comes within the margin of the closed cell."""
    x0, y0, x1, y1 = edges[:, :4].T
    low = np.clip(np.floor((np.minimum(y0, y1) - _MARGIN) / cell), 0, ny - 1).astype(np.int64)
    high = np.clip(np.floor((np.maximum(y0, y1) + _MARGIN) / cell), 0, ny - 1).astype(np.int64)
    wall, row = _expand(low, high)
    # The wall's part within this row of cells, and the columns under it.
    x0, y0, x1, y1 = edges[wall, :4].T
    rise = np.where(y1 == y0, 1.0, y1 - y0)
    t_south = np.clip((row * cell - _MARGIN - y0) / rise, 0.0, 1.0)
    t_north = np.clip(((row + 1) * cell + _MARGIN - y0) / rise, 0.0, 1.0)
    level = np.abs(y1 - y0) <= _MARGIN
    xs = np.where(level, x0, x0 + t_south * (x1 - x0))
    xn = np.where(level, x1, x0 + t_north * (x1 - x0))
    left = np.clip(np.floor((np.minimum(xs, xn) - _MARGIN) / cell), 0, nx - 1).astype(np.int64)
    right = np.clip(np.floor((np.maximum(xs, xn) + _MARGIN) / cell), 0, nx - 1).astype(np.int64)
    which, column = _expand(left, right)
    return wall[which], row[which] * nx + column


def _at_corners(edges: Floats, cell: float, nx: int, ny: int) -> Ints:
    """(nx * ny,) number + 1 of the building over each cell's south-west corner, 0 for none.

    Sweeps each line of corners from west to east: crossing a wall toggles its building. What is on
    is kept as the XOR of the numbers, so the order of two walls at one place does not matter. A
    corner on a wall counts as slightly east and north of it, as in the kernel `inside`.
    """
    y0, y1 = edges[:, 1], edges[:, 3]
    # Lines with min(y) <= y < max(y); the float product decides, as in the kernel.
    first = np.ceil(np.minimum(y0, y1) / cell).astype(np.int64) - 1
    last = np.ceil(np.maximum(y0, y1) / cell).astype(np.int64)
    wall, row = _expand(np.clip(first, 0, ny), np.clip(last, -1, ny - 1))
    y = row * cell
    crossed = (edges[wall, 1] <= y) != (edges[wall, 3] <= y)
    wall, row, y = wall[crossed], row[crossed], y[crossed]
    x0, y0, x1, y1 = edges[wall, :4].T
    x = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
    # The first corner that is not west of the wall; rounding may put it one to either side.
    column = np.floor(x / cell).astype(np.int64) + 2
    for _ in range(3):
        cross = (x1 - x0) * (y - y0) - (y1 - y0) * ((column - 1) * cell - x0)
        column -= np.where(y1 > y0, cross <= 0.0, cross >= 0.0)
    toggles = np.zeros((ny, nx + 1), dtype=np.int64)
    np.bitwise_xor.at(toggles, (row, np.clip(column, 0, nx)), edges[wall, 6].astype(np.int64) + 1)
    over: Ints = np.bitwise_xor.accumulate(toggles, axis=1)[:, :nx].reshape(-1)
    return over
