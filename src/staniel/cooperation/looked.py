"""How a map of when each cell was looked at is said in few bytes, and read back.

==========  ====================================================================================
bytes       meaning
==========  ====================================================================================
1           version of this format
4, 4        rows and columns of the map
4           the newest time that is told, in steps of `QUANTUM` since the start
4           the cell that the runs begin with: row times columns plus column
2, 2, ...   runs of cells along the rows, round the end of the map to its beginning: a code, and how
            many cells it stands for. Code k is k steps before the newest time; 255 says nothing of
            the cells, and 254 nothing of 256 times as many
==========  ====================================================================================

Cells without a street say whatever makes the runs long. Times are rounded down to whole steps since
the start: who says on what it heard says the same, and a cell never seems younger than it is.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from staniel.errors import StanielError
from staniel.kernels import looked as kernels

__all__ = ["MOST_BYTES", "QUANTUM", "pack_looked", "unpack_looked"]

QUANTUM = 2.0
"""Step of the times that are told [s]."""

MOST_BYTES = 2000
"""No word is longer."""

_HEAD = struct.Struct("<BIIII")
_VERSION = 1


def pack_looked(
    looked: NDArray[np.float64], streets: NDArray[np.bool_], time: float, first: int = 0
) -> tuple[bytes, int]:
    """Say when cells were looked at, as far back as codes go.

    Parameters
    ----------
    looked : (rows, columns) float array [s]
        When each cell was last looked at, not after `time`; negative for never.
    streets : (rows, columns) bool array
        Which cells count.
    time : float [s]
        Now, not negative.
    first : int
        Of the cells, along the rows: where to begin.

    Returns
    -------
    cells : bytes
        At most `MOST_BYTES`.
    next : int
        The cell that there was no more room for; 0 where there was room for all.
    """
    rows, columns = looked.shape
    newest = int(time // QUANTUM)
    runs = np.empty(((MOST_BYTES - _HEAD.size) // 2, 2), np.uint8)
    count, said = kernels.said(looked, streets, newest, QUANTUM, first, runs)
    rest = 0 if said == looked.size else (first + said) % looked.size
    return _HEAD.pack(_VERSION, rows, columns, newest, first) + runs[:count].tobytes(), rest


def unpack_looked(cells: bytes, shape: tuple[int, int], time: float) -> NDArray[np.float64]:
    """Read what `pack_looked` said.

    Parameters
    ----------
    cells : bytes
        From anywhere: nothing is taken for granted, and no more memory used than the map has.
    shape : (int, int)
        Rows and columns of the map that it has to be about.
    time : float [s]
        Now: nothing can have been looked at later.

    Returns
    -------
    (rows, columns) float array [s]
        When each cell was looked at; negative infinity where nothing is told.

    Raises
    ------
    StanielError
        No such message: cut off, of another version or map, too long, or ahead of its time.
    """
    if not _HEAD.size <= len(cells) <= MOST_BYTES or (len(cells) - _HEAD.size) % 2:
        raise StanielError(
            f"cells has {len(cells)} bytes: expected an odd number, {_HEAD.size} to {MOST_BYTES}"
        )
    version, rows, columns, newest, first = _HEAD.unpack_from(cells)
    if version != _VERSION:
        raise StanielError(f"cells: version = {version}: expected {_VERSION}")
    if (rows, columns) != shape:
        raise StanielError(f"cells: a map of {rows} x {columns}: expected {shape[0]} x {shape[1]}")
    if newest * QUANTUM > time:
        raise StanielError(f"cells: looked at {newest * QUANTUM:g} s: expected not after {time:g}")
    runs = np.frombuffer(cells, dtype=np.uint8, offset=_HEAD.size).reshape(-1, 2)
    total = rows * columns
    told = np.full(total, -np.inf)
    found = kernels.TOO_LONG
    if first < total:
        found = kernels.told(runs, newest, QUANTUM, first, told)
    if found == kernels.TOO_LONG:
        long = int((runs[:, 1] * np.where(runs[:, 0] == kernels.FAR_NOTHING, kernels.FAR, 1)).sum())
        raise StanielError(f"cells: runs over {long} cells from {first}: there are {total}")
    if found == kernels.BEFORE_START:
        raise StanielError("cells: looked at before the start: expected 0 s or later")
    return told.reshape(shape)
