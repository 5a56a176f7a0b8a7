"""What a searching aircraft saw for a moment: it stays until a track says what that was.

A track takes a few looks that agree. Who flies on after the first sees what it had in view behind
the next building, and has its streets marked as looked at.
"""

import math
from collections.abc import Iterable

from staniel.datatypes.message import Point

__all__ = ["Glimpse"]

NEAR = 20.0
"""Two looks this near to each other may have shown the same target [m] ..."""

FASTEST = 10.0
"""... or farther by so much for each second between them [m/s]."""

MOST = 3.0
"""Stays at one place, in a row."""

REST = 0.5
"""Of the time spent at a place where nothing was confirmed, before the next is looked at."""


class Glimpse:
    """The place of a sighting that no track explains, for as long as it is worth a second look.

    Parameters
    ----------
    stay : float [s]
        For which a place is looked at since something was seen there. What is seen elsewhere
        meanwhile, or soon afterwards, is let pass: so false alarms take two thirds of the search at
        most.
    """

    def __init__(self, stay: float) -> None:
        self._stay = stay
        self._place: Point = (0.0, 0.0)
        self._since = self._seen = self._ends = -math.inf

    def note(
        self,
        time: float,
        strangers: Iterable[Point],
        tracks: Iterable[Point] = (),
    ) -> None:
        """Take in where the own camera saw at `time` [s] what no track explains [m].

        And where the live tracks are: one that is near enough by now is what was seen.
        """
        reach = NEAR + FASTEST * (time - self._seen)
        if time < self._ends and any(math.dist(track, self._place) <= reach for track in tracks):
            self._since = self._ends = -math.inf
        for place in strangers:
            if time < self._ends:
                if math.dist(place, self._place) <= reach:
                    self._place, self._seen = place, time
                    self._ends = min(time + self._stay, self._since + MOST * self._stay)
            elif self._since == -math.inf or time - self._ends >= REST * (self._ends - self._since):
                self._place, self._since, self._seen = place, time, time
                self._ends = time + self._stay

    def place(self, time: float) -> Point | None:
        """Where to stay at `time` [s]; None where there is nothing to look at."""
        return self._place if time < self._ends else None
