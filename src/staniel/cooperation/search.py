"""Where nobody has looked for longest: a map of ages over the streets, one in each agent's head."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City, street_cells
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Point
from staniel.kernels.footprint import camera_axes
from staniel.kernels.search import choose, mark

__all__ = ["SearchMap"]

NEVER = -600.0
"""When a cell that nobody has looked at counts as looked at [s]: older than anything seen."""

PATIENCE = 40.0
"""A goal not looked at within this time is given up for a better one [s]."""

LOOK_EVERY = 2.0
"""Time between two entries [s]: an aircraft moves little more than a cell meanwhile."""

SPACING = 150.0
"""Two searching aircraft keep their goals this far apart if they can [m]."""


class SearchMap:
    """When each street cell of the chart was last looked at, by this aircraft or one it heard of.

    Parameters
    ----------
    chart : City
        The map that the agent holds; streets are where it has no building.
    airframe, camera : Airframe, Camera
        The team's: others' poses are taken to carry the same camera.
    cell : float [m]
        Side of a cell.
    """

    def __init__(self, chart: City, airframe: Airframe, camera: Camera, *, cell: float) -> None:
        self._chart, self._airframe, self._camera, self._cell = chart, airframe, camera, cell
        self._places = street_cells(chart, cell, camera.target_height)
        self._looked = np.full(self._places.shape[:2], NEVER)
        self._goal: tuple[int, int] | None = None
        self._chosen_at = -math.inf
        self._looked_at = -math.inf
        self._start: Point = (0.0, 0.0)

    @property
    def ages(self) -> NDArray[np.float64]:
        """When each cell was last looked at, rows from the south [s]; NaN without a street."""
        return np.where(np.isnan(self._places[:, :, 0]), np.nan, self._looked)

    def look(self, time: float, poses: Sequence[Pose], looks: Sequence[Point] = ()) -> None:
        """Take note of what cameras at `poses` have a free view of, by the chart, at `time` [s].

        `looks` are where gimbals look, one a pose [m]; not given, they look straight down.
        """
        if time - self._looked_at < LOOK_EVERY:
            return
        self._looked_at = time
        places = np.array(poses, dtype=np.float64)
        points = np.array(looks or [(math.nan, math.nan)] * len(poses), dtype=np.float64)
        mark(
            self._chart.walls,
            self._looked,
            self._places,
            self._cell,
            places,
            camera_axes(places, points, self._camera.mounting),
            self._camera.half_aperture,
            self._camera.range,
            time,
        )

    def leg(self, time: float, pose: Pose, others: Sequence[Point]) -> tuple[Point, Point]:
        """The straight leg to fly to look: kept until its goal was looked at, or for `PATIENCE`.

        It begins where the aircraft was when it chose: a leg from where it is now would have it
        circle for ever round a goal that is nearer than it can turn.

        Parameters
        ----------
        time : float [s]
        pose : Pose
        others : sequence of (float, float) [m]
            Goals of the other searching aircraft, as they said.

        Returns
        -------
        start, goal : (float, float) [m]
            The goal is the middle of the city, if it has no streets at all.
        """
        done = self._goal is None or self._looked[self._goal] >= self._chosen_at
        if done or time - self._chosen_at >= PATIENCE:
            self._goal = choose(
                self._looked,
                self._places,
                np.array(pose),
                self._airframe.min_turn_radius,
                np.array(others, dtype=np.float64).reshape(-1, 2),
                SPACING,
                time,
            )
            self._chosen_at, self._start = time, (pose.x, pose.y)
        return self._start, self._place(self._goal)

    def forget_goal(self) -> None:
        """Choose anew next time: the aircraft was elsewhere in between."""
        self._goal = None

    def _place(self, index: tuple[int, int] | None) -> Point:
        if index is None or index[0] < 0:
            return self._chart.size[0] / 2.0, self._chart.size[1] / 2.0
        return float(self._places[index][0]), float(self._places[index][1])
