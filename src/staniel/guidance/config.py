"""How an aircraft is flown to what it was assigned."""

import math
from typing import Literal

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["GuidanceConfig"]


class GuidanceConfig(Config):
    """Pursuit by a policy chosen by name, the loiters around it, and how paths are followed."""

    pursuit: str = Field("carrot", description="name of the pursuit policy")
    prediction_steps: int = Field(
        3, ge=0, le=20, description="decision steps that pursuit looks ahead"
    )
    loiter_radius: float = Field(45.0, gt=0.0, description="radius of a loiter [m]")
    loiter_entry: float = Field(
        1.5, ge=1.0, description="loiter within this many radii of the target"
    )
    recover_time: float = Field(
        25.0, ge=0.0, description="loiter on a lost target's last place [s]"
    )
    following: Literal["carrot", "vector-field"] = Field(
        "carrot", description="how the autopilot follows lines and orbits"
    )
    approach_deg: float = Field(
        60.0, gt=0.0, le=90.0, description="vector field: greatest angle to a line it joins [deg]"
    )

    @property
    def approach(self) -> float:
        """Greatest angle at which the vector field joins a line [rad]."""
        return math.radians(self.approach_deg)
