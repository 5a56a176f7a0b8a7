"""Who drives the vehicles: one interface for wanderers, road followers and recorded tracks."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.world.config import Traffic
from staniel.world.replay import Replayed
from staniel.world.roads import RoadFollowers
from staniel.world.traffic import Wanderers

__all__ = ["Drivers", "drivers_of"]

Floats = NDArray[np.float64]


class Drivers(Protocol):
    """All vehicles' drivers; they keep no state but what they hand out as memory."""

    def begin(self) -> tuple[Floats, Floats]:
        """(n, 4) vehicles as in `Truth`, and the drivers' memory, one row each."""

    def drive(self, vehicles: Floats, memory: Floats, tick: int) -> tuple[Floats, Floats]:
        """(n_substeps, n, 4) vehicles after each dynamics step of a tick, and the new memory."""


def drivers_of(
    city: City, traffic: Traffic, clock: Clock, place_key: np.uint64, drive_key: np.uint64
) -> Drivers:
    """The drivers that a scenario asks for.

    Raises
    ------
    ScenarioError
        Roads or recorded tracks that are missing or cannot be used in this city.
    """
    if traffic.kind == "roads":
        return RoadFollowers(city, traffic, clock, place_key)
    if traffic.kind == "replay":
        return Replayed(city, traffic, clock)
    return Wanderers(city, traffic, clock, place_key, drive_key)
