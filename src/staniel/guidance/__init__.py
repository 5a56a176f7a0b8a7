"""How to fly it: loiters, pursuit policies and shortest paths, and the dangers on the way."""

from staniel.guidance.config import GuidanceConfig
from staniel.guidance.dangers import NO_DANGERS, Dangers, KnownDangers
from staniel.guidance.dubins import Paths, Word, shortest
from staniel.guidance.dubins_wind import WindPath, shortest_in_wind
from staniel.guidance.loiter import loiter
from staniel.guidance.pursuit import (
    Policy,
    Pursuit,
    carrot,
    pursuit_names,
    pursuit_policy,
    pursuit_policy_named,
)

__all__ = [
    "NO_DANGERS",
    "Dangers",
    "GuidanceConfig",
    "KnownDangers",
    "Paths",
    "Policy",
    "Pursuit",
    "WindPath",
    "Word",
    "carrot",
    "loiter",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
    "shortest",
    "shortest_in_wind",
]
