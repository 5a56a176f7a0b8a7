"""Which broadcasts reach whom, in how many copies and how late."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform

__all__ = ["fates", "hear", "warm"]


@njit(cache=True, error_model="numpy")
def hear(
    aircraft: NDArray[np.float64],
    senders: NDArray[np.int64],
    sequences: NDArray[np.int64],
    sigma: float,
    reach: float,
    loss: float,
    key: np.uint64,
) -> NDArray[np.bool_]:
    r"""Draw who hears each message.

    Parameters
    ----------
    aircraft : (n, 6) float array
        x, y, z [m] first.
    senders : (m,) int array
        Row in `aircraft` of each message's sender.
    sequences : (m,) int array
        Its running number there. With the sender and the receiver it names the draw, so nobody's
        luck depends on how many others fly or talk.
    sigma : float [m]
    reach : float [m]
        Nothing is heard beyond.
    loss : float
        Probability that a message is lost whatever the distance. The draw is the same for each
        `loss`: what is heard with more of it is heard with less.
    key : uint64

    Returns
    -------
    (m, n) bool array
        False for the sender itself.

    Notes
    -----
    :math:`p = (1 - loss) e^{-d^2/2\sigma^2}` up to `reach`, 0 beyond; d the distance in space.
    Thesis eq. 3.5 (corrected), with the loss as a factor.
    """
    m, n = senders.shape[0], aircraft.shape[0]
    heard = np.zeros((m, n), dtype=np.bool_)
    for j in range(m):
        sender = senders[j]
        stream = fold(fold(key, sender), sequences[j])
        for i in range(n):
            dx = aircraft[i, 0] - aircraft[sender, 0]
            dy = aircraft[i, 1] - aircraft[sender, 1]
            dz = aircraft[i, 2] - aircraft[sender, 2]
            square = dx * dx + dy * dy + dz * dz
            if i != sender and square <= reach * reach:
                chance = math.exp(-0.5 * square / (sigma * sigma)) * (1.0 - loss)
                heard[j, i] = uniform(stream, i) < chance
    return heard


@njit(cache=True, error_model="numpy")
def fates(
    heard: NDArray[np.bool_],
    hidden: NDArray[np.bool_],
    senders: NDArray[np.int64],
    sequences: NDArray[np.int64],
    loss: float,
    jitter: float,
    exponential: bool,
    duplication: float,
    key: np.uint64,
) -> NDArray[np.float64]:
    """Draw what becomes of each message on its way to those that `hear` let hear it.

    Parameters
    ----------
    heard : (m, n) bool array
    hidden : (n, n) bool array
        Buildings stand between the two antennas.
    senders, sequences : (m,) int array
        As in `hear`; the draws differ from those there.
    loss : float
        Probability that a hidden receiver does not hear after all.
    jitter : float [s]
        The greatest, or the mean of an exponential.
    exponential : bool
    duplication : float
        Probability that what is heard comes in a second copy, with a jitter of its own.
    key : uint64

    Returns
    -------
    (m, n, 2) float array [s]
        Jitter of the first and of the second copy; infinite where there is none.
    """
    m, n = heard.shape
    late = np.full((m, n, 2), np.inf)
    for j in range(m):
        sender = senders[j]
        stream = fold(fold(fold(key, sender), sequences[j]), 1)
        for i in range(n):
            if not heard[j, i]:
                continue
            if hidden[sender, i] and uniform(stream, 4 * i) < loss:
                continue
            copies = 2 if uniform(stream, 4 * i + 1) < duplication else 1
            for copy in range(copies):
                draw = uniform(stream, 4 * i + 2 + copy)
                late[j, i, copy] = jitter * (-math.log1p(-draw) if exponential else draw)
    return late


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    index = np.zeros(1, dtype=np.int64)
    heard = hear(np.zeros((1, 6)), index, index, 1.0, 1.0, 0.0, np.uint64(0))
    fates(heard, heard, index, index, 0.0, 0.0, False, 0.0, np.uint64(0))
