"""How an aircraft is flown to what it was assigned."""

import math
from typing import Annotated, Literal, Self

import shapely
from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["GuidanceConfig", "LookaheadConfig"]


class LookaheadConfig(Config):
    """The search of the policy `lookahead`, see docs/pursuit.md."""

    horizon: int = Field(18, ge=2, le=60, description="how far ahead flights are looked at [s]")
    banks: int = Field(5, ge=3, le=15, description="different banks, evenly from limit to limit")
    width: int = Field(24, ge=1, le=5000, description="flights kept after each second")
    polish: int = Field(2, ge=0, le=10, description="times that the best are gone through")
    particles: int = Field(16, ge=1, le=200, description="places that stand for the belief")
    discount: float = Field(0.95, gt=0.0, le=1.0, description="worth of sight a second later")
    effort: float = Field(
        0.0, ge=0.0, le=10.0, description="sight that a second of banking by 1 rad costs [s]"
    )
    exposure: float = Field(
        1.0, ge=0.0, le=1e6, description="sight that one unit of exposure to a threat costs [s]"
    )
    trust: float = Field(
        0.9, ge=0.0, le=1.0, description="that a partner sees what its plan would show"
    )


Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]


class GuidanceConfig(Config):
    """Pursuit by a policy chosen by name, the loiters around it, and how paths are followed."""

    pursuit: str = Field("lookahead", description="name of the pursuit policy")
    prediction_steps: int = Field(
        3, ge=0, le=20, description="decision steps that pursuit looks ahead"
    )
    loiter_radius: float = Field(45.0, gt=0.0, description="radius of a loiter [m]")
    loiter_entry: float = Field(
        1.5, ge=1.0, description="loiter within this many radii of the target"
    )
    orbit_radius: float | None = Field(
        None, gt=0.0, le=1e4, description="of the policy orbit; not set: where it sees best [m]"
    )
    recover_time: float = Field(
        25.0, ge=0.0, description="loiter on a lost target's last place [s]"
    )
    glimpse_time: float = Field(
        12.0, ge=0.0, le=600.0, description="loiter where a search saw something once [s]"
    )
    following: Literal["carrot", "vector-field"] = Field(
        "carrot", description="how the autopilot follows lines and orbits"
    )
    approach_deg: float = Field(
        60.0, gt=0.0, le=90.0, description="vector field: greatest angle to a line it joins [deg]"
    )
    avoidance: Literal["none", "predictive", "saunders"] = Field(
        "none", description="of buildings, aircraft and no-fly regions"
    )
    layer_spacing: float | None = Field(
        None,
        ge=0.0,
        le=1000.0,
        description="each aircraft flies so much above the one before; "
        "not set: 15 with avoidance, else 0 [m]",
    )
    clearance: float = Field(6.0, gt=0.0, le=100.0, description="kept from walls [m]")
    separation: float = Field(10.0, gt=0.0, le=500.0, description="kept from other aircraft [m]")
    ban_margin: float = Field(
        5.0, ge=0.0, le=500.0, description="kept from no-fly regions and the fence [m]"
    )
    safe_altitude: float | None = Field(
        None, gt=0.0, description="no building reaches it, the team was told; not set: unknown [m]"
    )
    fence: tuple[tuple[Coordinate, Coordinate], ...] | None = Field(
        None, max_length=1000, description="outline that is not to be left; not set: none [m]"
    )
    lookahead: LookaheadConfig = LookaheadConfig()

    @model_validator(mode="after")
    def _fence_is_an_outline(self) -> Self:
        if self.fence is not None:
            shape = shapely.Polygon(self.fence) if len(self.fence) > 2 else shapely.Polygon()
            if not shape.is_valid or shape.area <= 0.0:
                raise ValueError("fence is not a simple outline with an area")
        return self

    @property
    def layers(self) -> float:
        """How much each aircraft flies above the one before [m]."""
        if self.layer_spacing is not None:
            return self.layer_spacing
        return 0.0 if self.avoidance == "none" else 15.0

    @property
    def approach(self) -> float:
        """Greatest angle at which the vector field joins a line [rad]."""
        return math.radians(self.approach_deg)
