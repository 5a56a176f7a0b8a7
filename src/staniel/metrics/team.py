"""What the team did together: its picture of the whole, what it agreed and what it said."""

import itertools
import statistics
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.metrics.following import Following
from staniel.metrics.identity import IdentityScores
from staniel.metrics.links import link_matrix
from staniel.record import Record

__all__ = ["handovers", "team_metrics"]


def team_metrics(
    record: Record, following: Following, targets: list[dict[str, Any]]
) -> dict[str, Any]:
    """The figures of the whole team, see ``docs/metrics.md``; None where one is undefined.

    Parameters
    ----------
    record : Record
    following : Following
    targets : list of dict
        Of `target_metrics`.

    Returns
    -------
    dict
    """
    messages = record.messages
    on_air = messages[messages["receivers"] > 0]
    awards = messages[messages["kind"] == "award"]
    means = following.gospa.mean(axis=0).tolist() if len(following.gospa) else [None] * 4
    names = ("gospa_mean", "gospa_localisation", "gospa_missed", "gospa_false")
    # A vehicle that was never detected was visible and tracked for nothing of the time.
    visible = [target["visible_fraction"] or 0.0 for target in targets]
    tracked = [target["tracked_fraction"] or 0.0 for target in targets]
    claims = [nees for target in targets if (nees := target["position_nees"]) is not None]
    return {
        **dict(zip(names, means, strict=True)),
        "ospa_mean": float(following.ospa.mean()) if len(following.ospa) else None,
        "visible_fraction": statistics.fmean(visible) if visible else None,
        "tracked_fraction": statistics.median(tracked) if tracked else None,
        "position_nees": statistics.fmean(claims) if claims else None,
        **_identity(following.identity),
        "tracks_started": following.tracks_started,
        "false_tracks": following.false_tracks,
        "auctions": _different(awards),
        "handovers": handovers(record.decisions),
        "messages_sent": len(on_air) if record.aircraft.shape[1] > 1 else len(messages),
        "messages_delivered": int(messages["heard"].sum()),
        "messages_possible": int(messages["receivers"].sum()),
        "messages_dropped": len(messages) - len(on_air) if record.aircraft.shape[1] > 1 else None,
        "links": link_matrix(record),
    }


def _different(awards: NDArray[np.void]) -> int:
    """How many there are, one that is said again counted once."""
    costs = np.nan_to_num(awards["cost"], nan=-1.0).tolist()
    words = awards[["target", "sender", "winner"]].tolist()
    return len(set(zip(words, costs, strict=True)))


def _identity(scores: IdentityScores) -> dict[str, Any]:
    figures = asdict(scores)
    return {"identity_switches": figures.pop("switches"), **figures}


def handovers(decisions: NDArray[np.void]) -> int:
    """How often responsibility for a target went from one living aircraft to another.

    The holder of a target is the aircraft that names it as its own. While two name it, the one that
    held it before is still the holder; while nobody does, the last one is remembered.

    Parameters
    ----------
    decisions : (n,) array of `staniel.record.DECISION_DTYPE`
        In the order of time; an aircraft that no longer decides has no rows.

    Returns
    -------
    int
    """
    times = decisions["time"]
    bounds = [0, *(np.flatnonzero(np.diff(times)) + 1).tolist(), len(times)]
    agents, targets = decisions["agent"].tolist(), decisions["target"].tolist()
    holder_of: dict[str, int] = {}
    count = 0
    for first, last in itertools.pairwise(bounds):
        claims: dict[str, list[int]] = {}
        for target, agent in zip(targets[first:last], agents[first:last], strict=True):
            if target:
                claims.setdefault(target, []).append(agent)
        for target, claimants in claims.items():
            holder = holder_of.get(target)
            if holder not in claimants:
                count += holder is not None and holder in agents[first:last]
                holder_of[target] = min(claimants)
    return count
