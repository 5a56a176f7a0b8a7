"""What fails, when, and what an aircraft that fails perceives."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Health, Percept, Pose, Sighting
from staniel.datatypes.truth import CAMERA, DRIFT_X, DRIFT_Y, ENERGY, RADIO, Truth
from staniel.errors import ScenarioError
from staniel.kernels.random import fold, uniform
from staniel.world.config import Faults

__all__ = ["KINDS", "Failures", "impair", "taken"]

KINDS = ("camera", "radio", "navigation", "lost")
"""What can fail, in the order of the columns of `Failures.times`."""

_CAMERA, _RADIO, _NAVIGATION, _LOST = range(len(KINDS))
_DIRECTION = len(KINDS)  # counter of the draw of the drift's direction


class Failures:
    """When each thing of each aircraft fails: the scheduled time or the drawn one, what is first.

    Everything is drawn before the start, by a key and the aircraft's number alone.

    Parameters
    ----------
    faults : Faults
    count : int
        Aircraft in the team.
    key : uint64

    Attributes
    ----------
    times : (count, 4) float array [s]
        Of each of `KINDS`; infinite where it never fails.

    Raises
    ------
    ScenarioError
        The schedule names an aircraft that is not there.
    """

    def __init__(self, faults: Faults, count: int, key: np.uint64) -> None:
        self.times = np.full((count, len(KINDS)), math.inf)
        rates = [getattr(faults.rate_per_hour, kind) / 3600.0 for kind in KINDS]
        angles = np.zeros(count)
        for i in range(count):
            stream = np.uint64(fold(key, i))
            angles[i] = 2.0 * math.pi * uniform(stream, _DIRECTION)
            for k, rate in enumerate(rates):
                if rate > 0.0:
                    self.times[i, k] = -math.log(1.0 - uniform(stream, k)) / rate
        for number, fault in enumerate(faults.schedule):
            if fault.aircraft >= count:
                raise ScenarioError(
                    f"faults.schedule[{number}].aircraft = {fault.aircraft}: "
                    f"expected 0 to {count - 1}, the team has {count}"
                )
            k = KINDS.index(fault.kind)
            self.times[fault.aircraft, k] = min(self.times[fault.aircraft, k], fault.time)
        self._drift = faults.drift_rate * np.stack([np.cos(angles), np.sin(angles)], axis=1)

    @property
    def never(self) -> bool:
        """Whether nothing ever fails."""
        return not np.isfinite(self.times).any()

    def camera(self, time: float) -> NDArray[np.bool_]:
        """Which cameras work at `time` [s], (n,) bool array."""
        return self.times[:, _CAMERA] > time

    def radio(self, time: float) -> NDArray[np.bool_]:
        """Which radios work at `time` [s], (n,) bool array."""
        return self.times[:, _RADIO] > time

    def lost(self, time: float) -> NDArray[np.bool_]:
        """Which aircraft are lost by `time` [s], (n,) bool array."""
        return self.times[:, _LOST] <= time

    def drift(self, time: float) -> NDArray[np.float64]:
        """How far each navigation is off at `time` [s], (n, 2) float array [m], east and north."""
        return np.maximum(time - self.times[:, _NAVIGATION], 0.0)[:, None] * self._drift


def impair(percepts: Sequence[Percept], truth: Truth) -> list[Percept]:
    """The percepts with each aircraft's health, and shifted where its navigation is off.

    Sightings are impaired when they are taken, not when they arrive: see `taken`. What the threat
    sensor noticed is mapped from the own pose, too, so its carriers are shifted.

    Parameters
    ----------
    percepts : sequence of Percept
        As equipment that works delivers them, one an aircraft.
    truth : Truth

    Returns
    -------
    list of Percept
    """
    kept = list(percepts)
    columns = [CAMERA, RADIO, ENERGY, DRIFT_X, DRIFT_Y]
    for i, (camera, radio, energy, east, north) in enumerate(truth.condition[:, columns].tolist()):
        health = Health(camera > 0.0, radio > 0.0, energy)
        if health != kept[i].health:
            kept[i] = replace(kept[i], health=health)
        if east or north:
            kept[i] = _shifted(kept[i], east, north)
    return kept


def taken(
    looks: Sequence[list[tuple[Sighting, int]]], truth: Truth
) -> list[list[tuple[Sighting, int]]]:
    """What cameras that may be dead take at this tick, mapped from where navigation says they are.

    Parameters
    ----------
    looks : sequence of list of (Sighting, int)
        As cameras that work take them, one an aircraft, each with the vehicle that it is of.
    truth : Truth
        At the end of the tick: a camera that died in it takes nothing in it.

    Returns
    -------
    list of list of (Sighting, int)
    """
    kept = list(looks)
    condition = truth.condition[:, [CAMERA, DRIFT_X, DRIFT_Y]].tolist()
    for i, (camera, east, north) in enumerate(condition):
        if not camera:
            kept[i] = []
        elif east or north:
            kept[i] = [(_off(sighting, east, north), origin) for sighting, origin in kept[i]]
    return kept


def _off(sighting: Sighting, east: float, north: float) -> Sighting:
    """The sighting as it is mapped with a navigation that is off by (east, north)."""
    return replace(
        sighting,
        position=sighting.position + np.array([east, north]),
        pose=None if sighting.pose is None else _moved(sighting.pose, east, north),
    )


def _shifted(percept: Percept, east: float, north: float) -> Percept:
    """The percept as it is with a navigation that is off by (east, north)."""
    scan = percept.lidar
    if scan is not None:
        scan = replace(
            scan,
            pose=_moved(scan.pose, east, north),
            origins=scan.origins + np.array([east, north]),
        )
    threats = percept.threats
    if threats.carriers:
        carriers = tuple(
            replace(carrier, position=carrier.position + np.array([east, north]))
            for carrier in threats.carriers
        )
        threats = replace(threats, carriers=carriers)
    pose = _moved(percept.pose, east, north)
    return replace(percept, pose=pose, lidar=scan, threats=threats)


def _moved(pose: Pose, east: float, north: float) -> Pose:
    return pose._replace(x=pose.x + east, y=pose.y + north)
