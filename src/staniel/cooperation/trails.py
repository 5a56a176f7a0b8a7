"""Where an agent's tracks have been: so it knows an old word for one of them again."""

import math
from bisect import bisect_left
from collections.abc import Iterable

from staniel.cooperation.table import Task
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Point, Unheld

__all__ = ["Trails"]

_SLACK = 1.0  # a vehicle may have been faster before its track began than it is in it [m/s]


class Trails:
    """The places of live tracks over the last time.

    Parameters
    ----------
    memory : float [s]
        How long a place is remembered.
    near : float [m]
        Two places this close are one target's.
    """

    def __init__(self, memory: float, near: float) -> None:
        self._memory, self._near = memory, near
        self._trails: dict[TrackId, tuple[list[float], list[Point]]] = {}

    def note(self, time: float, tasks: Iterable[Task]) -> None:
        """Add where the tracks are at `time` [s], and forget those that live no more."""
        trails = {}
        for task in tasks:
            times, places = self._trails.get(task.id, ([], []))
            times.append(time)
            places.append(task.position)
            if times[0] < time - self._memory:
                del times[0], places[0]
            trails[task.id] = times, places
        self._trails = trails

    def rename(self, old: TrackId, new: TrackId) -> None:
        """The track `old` is called `new` from now on."""
        if old in self._trails:
            self._trails[new] = self._trails.pop(old)

    def exchange(self, one: TrackId, other: TrackId) -> None:
        """Two tracks have each other's name from now on."""
        trails = self._trails
        moved = {new: trails.pop(old) for old, new in ((one, other), (other, one)) if old in trails}
        trails.update(moved)

    def explained(self, words: Iterable[Unheld], speeds: dict[TrackId, float]) -> list[Unheld]:
        """Of which targets one of the tracks is the one, under another name.

        It was there when the target was seen, or began later where the target can have come to.

        Parameters
        ----------
        words : iterable of Unheld
        speeds : dict of TrackId to float [m/s]
            Of the live tracks.

        Returns
        -------
        list of Unheld
            In the order of `words`.
        """
        near, found = self._near, []
        for word in words:
            target, position, _, seen = word
            for name, (times, places) in self._trails.items():
                if seen > times[-1] or name == target:
                    continue
                late = times[0] - seen
                reach = near if late <= 0.0 else near + late * (speeds.get(name, 0.0) + _SLACK)
                if math.dist(places[bisect_left(times, seen)], position) <= reach:
                    found.append(word)
                    break
        return found
