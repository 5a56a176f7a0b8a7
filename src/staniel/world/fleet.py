"""The team's aircraft: how they start, fly, tire, fail and fall."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.truth import (
    CAMERA,
    CLIMB,
    DRIFT_X,
    DRIFT_Y,
    ENERGY,
    FLYING,
    LOST,
    RADIO,
    Truth,
    nominal,
)
from staniel.kernels.flight import fly
from staniel.world.config import Faults, Launch, Wind
from staniel.world.faults import Failures
from staniel.world.launch import Pad, on_perimeter
from staniel.world.wind import Air

__all__ = ["Fleet"]

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Fleet:
    """All aircraft with the air around them. Keeps no state: that is in the `Truth` handed in.

    Energy falls by 1 / endurance, times 1 + k (n² - 1) in a turn of load factor n = 1 / cos(bank).
    An aircraft without energy is lost, like one that a fault takes: it lies at its last place.

    Parameters
    ----------
    city : City
        The true one.
    airframes : sequence of Airframe
        One an aircraft.
    clock : Clock
    seed : numpy.random.SeedSequence
        Of gusts and faults; not changed.
    wind : Wind
    faults : Faults
    launch : Launch
    following : str
        How the autopilots follow lines and orbits, of `staniel.kernels.following.FOLLOWERS`.
    approach : float [rad]
        Greatest angle at which the vector field joins a line.

    Raises
    ------
    ScenarioError
        A fault of an aircraft that is not there.
    """

    def __init__(
        self,
        city: City,
        airframes: Sequence[Airframe],
        clock: Clock,
        seed: np.random.SeedSequence,
        wind: Wind,
        faults: Faults,
        launch: Launch,
        following: str,
        approach: float,
    ) -> None:
        gust_key, fault_key = seed.generate_state(2, np.uint64)
        self._city, self._airframes, self._clock = city, airframes, clock
        self._limits = limits(airframes, following, approach)
        self._air = Air(wind, airframes, clock, gust_key)
        self._failures = Failures(faults, len(airframes), fault_key)
        self._pad = None if launch.kind == "air" else Pad(launch, airframes, city.tallest)
        minutes = [airframe.endurance_minutes for airframe in airframes]
        self._drain = np.array(
            [0.0 if m is None else clock.decision_step / (60.0 * m) for m in minutes]
        )
        self._turn_power = np.array([airframe.turn_power for airframe in airframes])
        self._plain = self._failures.never and self._pad is None and not self._drain.any()

    def start(self) -> tuple[Floats, Floats, Floats]:
        """Aircraft (n, 6), condition (n, 8) and wind (n, 2) at tick 0, as in `Truth`."""
        count, wind = len(self._airframes), self._air.start()
        if self._plain:
            return on_perimeter(self._city, self._airframes), nominal(count), wind
        in_air = self._pad is None
        aircraft = (
            on_perimeter(self._city, self._airframes)
            if self._pad is None
            else self._pad.standing.copy()
        )
        flying, lost = np.full(count, in_air), np.zeros(count, dtype=np.bool_)
        condition = self._condition(0.0, np.ones(count), flying, lost, np.zeros(count), aircraft)
        return aircraft, condition, wind

    def advance(self, truth: Truth, commands: Sequence[Command]) -> tuple[Floats, Floats, Floats]:
        """Fly one decision step.

        Parameters
        ----------
        truth : Truth
            Not changed.
        commands : sequence of Command
            One an aircraft; not followed on the ground, nor in the first part of a climb-out.

        Returns
        -------
        path : (substeps, n, 6) float array
        condition : (n, 8) float array
        wind : (n, 2) float array
            As in `Truth`, the last two after the step.

        Raises
        ------
        ValueError
            A command that cannot be flown.
        """
        rows = encode(commands)
        dt, substeps = self._clock.dynamics_step, self._clock.substeps
        climbs = np.ascontiguousarray(truth.condition[:, CLIMB])
        air = self._air.advance(truth.wind, truth.aircraft[:, 5], truth.tick)
        if self._plain:
            path, climbs = fly(truth.aircraft, climbs, rows, self._limits, air, dt, substeps)
            condition = truth.condition.copy()
            condition[:, CLIMB] = climbs
            return path, condition, air[-1]
        aircraft, flying = truth.aircraft, truth.condition[:, FLYING] > 0.0
        held, carried = ~flying, air
        if self._pad is not None:
            due = held & (truth.condition[:, LOST] == 0.0) & (self._pad.times <= truth.time)
            aircraft, climbs = self._pad.let_go(due, aircraft, climbs)
            rows, rolling = self._pad.steer(rows, aircraft)
            flying, held = flying | due, held & ~due
            carried = air.copy()
            carried[:, rolling] = 0.0
        path, climbs = fly(aircraft, climbs, rows, self._limits, carried, dt, substeps)
        path[:, held] = aircraft[held]
        condition = self._condition(
            (truth.tick + 1) * self._clock.decision_step,
            self._energy_left(truth.condition[:, ENERGY], flying, path),
            flying,
            truth.condition[:, LOST] > 0.0,
            np.where(held, 0.0, climbs),
            path[-1],
        )
        return path, condition, air[-1]

    def _energy_left(self, energy: Floats, flying: Mask, path: Floats) -> Floats:
        """Share of the energy after the step."""
        power = 1.0 + self._turn_power * (np.tan(path[:, :, 4]) ** 2).mean(axis=0)
        left: Floats = np.maximum(energy - np.where(flying, self._drain * power, 0.0), 0.0)
        return left

    def _condition(
        self,
        time: float,
        energy: Floats,
        flying: Mask,
        lost: Mask,
        climbs: Floats,
        aircraft: Floats,
    ) -> Floats:
        """Conditions at `time`; those that are lost by then are laid on the ground, in place."""
        failures = self._failures
        lost = lost | failures.lost(time) | (energy <= 0.0)
        fell = flying & lost
        aircraft[fell, 2] = aircraft[fell, 4] = aircraft[fell, 5] = 0.0
        flying = flying & ~lost
        condition = nominal(len(aircraft))
        condition[:, ENERGY] = energy
        condition[:, CAMERA] = flying & failures.camera(time)
        condition[:, RADIO] = flying & failures.radio(time)
        condition[:, FLYING], condition[:, LOST] = flying, lost
        condition[:, DRIFT_X : DRIFT_Y + 1] = failures.drift(time)
        condition[:, CLIMB] = np.where(flying, climbs, 0.0)
        return condition
