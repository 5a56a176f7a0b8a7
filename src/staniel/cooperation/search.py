"""Where nobody has looked for longest: a map of ages over the streets, one in each agent's head.

What is known of the others comes two ways. Their words (`SearchMap.pack`, `SearchMap.take`) say
which cells were truly looked at, by whomever, and are told on. Their heartbeats say where they are:
what a camera has a free view of from there counts as looked at too, but it is a guess and is not
told on.
"""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.city import City, street_cells
from staniel.cooperation.config import Area
from staniel.cooperation.interest import Cloud, lost_factors, priorities, sight_radius
from staniel.cooperation.looked import pack_looked, unpack_looked
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Heartbeat, Point
from staniel.kernels.footprint import camera_axes
from staniel.kernels.search import choose, mark

__all__ = ["SearchMap"]

NEVER = -600.0
"""When a cell that nobody has looked at counts as looked at [s]: older than anything seen."""

PATIENCE = 40.0
"""A goal not looked at within this time is given up for a better one [s]."""

LOOK_EVERY = 2.0
"""Time between two entries [s]: an aircraft moves little more than a cell meanwhile."""

STALE = 30.0
"""After this time without a heartbeat another aircraft's part of the city is nobody's [s]."""


def _nowhere() -> Sequence[Cloud]:
    return ()


class SearchMap:
    """When each street cell of the chart was last looked at, by this aircraft or another one.

    Parameters
    ----------
    chart : City
        The map that the agent holds; streets are where it has no building.
    airframe, camera : Airframe, Camera
        The aircraft's own: others' are taken to be the same.
    cell : float [m]
        Side of a cell.
    areas : sequence of Area, optional
        Where it matters more, or less, whether somebody looks.
    """

    def __init__(
        self,
        chart: City,
        airframe: Airframe,
        camera: Camera,
        *,
        cell: float,
        areas: Sequence[Area] = (),
    ) -> None:
        self._chart, self._airframe, self._camera, self._cell = chart, airframe, camera, cell
        self._places = street_cells(chart, cell, camera.target_height)
        self._shape = rows, columns = len(self._places), len(self._places[0])
        self._streets = ~np.isnan(self._places[:, :, 0])
        self._priorities: NDArray[np.float64] = priorities(areas, self._places)
        self._told: NDArray[np.float64] = np.full((rows, columns), NEVER)
        self._guessed: NDArray[np.float64] = np.full((rows, columns), NEVER)
        self._others: dict[int, Heartbeat] = {}
        self._marked: dict[int, float] = {}
        self._goal: tuple[int, int] | None = None
        self._chosen_at = -math.inf
        self._looked_at = -math.inf
        self._start: Point = (0.0, 0.0)
        self._first = 0

    @property
    def ages(self) -> NDArray[np.float64]:
        """When each cell was last looked at, rows from the south [s]; NaN without a street."""
        return np.where(self._streets, np.maximum(self._told, self._guessed), np.nan)

    def look(self, time: float, pose: Pose, aim: Point = (math.nan, math.nan)) -> None:
        """Take note of what the own camera has a free view of, by the chart, at `time` [s].

        `aim` is where a gimbal looks [m]; not given, straight down.
        """
        if time - self._looked_at >= LOOK_EVERY:
            self._looked_at = time
            self._mark(self._told, [time], [pose], [aim])

    def hear(self, heartbeats: Iterable[Heartbeat]) -> None:
        """Take note of where the others are, and of what those have a view of that are not blind.

        Parameters
        ----------
        heartbeats : iterable of Heartbeat
            In any order; what is older than what was heard of its sender is not heeded.
        """
        looks = []
        for beat in heartbeats:
            known = self._others.get(beat.sender)
            if known is not None and beat.time <= known.time:
                continue
            self._others[beat.sender] = beat
            marked = self._marked.get(beat.sender, -math.inf)
            if beat.health != "blind" and beat.time - marked >= LOOK_EVERY:
                self._marked[beat.sender] = beat.time
                looks.append(beat)
        if looks:
            self._mark(
                self._guessed,
                [beat.time for beat in looks],
                [beat.pose for beat in looks],
                [beat.goal for beat in looks],
            )

    def pack(self, time: float) -> bytes:
        """What was looked at, for the others: what fits into one word of `looked.MOST_BYTES`.

        What did not fit comes first the next time.
        """
        cells, self._first = pack_looked(self._told, self._streets, time, self._first)
        return cells

    def take(self, cells: bytes, time: float) -> None:
        """Take over what another aircraft says, where it is newer.

        Words may come in any order, late, twice or not at all: a cell keeps the newest time that it
        was said to be looked at.

        Raises
        ------
        StanielError
            It is no such word, or of another map. Nothing has changed then.
        """
        told = unpack_looked(cells, self._shape, time)
        np.maximum(self._told, told, out=self._told, where=self._streets)

    def overdue(self, time: float, age: float) -> float:
        """Share of the street cells not looked at for longer than `age` [s]; 0 where that is 0."""
        if not 0.0 < age < time or not self._streets.any():
            return 0.0
        looked = np.maximum(self._told, self._guessed)[self._streets]
        return float((looked < time - age).mean())

    def leg(
        self, time: float, pose: Pose, lost: Callable[[], Iterable[Cloud]] = _nowhere
    ) -> tuple[Point, Point]:
        """The straight leg to fly to look: kept until its goal was looked at or passed.

        At the latest it is given up after `PATIENCE`. It begins where the aircraft was when it
        chose: a leg from where it is now would have it circle for ever round a goal that is nearer
        than it can turn.

        Parameters
        ----------
        time : float [s]
        pose : Pose
        lost : callable, optional
            Gives where each lost target may be: places (n, 2) [m] and weights (n,) of sum 1. Only
            asked when a goal is to be chosen.

        Returns
        -------
        start, goal : (float, float) [m]
            The goal is the middle of the city, if it has no streets at all.
        """
        if self._is_done(time, pose):
            self._goal = self._choose(time, pose, lost())
            self._chosen_at, self._start = time, (pose.x, pose.y)
        return self._start, self._place(self._goal)

    def forget_goal(self) -> None:
        """Choose anew next time: the aircraft was elsewhere in between."""
        self._goal = None

    def _is_done(self, time: float, pose: Pose) -> bool:
        if self._goal is None or time - self._chosen_at >= PATIENCE:
            return True
        if max(self._told[self._goal], self._guessed[self._goal]) >= self._chosen_at:
            return True
        (x, y), (east, north) = self._start, self._place(self._goal)
        return (east - pose.x) * (east - x) + (north - pose.y) * (north - y) <= 0.0

    def _choose(self, time: float, pose: Pose, lost: Iterable[Cloud]) -> tuple[int, int]:
        searching = [
            beat
            for _, beat in sorted(self._others.items())
            if beat.role in ("search", "patrol")
            and beat.health != "blind"
            and time - beat.time < STALE
        ]
        factors: NDArray[np.float64] = lost_factors(
            lost, self._shape, self._cell, sight_radius(self._airframe, self._camera)
        )
        row, column = choose(
            np.maximum(self._told, self._guessed),
            self._places,
            factors * self._priorities,
            np.array(pose, dtype=np.float64),
            self._airframe.min_turn_radius,
            np.array([beat.pose for beat in searching], dtype=np.float64).reshape(-1, 6),
            np.array([beat.goal for beat in searching], dtype=np.float64).reshape(-1, 2),
            np.array([1.0 - (time - beat.time) / STALE for beat in searching], dtype=np.float64),
            time,
        )
        return int(row), int(column)

    def _mark(
        self,
        looked: NDArray[np.float64],
        times: Sequence[float],
        poses: Sequence[Pose],
        aims: Sequence[Point],
    ) -> None:
        eyes = np.array(poses, dtype=np.float64)
        mark(
            self._chart.walls,
            looked,
            self._places,
            self._cell,
            eyes,
            camera_axes(eyes, np.array(aims, dtype=np.float64), self._camera.mounting),
            self._camera.half_aperture,
            self._camera.range,
            np.array(times, dtype=np.float64),
        )

    def _place(self, index: tuple[int, int] | None) -> Point:
        if index is None or index[0] < 0:
            return self._chart.size[0] / 2.0, self._chart.size[1] / 2.0
        return float(self._places[index][0]), float(self._places[index][1])
