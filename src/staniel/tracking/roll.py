"""The roll of live tracks: who they are, how surely they are there, and when each was last seen."""

import math

import numpy as np

from staniel.datatypes.belief import TrackEstimate, TrackId

__all__ = ["Roll"]


class Roll:
    """What is kept of each track beside its particles, in the same order as they.

    Attributes
    ----------
    names : list of TrackId
    known : list of TrackEstimate
        Each track as it was when it was last seen.
    log_odds : (n,) float64 array
        That its target is there.
    unseen : (n,) int64 array
        Steps since a sighting.
    last_seen : (n,) float64 array [s]
        Time of the newest sighting.
    """

    def __init__(self) -> None:
        self.names: list[TrackId] = []
        self.known: list[TrackEstimate] = []
        self.log_odds = np.zeros(0)
        self.unseen = np.zeros(0, np.int64)
        self.last_seen = np.zeros(0)

    def __len__(self) -> int:
        return len(self.names)

    def enter(self, newborn: TrackEstimate) -> None:
        """Add a track at the end."""
        odds = math.log(newborn.existence / (1.0 - newborn.existence))
        self.names.append(newborn.id)
        self.known.append(newborn)
        self.log_odds = np.append(self.log_odds, odds)
        self.unseen = np.append(self.unseen, 0)
        self.last_seen = np.append(self.last_seen, newborn.last_seen)

    def keep(self, kept: list[int]) -> None:
        """Keep only the tracks with these numbers."""
        self.names = [self.names[k] for k in kept]
        self.known = [self.known[k] for k in kept]
        self.log_odds = self.log_odds[kept]
        self.unseen = self.unseen[kept]
        self.last_seen = self.last_seen[kept]

    def rename(self, k: int, name: TrackId) -> None:
        """Call track `k` by another name."""
        self.names[k] = name
        self.known[k] = self.known[k]._replace(id=name)

    def inherit(self, heir: int, donor: int) -> None:
        """Track `heir` keeps its name, and has the better of all that is known of the two."""
        if self.last_seen[donor] > self.last_seen[heir]:
            self.last_seen[heir] = self.last_seen[donor]
            self.known[heir] = self.known[donor]._replace(id=self.names[heir])
        self.log_odds[heir] = max(self.log_odds[heir], self.log_odds[donor])
        self.unseen[heir] = min(self.unseen[heir], self.unseen[donor])
