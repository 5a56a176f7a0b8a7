"""How to fly it: paths, how to follow them, pursuit policies, avoidance, and known dangers."""

from staniel.guidance.avoidance import Avoidance, avoidance_for
from staniel.guidance.config import GuidanceConfig, LookaheadConfig
from staniel.guidance.dangers import NO_DANGERS, Dangers, KnownDangers
from staniel.guidance.dubins import Paths, Word, shortest
from staniel.guidance.dubins_wind import WindPath, shortest_in_wind
from staniel.guidance.following import (
    Follower,
    carrot_line,
    carrot_loiter,
    follower_named,
    follower_names,
    heading_for_course,
    line_course,
    orbit_course,
)
from staniel.guidance.foresight import predicted_visibility
from staniel.guidance.loiter import loiter, safe_loiter
from staniel.guidance.lookahead import lookahead
from staniel.guidance.orbit import best_radius, orbit
from staniel.guidance.path_manager import PathState, follow
from staniel.guidance.paths import Path, dubins_path, waypoint_path
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
    "NO_DANGERS",
    "Avoidance",
    "Dangers",
    "Follower",
    "GuidanceConfig",
    "KnownDangers",
    "LookaheadConfig",
    "NoFeasibleFlightError",
    "Partner",
    "Path",
    "PathState",
    "Paths",
    "Policy",
    "Pursuit",
    "WindPath",
    "Word",
    "avoidance_for",
    "best_radius",
    "carrot",
    "carrot_line",
    "carrot_loiter",
    "dubins_path",
    "follow",
    "follower_named",
    "follower_names",
    "heading_for_course",
    "line_course",
    "loiter",
    "lookahead",
    "orbit",
    "orbit_course",
    "predicted_visibility",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
    "safe_loiter",
    "shortest",
    "shortest_in_wind",
    "waypoint_path",
]
