"""The map: buildings with heights, what they hide, and where they come from."""

from staniel.city.cells import street_cells
from staniel.city.city import City
from staniel.city.coverage import Footprint, footprint
from staniel.city.geojson import CityWarning
from staniel.city.load import load_city
from staniel.city.roads import RoadNetwork
from staniel.city.shadow import visible_ground, visible_share

__all__ = [
    "City",
    "CityWarning",
    "Footprint",
    "RoadNetwork",
    "footprint",
    "load_city",
    "street_cells",
    "visible_ground",
    "visible_share",
]
