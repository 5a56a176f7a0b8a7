"""Which broadcasts reach whom."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import fold, uniform

__all__ = ["hear", "warm"]


@njit(cache=True, error_model="numpy")
def hear(
    aircraft: NDArray[np.float64],
    senders: NDArray[np.int64],
    sequences: NDArray[np.int64],
    sigma: float,
    reach: float,
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
    key : uint64

    Returns
    -------
    (m, n) bool array
        False for the sender itself.

    Notes
    -----
    :math:`p = e^{-d^2/2\sigma^2}` up to `reach`, 0 beyond; d the distance in space. Thesis eq. 3.5
    (corrected).
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
                chance = math.exp(-0.5 * square / (sigma * sigma))
                heard[j, i] = uniform(stream, i) < chance
    return heard


def warm() -> None:
    """Compile, or load from the disk cache, what this module is flown with."""
    index = np.zeros(1, dtype=np.int64)
    hear(np.zeros((1, 6)), index, index, 1.0, 1.0, np.uint64(0))
