"""How many vehicles drive through the city, and how."""

from typing import Annotated

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["Traffic"]

Metres = Annotated[float, Field(gt=0.0, le=1000.0)]


class Traffic(Config):
    """Differential-drive vehicles that wander the streets on two forward feelers (thesis 4.2)."""

    count: int = Field(4, ge=0, le=10_000, description="vehicles; the team is not told how many")
    speed: float = Field(2.0, ge=0.0, le=40.0, description="on a clear path [m/s]")
    radius: float = Field(1.0, gt=0.0, le=10.0, description="of the body's disc [m]")
    axle: float = Field(1.2, gt=0.0, le=10.0, description="distance between the wheels b [m]")
    feeler_length: float = Field(5.0, gt=0.0, le=100.0, description="from the body's edge [m]")
    feeler_angle_deg: float = Field(20.0, gt=0.0, lt=90.0, description="off the heading [deg]")
    turn_rate_deg: float = Field(60.0, gt=0.0, le=360.0, description="turning away [deg/s]")
    cruise_distance: Metres = Field(30.0, description="mean way straight on before a drift [m]")
    drift_distance: Metres = Field(15.0, description="mean way of a drift to one side [m]")
    drift_radius: Metres = Field(10.0, description="of the arc of a drift [m]")
