"""How long the streets wait for the next look: the search judged by what was truly visible."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from staniel.city import street_cells
from staniel.cooperation import CooperationConfig
from staniel.datatypes.truth import CAMERA, FLYING
from staniel.errors import RecordError
from staniel.kernels.footprint import camera_axes
from staniel.kernels.revisit import revisits
from staniel.record import Record

__all__ = ["revisit_metrics"]

_ROUNDING = 1e-6  # of a decision step


def revisit_metrics(record: Record) -> dict[str, Any]:
    """The figures of the streets, see ``docs/metrics.md``; None where one is undefined.

    Parameters
    ----------
    record : Record

    Returns
    -------
    dict
        With ``revisit_mean``, ``revisit_longest``, ``age_mean`` [s] and ``never_seen_share``.

    Raises
    ------
    RecordError
        The record's scenario has cameras or a search cell that no scenario can have.
    """
    cell = _search_cell(record)
    cameras = record.cameras
    optics = [(camera.half_aperture, camera.range, camera.target_height) for camera in cameras]
    places = street_cells(record.city, cell, 0.0)[:, :, :2]
    streets = ~np.isnan(places[:, :, 0])
    if not len(record.times) or not streets.any():
        return dict.fromkeys(("revisit_mean", "revisit_longest", "age_mean", "never_seen_share"))
    steps = np.diff(record.times)
    last, waits, returns, longest, ages = revisits(
        record.city.walls,
        record.times,
        np.ascontiguousarray(record.aircraft, dtype=np.float64),
        _axes(record),
        np.array(optics, dtype=np.float64).reshape(-1, 3),
        np.ascontiguousarray(places),
        cell,
        float(np.median(steps)) * (1.0 + _ROUNDING) if len(steps) else 0.0,
    )
    total = int(returns[streets].sum())
    return {
        "revisit_mean": float(waits[streets].sum()) / total if total else None,
        "revisit_longest": float(longest[streets].max()),
        "age_mean": float(ages[streets].mean()) / len(record.times),
        "never_seen_share": float(np.isnan(last[streets]).mean()),
    }


def _axes(record: Record) -> NDArray[np.float64]:
    """Along which each camera looks at each decision instant; NaN of what is down or blind."""
    poses, looks = record.aircraft, record.looks(record.times)
    axes = np.full((*poses.shape[:2], 3), np.nan)
    for i, camera in enumerate(record.cameras):
        pose = np.ascontiguousarray(poses[:, i], dtype=np.float64)
        axes[:, i] = camera_axes(pose, np.ascontiguousarray(looks[:, i]), camera.mounting)
    works = (record.condition[:, :, CAMERA] > 0.0) & (record.condition[:, :, FLYING] > 0.0)
    axes[~works] = np.nan
    return axes


def _search_cell(record: Record) -> float:
    """Side of a cell of the scenario's search map [m]."""
    try:
        section = CooperationConfig.model_validate(record.scenario.get("cooperation", {}))
    except ValidationError as error:
        raise RecordError(f"scenario.cooperation: {error.errors()[0]['msg']}") from error
    return section.search_cell
