"""The cameras: what each aircraft perceives of the truth."""

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Percept, Pose, Sighting
from staniel.datatypes.equipment import Camera
from staniel.datatypes.truth import Truth
from staniel.kernels.camera import detect

__all__ = ["Cameras"]


class Cameras:
    """Body-fixed belly cameras with misses, noise and false alarms.

    A visible vehicle is detected with a fixed probability. A direction is measured with a constant
    angular error delta, which makes `Camera.noise` on the ground straight below the reference
    altitude: at slant range s and height h it is s delta across the look and s² delta / h along it.
    A sighting carries the covariance of its *measured* geometry. False alarms are a Poisson number,
    uniform over the footprint; those that a building would hide, and those outside the city, are
    dropped.

    It keeps no state: aircraft, vehicle and tick name every draw, so that an aircraft's luck does
    not depend on who else flies, nor on whom it sees.

    Parameters
    ----------
    city : City
        The true one.
    camera : Camera
        Of every aircraft.
    altitude : float [m]
        Above ground, where `Camera.noise` holds.
    seed : numpy.random.SeedSequence
        Of the cameras' own streams.
    """

    def __init__(
        self, city: City, camera: Camera, altitude: float, seed: np.random.SeedSequence
    ) -> None:
        self._city = city
        self._camera = camera
        self._delta = camera.noise / altitude
        self._key = np.uint64(seed.generate_state(1, np.uint64)[0])

    def sense(self, truth: Truth) -> tuple[list[Percept], list[tuple[int, ...]]]:
        """One look of every camera.

        Parameters
        ----------
        truth : Truth

        Returns
        -------
        percepts : list of Percept
            One an aircraft, sightings in random order.
        origins : list of tuple of int
            For the record only: the vehicle of each sighting, -1 for a false alarm.
        """
        poses = truth.aircraft.tolist()
        camera = self._camera
        rows, sources, first = detect(
            self._city.walls,
            truth.aircraft,
            truth.vehicles,
            camera.half_aperture,
            camera.range,
            camera.target_height,
            self._delta,
            camera.detection_probability,
            camera.clutter,
            self._key,
            truth.tick,
        )
        detections, who, bounds = rows.tolist(), sources.tolist(), first.tolist()
        percepts, origins = [], []
        for i, values in enumerate(poses):
            pose = Pose(*values)
            sightings = tuple(
                Sighting(truth.time, (x, y), ((xx, xy), (xy, yy)), reporter=i, pose=pose)  # type: ignore[arg-type]
                for x, y, xx, xy, yy in detections[bounds[i] : bounds[i + 1]]
            )
            percepts.append(Percept(truth.time, pose, sightings))
            origins.append(tuple(who[bounds[i] : bounds[i + 1]]))
        return percepts, origins
