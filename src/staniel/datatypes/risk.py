"""Where it is dangerous or forbidden to fly: the words of scenarios and of briefings."""

from typing import Annotated, Literal, Self

import shapely
from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["CarriedThreat", "RiskConfig", "RiskRegion"]

MAX_REGIONS = 1000
MAX_POINTS = 10_000

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = tuple[Coordinate, Coordinate]
Rate = Annotated[float, Field(ge=0.0, le=1e6)]


class RiskRegion(Config):
    """A part of the air, upright over a polygon or a disc, that exposes who flies in it."""

    kind: Literal["threat", "no-fly"] = Field(description="soft exposure, or hard prohibition")
    polygon: tuple[Point, ...] | None = Field(None, description="corners, east and north [m]")
    center: Point | None = Field(None, description="of a disc, east and north [m]")
    radius: float | None = Field(None, gt=0.0, le=1e6, description="of a disc [m]")
    rate: Rate | None = Field(None, description="exposure of a threat per second inside [1/s]")
    floor: float = Field(0.0, ge=-1e5, le=1e5, description="lower end above ground [m]")
    ceiling: float | None = Field(None, ge=-1e5, le=1e6, description="upper end; not set: none [m]")
    briefed: bool = Field(True, description="the agents are told of it before the start")

    @model_validator(mode="after")
    def _one_shape_of_its_kind(self) -> Self:
        if (self.center is None) != (self.radius is None):
            raise ValueError("radius and center belong together: a disc has both")
        if (self.polygon is None) == (self.center is None):
            raise ValueError("polygon or center and radius: expected one of the two shapes")
        if self.polygon is not None:
            if not 3 <= len(self.polygon) <= MAX_POINTS:
                raise ValueError(
                    f"polygon has {len(self.polygon):,} corners: expected 3 to {MAX_POINTS:,}"
                )
            shape = shapely.Polygon(self.polygon)
            if not shape.is_valid or shape.area <= 0.0:
                reason = shapely.is_valid_reason(shape)
                raise ValueError(f"polygon is not a simple outline with an area ({reason})")
        if (self.kind == "threat") != (self.rate is not None):
            expected = "a threat needs one" if self.rate is None else "only a threat has one"
            raise ValueError(f"rate = {self.rate}: {expected} [1/s]")
        if self.ceiling is not None and self.ceiling <= self.floor:
            raise ValueError(
                f"ceiling = {self.ceiling:g} must be higher than floor = {self.floor:g}"
            )
        return self


class CarriedThreat(Config):
    """Vehicles that are a threat to what flies near them (thesis eq. 3.2)."""

    radius: float = Field(
        0.0, ge=0.0, le=1e5, description="slant range that it reaches [m]; 0: off"
    )
    rate: Rate = Field(0.0, description="exposure per second and vehicle within it [1/s]")
    vehicles: tuple[Annotated[int, Field(ge=0)], ...] | None = Field(
        None, max_length=10_000, description="who carries it, by id; not set: all"
    )

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        if self.vehicles is not None and len(set(self.vehicles)) < len(self.vehicles):
            raise ValueError("vehicles names one twice: expected each at most once")
        return self


class RiskConfig(Config):
    """Threats and no-fly regions, and threats that vehicles carry."""

    regions: tuple[RiskRegion, ...] = Field(
        (), description="each a table: kind, shape, rate, heights, briefed"
    )
    carried: CarriedThreat = CarriedThreat()

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if len(self.regions) > MAX_REGIONS:
            raise ValueError(
                f"regions has {len(self.regions):,} tables: expected at most {MAX_REGIONS:,}"
            )
        points = sum(len(region.polygon or ()) for region in self.regions)
        if points > MAX_POINTS:
            raise ValueError(
                f"regions have {points:,} corners together: expected at most {MAX_POINTS:,}"
            )
        return self

    @property
    def briefed(self) -> tuple[RiskRegion, ...]:
        """What the agents are told before the start: never what vehicles carry."""
        return tuple(region for region in self.regions if region.briefed)
