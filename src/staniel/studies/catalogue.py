"""The metrics that a study can show: names, meanings, and what stands for a vehicle never seen."""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from staniel.metrics import Cause

__all__ = ["CATALOGUE", "CAUSES", "Metric", "check_metric", "figures"]


@dataclass(frozen=True, slots=True)
class Metric:
    """One column of the results.

    Attributes
    ----------
    label : str
        For axes and tables.
    unit : str
        ``"%"`` of what is a share.
    better : {"higher", "lower", ""}
    unseen : {"zero", "mission", ""}
        What stands for a vehicle that was never detected, in the mean over a run's vehicles: 0,
        the whole mission's time, or nothing: then the vehicle does not count.
    """

    label: str
    unit: str = ""
    better: Literal["higher", "lower", ""] = ""
    unseen: Literal["zero", "mission", ""] = ""

    def stand_in(self, duration: float) -> float:
        """Value of a vehicle that was never detected, NaN where it does not count."""
        return {"zero": 0.0, "mission": duration, "": math.nan}[self.unseen]


_VEHICLE: Final = {
    "first_detection": Metric("first detection", "s", "lower", "mission"),
    "found_at": Metric("found at", "s", "lower", "mission"),
    "visible_fraction": Metric("in sight, at 1 s", "%", "higher", "zero"),
    "visible_fraction_fine": Metric("in sight", "%", "higher", "zero"),
    "tracked_fraction": Metric("tracked", "%", "higher", "zero"),
    "visible_time": Metric("time in sight", "s", "higher", "zero"),
    "invisible_time": Metric("time out of sight", "s", "lower", "mission"),
    "longest_gap": Metric("longest time out of sight", "s", "lower", "mission"),
    "mean_gap": Metric("mean time out of sight", "s", "lower", "mission"),
    "position_rmse": Metric("position error", "m", "lower"),
    "speed_rmse": Metric("speed error", "m/s", "lower"),
    "course_rmse": Metric("course error", "rad", "lower"),
    "position_nees": Metric("NEES of the position"),
    "identity_switches": Metric("identity switches", "", "lower"),
}
_CAUSES: Final = {
    "watched": Metric("watched", "s", "higher"),
    **{
        f"unwatched_{cause.key}": Metric(f"unwatched: {cause.words}", "s", "lower")
        for cause in Cause
        if cause != Cause.WATCHED
    },
}
"""Seconds of each vehicle, in the order of `staniel.metrics.Cause`."""

_TEAM: Final = {
    "gospa_mean": Metric("mean GOSPA", "m", "lower"),
    "gospa_localisation": Metric("GOSPA, localisation", "m²", "lower"),
    "gospa_missed": Metric("GOSPA, missed", "m²", "lower"),
    "gospa_false": Metric("GOSPA, false", "m²", "lower"),
    "ospa_mean": Metric("mean OSPA", "m", "lower"),
    "visible_fraction": Metric("team's mean in sight, at 1 s", "%", "higher"),
    "tracked_fraction": Metric("team's median tracked", "%", "higher"),
    "position_nees": Metric("team's mean NEES of the position"),
    "identity_switches": Metric("identity switches of all", "", "lower"),
    "fragmentations": Metric("fragmentations", "", "lower"),
    "misses": Metric("misses", "", "lower"),
    "false_positives": Metric("false positives", "", "lower"),
    "mota": Metric("MOTA", "%", "higher"),
    "motp": Metric("MOTP", "m", "lower"),
    "idp": Metric("IDP", "%", "higher"),
    "idr": Metric("IDR", "%", "higher"),
    "idf1": Metric("IDF1", "%", "higher"),
    "tracks_started": Metric("tracks started"),
    "false_tracks": Metric("false tracks", "", "lower"),
    "auctions": Metric("auctions"),
    "handovers": Metric("hand-overs"),
    "double_held_longest": Metric("longest with two holders in reach", "s", "lower"),
    "orphaned_longest": Metric("longest unheld with a free aircraft in reach", "s", "lower"),
    "messages_sent": Metric("messages sent"),
    "messages_delivered": Metric("messages delivered"),
    "messages_possible": Metric("messages possible"),
    "messages_dropped": Metric("messages dropped", "", "lower"),
    "revisit_mean": Metric("mean time to a street's next look", "s", "lower"),
    "revisit_longest": Metric("longest time that a street waited", "s", "lower"),
    "age_mean": Metric("mean time since a street was seen", "s", "lower"),
    "never_seen_share": Metric("streets never seen", "%", "lower"),
}
_AIRCRAFT: Final = {
    "distance": Metric("flown together", "m"),
    "exposure": Metric("exposure together", "s", "lower"),
    "min_separation": Metric("least separation", "m", "higher"),
    "building_strikes": Metric("building strikes together", "", "lower"),
    "risk_exposure": Metric("risk exposure together", "", "lower"),
    "no_fly_seconds": Metric("time in no-fly regions", "s", "lower"),
    "no_fly_violations": Metric("no-fly regions entered", "", "lower"),
    "heard_share": Metric("broadcasts heard", "%", "higher"),
}
_TOGETHER: Final = {"min_separation": "min", "heard_share": "mean"}
"""How the figures of a run's aircraft become one; the others are added up."""

CATALOGUE: Final[Mapping[str, Metric]] = {
    **_VEHICLE,
    **_CAUSES,
    **{f"team_{name}": metric for name, metric in _TEAM.items()},
    **{f"aircraft_{name}": metric for name, metric in _AIRCRAFT.items()},
}
"""Every metric by its column. Those of vehicles differ from row to row of a run, the others do
not."""


CAUSES: Final = tuple(_CAUSES)
"""Columns of the seconds of each cause why a vehicle is not watched, watched ones first."""


def check_metric(where: str, name: str) -> None:
    """Refuse what is no metric.

    Raises
    ------
    ValueError
        Begins with `where`, and names the nearest metric.
    """
    if name in CATALOGUE:
        return
    near = difflib.get_close_matches(name, CATALOGUE, n=1, cutoff=0.6)
    hint = f'did you mean "{near[0]}"?' if near else "expected one of: " + ", ".join(CATALOGUE)
    raise ValueError(f"{where}: unknown metric {name!r}, {hint}")


def figures(metrics: Mapping[str, Any]) -> list[dict[str, float | int | None]]:
    """The catalogue's figures of one run, a row for each vehicle.

    Parameters
    ----------
    metrics : mapping
        As `staniel.metrics.compute_metrics` gives them.

    Returns
    -------
    list of dict
        With ``vehicle`` and every column of `CATALOGUE`; None where a figure is undefined. A run
        without vehicles has one row, of vehicle -1.
    """
    common: dict[str, float | int | None] = {
        f"team_{name}": metrics["team"][name] for name in _TEAM
    }
    for name in _AIRCRAFT:
        values = [one[name] for one in metrics["aircraft"] if one[name] is not None]
        common[f"aircraft_{name}"] = _joined(values, _TOGETHER.get(name, "sum"))
    rows: list[dict[str, float | int | None]] = []
    for target in metrics["targets"] or [{"id": -1}]:
        row = {"vehicle": target["id"], **{name: target.get(name) for name in _VEHICLE}}
        unwatched = target.get("unwatched", {})
        row |= {f"unwatched_{cause}": seconds for cause, seconds in unwatched.items()}
        row["watched"] = target.get("watched")
        share, first = target.get("visible_fraction_fine"), target.get("first_detection")
        if share is not None and first is not None:
            since = metrics["duration"] - first
            row["visible_time"] = round(share * since, 6)
            row["invisible_time"] = round((1.0 - share) * since, 6)
        rows.append({**row, **common})
    return rows


def _joined(values: list[float], how: str) -> float | None:
    if how == "sum":
        return sum(values)
    if not values:
        return None
    return min(values) if how == "min" else sum(values) / len(values)
