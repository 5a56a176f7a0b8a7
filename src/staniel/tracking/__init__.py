"""What an agent believes: one particle filter a track, births, association, deletion."""

from staniel.tracking.config import TrackingConfig
from staniel.tracking.tracker import Tracker

__all__ = ["Tracker", "TrackingConfig"]
