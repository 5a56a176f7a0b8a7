"""TOML and a seed become a checked scenario, and its city."""

from staniel.scenario.build import build_city
from staniel.scenario.load import load_scenario, preset_names, preset_text, read_settings
from staniel.scenario.model import Aircraft, CitySource, Scenario
from staniel.scenario.write import dump_scenario

__all__ = [
    "Aircraft",
    "CitySource",
    "Scenario",
    "build_city",
    "dump_scenario",
    "load_scenario",
    "preset_names",
    "preset_text",
    "read_settings",
]
