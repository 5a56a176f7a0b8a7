"""What a look would have shown: negative information."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Camera
from staniel.errors import StanielError
from staniel.kernels import footprint, misses

__all__ = ["CameraView", "Coverage", "checked_coverage"]

Places = NDArray[np.float64]
Shows = Callable[[Places], NDArray[np.bool_]]

_CLOCK_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class CameraView:
    """What a camera has in view of the ground, as far as a chart knows what hides it.

    Attributes
    ----------
    chart : City
    camera : Camera
    pose : Pose
        The aircraft's.
    axis : (1, 3) float array
        Along which the camera looks.
    """

    chart: City
    camera: Camera
    pose: Pose
    axis: Places

    @classmethod
    def of(cls, chart: City, camera: Camera, pose: Pose, aim: tuple[float, float]) -> "CameraView":
        """View from a pose; `aim` is where a gimbal looks [m], NaN for straight down."""
        eye, point = np.array([pose], np.float64), np.array([aim], np.float64)
        return cls(chart, camera, pose, footprint.camera_axes(eye, point, camera.mounting))

    def __call__(self, places: Places) -> NDArray[np.bool_]:
        """Which of (n, 2) places it has in view."""
        camera, points = self.camera, np.empty((len(places), 3))
        points[:, :2], points[:, 2] = places, camera.target_height
        eye, walls = np.array([self.pose], np.float64), self.chart.walls
        seen: NDArray[np.bool_] = footprint.look(
            walls, eye, self.axis, points, camera.half_aperture, camera.range
        )[0]
        return seen

    def discount(
        self,
        state: NDArray[np.float32],
        origins: Places,
        log_weights: NDArray[np.float32],
        missed: NDArray[np.int64],
        loss: float,
    ) -> None:
        """As calling it with all particles of the clouds in `staniel.tracking.bank.Bank`."""
        camera = self.camera
        misses.discount(
            self.chart.walls, np.array(self.pose[:3], np.float64), self.axis[0],
            camera.target_height, camera.half_aperture, camera.range, state, origins, log_weights,
            missed, np.float32(loss),
        )  # fmt: skip


class Coverage(NamedTuple):
    """One look: from where, what ground it could see, and how surely it reports what is there.

    Attributes
    ----------
    pose : Pose or None
        Where the camera was.
    visible : shapely polygon or multipolygon, or callable
        Ground that was seen, shadows left out [m]; or ``visible(places)`` that says of an (n, 2)
        array of places which of them were, as an (n,) bool array.
    detection_probability : float
        Of a target in there, in [0, 1).
    time : float, optional [s]
        Of the look; not given: that of the step.
    """

    pose: Pose | None
    visible: BaseGeometry | Shows
    detection_probability: float
    time: float | None = None

    def shows(self, places: Places) -> NDArray[np.bool_]:
        """Which of (n, 2) places were in view."""
        if isinstance(self.visible, BaseGeometry):
            shown: NDArray[np.bool_] = shapely.contains_xy(self.visible, places[:, 0], places[:, 1])
            return shown
        return self.visible(places)


def checked_coverage(coverage: Any, now: float) -> list[Coverage] | None:  # noqa: ANN401 - unchecked
    """The looks, checked, polygons prepared.

    Raises
    ------
    StanielError
        Not a sequence of looks, one that is not (pose, visible, detection probability[, time]), or
        is later than `now`, or whose callable does not answer as it should for one place.
    """
    if coverage is None:
        return None
    if isinstance(coverage, BaseGeometry | Coverage) or not isinstance(coverage, Sequence):
        raise StanielError(
            f"coverage is a {type(coverage).__name__}: expected a sequence of looks, each (pose, "
            "visible polygon, detection probability)"
        )
    return [_checked(f"coverage[{number}]", given, now) for number, given in enumerate(coverage)]


def _checked(name: str, given: Any, now: float) -> Coverage:  # noqa: ANN401 - unchecked
    try:
        look = given if isinstance(given, Coverage) else Coverage(*given)
    except TypeError as error:
        raise StanielError(
            f"{name}: expected (pose, visible polygon, detection probability), "
            f"got {type(given).__name__}"
        ) from error
    probability, time, visible = look.detection_probability, look.time, look.visible
    if not (isinstance(probability, Real) and 0.0 <= probability < 1.0):
        raise StanielError(f"{name}.detection_probability = {probability}: expected 0 to below 1")
    if time is not None and not (
        isinstance(time, Real) and math.isfinite(time) and time <= now + _CLOCK_TOLERANCE
    ):
        raise StanielError(f"{name}.time = {time}: expected {now:g}, the step's, or earlier")
    if isinstance(visible, Polygon | MultiPolygon):
        if not visible.is_valid:
            raise StanielError(
                f"{name}.visible: expected a valid polygon, found "
                f"{shapely.is_valid_reason(visible)}"
            )
        shapely.prepare(visible)
    elif isinstance(visible, CameraView):
        return look
    elif callable(visible):
        _probe(name, visible)
    else:
        raise StanielError(
            f"{name}.visible is a {type(visible).__name__}: expected a polygon or a callable"
        )
    return look


def _probe(name: str, visible: Shows) -> None:
    """Ask a callable of one place, before anything has changed."""
    try:
        answer = visible(np.zeros((1, 2)))
    except Exception as error:
        raise StanielError(f"{name}.visible: fails for the place (0, 0): {error}") from error
    if not (isinstance(answer, np.ndarray) and answer.dtype == bool and answer.shape == (1,)):
        raise StanielError(
            f"{name}.visible: expected a (1,) bool array for one place, got {answer!r}"
        )
