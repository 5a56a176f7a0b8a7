"""All figures of a run, from its record alone."""

from typing import Any

from staniel.metrics.custody import custody_metrics
from staniel.metrics.dangers import danger_metrics, noticed_metrics
from staniel.metrics.flown import aircraft_metrics
from staniel.metrics.following import follow
from staniel.metrics.links import sender_metrics
from staniel.metrics.revisit import revisit_metrics
from staniel.metrics.targets import target_metrics
from staniel.metrics.team import team_metrics
from staniel.metrics.unseen import unwatched_metrics
from staniel.metrics.visible import visible_decisions, visible_samples
from staniel.record import Record

__all__ = ["compute_metrics"]

_DIGITS = 6


def compute_metrics(record: Record) -> dict[str, Any]:
    """The metrics of a run: a pure function of its record.

    Parameters
    ----------
    record : Record

    Returns
    -------
    dict
        Ready for JSON: strings, booleans, integers, finite floats rounded to six decimals, and None
        where a figure is undefined. Keys ``scenario`` (its name), ``seed``, ``version``,
        ``duration``, ``complete``, ``targets``, ``aircraft`` and ``team``; every figure is defined
        in ``docs/metrics.md``.
    """
    following = follow(record)
    visible = visible_decisions(record)
    targets = target_metrics(record, following, visible_samples(record), visible)
    causes, team_causes = unwatched_metrics(record, visible)
    metrics = {
        "scenario": record.scenario.get("name"),
        "seed": record.scenario.get("seed"),
        "version": record.version,
        "duration": float(record.times[-1]) if len(record.times) else 0.0,
        "complete": bool(record.complete),
        "targets": [
            {**target, **unwatched} for target, unwatched in zip(targets, causes, strict=True)
        ],
        "aircraft": [
            {**flown, **dangers, **heard}
            for flown, dangers, heard in zip(
                aircraft_metrics(record),
                danger_metrics(record),
                sender_metrics(record),
                strict=True,
            )
        ],
        "team": {
            **team_metrics(record, following, targets),
            **team_causes,
            **custody_metrics(record),
            **revisit_metrics(record),
            "risk_noticed": noticed_metrics(record),
        },
    }
    rounded: dict[str, Any] = _rounded(metrics)
    return rounded


def _rounded(value: Any) -> Any:  # noqa: ANN401 -- walks whatever JSON can hold
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_rounded(inner) for inner in value]
    return round(value, _DIGITS) if isinstance(value, float) else value
