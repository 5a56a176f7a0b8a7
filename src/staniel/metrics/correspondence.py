"""Which track is which target's, instant by instant: CLEAR MOT's correspondence."""

from collections import Counter
from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["Correspondence"]

Floats = NDArray[np.float64]

_Pair = tuple[Hashable, Hashable]
_Near = dict[_Pair, tuple[int, int, float]]
"""Row, column and distance of each (target, track) within the gate."""


class Correspondence:
    """Matches targets with tracks one to one, holds on to the matches, and counts.

    Bernardin and Stiefelhagen 2008, section 2.1.3: a target keeps the track that it was last
    matched with while that is within the gate; of the others as many as possible are matched, and
    among those ways the one with the least sum of distances is taken.

    Parameters
    ----------
    gate : float [m]
        A target and a track farther apart are never matched.

    Attributes
    ----------
    switches : Counter
        Per target: how often its match was another track than its last match before, however long
        ago that was.
    fragmentations : int
        How often a target that had been matched was without a track and then matched again.
    matched : int
        Matches over all instants, switches included.
    distance : float [m]
        Sum of the matches' distances.
    targets, tracks : int
        How many there were, summed over all instants.
    shared : Counter
        In how many instants each (target, track) was within the gate, matched or not.
    """

    def __init__(self, gate: float) -> None:
        self.switches: Counter[Hashable] = Counter()
        self.fragmentations = 0
        self.matched = 0
        self.distance = 0.0
        self.targets = 0
        self.tracks = 0
        self.shared: Counter[tuple[Hashable, Hashable]] = Counter()
        self._gate = gate
        self._last: dict[Hashable, Hashable] = {}
        self._lost: set[Hashable] = set()

    def update(
        self, distances: Floats, targets: Sequence[Hashable], tracks: Sequence[Hashable]
    ) -> None:
        """Take in one instant.

        Parameters
        ----------
        distances : (k, m) float array [m]
            From each target to each track.
        targets : sequence of k hashables
            The targets' ids; no two are equal.
        tracks : sequence of m hashables
            The tracks' ids; no two are equal.
        """
        self.targets += len(targets)
        self.tracks += len(tracks)
        close = distances <= self._gate
        sides = (side.tolist() for side in np.nonzero(close))
        near: _Near = {}
        for row, column, distance in zip(*sides, distances[close].tolist(), strict=True):
            near[targets[row], tracks[column]] = (row, column, distance)
        self.shared.update(near.keys())
        matches = self._kept(near, targets)
        if len(matches) < min(len(targets), len(tracks)):
            matches |= self._found(near, distances, matches)
        for (target, track), (_, _, distance) in matches.items():
            self._count(target, track, distance)
        if len(matches) < len(targets):
            matched = {target for target, _ in matches}
            self._lost |= (self._last.keys() & targets) - matched

    def _kept(self, near: _Near, targets: Sequence[Hashable]) -> _Near:
        """The targets whose last track is near and not another's already."""
        kept: _Near = {}
        taken = set()
        for target in targets:
            if target in self._last:
                track = self._last[target]
                if (target, track) in near and track not in taken:
                    taken.add(track)
                    kept[target, track] = near[target, track]
        return kept

    def _found(self, near: _Near, distances: Floats, kept: _Near) -> _Near:
        """The best matches of the targets and tracks that are left."""
        had, taken = {target for target, _ in kept}, {track for _, track in kept}
        free = {
            place[:2]: pair
            for pair, place in near.items()
            if pair[0] not in had and pair[1] not in taken
        }
        if not free:
            return {}
        from scipy.optimize import linear_sum_assignment

        rows, columns = (sorted(set(side)) for side in zip(*free, strict=True))
        # A forbidden pair costs more than all allowed ones together, so matches come first.
        costs = distances[np.ix_(rows, columns)]
        costs[costs > self._gate] = self._gate * (1 + min(costs.shape))
        chosen = (side.tolist() for side in linear_sum_assignment(costs))
        places = ((rows[i], columns[j]) for i, j in zip(*chosen, strict=True))
        return {free[place]: near[free[place]] for place in places if place in free}

    def _count(self, target: Hashable, track: Hashable, distance: float) -> None:
        self.matched += 1
        self.distance += distance
        if self._last.setdefault(target, track) != track:
            self.switches[target] += 1
            self._last[target] = track
        if target in self._lost:
            self.fragmentations += 1
            self._lost.remove(target)
