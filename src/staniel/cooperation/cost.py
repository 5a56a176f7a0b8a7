"""What a target costs an aircraft: Dubins distance, and the terms that a scenario switches on."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.cooperation.config import Area, CostConfig, priority_at
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import COST_TERMS, Point
from staniel.kernels.dubins import shortest

__all__ = ["CostModel", "Goal", "Price", "Prices", "Situation"]

Floats = NDArray[np.float64]

_RING = 12
"""Places around a goal from which it is looked at."""

_PIECES = 16
"""Places on the straight way to a goal at which it is asked how dangerous they are."""


class Goal(NamedTuple):
    """A target as its cost sees it: where [m], which way [rad] and how fast [m/s] it drives."""

    position: Point
    course: float
    speed: float = 0.0


class Price(NamedTuple):
    """A cost [m] and the terms that it is the sum of, in the order of `COST_TERMS`.

    No terms: the cost is the distance alone.
    """

    cost: float
    terms: tuple[float, ...] = ()


Prices = Callable[[Sequence[Goal]], list[Price]]
"""What some goals cost an agent, one price each, as `CostModel.prices` of a situation."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a cost depends on beside the goal.

    Attributes
    ----------
    pose : Pose
        The aircraft's.
    energy : float
        Share of it that is left.
    sees : bool
        Whether its camera works.
    rate : callable or None
        Expected losses per second [1/s] at places (n, 3) [m], as the agent knows of dangers; None
        where it knows of none.
    """

    pose: Pose
    energy: float = 1.0
    sees: bool = True
    rate: Callable[[Floats], Floats] | None = None


class CostModel:
    """Prices goals for one aircraft.

    Parameters
    ----------
    config : CostConfig
        The weights; a term of weight 0 is not computed.
    airframe, camera : Airframe, Camera
    chart : City
        What hides goals, as far as the agent knows.
    areas : sequence of Area, optional
        Where targets matter more, or less, for the term ``priority``.
    """

    def __init__(
        self,
        config: CostConfig,
        airframe: Airframe,
        camera: Camera,
        chart: City,
        areas: Sequence[Area] = (),
    ) -> None:
        self._config, self._airframe, self._camera = config, airframe, camera
        self._chart, self._areas = chart, areas
        weights = (config.energy, config.exposure, config.visibility, config.sensor, config.speed)
        self._plain = not any(weights) and not config.priority

    def prices(self, situation: Situation, goals: Sequence[Goal]) -> list[Price]:
        """One price a goal.

        Parameters
        ----------
        situation : Situation
        goals : sequence of Goal

        Returns
        -------
        list of Price
            ``handover`` is 0 in them: only an auction knows who holds what.
        """
        if not goals:
            return []
        pose = situation.pose
        ends = np.array([(*goal.position, goal.course) for goal in goals])
        start = np.array(((pose.x, pose.y, pose.heading),))
        lengths = shortest(start, ends, self._airframe.min_turn_radius)[0].tolist()
        if self._plain:
            return [Price(length) for length in lengths]
        return [
            self._with_terms(situation, goal, length)
            for goal, length in zip(goals, lengths, strict=True)
        ]

    def _with_terms(self, situation: Situation, goal: Goal, length: float) -> Price:
        weights = self._config
        terms = dict.fromkeys(COST_TERMS, 0.0)
        terms["distance"] = length
        terms["energy"] = weights.energy * (1.0 - situation.energy)
        if weights.exposure and situation.rate is not None:
            terms["exposure"] = weights.exposure * self._exposure(situation, goal)
        if weights.visibility:
            terms["visibility"] = weights.visibility * (1.0 - self._visibility(goal))
        if weights.sensor:
            terms["sensor"] = weights.sensor * (1.0 - self._capability(situation))
        terms["speed"] = weights.speed * goal.speed / self._airframe.max_speed
        if weights.priority:
            terms["priority"] = weights.priority * (1.0 - priority_at(self._areas, goal.position))
        return Price(math.fsum(terms.values()), tuple(terms.values()))

    def _exposure(self, situation: Situation, goal: Goal) -> float:
        """Expected losses on the straight way there at the flight's height and speed."""
        pose, rate = situation.pose, situation.rate
        assert rate is not None
        share = (np.arange(_PIECES) + 0.5) / _PIECES
        way = np.subtract(goal.position, (pose.x, pose.y))
        places = np.column_stack(
            [pose.x + share * way[0], pose.y + share * way[1], np.full(_PIECES, pose.z)]
        )
        seconds = float(np.hypot(*way)) / self._airframe.speed
        return float(rate(places).mean()) * seconds

    def _visibility(self, goal: Goal) -> float:
        """Share of a ring at flight height, two turn radii around the goal, that has it in view."""
        angles = np.arange(_RING) * (2.0 * math.pi / _RING)
        radius = 2.0 * self._airframe.min_turn_radius
        eyes = np.column_stack(
            [
                goal.position[0] + radius * np.cos(angles),
                goal.position[1] + radius * np.sin(angles),
                np.full(_RING, self._airframe.altitude),
            ]
        )
        end = [(*goal.position, self._camera.target_height)]
        return float(self._chart.visible(eyes, end).mean())

    def _capability(self, situation: Situation) -> float:
        """Probability that the camera detects a target straight below in one look."""
        camera, height = self._camera, self._airframe.altitude - self._camera.target_height
        ceiling = math.inf if camera.max_height is None else camera.max_height
        if not situation.sees or height > min(ceiling, camera.range):
            return 0.0
        if camera.detection_falloff is None:
            return camera.detection_probability
        fall = (height / camera.range) ** camera.detection_falloff
        return float(camera.detection_probability * (1.0 - fall))
