"""When each vehicle is truly visible to the team, and the gaps in between."""

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.truth import CAMERA
from staniel.kernels.visibility import seen_by
from staniel.record import Record

__all__ = [
    "condition_samples",
    "gaps",
    "sample_step",
    "since",
    "visible_decisions",
    "visible_samples",
    "whole_seconds",
]

Floats = NDArray[np.float64]

_NOWHERE = -1e6  # height of a camera that sees nothing [m]
_CLOSE = 1e-6  # instants this near to each other are one [s]


def visible_samples(record: Record) -> NDArray[np.bool_]:
    """When each vehicle is in a footprint, in range and in free sight of at least one aircraft.

    Parameters
    ----------
    record : Record

    Returns
    -------
    (m, n_vehicles) bool array
        At ``record.fine_times``.
    """
    works = condition_samples(record, CAMERA)
    return _visible(record, record.fine_times, record.fine_aircraft, record.fine_vehicles, works)


def visible_decisions(record: Record) -> NDArray[np.bool_]:
    """`visible_samples` of the decision instants, (n, n_vehicles) bool array."""
    works = record.condition[:, :, CAMERA] > 0.0
    return _visible(record, record.times, record.aircraft, record.vehicles, works)


def _visible(
    record: Record, times: Floats, aircraft: Floats, vehicles: Floats, works: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    cameras, looks = record.cameras, record.looks(times)
    vehicles = np.ascontiguousarray(vehicles, dtype=np.float64)
    visible = np.zeros(vehicles.shape[:2], dtype=np.bool_)
    for k, camera in enumerate(cameras):
        if camera in cameras[:k]:
            continue
        # One kind at a time: the cameras of the others, and dead ones, are nowhere.
        poses = np.array(aircraft, dtype=np.float64)
        poses[~(works & [other == camera for other in cameras]), 2] = _NOWHERE
        visible |= (
            seen_by(
                record.city.walls,
                poses,
                vehicles,
                camera.target_height,
                camera.half_aperture,
                camera.range,
                camera.mounting,
                looks,
            )
            > 0
        )
    return visible


def condition_samples(record: Record, column: int) -> NDArray[np.bool_]:
    """Whether a condition of each aircraft holds, such as that it flies.

    Parameters
    ----------
    record : Record
    column : int
        Of `Record.condition`; 1 where it holds.

    Returns
    -------
    (m, n_aircraft) bool array
        At ``record.fine_times``: what holds at the end of a tick holds throughout it.
    """
    ticks = np.searchsorted(record.times, record.fine_times - _CLOSE)
    held = record.condition[:, :, column] > 0.0
    return np.asarray(held[np.minimum(ticks, len(held) - 1)])


def whole_seconds(times: Floats) -> NDArray[np.intp]:
    """Index of the first sample of each second.

    Parameters
    ----------
    times : (m,) float array [s]
        Ascending.

    Returns
    -------
    (k,) int array

    Examples
    --------
    >>> whole_seconds(np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0]))
    array([0, 3, 5])
    """
    return np.unique(np.floor(times + _CLOSE), return_index=True)[1]


def since(times: Floats, start: float) -> NDArray[np.bool_]:
    """Which instants lie at or after `start`, (m,) bool array."""
    return times >= start - _CLOSE


def sample_step(times: Floats) -> float:
    """Seconds that one sample stands for: the usual distance between two, 0 with fewer than two."""
    return float(np.median(np.diff(times))) if len(times) > 1 else 0.0


def gaps(visible: NDArray[np.bool_], step: float) -> list[float]:
    """Length of each maximal run of samples without visibility.

    Parameters
    ----------
    visible : (m,) bool array
    step : float [s]
        What one sample stands for.

    Returns
    -------
    list of float [s]
        In the order of time.

    Examples
    --------
    >>> gaps(np.array([False, False, True, False]), 0.5)
    [1.0, 0.5]
    """
    change = np.diff(np.concatenate(([0], (~visible).astype(np.int8), [0])))
    starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    return [int(length) * step for length in ends - starts]
