"""What one mind makes of all that it saw and was told: one tracker, and the team's names in it."""

from collections.abc import Collection, Sequence

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Sighting, TrackEstimate, TrackId
from staniel.datatypes.message import Message, Report
from staniel.tracking.aliases import Aliases
from staniel.tracking.config import TrackingConfig
from staniel.tracking.coverage import Coverage
from staniel.tracking.tracker import Tracker

__all__ = ["Picture"]


class Picture:
    """Own sightings and those of others, fused, under names that the team agrees on.

    Parameters
    ----------
    config : TrackingConfig
    rng : numpy.random.Generator
    founder : int
        Who names new tracks.
    chart : City

    Attributes
    ----------
    tracker : Tracker
    """

    def __init__(
        self, config: TrackingConfig, rng: np.random.Generator, founder: int, chart: City
    ) -> None:
        self.tracker = Tracker(config, rng, founder=founder, chart=chart)
        self._aliases = Aliases()

    def step(
        self,
        time: float,
        sightings: Sequence[Sighting],
        inbox: Sequence[Message],
        coverage: Sequence[Coverage] | None = None,
        held: Collection[TrackId] = (),
    ) -> list[TrackEstimate]:
        """Take in a step's sightings and the reports among the messages.

        Parameters
        ----------
        time : float [s]
        sightings : sequence of Sighting
            Its own.
        inbox : sequence of Message
        coverage : sequence of Coverage, optional
            As in `Tracker.step`.
        held : collection of TrackId
            Names that are not to change.

        Returns
        -------
        list of TrackEstimate
            All live tracks.
        """
        reports = [message for message in inbox if isinstance(message, Report)]
        known = list(sightings)
        for report in reports:
            known.extend(report.sightings)
        tracks = self.tracker.step(time, known, coverage)
        told = [
            (report.sender, report.time, own, name)
            for report in reports
            for seen, name in zip(report.sightings, report.names, strict=False)
            if name is not None and (own := self.tracker.owner_of(seen)) is not None
        ]
        live = [track.id for track in tracks]
        for old, new in self._aliases.step(told, live, held):
            self.tracker.rename(old, new)
        return list(self.tracker.estimates)
