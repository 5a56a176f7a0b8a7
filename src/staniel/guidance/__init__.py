"""How to fly it: paths and how to follow them, loiters and pursuit policies, known dangers."""

from staniel.guidance.config import GuidanceConfig
from staniel.guidance.dangers import NO_DANGERS, Dangers, KnownDangers
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
from staniel.guidance.loiter import loiter
from staniel.guidance.path_manager import PathState, follow
from staniel.guidance.paths import Path, dubins_path, waypoint_path
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
    "Follower",
    "GuidanceConfig",
    "KnownDangers",
    "Path",
    "PathState",
    "Policy",
    "Pursuit",
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
    "orbit_course",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
    "waypoint_path",
]
