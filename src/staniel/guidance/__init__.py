"""How to fly it: loiters, pursuit policies, avoidance, and the dangers known on the way."""

from staniel.guidance.avoidance import Avoidance, avoidance_for
from staniel.guidance.config import GuidanceConfig
from staniel.guidance.dangers import NO_DANGERS, Dangers, KnownDangers
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
    "Avoidance",
    "Dangers",
    "GuidanceConfig",
    "KnownDangers",
    "Policy",
    "Pursuit",
    "avoidance_for",
    "carrot",
    "loiter",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
]
