"""What of the sightings handed in is new, in time and usable."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Sighting
from staniel.errors import StanielError

__all__ = ["Batch", "Intake", "Key"]

_FARTHEST = 1e9
_LARGEST = 1e12
_CLOCK_TOLERANCE = 1e-3
# A millimetre: no camera is better, and inverse covariances stay inside float32.
_SMALLEST = 1e-6

Key = tuple[int, float, float, float]
"""Reporter, time, x, y of a sighting: by which a copy is recognised."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Sightings of one step in a canonical order: by time, then place, then reporter.

    Attributes
    ----------
    values : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²].
    looks : (m,) int64 array
        Number of the look (reporter and time) that each belongs to, from 0.
    times : list of float [s]
    keys : list of Key
        By which a copy of each is recognised.
    """

    values: NDArray[np.float64]
    looks: NDArray[np.int64]
    times: list[float]
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
        self._heard: dict[float, set[Key]] = {}

    def read(self, now: float, sightings: Sequence[Sighting]) -> Batch:
        """Check and order the sightings, leaving out the late and the known. Changes nothing.

        Raises
        ------
        StanielError
            A sighting after `now`, or a place or covariance beyond all measure.
        """
        heard = self._heard
        fresh: dict[Key, tuple[float, float, float, float, float, float, int]] = {}
        for number, sighting in enumerate(sightings):
            time, x, y, xx, xy, yy, reporter = sighting.row
            if time > now + _CLOCK_TOLERANCE:
                raise StanielError(
                    f"sightings[{number}].time = {time:g}: expected {now:g}, the step's, or earlier"
                )
            if not (abs(x) <= _FARTHEST and abs(y) <= _FARTHEST and xx + yy <= _LARGEST):
                raise StanielError(
                    f"sightings[{number}] at ({x:g}, {y:g}), variances {xx:g} and {yy:g}: "
                    f"expected within {_FARTHEST:g} m, and variances up to {_LARGEST:g} m²"
                )
            key = (reporter, time, x, y)
            if time >= now - self._late_limit and key not in heard.get(time, ()):
                fresh[key] = (time, x, y, xx + _SMALLEST, xy, yy + _SMALLEST, reporter)
        return _batch(fresh)

    def accept(self, batch: Batch, now: float) -> None:
        """Remember a batch, and forget what is too old to come again."""
        oldest = now - self._late_limit
        for time in [time for time in self._heard if time < oldest]:
            del self._heard[time]
        for key in batch.keys:
            self._heard.setdefault(key[1], set()).add(key)


def _batch(fresh: dict[Key, tuple[float, float, float, float, float, float, int]]) -> Batch:
    rows = sorted(fresh.values())
    numbers: dict[tuple[float, int], int] = {}
    looks = [numbers.setdefault((row[0], row[6]), len(numbers)) for row in rows]
    table = np.array(rows, np.float64).reshape(-1, 7)
    return Batch(
        np.ascontiguousarray(table[:, :6]),
        np.array(looks, np.int64),
        [row[0] for row in rows],
        [(row[6], row[0], row[1], row[2]) for row in rows],
    )
