"""The ground station of the centralised mode: it flies nothing, hears all it can, and assigns.

Like an agent it has an inbox and an outbox on the same lossy radio, and its own tracker. Its awards
are orders; it says them again until a heartbeat shows that they were heard.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.cooperation import CooperationConfig
from staniel.cooperation.allocation import BIDS_TOLD
from staniel.cooperation.auction import assign
from staniel.datatypes.belief import TrackEstimate, TrackId
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.message import Award, Beacon, Heartbeat, Message, Offer
from staniel.kernels.dubins import shortest
from staniel.tracking import Picture, TrackingConfig

__all__ = ["Ground", "GroundBriefing"]


@dataclass(frozen=True, slots=True)
class GroundBriefing:
    """What the station is told before the start."""

    chart: City
    airframe: Airframe
    tracking: TrackingConfig
    cooperation: CooperationConfig


class Ground:
    """The station's mind.

    Parameters
    ----------
    id : int
        Its number on the radio: the one after the aircraft's.
    briefing : GroundBriefing
    rng : numpy.random.Generator
        Its own.
    """

    def __init__(self, id: int, briefing: GroundBriefing, rng: np.random.Generator) -> None:
        self.id, self._briefing = id, briefing
        self._picture = Picture(briefing.tracking, rng, id, briefing.chart)
        self._beats: dict[int, Heartbeat] = {}
        self._assigned: dict[int, TrackId] = {}
        self._sequence = 0

    def step(self, time: float, inbox: Sequence[Message]) -> list[Message]:
        """Hear, track, assign: once every decision step.

        Parameters
        ----------
        time : float [s]
        inbox : sequence of Message
            What arrived since the last step.

        Returns
        -------
        list of Message
            Awards, and a beacon by which the aircraft know that they are led.
        """
        tracks = self._picture.step(time, (), inbox, held=set(self._assigned.values()))
        for message in inbox:
            if isinstance(message, Heartbeat):
                known = self._beats.get(message.sender)
                if known is None or known.sequence < message.sequence:
                    self._beats[message.sender] = message
        lease = self._briefing.cooperation.lease
        self._beats = {k: v for k, v in self._beats.items() if time - v.time <= lease}
        self._sequence += 1
        out: list[Message] = [Beacon(self.id, self._sequence, time)]
        pilots = [k for k in sorted(self._beats, reverse=True) if self._is_fit(k)]
        self._assigned = {k: v for k, v in self._assigned.items() if k in pilots}
        if pilots and tracks:
            out += self._assign(time, pilots, tracks)
        return out

    def _assign(self, time: float, pilots: list[int], tracks: list[TrackEstimate]) -> list[Message]:
        """The least total cost for the whole team, and an award for who does not hold his yet."""
        costs = self._costs(time, pilots, tracks)
        columns = assign(costs).columns.tolist()
        live = {track.id for track in tracks}
        awards: list[Message] = []
        for row, (pilot, column) in enumerate(zip(pilots, columns, strict=True)):
            if column < 0:
                if self._assigned.get(pilot) in live:
                    del self._assigned[pilot]
                continue
            track = tracks[column]
            self._assigned[pilot] = track.id
            if self._beats[pilot].target == track.id:
                continue
            self._sequence += 1
            awards.append(
                Award(
                    self.id,
                    self._sequence,
                    time,
                    target=track.id,
                    position=(*track.position.tolist(),),
                    winner=pilot,
                    cost=float(costs[row, column]),
                    bids=tuple(
                        sorted(
                            (
                                Offer(k, float(c))
                                for k, c in zip(pilots, costs[:, column], strict=True)
                            ),
                            key=lambda offer: offer.cost,
                        )[:8]
                    ),
                )
            )
        return awards

    def _costs(
        self, time: float, pilots: list[int], tracks: list[TrackEstimate]
    ) -> NDArray[np.float64]:
        """Dubins distances, less the margin for who is on it already."""
        config, airframe = self._briefing.cooperation, self._briefing.airframe
        starts = []
        for pilot in pilots:
            beat = self._beats[pilot]
            way = beat.pose.speed * (time - beat.time)
            starts.append(
                (
                    beat.pose.x + way * math.cos(beat.pose.heading),
                    beat.pose.y + way * math.sin(beat.pose.heading),
                    beat.pose.heading,
                )
            )
        goals = [(*track.position.tolist(), track.course) for track in tracks]
        pairs = np.repeat(np.array(starts), len(goals), axis=0)
        costs = shortest(
            pairs, np.tile(np.array(goals), (len(pilots), 1)), airframe.min_turn_radius
        )
        table = costs[0].reshape(len(pilots), len(goals))
        for column, track in enumerate(tracks):
            for row, pilot in enumerate(pilots):
                if self._assigned.get(pilot) == track.id:
                    table[row, column] -= config.handover_margin
        return table

    def _is_fit(self, pilot: int) -> bool:
        return self._beats[pilot].health == "healthy"


def _lowest(pilots: list[int], costs: list[float]) -> tuple[Offer, ...]:
    """The offers that an award tells of."""
    offers = [Offer(pilot, cost) for pilot, cost in zip(pilots, costs, strict=True)]
    return tuple(sorted(offers, key=lambda offer: offer.cost)[:BIDS_TOLD])
