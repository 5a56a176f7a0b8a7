"""What holding a bank for a while does to a flight, worked out beforehand for every bank before it.

Where a flight begins, and its heading, only shift and turn what comes of it. On its bank that
depends smoothly, so a table over banks, linear between its entries, stands for the dynamics where a
search asks for the same few moves thousands of times.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, Mount
from staniel.kernels.lookout import axis_of, glide
from staniel.kernels.pieces import woven

__all__ = ["Moves", "entry_of", "nearest", "new_moves", "warm"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_BINS = 36  # of the table, evenly from limit to limit: two degrees or so


class Moves(NamedTuple):
    """The table."""

    banks: Floats
    """(k,) what may be held, evenly from limit to limit [rad]."""
    stride: int
    """Every how many of them are tried at first; those between are for small changes."""
    ends: Floats
    """(_BINS, k, samples, 8) after each sample, in the frame of the start: the way ahead and to the
    left, heading, cosine and sine of it, bank, and the axis to the left and up, of `axis_of`."""
    forward: float
    """That axis ahead, which no bank changes."""


@njit(cache=True, error_model="numpy")
def new_moves(
    coarse: Floats,
    stride: int,
    speed: float,
    roll_gain: float,
    roll_rate: float,
    step: float,
    samples: int,
    mount: Mount,
) -> Moves:
    """Fly every bank from every bank.

    Parameters
    ----------
    coarse : (k,) float array [rad]
        What may be held at first, evenly from limit to limit.
    stride : int
        Into how many parts the way from each of them to the next is divided.
    speed : float [m/s]
    roll_gain, roll_rate : float [1/s, rad/s]
    step : float [s]
        Between two samples.
    samples : int
        While one bank is held.
    mount : Mount
        Of the camera.
    """
    banks = np.linspace(coarse[0], coarse[-1], stride * (coarse.size - 1) + 1)
    ends = np.empty((_BINS, banks.size, samples, 8))
    for b in range(_BINS):
        for k in range(banks.size):
            x, y, heading = 0.0, 0.0, 0.0
            bank = banks[-1] * (2.0 * b / (_BINS - 1) - 1.0)
            for s in range(samples):
                x, y, heading, bank = glide(
                    x, y, heading, bank, speed, banks[k], roll_gain, roll_rate, step
                )
                end = ends[b, k, s]
                end[0], end[1], end[2] = x, y, heading
                end[3], end[4], end[5] = math.cos(heading), math.sin(heading), bank
                _, end[6], end[7] = axis_of(0.0, bank, mount)
    return Moves(banks, stride, ends, axis_of(0.0, 0.0, mount)[0])


@woven
def entry_of(moves: Moves, bank: float) -> tuple[int, float]:
    """Entry of `Moves.ends` below a bank, and the share of the way to the next."""
    at = (bank / moves.banks[-1] + 1.0) * 0.5 * (_BINS - 1)
    at = min(max(at, 0.0), _BINS - 1.000001)
    return int(at), at - int(at)


@njit(cache=True, error_model="numpy")
def nearest(moves: Moves, banks: Floats) -> Indices:
    """Which of the moves' banks is nearest to each."""
    top = moves.banks.size - 1
    found = np.empty(banks.size, dtype=np.int64)
    for i in range(banks.size):
        at = round((banks[i] / moves.banks[-1] + 1.0) * 0.5 * top)
        found[i] = min(max(at, 0), top)
    return found


def warm() -> None:
    """Compile, or load from the disk cache, what a flight calls."""
    moves = new_moves(np.array([-0.5, 0.5]), 2, 15.0, 3.0, 1.0, 0.5, 2, BODY)
    entry_of(moves, 0.0)
