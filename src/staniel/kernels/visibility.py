"""How many aircraft see each vehicle, over many instants: the camera's own test, repeated."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, Mount, camera_axes, look
from staniel.kernels.walls import Walls, warm_walls

__all__ = ["seen_by", "warm"]

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def seen_by(
    walls: Walls,
    aircraft: Floats,
    vehicles: Floats,
    height: float,
    half_aperture: float,
    reach: float,
    mount: Mount,
    looks: Floats,
) -> NDArray[np.int64]:
    """Count the aircraft that have each vehicle in their footprint, in range and in free sight.

    Parameters
    ----------
    walls : Walls
    aircraft : (t, n, 6) float array
        x, y, z [m], heading, bank [rad], speed, as in `staniel.datatypes.truth.Truth`.
    vehicles : (t, k, 4) float array
        x, y [m], heading, speed.
    height : float [m]
        Of the point on a vehicle that is looked at, above ground.
    half_aperture : float [rad]
    reach : float [m]
        The camera's greatest slant range.
    mount : Mount
        How the cameras sit in the aircraft.
    looks : (t, n, 2) float array [m]
        Where gimbals look, as in `camera_axes`.

    Returns
    -------
    (t, k) int array
    """
    instants, count = vehicles.shape[0], vehicles.shape[1]
    seen = np.zeros((instants, count), dtype=np.int64)
    points = np.empty((count, 3))
    points[:, 2] = height
    for t in range(instants):
        for k in range(count):
            points[k, 0] = vehicles[t, k, 0]
            points[k, 1] = vehicles[t, k, 1]
        axes = camera_axes(aircraft[t], looks[t], mount)
        views = look(walls, aircraft[t], axes, points, half_aperture, reach)
        for o in range(views.shape[0]):
            for k in range(count):
                seen[t, k] += views[o, k]
    return seen


def warm() -> None:
    """Compile, or load from the cache, what a flight calls."""
    aircraft, vehicles, looks = (np.zeros((1, 1, columns)) for columns in (6, 4, 2))
    seen_by(warm_walls(), aircraft, vehicles, 1.0, 1.0, 1.0, BODY, looks)
