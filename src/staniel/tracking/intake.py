"""What of the sightings handed in is new, in time and usable."""

from collections import deque
from collections.abc import Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Sighting
from staniel.errors import StanielError
from staniel.kernels.intake import arranged

__all__ = ["Batch", "Intake", "Key"]

_FARTHEST = 1e9
_LARGEST = 1e12
_CLOCK_TOLERANCE = 1e-3

Key = tuple[int, float, float, float]
"""Reporter, time, x, y of a sighting: by which a copy is recognised."""


class Batch(NamedTuple):
    """Sightings of one step in a canonical order: by time, then place, then reporter.

    Attributes
    ----------
    values : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²].
    looks : (m,) int64 array
        Number of the look (reporter and time) that each belongs to, from 0.
    keys : list of Key
        By which a copy of each is recognised.
    """

    values: NDArray[np.float64]
    looks: NDArray[np.int64]
    keys: list[Key]


class Intake:
    """Remembers what it accepted for as long as a copy of it could still be in time.

    Parameters
    ----------
    late_limit : float [s]
        Older sightings are ignored.
    """

    def __init__(self, late_limit: float) -> None:
        self._late_limit = late_limit
        self._heard: set[Key] = set()
        self._accepted: deque[tuple[float, list[Key]]] = deque()

    def read(self, now: float, sightings: Sequence[Sighting]) -> Batch:
        """Check and order the sightings, leaving out the late and the known. Changes nothing.

        Raises
        ------
        StanielError
            A sighting after `now`, or a place or covariance beyond all measure.
        """
        heard, oldest = self._heard, now - self._late_limit
        fresh = {s.key: s for s in sightings if s.time >= oldest and s.key not in heard}
        ordered = sorted(fresh.values(), key=_ROW)
        rows = np.frombuffer(bytearray().join([s.packed for s in ordered])).reshape(-1, 7)
        fault, values, looks = arranged(rows, now + _CLOCK_TOLERANCE, _FARTHEST, _LARGEST)
        if fault >= 0:
            raise _refusal(now, sightings, ordered[fault])
        return Batch(values, looks, [s.key for s in ordered])

    def accept(self, batch: Batch, now: float) -> None:
        """Remember a batch, and forget what is too old to come again."""
        oldest = now - self._late_limit
        while self._accepted and self._accepted[0][0] < oldest:
            self._heard.difference_update(self._accepted.popleft()[1])
        if batch.keys:
            self._heard.update(batch.keys)
            self._accepted.append((now, batch.keys))


_ROW = attrgetter("row")


def _refusal(now: float, sightings: Sequence[Sighting], wrong: Sighting) -> StanielError:
    """What is said of a sighting that cannot be used."""
    number = next(k for k, sighting in enumerate(sightings) if sighting is wrong)
    time, x, y, xx, _, yy, _ = wrong.row
    if time > now + _CLOCK_TOLERANCE:
        return StanielError(
            f"sightings[{number}].time = {time:g}: expected {now:g}, the step's, or earlier"
        )
    return StanielError(
        f"sightings[{number}] at ({x:g}, {y:g}), variances {xx:g} and {yy:g}: "
        f"expected within {_FARTHEST:g} m, and variances up to {_LARGEST:g} m²"
    )
