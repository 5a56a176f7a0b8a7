"""What an agent believes: one particle filter a track, births, association, fusion, deletion."""

from staniel.tracking.aliases import Aliases
from staniel.tracking.config import TrackingConfig
from staniel.tracking.coverage import CameraView, Coverage
from staniel.tracking.picture import Picture
from staniel.tracking.tracker import Tracker

__all__ = ["Aliases", "CameraView", "Coverage", "Picture", "Tracker", "TrackingConfig"]
