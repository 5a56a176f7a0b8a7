"""Pursuit policies: where to fly so that a target stays in sight. Rivals of one signature, by name.

A policy is a plain function ``(Pursuit) -> Command``. Whoever writes one of his own registers it::

    @pursuit_policy("mine")
    def mine(pursuit: Pursuit) -> Command: ...

and names it in the scenario: ``guidance.pursuit = "mine"``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import Pose, TrackEstimate
from staniel.datatypes.command import Command, FlyBanks, FlyLine
from staniel.datatypes.equipment import Airframe, Camera
from staniel.errors import StanielError
from staniel.guidance.config import GuidanceConfig
from staniel.guidance.dangers import NO_DANGERS, Dangers
from staniel.guidance.loiter import loiter
from staniel.guidance.registry import Registry

__all__ = [
    "POLICIES",
    "NoFeasibleFlightError",
    "Partner",
    "Policy",
    "Pursuit",
    "carrot",
    "pursuit_names",
    "pursuit_policy",
    "pursuit_policy_named",
]


class NoFeasibleFlightError(StanielError):
    """What a policy raises when it finds no flight that is safe: its agent then loiters."""


@dataclass(frozen=True, slots=True)
class Partner:
    """Another aircraft on the same target, as it said itself.

    Attributes
    ----------
    time : float [s]
        When it said so.
    pose : Pose
        Then.
    plan : FlyBanks or None
        What it was about to fly from then on; None where it did not say.
    """

    time: float
    pose: Pose
    plan: FlyBanks | None


@dataclass(frozen=True, slots=True)
class Pursuit:
    """What a pursuit policy may look at: one aircraft, one track, and the map.

    Attributes
    ----------
    time : float [s]
    pose : Pose
        The aircraft's own.
    track : TrackEstimate
        Of the target, now.
    waypoint : (2,) float array [m]
        The track's prediction `GuidanceConfig.prediction_steps` decision steps ahead (thesis 5.5).
    cloud : callable
        ``particles, weights = cloud()``: the belief about the target, (n, 4) float array of x, y
        [m], vx, vy [m/s] and (n,) float array of weights that sum to 1. Made when asked for.
    airframe, camera : Airframe, Camera
    chart : City
        The map that the agent holds.
    config : GuidanceConfig
    dangers : Dangers
        What the agent knows of threats and no-fly regions: the expected exposure rate at a place,
        and whether it is forbidden to be there.
    partners : tuple of Partner
        Other aircraft on the same target, as of the last message heard of each.
    look : (float, float) [m]
        Ground point that the aircraft's gimbal, if it has one, was led to until now; NaN for none.
    memory : dict
        The agent's own, handed in again at its next step: what a policy wants to keep is there.
    """

    time: float
    pose: Pose
    track: TrackEstimate
    waypoint: NDArray[np.float64]
    cloud: Callable[[], tuple[NDArray[np.float64], NDArray[np.float64]]]
    airframe: Airframe
    camera: Camera
    chart: City
    config: GuidanceConfig
    dangers: Dangers = NO_DANGERS
    partners: tuple[Partner, ...] = ()
    look: tuple[float, float] = (math.nan, math.nan)
    memory: dict[str, Any] = field(default_factory=dict)


Policy = Callable[[Pursuit], Command]

POLICIES: Registry[Policy] = Registry("pursuit policy", "guidance.pursuit", ValueError)
"""All that are registered."""

pursuit_policy = POLICIES.register
"""Decorator: registers a function as the pursuit policy of a name; ValueError where it is taken."""

pursuit_names = POLICIES.names
"""Names of all registered pursuit policies, sorted."""

pursuit_policy_named = POLICIES.named
"""The policy registered under a name; ValueError where nobody did."""


@pursuit_policy("carrot")
def carrot(pursuit: Pursuit) -> Command:
    """Chase the predicted place along a line; circle it when close (thesis 5.5, alg. 5.3)."""
    x, y = pursuit.waypoint.tolist()
    pose, config = pursuit.pose, pursuit.config
    distance = math.hypot(x - pose.x, y - pose.y)
    if distance > config.loiter_entry * config.loiter_radius:
        airframe = pursuit.airframe
        return FlyLine((pose.x, pose.y), (x, y), airframe.speed, airframe.altitude)
    return loiter(pose, (x, y), pursuit.airframe, config)
