"""Staniel: teams of small aircraft that keep moving ground vehicles in sight in a dense city.

>>> import staniel
>>> scenario = staniel.load_scenario("downtown", minutes=1.0)
>>> scenario.aircraft.count
4
"""

from typing import TYPE_CHECKING, Any

from staniel._version import __version__

if TYPE_CHECKING:
    from staniel.city import City
    from staniel.datatypes.belief import Sighting
    from staniel.flight import Run, fly
    from staniel.scenario import Scenario, load_scenario

__all__ = ["City", "Run", "Scenario", "Sighting", "__version__", "fly", "load_scenario"]

_HOMES = {
    "City": "staniel.city",
    "Run": "staniel.flight",
    "Scenario": "staniel.scenario",
    "Sighting": "staniel.datatypes.belief",
    "fly": "staniel.flight",
    "load_scenario": "staniel.scenario",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 - a module attribute can be anything
    """Import a public name when it is first used: `import staniel` itself costs nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'staniel' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value
