"""The cameras: what each aircraft perceives of the truth."""

import math
from collections import deque

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Percept, Pose, Sighting
from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Camera
from staniel.datatypes.truth import Truth
from staniel.errors import ScenarioError
from staniel.kernels.camera import Optics, detect
from staniel.kernels.footprint import camera_axes
from staniel.world.faults import taken

__all__ = ["Cameras"]

_ROUNDING = 1e-9

Caught = list[list[tuple[Sighting, int]]]
"""Per aircraft the sightings of one look and the vehicle behind each, -1 for a false alarm."""


class Cameras:
    """Mounted cameras with misses, noise, false alarms, frames and a delay.

    A visible vehicle is detected with a probability that may fall with the range and towards the
    image's edge. A direction is measured with an angular error delta, the same in all directions,
    which makes `Camera.noise` on the ground straight below the reference altitude. Its ray meets
    the ground farther or nearer than the true one: to the first order it is off by s delta across
    the look and by s² delta / h along it, at slant range s and height h. A sighting carries that
    covariance, of its *measured* geometry. False alarms are a Poisson number, uniform over the
    footprint; those that a building would hide, and those outside the city, are dropped.

    Of vehicles nearer together than two pixels only one is seen, at the mean of their places.

    Aircraft, vehicle and look name every draw, so that an aircraft's luck does not depend on who
    else flies, nor on whom it sees. With a delay, and only then, it remembers what was seen and not
    yet handed out; a truth that does not follow the last one forgets it. A camera that dies takes
    no more pictures; what it has taken still arrives.

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
    clock : Clock

    Raises
    ------
    ScenarioError
        A frame interval that is not a whole number of dynamics steps.
    """

    def __init__(
        self,
        city: City,
        camera: Camera,
        altitude: float,
        seed: np.random.SeedSequence,
        clock: Clock = Clock(),  # noqa: B008 - frozen
    ) -> None:
        self._city, self._camera, self._clock = city, camera, clock
        self._optics = Optics(
            half_aperture=camera.half_aperture,
            reach=camera.range,
            height=camera.target_height,
            delta=camera.noise / altitude,
            chance=camera.detection_probability,
            falloff=camera.detection_falloff or 0.0,
            gaussian=1.0 if camera.weighting == "gaussian" else 0.0,
            clutter=camera.clutter,
            blur=camera.pixel_pair,
        )
        self._mount = camera.mounting
        self._every = _substeps(camera, clock)
        self._key = np.uint64(seed.generate_state(1, np.uint64)[0])
        self._tick = -1
        self._waiting: deque[tuple[int, Caught]] = deque()

    def sense(self, truth: Truth) -> tuple[list[Percept], list[tuple[int, ...]]]:
        """What every camera hands out at this tick: of one look in it, of several, or of none.

        Parameters
        ----------
        truth : Truth
            Its paths are where the looks before its own instant were taken from.

        Returns
        -------
        percepts : list of Percept
            One an aircraft; its sightings look by look, in random order within one.
        origins : list of tuple of int
            For the record only: the vehicle of each sighting, -1 for a false alarm.
        """
        arrived: Caught = [[] for _ in truth.aircraft]
        for caught in self._handed_out(truth):
            for mine, new in zip(arrived, caught, strict=True):
                mine.extend(new)
        percepts = [
            Percept(truth.time, Pose(*values), tuple(sighting for sighting, _ in mine))
            for values, mine in zip(truth.aircraft.tolist(), arrived, strict=True)
        ]
        return percepts, [tuple(origin for _, origin in mine) for mine in arrived]

    def _handed_out(self, truth: Truth) -> list[Caught]:
        """The looks whose sightings arrive now, the oldest first."""
        if self._camera.delay == 0.0:
            return [self._look(truth, back) for back in self._looks(truth)]
        if truth.tick != self._tick + 1:
            self._waiting.clear()
        self._tick = truth.tick
        step, decision = self._clock.dynamics_step, self._clock.decision_step
        for back in self._looks(truth):
            late = (self._camera.delay - back * step) / decision
            ready = truth.tick + max(0, math.ceil(late - _ROUNDING))
            self._waiting.append((ready, self._look(truth, back)))
        due = []
        while self._waiting and self._waiting[0][0] <= truth.tick:
            due.append(self._waiting.popleft()[1])
        return due

    def _looks(self, truth: Truth) -> list[int]:
        """Of each look in this tick, the oldest first: how many substeps before its end it was."""
        last = truth.tick * self._clock.substeps
        return [
            back
            for back in range(len(truth.aircraft_path) - 1, -1, -1)
            if (last - back) % self._every == 0
        ]

    def _look(self, truth: Truth, back: int) -> Caught:
        """One look of every camera, `back` substeps before the end of the tick."""
        aircraft, vehicles = truth.aircraft_path[-1 - back], truth.vehicle_path[-1 - back]
        number = (truth.tick * self._clock.substeps - back) // self._every
        rows, sources, first = detect(
            self._city.walls,
            aircraft,
            camera_axes(aircraft, truth.look, self._mount),
            vehicles,
            self._optics,
            self._key,
            number,
        )
        detections, who, bounds = rows.tolist(), sources.tolist(), first.tolist()
        time = truth.time - back * self._clock.dynamics_step if back else truth.time
        caught: Caught = []
        for i, values in enumerate(aircraft.tolist()):
            pose, mine = Pose(*values), slice(bounds[i], bounds[i + 1])
            caught.append(
                [
                    (Sighting(time, (x, y), ((xx, xy), (xy, yy)), reporter=i, pose=pose), origin)  # type: ignore[arg-type]
                    for (x, y, xx, xy, yy), origin in zip(detections[mine], who[mine], strict=True)
                ]
            )
        return taken(caught, truth)


def _substeps(camera: Camera, clock: Clock) -> int:
    """Dynamics steps from one look to the next."""
    if camera.frame_interval is None:
        return clock.substeps
    steps = camera.frame_interval / clock.dynamics_step
    if not math.isclose(steps, round(steps), rel_tol=_ROUNDING):
        raise ScenarioError(
            f"camera.frame_interval = {camera.frame_interval:g} s: expected a whole number of "
            f"clock.dynamics_step = {clock.dynamics_step:g} s"
        )
    return round(steps)
