"""A team whose aircraft carry different cameras."""

from collections.abc import Sequence

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Percept
from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Camera
from staniel.datatypes.truth import Truth
from staniel.world.camera import Cameras

__all__ = ["MixedCameras"]


class MixedCameras:
    """The cameras of a team, kind by kind.

    Each kind looks for the whole team, and of each aircraft the look of its own kind is taken.
    Aircraft, vehicle and look name every draw, so an aircraft sees what it would see in a team that
    carries its camera throughout.

    Parameters
    ----------
    city : City
        The true one.
    cameras : sequence of Camera
        One an aircraft.
    altitude : float [m]
        Above ground, where `Camera.noise` holds.
    seed : numpy.random.SeedSequence
    clock : Clock
    """

    def __init__(
        self,
        city: City,
        cameras: Sequence[Camera],
        altitude: float,
        seed: np.random.SeedSequence,
        clock: Clock,
    ) -> None:
        kinds: list[Camera] = []
        for camera in cameras:
            if camera not in kinds:
                kinds.append(camera)
        self._kind_of = [kinds.index(camera) for camera in cameras]
        self._kinds = [Cameras(city, kind, altitude, seed, clock) for kind in kinds]

    def sense(self, truth: Truth) -> tuple[list[Percept], list[tuple[int, ...]]]:
        """What every camera hands out at this tick; see `Cameras.sense`."""
        seen = [kind.sense(truth) for kind in self._kinds]
        return (
            [seen[kind][0][i] for i, kind in enumerate(self._kind_of)],
            [seen[kind][1][i] for i, kind in enumerate(self._kind_of)],
        )
