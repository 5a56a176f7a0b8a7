"""What a camera's look that showed nothing says of clouds of particles."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import in_cone
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = ["discount", "warm"]

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Indices = NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def discount(
    walls: Walls,
    eye: Floats,
    axis: Floats,
    height: float,
    half_aperture: float,
    reach: float,
    state: Singles,
    origins: Floats,
    log_weights: Singles,
    missed: Indices,
    loss: np.float32,
) -> None:
    """Add `loss` to the log weights of all particles that a camera has in view, in place.

    Parameters
    ----------
    walls : Walls
        That hide what is behind them.
    eye : (3,) float array [m]
        Where the camera is.
    axis : (3,) float array
        Along which it looks; NaN where it sees nothing.
    height : float [m]
        Of what it looks for, above ground.
    half_aperture, reach : float [rad, m]
    state : (tracks, 4, n) float32 array
        x, y [m, from the track's origin], vx, vy [m/s].
    origins : (tracks, 2) float array [m]
    log_weights : (tracks, n) float32 array
    missed : (k,) int array
        The tracks.
    loss : float
    """
    cosine, x, y, z = math.cos(half_aperture), eye[0], eye[1], eye[2]
    for k in missed:
        for i in range(state.shape[2]):
            px, py = state[k, 0, i] + origins[k, 0], state[k, 1, i] + origins[k, 1]
            if in_cone(
                px - x, py - y, height - z, axis[0], axis[1], axis[2], cosine, reach
            ) and line_of_sight(walls, x, y, z, px, py, height):
                log_weights[k, i] += loss


def warm() -> None:
    """Compile, or load from the disk cache."""
    discount(
        warm_walls(), np.zeros(3), np.zeros(3), 1.0, 1.0, 1.0, np.zeros((1, 4, 1), np.float32),
        np.zeros((1, 2)), np.zeros((1, 1), np.float32), np.zeros(1, np.int64), np.float32(-1.0),
    )  # fmt: skip
