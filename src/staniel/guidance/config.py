"""How an aircraft is flown to what it was assigned."""

from typing import Annotated, Literal, Self

import shapely
from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["GuidanceConfig"]

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]


class GuidanceConfig(Config):
    """Pursuit by a policy chosen by name, and the loiters around it."""

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
    avoidance: Literal["none", "predictive", "saunders"] = Field(
        "none", description="of buildings, aircraft and no-fly regions"
    )
    layer_spacing: float = Field(
        0.0, ge=0.0, le=1000.0, description="each aircraft flies so much above the one before [m]"
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

    @model_validator(mode="after")
    def _fence_is_an_outline(self) -> Self:
        if self.fence is not None:
            shape = shapely.Polygon(self.fence) if len(self.fence) > 2 else shapely.Polygon()
            if not shape.is_valid or shape.area <= 0.0:
                raise ValueError("fence is not a simple outline with an area")
        return self
