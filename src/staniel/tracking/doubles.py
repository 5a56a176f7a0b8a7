"""Two tracks on one target: how that is noticed."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import TrackId

__all__ = ["Doubles", "dispersion"]


class Doubles:
    """Counts for how long tracks have shared a place.

    Parameters
    ----------
    distance : float [m]
        Two tracks as near as this share a place.
    steps : int
        After so many steps in a row they are one target.
    """

    def __init__(self, distance: float, steps: int) -> None:
        self._distance = distance
        self._steps = steps
        self._overlaps: dict[tuple[TrackId, TrackId], int] = {}

    def step(
        self,
        names: Sequence[TrackId],
        positions: NDArray[np.float64],
        owners: NDArray[np.int64],
        looks: NDArray[np.int64],
    ) -> list[tuple[int, int]]:
        """Pairs (younger, older) that are one target, by their numbers in `names`.

        Two tracks that took sightings of one look are two targets, however close: their count
        starts again. A track is in one pair at most.
        """
        close = self._close(positions)
        overlaps: dict[tuple[TrackId, TrackId], int] = {}
        doubles: list[tuple[int, int]] = []
        looked = _looked(owners, looks) if close else {}
        for a, b in close:
            if looked.get(a, set()) & looked.get(b, set()):
                continue
            older, younger = sorted((a, b), key=lambda k: names[k])
            pair = (names[older], names[younger])
            overlaps[pair] = self._overlaps.get(pair, 0) + 1
            taken = any(k in double for double in doubles for k in (a, b))
            if overlaps[pair] >= self._steps and not taken:
                doubles.append((younger, older))
        self._overlaps = overlaps
        return doubles

    def forget(self, track: TrackId) -> None:
        """Start again with a track that changes its name."""
        self._overlaps = {pair: n for pair, n in self._overlaps.items() if track not in pair}

    def _close(self, positions: NDArray[np.float64]) -> list[tuple[int, int]]:
        """Pairs within the distance, found by a sweep along the east axis."""
        reach = self._distance
        east = sorted(positions[:, 0].tolist())
        if all(b - a > reach for a, b in pairwise(east)):
            return []
        places = positions.tolist()
        order = sorted(range(len(places)), key=lambda k: places[k][0])
        pairs = []
        for i, a in enumerate(order):
            for b in order[i + 1 :]:
                if places[b][0] - places[a][0] > reach:
                    break
                if math.dist(places[a], places[b]) <= reach:
                    pairs.append((a, b))
        return pairs


def _looked(owners: NDArray[np.int64], looks: NDArray[np.int64]) -> dict[int, set[int]]:
    """The looks that each track took sightings of."""
    looked: dict[int, set[int]] = {}
    for owner, look in zip(owners.tolist(), looks.tolist(), strict=True):
        looked.setdefault(owner, set()).add(look)
    return looked


def dispersion(covariance: NDArray[np.float64]) -> float:
    """Spread along the longer axis [m]: root of the larger eigenvalue of a (2, 2) covariance."""
    xx, xy, _, yy = covariance.ravel().tolist()
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))
