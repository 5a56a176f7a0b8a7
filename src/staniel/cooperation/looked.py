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

__all__ = ["MOST_BYTES", "QUANTUM", "pack_looked", "unpack_looked"]

QUANTUM = 2.0
"""Step of the times that are told [s]."""

MOST_BYTES = 2000
"""No word is longer."""

_HEAD = struct.Struct("<BIIII")
_VERSION = 1
_NOTHING, _FAR_NOTHING, _OLDEST, _FAR = 255, 254, 253, 256
_MOST_OF_A_RUN = 255


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
    steps = newest - np.floor_divide(looked, QUANTUM).astype(np.int64)
    codes = np.where((looked >= 0.0) & (steps <= _OLDEST), steps, _NOTHING).reshape(-1)
    counts = streets.reshape(-1)
    if first:
        codes, counts = np.roll(codes, -first), np.roll(counts, -first)
    # What does not count takes the code of what comes before it.
    before = np.maximum.accumulate(np.where(counts, np.arange(len(codes)), -1))
    codes = np.where(before >= 0, codes[before], _NOTHING)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(codes)) + 1))
    runs, lengths = _pieces(codes[starts], np.diff(np.append(starts, len(codes))))
    head = _HEAD.pack(_VERSION, rows, columns, newest, first)
    room = (MOST_BYTES - _HEAD.size) // 2
    said = lengths[:room] * np.where(runs[:room] == _FAR_NOTHING, _FAR, 1)
    rest = 0 if len(runs) <= room else (first + int(said.sum())) % len(codes)
    return head + np.stack((runs, lengths), axis=1)[:room].astype(np.uint8).tobytes(), rest


def _pieces(
    codes: NDArray[np.int64], lengths: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Runs as codes with lengths that fit in a byte; the last is left out if it says nothing."""
    if codes[-1] == _NOTHING:
        codes, lengths = codes[:-1], lengths[:-1]
    far = np.where(codes == _NOTHING, lengths // _FAR, 0)
    kinds = np.stack((np.full_like(codes, _FAR_NOTHING), codes), axis=1).reshape(-1)
    amounts = np.stack((far, lengths - _FAR * far), axis=1).reshape(-1)
    pieces = -(-amounts // _MOST_OF_A_RUN)
    full = np.full(pieces.sum(), _MOST_OF_A_RUN)
    some = pieces > 0
    full[np.cumsum(pieces)[some] - 1] = (amounts - _MOST_OF_A_RUN * (pieces - 1))[some]
    return np.repeat(kinds, pieces), full


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
    runs = np.frombuffer(cells, dtype=np.uint8, offset=_HEAD.size).reshape(-1, 2).astype(np.int64)
    codes, lengths = runs[:, 0], runs[:, 1].copy()
    lengths[codes == _FAR_NOTHING] *= _FAR
    total = rows * columns
    if first >= total or lengths.sum() > total or not (lengths > 0).all():
        raise StanielError(
            f"cells: runs over {lengths.sum()} cells from {first}: there are {total}"
        )
    times = np.where(codes <= _OLDEST, (newest - codes) * QUANTUM, -np.inf)
    if (times[codes <= _OLDEST] < 0.0).any():
        raise StanielError("cells: looked at before the start: expected 0 s or later")
    told = np.full(total, -np.inf)
    told[: lengths.sum()] = np.repeat(times, lengths)
    return np.roll(told, first).reshape(shape)
