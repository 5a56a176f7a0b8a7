"""The truth: how it begins and how it goes on from tick to tick."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.truth import Truth
from staniel.errors import ScenarioError
from staniel.kernels.flight import fly
from staniel.kernels.traffic import drive
from staniel.world.aircraft import encode, limits
from staniel.world.config import Traffic
from staniel.world.traffic import begin, habits

__all__ = ["World"]

_INSET = 30.0  # how far inside the city's rectangle the aircraft start [m]


class World:
    """A city, the vehicles that drive in it and the aircraft that fly over it.

    It keeps no state: what is the case is in the `Truth` handed in, and every draw is named by a
    key, the vehicle and `Truth.tick`. Adding a vehicle or an aircraft changes no other's draws.

    Parameters
    ----------
    city : City
        The true one.
    airframe : Airframe
        Of every aircraft.
    aircraft_count : int
        At least 1.
    traffic : Traffic
    clock : Clock
    seed : numpy.random.SeedSequence
        Of the world's own streams.

    Raises
    ------
    ScenarioError
        No aircraft, or aircraft that would not fly above the tallest roof.
    """

    def __init__(
        self,
        city: City,
        airframe: Airframe,
        aircraft_count: int,
        traffic: Traffic,
        clock: Clock,
        seed: np.random.SeedSequence,
    ) -> None:
        if aircraft_count < 1:
            raise ScenarioError(f"aircraft count = {aircraft_count}: expected at least 1")
        if airframe.altitude <= city.tallest:
            raise ScenarioError(
                f"aircraft.altitude = {airframe.altitude:g} m: expected above the tallest roof "
                f"({city.tallest:g} m), since aircraft do not avoid buildings"
            )
        self._city = city
        self._airframe = airframe
        self._aircraft_count = aircraft_count
        self._traffic = traffic
        self._clock = clock
        self._limits = limits(airframe)
        self._habits = habits(traffic)
        self._place_key, self._drive_key = seed.generate_state(2, np.uint64)

    def start(self) -> Truth:
        """The truth at tick 0; its paths hold this one instant.

        Returns
        -------
        Truth
            Aircraft spread evenly along the rectangle's perimeter, 30 m inside it, level, at cruise
            speed and altitude, heading for the centre; vehicles at rest at random free places.

        Raises
        ------
        CityError
            A city with no free space.
        ScenarioError
            A vehicle for which no place was found.
        """
        vehicles, memory = begin(self._city, self._traffic, self._place_key)
        aircraft = self._perimeter()
        return Truth(0, 0.0, aircraft, vehicles, memory, aircraft[None], vehicles[None])

    def advance(self, truth: Truth, commands: Sequence[Command]) -> Truth:
        """The truth one decision step later.

        Parameters
        ----------
        truth : Truth
            Not changed.
        commands : sequence of Command
            One an aircraft; each counts from the beginning of the step.

        Returns
        -------
        Truth

        Raises
        ------
        ValueError
            A command that cannot be flown, or not one an aircraft.
        """
        if len(commands) != len(truth.aircraft):
            raise ValueError(f"got {len(commands)} commands for {len(truth.aircraft)} aircraft")
        dt, substeps = self._clock.dynamics_step, self._clock.substeps
        aircraft_path = fly(truth.aircraft, encode(commands), self._limits, dt, substeps)
        vehicle_path, memory = drive(
            self._city.walls,
            truth.vehicles,
            truth.traffic,
            self._habits,
            self._drive_key,
            truth.tick,
            dt,
            substeps,
        )
        tick = truth.tick + 1
        return Truth(
            tick,
            tick * self._clock.decision_step,
            aircraft_path[-1],
            vehicle_path[-1],
            memory,
            aircraft_path,
            vehicle_path,
        )

    def _perimeter(self) -> NDArray[np.float64]:
        """(n, 6) starting states, counter-clockwise from the south-west corner."""
        width, height = self._city.size
        inset = min(_INSET, 0.25 * width, 0.25 * height)
        east, north = width - 2.0 * inset, height - 2.0 * inset
        states = np.zeros((self._aircraft_count, 6))
        for i in range(self._aircraft_count):
            way = 2.0 * (east + north) * i / self._aircraft_count
            if way < east:
                x, y = way, 0.0
            elif way < east + north:
                x, y = east, way - east
            elif way < 2.0 * east + north:
                x, y = 2.0 * east + north - way, north
            else:
                x, y = 0.0, 2.0 * (east + north) - way
            heading = math.atan2(0.5 * north - y, 0.5 * east - x)
            states[i] = (
                inset + x,
                inset + y,
                self._airframe.altitude,
                heading,
                0.0,
                self._airframe.speed,
            )
        return states
