"""The truth: what the world holds and no agent ever sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["AIRCRAFT_COLUMNS", "VEHICLE_COLUMNS", "Truth"]

AIRCRAFT_COLUMNS = ("x", "y", "z", "heading", "bank", "speed")
VEHICLE_COLUMNS = ("x", "y", "heading", "speed")


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything that is the case at one decision instant, and how it came there.

    Attributes
    ----------
    tick : int
        Decision steps since the start.
    time : float [s]
        Since the start.
    aircraft : (n_aircraft, 6) float array
        x, y, z [m], heading [rad], bank [rad, left positive], airspeed [m/s].
    vehicles : (n_vehicles, 4) float array
        x, y [m], heading [rad], speed [m/s].
    traffic : (n_vehicles, k) float array
        What the drivers remember between ticks; its columns belong to `staniel.world.traffic`.
    aircraft_path : (n_substeps, n_aircraft, 6) float array
        Poses at the end of each dynamics substep of the tick; the last is `aircraft`.
    vehicle_path : (n_substeps, n_vehicles, 4) float array
        Likewise for the vehicles.
    """

    tick: int
    time: float
    aircraft: NDArray[np.float64]
    vehicles: NDArray[np.float64]
    traffic: NDArray[np.float64]
    aircraft_path: NDArray[np.float64]
    vehicle_path: NDArray[np.float64]
