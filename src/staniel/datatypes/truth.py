"""The truth: what the world holds and no agent ever sees."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "AIRCRAFT_COLUMNS",
    "CAMERA",
    "CLIMB",
    "CONDITION_COLUMNS",
    "DRIFT_X",
    "DRIFT_Y",
    "ENERGY",
    "FLYING",
    "LOST",
    "NOMINAL",
    "RADIO",
    "VEHICLE_COLUMNS",
    "Truth",
    "nominal",
]

AIRCRAFT_COLUMNS = ("x", "y", "z", "heading", "bank", "speed")
VEHICLE_COLUMNS = ("x", "y", "heading", "speed")
CONDITION_COLUMNS = ("energy", "camera", "radio", "flying", "lost", "drift_x", "drift_y", "climb")
ENERGY, CAMERA, RADIO, FLYING, LOST, DRIFT_X, DRIFT_Y, CLIMB = range(len(CONDITION_COLUMNS))
NOMINAL = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
"""Condition of an aircraft that flies level and lacks nothing."""


def nominal(count: int) -> NDArray[np.float64]:
    """Conditions of `count` aircraft that lack nothing, (count, 8) float array."""
    return np.tile(np.array(NOMINAL), (count, 1))


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
    condition : (n_aircraft, 8) float array
        Share of the energy left; 1 or 0 each: does the camera deliver, does the radio send and
        hear, does it fly (not before its launch, not once lost), is it lost; how far its navigation
        is off, to east and north [m]; climb rate [m/s]. Not given: nothing is wrong.
    wind : (n_aircraft, 2) float array [m/s]
        Velocity of the air around each aircraft, to east and north. Not given: calm.
    look : (n_aircraft, 2) float array [m]
        Where a gimballed camera was to look during the tick. Not given: NaN, straight down.
    """

    tick: int
    time: float
    aircraft: NDArray[np.float64]
    vehicles: NDArray[np.float64]
    traffic: NDArray[np.float64]
    aircraft_path: NDArray[np.float64]
    vehicle_path: NDArray[np.float64]
    condition: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 8)))
    wind: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    look: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        count = len(self.aircraft)
        if len(self.condition) != count:
            object.__setattr__(self, "condition", nominal(count))
        if len(self.wind) != count:
            object.__setattr__(self, "wind", np.zeros((count, 2)))
        if len(self.look) != count:
            object.__setattr__(self, "look", np.full((count, 2), np.nan))
