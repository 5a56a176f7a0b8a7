"""What threats and no-fly regions did to each aircraft, and when they were noticed."""

from typing import Any

import numpy as np

from staniel.datatypes.truth import FLYING
from staniel.metrics.visible import condition_samples, sample_step
from staniel.record import Record
from staniel.world.risk import Hazards

__all__ = ["danger_metrics", "noticed_metrics"]


def danger_metrics(record: Record) -> list[dict[str, Any]]:
    """The figures of each aircraft, see ``docs/metrics.md``; zeros without risk regions.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of dict
        With ``risk_exposure``, ``no_fly_seconds`` and ``no_fly_violations``.

    Raises
    ------
    RecordError
        The record's scenario has a risk section that no scenario can have.
    """
    paths = record.fine_aircraft.copy()
    paths[~condition_samples(record, FLYING)] = np.nan
    exposure = Hazards(record.risk).exposure(
        paths, record.fine_vehicles, sample_step(record.fine_times)
    )
    columns = (exposure.risk.tolist(), exposure.no_fly.tolist(), exposure.violations.tolist())
    return [
        {"risk_exposure": risk, "no_fly_seconds": seconds, "no_fly_violations": count}
        for risk, seconds, count in zip(*columns, strict=True)
    ]


def noticed_metrics(record: Record) -> list[dict[str, Any]]:
    """When each region that nobody was briefed on was first noticed, by any threat sensor.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of dict
        With ``region``, its number in the scenario, and ``time`` [s], None where never.

    Raises
    ------
    RecordError
        The record's scenario has a risk section that no scenario can have.
    """
    noticed = record.threats[record.threats["kind"] == "region"]
    first: dict[int, float] = {}
    for origin, time in zip(noticed["origin"].tolist(), noticed["time"].tolist(), strict=True):
        first[origin] = min(time, first.get(origin, time))
    return [
        {"region": number, "time": first.get(number)}
        for number, region in enumerate(record.risk.regions)
        if not region.briefed
    ]
