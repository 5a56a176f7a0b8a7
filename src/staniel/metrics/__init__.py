"""Figures of a run, computed from its record: per vehicle, per aircraft, for the team."""

from staniel.metrics.central import central_fusion
from staniel.metrics.compute import compute_metrics
from staniel.metrics.flown import EXPOSURE_RANGE
from staniel.metrics.following import gospa_steps, ospa_steps
from staniel.metrics.gospa import CUTOFF, ORDER, Gospa, gospa
from staniel.metrics.identity import GATE, IdentityScores, identity_scores
from staniel.metrics.nees import anees, consistency_band, nees
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
    "IdentityScores",
    "Ospa",
    "Unwatched",
    "anees",
    "central_fusion",
    "compute_metrics",
    "consistency_band",
    "gospa",
    "gospa_steps",
    "identity_scores",
    "nees",
    "ospa",
    "ospa_steps",
    "team_picture",
    "unwatched",
]
