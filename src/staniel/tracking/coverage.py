"""What a look would have shown: negative information."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from staniel.datatypes.belief import Pose
from staniel.errors import StanielError

__all__ = ["Coverage", "checked_coverage"]

Places = NDArray[np.float64]
Shows = Callable[[Places], NDArray[np.bool_]]


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


def checked_coverage(coverage: Sequence[Any] | None, now: float) -> list[Coverage] | None:
    """The looks, checked, polygons prepared.

    Raises
    ------
    StanielError
        One that is not (pose, visible, detection probability[, time]), or later than `now`.
    """
    if coverage is None:
        return None
    looks = []
    for number, given in enumerate(coverage):
        try:
            look = given if isinstance(given, Coverage) else Coverage(*given)
        except TypeError as error:
            raise StanielError(
                f"coverage[{number}]: expected (pose, visible polygon, detection probability), "
                f"got {type(given).__name__}"
            ) from error
        probability = look.detection_probability
        if not (isinstance(probability, float | int) and 0.0 <= probability < 1.0):
            raise StanielError(
                f"coverage[{number}].detection_probability = {probability}: expected 0 to below 1"
            )
        if look.time is not None and not (math.isfinite(look.time) and look.time <= now + 1e-3):
            raise StanielError(
                f"coverage[{number}].time = {look.time}: expected {now:g}, the step's, or earlier"
            )
        if isinstance(look.visible, BaseGeometry):
            if not look.visible.is_valid:
                raise StanielError(
                    f"coverage[{number}].visible: expected a valid polygon, found "
                    f"{shapely.is_valid_reason(look.visible)}"
                )
            shapely.prepare(look.visible)
        elif not callable(look.visible):
            raise StanielError(
                f"coverage[{number}].visible is a {type(look.visible).__name__}: "
                "expected a shapely polygon or a callable"
            )
        looks.append(look)
    return looks
