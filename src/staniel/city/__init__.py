"""The map: buildings with heights, what they hide, and where they come from."""

from staniel.city.city import City
from staniel.city.load import load_city

__all__ = ["City", "load_city"]
