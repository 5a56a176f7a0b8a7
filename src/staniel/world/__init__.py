"""The truth: traffic, aircraft, camera and radio as they are, which no agent ever sees."""

from staniel.world.camera import Cameras
from staniel.world.config import Traffic
from staniel.world.radio import Radio
from staniel.world.world import World

__all__ = ["Cameras", "Radio", "Traffic", "World"]
