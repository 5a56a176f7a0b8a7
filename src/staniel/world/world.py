"""The truth: how it begins and how it goes on from tick to tick."""

import math
from collections.abc import Sequence

import numpy as np

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command, look_point
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.truth import Truth
from staniel.errors import ScenarioError
from staniel.world.config import Faults, Launch, Traffic, Wind
from staniel.world.drivers import drivers_of
from staniel.world.fleet import Fleet

__all__ = ["World"]


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
    wind : Wind, optional
        Calm when not given.
    faults : Faults, optional
    launch : Launch, optional
        In the air around the city when not given.
    airframes : sequence of Airframe, optional
        One an aircraft, where they are not all of one kind; then `airframe` does not count.
    following : {"carrot", "vector-field"}, optional
        How every autopilot follows lines and orbits.
    approach : float [rad], optional
        Greatest angle at which the vector field joins a line.
    low : bool, optional
        Aircraft avoid buildings: they may fly below the tallest roof, and begin clear of those
        that they do not fly over.

    Raises
    ------
    ScenarioError
        No aircraft, aircraft that would not fly above the tallest roof though they are not `low`
        or begin on the ground, a wind as fast as they, no clear place to begin, a fault of an
        aircraft that is not there; roads or recorded tracks that cannot be used.
    """

    def __init__(
        self,
        city: City,
        airframe: Airframe,
        aircraft_count: int,
        traffic: Traffic,
        clock: Clock,
        seed: np.random.SeedSequence,
        *,
        wind: Wind = Wind(),  # noqa: B008 - frozen
        faults: Faults = Faults(),  # noqa: B008
        launch: Launch = Launch(),  # noqa: B008
        airframes: Sequence[Airframe] | None = None,
        following: str = "carrot",
        approach: float = math.radians(60.0),
        low: bool = False,
    ) -> None:
        if aircraft_count < 1:
            raise ScenarioError(f"aircraft count = {aircraft_count}: expected at least 1")
        airframes = airframes or [airframe] * aircraft_count
        for one in airframes:
            _check(one, city.tallest, wind.speed, low and launch.kind == "air")
        self._clock = clock
        own = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 0))
        self._fleet = Fleet(city, airframes, clock, own, wind, faults, launch, following, approach)
        place_key, drive_key = seed.generate_state(2, np.uint64)
        self._drivers = drivers_of(city, traffic, clock, place_key, drive_key)

    def start(self) -> Truth:
        """The truth at tick 0; its paths hold this one instant.

        Returns
        -------
        Truth
            Aircraft spread evenly along the rectangle's perimeter, 30 m inside it, level, at cruise
            speed and altitude, heading for the centre, or on the ground where the launch says so;
            vehicles at rest at random free places, or where their recorded tracks begin.

        Raises
        ------
        CityError
            A city with no free space.
        ScenarioError
            A vehicle for which no place was found.
        """
        vehicles, memory = self._drivers.begin()
        aircraft, condition, wind = self._fleet.start()
        return Truth(
            0, 0.0, aircraft, vehicles, memory, aircraft[None], vehicles[None], condition, wind
        )

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
        aircraft_path, condition, wind = self._fleet.advance(truth, commands)
        vehicle_path, memory = self._drivers.drive(truth.vehicles, truth.traffic, truth.tick)
        tick = truth.tick + 1
        return Truth(
            tick,
            tick * self._clock.decision_step,
            aircraft_path[-1],
            vehicle_path[-1],
            memory,
            aircraft_path,
            vehicle_path,
            condition,
            wind,
            np.array([look_point(command) for command in commands]),
        )


def _check(airframe: Airframe, tallest: float, wind: float, low: bool) -> None:
    if airframe.altitude <= tallest and not low:
        raise ScenarioError(
            f"aircraft.altitude = {airframe.altitude:g} m: expected above the tallest roof "
            f"({tallest:g} m), since aircraft do not avoid buildings"
        )
    if wind >= airframe.speed:
        raise ScenarioError(
            f"wind.speed = {wind:g} m/s: expected below aircraft.speed = {airframe.speed:g} m/s"
        )
