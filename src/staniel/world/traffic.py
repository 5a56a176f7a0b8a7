"""Traffic in the rows that its kernels read, and where the vehicles begin."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.errors import CityError, ScenarioError
from staniel.kernels.traffic import MEMORY_WIDTH, place, streets
from staniel.world.config import Traffic

__all__ = ["TRIES", "begin", "habits"]

TRIES = 20_000
"""Random places that are tried for each vehicle before the scenario is refused."""

_MOST_NODES = 1_000_000  # of the grid on which streets are joined: about half a second


def habits(traffic: Traffic) -> NDArray[np.float64]:
    """Row of habits for `staniel.kernels.traffic.drive`: see the head of that module."""
    return np.array(
        [
            traffic.speed,
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
    return vehicles, np.zeros((traffic.count, MEMORY_WIDTH))
