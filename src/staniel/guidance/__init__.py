"""How to fly it: loiters and pursuit policies."""

from staniel.guidance.config import GuidanceConfig
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
    "GuidanceConfig",
    "Policy",
    "Pursuit",
    "carrot",
    "loiter",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
]
