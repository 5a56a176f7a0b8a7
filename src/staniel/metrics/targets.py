"""What the team achieved on each vehicle: found when, seen and tracked how much and how well."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.metrics.following import Following
from staniel.metrics.nees import anees
from staniel.metrics.visible import gaps, sample_step, since, whole_seconds
from staniel.record import Record

__all__ = ["target_metrics"]

Floats = NDArray[np.float64]


def target_metrics(
    record: Record,
    following: Following,
    visible: NDArray[np.bool_],
    decided_visible: NDArray[np.bool_],
) -> list[dict[str, Any]]:
    """The figures of each vehicle, see ``docs/metrics.md``; None where one is undefined.

    Parameters
    ----------
    record : Record
    following : Following
    visible : (m, n_vehicles) bool array
        At ``record.fine_times``.
    decided_visible : (n, n_vehicles) bool array
        The same at ``record.times``.

    Returns
    -------
    list of dict
    """
    return [
        _one(record, following, visible[:, vehicle], decided_visible[:, vehicle], vehicle)
        for vehicle in range(record.vehicles.shape[1])
    ]


def _one(
    record: Record,
    following: Following,
    visible: NDArray[np.bool_],
    decided_visible: NDArray[np.bool_],
    vehicle: int,
) -> dict[str, Any]:
    start = _first_detection(record, vehicle)
    # Without a detection nothing lies "since" it, and every figure of that time is undefined.
    begin = np.inf if start is None else start
    decided, sampled = since(record.times, begin), since(record.fine_times, begin)
    seconds = whole_seconds(record.fine_times)
    unseen = gaps(visible[sampled], sample_step(record.fine_times))
    tracked = following.tracked[:, vehicle]
    found = record.times[decided & tracked]
    return {
        "id": vehicle,
        "first_detection": start,
        "found_at": float(found[0]) if found.size else None,
        "detection_latency": start,
        "visible_fraction": _share(visible[seconds[sampled[seconds]]]),
        "visible_fraction_fine": _share(visible[sampled]),
        "tracked_fraction": _share(tracked[decided]),
        "longest_gap": None if start is None else max(unseen, default=0.0),
        "mean_gap": None if start is None else sum(unseen) / max(len(unseen), 1),
        "position_rmse": _rms(following.position_error[decided, vehicle]),
        "speed_rmse": _rms(following.speed_error[decided, vehicle]),
        "course_rmse": _rms(following.course_error[decided, vehicle]),
        "position_nees": _anees(following.position_nees[decided & decided_visible, vehicle], 2),
        "identity_switches": int(following.switches[vehicle]),
    }


def _first_detection(record: Record, vehicle: int) -> float | None:
    times = record.sightings["time"][record.sightings["origin"] == vehicle]
    return float(times.min()) if times.size else None


def _share(samples: NDArray[np.bool_]) -> float | None:
    return float(samples.mean()) if samples.size else None


def _anees(values: Floats, dimension: int) -> float | None:
    """ANEES of the values that are there (the others are NaN)."""
    values = values[~np.isnan(values)]
    return float(anees(values, dimension)) if values.size else None


def _rms(errors: Floats) -> float | None:
    """Root mean square of the errors that are there (the others are NaN)."""
    errors = errors[~np.isnan(errors)]
    return float(np.sqrt(np.mean(errors**2))) if errors.size else None
