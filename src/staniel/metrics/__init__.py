"""Figures of a run, computed from its record: per vehicle, per aircraft, for the team."""

from staniel.metrics.compute import compute_metrics
from staniel.metrics.flown import EXPOSURE_RANGE
from staniel.metrics.following import GATE, gospa_steps
from staniel.metrics.gospa import CUTOFF, ORDER, Gospa, gospa
from staniel.metrics.ospa import Ospa, ospa
from staniel.metrics.picture import team_picture
from staniel.metrics.unseen import Cause, Unwatched, unwatched

__all__ = [
    "CUTOFF",
    "EXPOSURE_RANGE",
    "GATE",
    "ORDER",
    "Cause",
    "Gospa",
    "Ospa",
    "Unwatched",
    "compute_metrics",
    "gospa",
    "gospa_steps",
    "ospa",
    "team_picture",
    "unwatched",
]
