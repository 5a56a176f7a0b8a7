"""How to fly it: loiters and pursuit policies."""

from staniel.guidance.config import GuidanceConfig, LookaheadConfig
from staniel.guidance.loiter import loiter, safe_loiter
from staniel.guidance.lookahead import lookahead
from staniel.guidance.orbit import best_radius, orbit
from staniel.guidance.pursuit import (
    NoFeasibleFlightError,
    Partner,
    Policy,
    Pursuit,
    carrot,
    pursuit_names,
    pursuit_policy,
    pursuit_policy_named,
)

__all__ = [
    "GuidanceConfig",
    "LookaheadConfig",
    "NoFeasibleFlightError",
    "Partner",
    "Policy",
    "Pursuit",
    "best_radius",
    "carrot",
    "loiter",
    "lookahead",
    "orbit",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
    "safe_loiter",
]
