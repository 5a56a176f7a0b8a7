"""The truth: traffic, aircraft, camera and radio as they are, which no agent ever sees."""

from staniel.world.camera import Cameras
from staniel.world.config import Faults, Launch, Traffic, Wind
from staniel.world.faults import impair
from staniel.world.kinds import MixedCameras
from staniel.world.lidar import Lidars
from staniel.world.radio import Radio
from staniel.world.risk import Exposure, Hazards
from staniel.world.threats import ThreatSensors
from staniel.world.world import World

__all__ = [
    "Cameras",
    "Exposure",
    "Faults",
    "Hazards",
    "Launch",
    "Lidars",
    "MixedCameras",
    "Radio",
    "ThreatSensors",
    "Traffic",
    "Wind",
    "World",
    "impair",
]
