"""The threat sensors: dangers around each aircraft that nobody briefed it on."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import Percept
from staniel.datatypes.risk import RiskConfig, region_arrays
from staniel.datatypes.threats import Carrier, Threats
from staniel.datatypes.truth import FLYING, Truth
from staniel.kernels.threats import nearest_points, sensor_draws
from staniel.kernels.walls import visible_pairs

__all__ = ["ThreatSensors"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


class ThreatSensors:
    """Warning receivers with a range, a chance, noise and, if wanted, a free line of sight.

    A region, threat or no-fly, is noticed by the distance in space from the aircraft to the nearest
    point of its volume, floor and ceiling counted, and is then known exactly: it has an outline of
    its own, which does not shift with the aircraft's navigation. A carried threat is noticed by the
    slant range to its vehicle on the ground, and reported where it was measured. Where sight is
    needed, the line to this point, or vehicle, decides for the whole danger.

    It keeps no state: aircraft, tick and danger, by its number in the scenario, name every draw.
    What does not fly notices nothing.

    Parameters
    ----------
    city : City
        The true one.
    risk : RiskConfig
    seed : numpy.random.SeedSequence
        Of the sensors' own streams.
    """

    def __init__(self, city: City, risk: RiskConfig, seed: np.random.SeedSequence) -> None:
        hidden = [(k, region) for k, region in enumerate(risk.regions) if not region.briefed]
        self._walls, self._sensor, self._carried = city.walls, risk.sensor, risk.carried
        self._unbriefed = [region for _, region in hidden]
        self._numbers = np.array([k for k, _ in hidden], dtype=np.int64)
        self._regions = region_arrays(self._unbriefed)
        self._region_key, self._carrier_key = seed.generate_state(2, np.uint64)

    def sense(
        self, truth: Truth, percepts: Sequence[Percept]
    ) -> tuple[list[Percept], list[tuple[int, ...]]]:
        """The same percepts, each with what the aircraft's sensor noticed at this instant.

        Parameters
        ----------
        truth : Truth
        percepts : sequence of Percept
            One an aircraft.

        Returns
        -------
        percepts : list of Percept
        origins : list of tuple of int
            For the record only: of each region noticed its number in the scenario, then of each
            carrier its vehicle.
        """
        sensed: list[Percept] = []
        origins: list[tuple[int, ...]] = []
        for percept, near, carriers in zip(
            percepts, self._near_regions(truth), self._near_carriers(truth), strict=True
        ):
            threats = Threats(
                tuple(self._unbriefed[k] for k in near), tuple(carrier for carrier, _ in carriers)
            )
            sensed.append(dataclasses.replace(percept, threats=threats) if threats else percept)
            vehicles = [vehicle for _, vehicle in carriers]
            origins.append((*self._numbers[near].tolist(), *vehicles))
        return sensed, origins

    def _near_regions(self, truth: Truth) -> list[list[int]]:
        """Per aircraft the unbriefed regions noticed, in the scenario's order."""
        near: list[list[int]] = [[] for _ in truth.aircraft]
        if self._unbriefed:
            places = np.ascontiguousarray(truth.aircraft[:, :3])
            points = nearest_points(places, self._regions, self._sensor.range)
            who, what, _ = self._noticed(truth, points, self._numbers, self._region_key)
            for i, k in zip(who.tolist(), what.tolist(), strict=True):
                near[i].append(k)
        return near

    def _near_carriers(self, truth: Truth) -> list[list[tuple[Carrier, int]]]:
        """Per aircraft the carriers noticed and their vehicles, in the order of measured places."""
        near: list[list[tuple[Carrier, int]]] = [[] for _ in truth.aircraft]
        carried, count = self._carried, len(truth.vehicles)
        if carried.active and count:
            named = range(count) if carried.vehicles is None else carried.vehicles
            vehicles = np.array([k for k in named if k < count], dtype=np.int64)
            ground = np.zeros((len(vehicles), 3))
            ground[:, :2] = truth.vehicles[vehicles, :2]
            points = np.broadcast_to(ground, (len(near), *ground.shape))
            who, what, noise = self._noticed(truth, points, vehicles, self._carrier_key)
            measured = ground[what, :2] + self._sensor.noise * noise
            covariance = self._sensor.noise**2 * np.eye(2)
            covariance.flags.writeable = False  # every carrier has this one
            order = np.lexsort((measured[:, 1], measured[:, 0]))
            for i, k, place in zip(
                who[order].tolist(), vehicles[what[order]].tolist(), measured[order], strict=True
            ):
                carrier = Carrier(
                    truth.time, place.copy(), covariance, carried.radius, carried.rate, reporter=i
                )
                near[i].append((carrier, k))
        return near

    def _noticed(
        self, truth: Truth, points: Floats, numbers: Indices, key: np.uint64
    ) -> tuple[Indices, Indices, Floats]:
        """Who notices what of m dangers at points (n, m, 3) [m], with two standard normals each."""
        places = truth.aircraft[:, :3]
        slant = np.linalg.norm(points - places[:, None], axis=2)
        flying = truth.condition[:, FLYING] > 0.0
        who, what = np.nonzero((slant <= self._sensor.range) & flying[:, None])
        if self._sensor.needs_sight:
            free = visible_pairs(self._walls, places[who], points[who, what])
            who, what = who[free], what[free]
        draws = sensor_draws(key, truth.tick, who, numbers[what])
        lucky = draws[:, 0] < self._sensor.probability
        return who[lucky], what[lucky], draws[lucky, 1:]
