"""Traffic in the rows that its kernels read, and where the vehicles begin."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.errors import CityError, ScenarioError
from staniel.kernels.random import fold, uniform
from staniel.kernels.streets import place, streets
from staniel.kernels.traffic import MEMORY_WIDTH, ROOM, drive
from staniel.world.config import Traffic

__all__ = ["TRIES", "Wanderers", "begin", "habits", "speeds"]

TRIES = 20_000
"""Random places that are tried for each vehicle before the scenario is refused."""

_MOST_NODES = 1_000_000  # of the grid on which streets are joined: about half a second


_SPEEDS = 1 << 40  # sub-stream of a key from which vehicles draw their speeds


class Wanderers:
    """Differential-drive vehicles that wander the streets on two forward feelers (thesis 4.2).

    Parameters
    ----------
    city : City
    traffic : Traffic
    clock : Clock
    place_key, drive_key : uint64
        Of the draws before and during the mission.
    """

    def __init__(
        self,
        city: City,
        traffic: Traffic,
        clock: Clock,
        place_key: np.uint64,
        drive_key: np.uint64,
    ) -> None:
        self._city = city
        self._traffic = traffic
        self._clock = clock
        self._keys = place_key, drive_key
        self._habits = habits(traffic)
        self._speeds = speeds(traffic, place_key)

    def begin(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `staniel.world.traffic.begin`."""
        return begin(self._city, self._traffic, self._keys[0])

    def drive(
        self, vehicles: NDArray[np.float64], memory: NDArray[np.float64], tick: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `staniel.kernels.traffic.drive`."""
        clock = self._clock
        return drive(
            self._city.walls,
            vehicles,
            memory,
            self._habits,
            self._speeds,
            self._keys[1],
            tick,
            clock.dynamics_step,
            clock.substeps,
        )


def speeds(traffic: Traffic, key: np.uint64) -> NDArray[np.float64]:
    """(count,) speed of each vehicle on a clear way [m/s]: all the same, or each its own."""
    if traffic.speed_range is None:
        return np.full(traffic.count, traffic.speed)
    low, high = traffic.speed_range
    stream = np.uint64(fold(np.uint64(key), _SPEEDS))
    draws = [uniform(stream, i) for i in range(traffic.count)]
    return low + (high - low) * np.array(draws, dtype=np.float64)


def habits(traffic: Traffic) -> NDArray[np.float64]:
    """Row of habits for `staniel.kernels.traffic.drive`: see the head of that module."""
    return np.array(
        [
            traffic.radius,
            traffic.axle,
            traffic.feeler_length,
            math.radians(traffic.feeler_angle_deg),
            math.radians(traffic.turn_rate_deg),
            traffic.cruise_distance,
            traffic.drift_distance,
            traffic.drift_radius,
        ]
    )


def begin(
    city: City, traffic: Traffic, key: np.uint64
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Vehicles at rest at random places of the largest connected part of the streets.

    The centre of each keeps 2 radii + 1 m from every wall and every other vehicle's centre. Closed
    courtyards are left out: nobody could have driven there.

    Parameters
    ----------
    city : City
    traffic : Traffic
    key : uint64
        Of the stream of the draws.

    Returns
    -------
    vehicles : (count, 4) float array
        As in `Truth`.
    memory : (count, MEMORY_WIDTH) float array
        The drivers'.

    Raises
    ------
    CityError
        A city with no free space.
    ScenarioError
        A vehicle for which no place was found.
    """
    width, height = city.size
    radius = traffic.radius
    spacing = max(radius, math.sqrt(width * height / _MOST_NODES))
    street = streets(city.walls, radius, spacing)
    if not street.any():
        raise CityError(
            f"city: no free space for a disc of radius {radius:g} m in {width:g} m x {height:g} m "
            f"({city.density:.0%} built): expected streets"
        )
    clearance = 2.0 * radius + 1.0
    places = place(city.walls, street, spacing, traffic.count, clearance, TRIES, key)
    if len(places) < traffic.count:
        raise ScenarioError(
            f"vehicle {len(places)} cannot be placed: no free place of radius {radius:g} m found "
            f"in {TRIES} tries, at least {clearance:g} m from walls and other vehicles"
        )
    vehicles = np.zeros((traffic.count, 4))
    vehicles[:, :3] = places
    memory = np.zeros((traffic.count, MEMORY_WIDTH))
    memory[:, ROOM] = -1.0  # nothing surveyed
    return vehicles, memory
