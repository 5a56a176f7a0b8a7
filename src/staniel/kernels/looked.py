"""The loops of the words on what was looked at: `staniel.cooperation.looked` has their format."""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "BEFORE_START",
    "FAR",
    "FAR_NOTHING",
    "NOTHING",
    "SOUND",
    "TOO_LONG",
    "said",
    "told",
    "warm",
]

NOTHING: Final = 255
"""Code of cells of which nothing is said."""
FAR_NOTHING: Final = 254
"""The same of `FAR` times as many."""
FAR: Final = 256
_OLDEST, _LONGEST = 253, 255
SOUND, TOO_LONG, BEFORE_START = 0, 1, 2

Floats = NDArray[np.float64]
Runs = NDArray[np.uint8]


@njit(cache=True, error_model="numpy")
def said(
    looked: Floats, streets: NDArray[np.bool_], newest: int, step: float, first: int, runs: Runs
) -> tuple[int, int]:
    """Fill in runs of codes, as many as there is room for; how many, and the cells they stand for.

    Parameters
    ----------
    looked : (rows, columns) float array [s]
    streets : (rows, columns) bool array
    newest : int
        Steps since the start until now.
    step : float [s]
    first : int
        Cell to begin with.
    runs : (room, 2) uint8 array
        Code and length of each run; written in place.

    Returns
    -------
    count, cells : int
        All cells but those at the end of which there is nothing to say, where it is all said.
    """
    rows, columns = looked.shape
    total, count, cells = rows * columns, 0, 0
    code, length = NOTHING, 0
    for i in range(total + 1):
        here = -1
        if i < total:
            at = (first + i) % total
            here = code
            if streets[at // columns, at % columns]:
                time = looked[at // columns, at % columns]
                here = NOTHING
                if time >= 0.0:
                    age = newest - int(np.floor(time / step))
                    here = age if age <= _OLDEST else NOTHING
        if here == code:
            length += 1
            continue
        # A run is over: it is said, unless it is the last and says nothing.
        if here < 0 and code == NOTHING:
            break
        far = length // FAR if code == NOTHING else 0
        for kind, amount, each in ((FAR_NOTHING, far, FAR), (code, length - FAR * far, 1)):
            left = amount
            while left > 0:
                if count == runs.shape[0]:
                    return count, cells
                piece = min(left, _LONGEST)
                runs[count, 0], runs[count, 1] = kind, piece
                count, cells, left = count + 1, cells + piece * each, left - piece
        code, length = here, 1
    return count, total


@njit(cache=True, error_model="numpy")
def told(runs: Runs, newest: int, step: float, first: int, times: Floats) -> int:
    """Write what runs say into a map on which nothing is told yet; whether they are `SOUND`.

    Parameters
    ----------
    runs : (k, 2) uint8 array
    newest, step, first
        As in `said`.
    times : (cells,) float array [s]
        Negative infinity in all of them; written in place, for nothing where they are not sound.
    """
    total, at = times.size, 0
    for k in range(runs.shape[0]):
        code, length = int(runs[k, 0]), int(runs[k, 1])
        if code == FAR_NOTHING:
            length *= FAR
        if length == 0 or at + length > total:
            return TOO_LONG
        if code <= _OLDEST:
            time = (newest - code) * step
            if time < 0.0:
                return BEFORE_START
            for i in range(at, at + length):
                times[(first + i) % total] = time
        at += length
    return SOUND


def warm() -> None:
    """Compile, or load from the disk cache."""
    runs = np.zeros((2, 2), np.uint8)
    said(np.zeros((1, 1)), np.ones((1, 1), np.bool_), 0, 1.0, 0, runs)
    # What comes out of a packet is not writable.
    told(np.frombuffer(b"\0\1", np.uint8).reshape(1, 2), 0, 1.0, 0, np.zeros(1))
