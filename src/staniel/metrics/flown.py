"""What each aircraft flew: its way, how near it came to vehicles, other aircraft and walls."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.truth import FLYING
from staniel.metrics.visible import condition_samples, sample_step
from staniel.record import Record

__all__ = ["EXPOSURE_RANGE", "aircraft_metrics"]

EXPOSURE_RANGE = 100.0
"""An aircraft nearer than this to a vehicle is exposed to it, slant range [m]."""

Floats = NDArray[np.float64]


def aircraft_metrics(record: Record) -> list[dict[str, Any]]:
    """The figures of each aircraft, see ``docs/metrics.md``.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of dict
        With ``id``, ``distance``, ``exposure``, ``min_separation`` and ``building_strikes``.
    """
    # Coordinate by coordinate, aircraft first: each row is then one contiguous path.
    paths = np.ascontiguousarray(record.fine_aircraft[:, :, :3].transpose(2, 1, 0))
    ground = np.zeros((3, *record.fine_vehicles.shape[1::-1]))
    ground[:2] = record.fine_vehicles[:, :, :2].transpose(2, 1, 0)
    step = sample_step(record.fine_times)
    flying = condition_samples(record, FLYING)
    strikes = _strikes(record, flying)
    table = []
    for own in range(paths.shape[1]):
        path = paths[:, own]
        others = np.delete(paths, own, axis=1)
        up = flying[:, own]
        exposed = (_squares(path, ground) < EXPOSURE_RANGE**2).any(axis=0) & up
        both = np.delete(flying, own, axis=1).T & up
        apart = _squares(path, others)[both]
        steps = np.sqrt((np.diff(path) ** 2).sum(axis=0))
        table.append(
            {
                "id": own,
                "distance": float(steps[up[1:] & up[:-1]].sum()),
                "exposure": int(exposed.sum()) * step,
                "min_separation": float(np.sqrt(apart.min())) if apart.size else None,
                "building_strikes": strikes[own],
            }
        )
    return table


def _squares(path: Floats, others: Floats) -> Floats:
    """Squared distances (k, m) from one path (3, m) to k others (3, k, m), instant by instant."""
    squares: Floats = (others[0] - path[0]) ** 2
    squares += (others[1] - path[1]) ** 2
    squares += (others[2] - path[2]) ** 2
    return squares


def _strikes(record: Record, flying: NDArray[np.bool_]) -> list[int]:
    """How often each aircraft flies into a building: runs of segments that a building blocks."""
    poses = record.fine_aircraft[:, :, :3]
    segments, count = max(len(poses) - 1, 0), poses.shape[1]
    starts = np.ascontiguousarray(poses[:-1]).reshape(-1, 3)
    ends = np.ascontiguousarray(poses[1:]).reshape(-1, 3)
    blocked = ~record.city.visible_pairs(starts, ends).reshape(segments, count)
    blocked &= flying[1:] & flying[:-1]
    entered = blocked.copy()
    entered[1:] &= ~blocked[:-1]
    return [int(number) for number in entered.sum(axis=0)]
