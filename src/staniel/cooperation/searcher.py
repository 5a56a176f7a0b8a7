"""One aircraft in the team's search: what it looked at, what it tells of that, where it looks next.

It remembers on a `SearchMap`, and stays where it saw something once as its `Glimpse` says.
"""

import math
from collections.abc import Callable, Iterable, Sequence

from staniel.city import City
from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.glimpse import Glimpse
from staniel.cooperation.interest import Cloud
from staniel.cooperation.search import SearchMap
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Heartbeat, Looked, Message, Point
from staniel.errors import StanielError

__all__ = ["Searcher"]


class Searcher:
    """The aircraft as one who searches.

    Parameters
    ----------
    agent : int
        Its id.
    chart : City
    airframe, camera : Airframe, Camera
    config : CooperationConfig
    glimpse_time : float [s]
        For which it stays where it saw something once.

    Attributes
    ----------
    refused : int
        Words on what was looked at that were none, and were dropped.
    """

    def __init__(
        self,
        agent: int,
        chart: City,
        airframe: Airframe,
        camera: Camera,
        config: CooperationConfig,
        *,
        glimpse_time: float,
    ) -> None:
        self.refused = 0
        self._agent, self._config = agent, config
        self._map = SearchMap(chart, airframe, camera, cell=config.search_cell, areas=config.areas)
        self._glimpse = Glimpse(glimpse_time)
        self._told_at = -math.inf

    def look_around(self, percept: Percept, look: Point, inbox: Iterable[Message]) -> None:
        """Note what was looked at, by this aircraft, whose gimbal looks at `look`, and by others.

        Parameters
        ----------
        percept : Percept
        look : (float, float) [m]
            NaN: straight down.
        inbox : iterable of Message
            Heartbeats and words on what was looked at count, the rest does not.
        """
        time, beats = percept.time, []
        if percept.health.camera:
            self._map.look(time, percept.pose, look)
        for message in inbox:
            if isinstance(message, Heartbeat):
                beats.append(message)
            elif isinstance(message, Looked):
                try:
                    self._map.take(message.cells, time)
                except StanielError:
                    self.refused += 1
        self._map.hear(beats)

    def tell(self, time: float, next_sequence: Callable[[], int]) -> list[Message]:
        """What was looked at, for the others, every `CooperationConfig.share_every` seconds."""
        every = self._config.share_every
        if every == 0.0 or time - self._told_at < every:
            return []
        self._told_at = time
        return [Looked(self._agent, next_sequence(), time, cells=self._map.pack(time))]

    def overdue(self, time: float) -> float:
        """Share of the streets not looked at for `CooperationConfig.revisit_after`."""
        return self._map.overdue(time, self._config.revisit_after)

    def second_look(
        self, time: float, strange: Sequence[Point], tracks: Sequence[Point]
    ) -> Point | None:
        """Where to stay for what was seen once; None where there is nothing to look at again.

        Parameters
        ----------
        time : float [s]
        strange : sequence of (float, float) [m]
            Where the own camera sees now what is none of the tracks'.
        tracks : sequence of (float, float) [m]
            Where the live tracks are.
        """
        near = self._config.same_target
        unknown = [z for z in strange if all(math.dist(z, track) >= near for track in tracks)]
        self._glimpse.note(time, unknown, tracks)
        return self._glimpse.place(time)

    def leg(
        self, time: float, pose: Pose, lost: Callable[[], Iterable[Cloud]]
    ) -> tuple[Point, Point]:
        """The straight leg to fly to look, as `SearchMap.leg`."""
        return self._map.leg(time, pose, lost)

    def forget_goal(self) -> None:
        """Choose anew next time: the aircraft was elsewhere in between."""
        self._map.forget_goal()
