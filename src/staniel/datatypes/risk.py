"""Where it is dangerous or forbidden to fly: the words of scenarios and of briefings."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
import shapely
from pydantic import Field, model_validator

from staniel.datatypes.config import Config
from staniel.kernels.risk import Regions

__all__ = ["CarriedThreat", "RiskConfig", "RiskRegion", "ThreatSensor", "region_arrays"]

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
    briefed: bool = Field(
        False, description="the agents are told that vehicles carry it; never which"
    )

    @property
    def active(self) -> bool:
        """Whether it exposes anybody."""
        return self.radius > 0.0 and self.rate > 0.0

    @property
    def briefing(self) -> "CarriedThreat | None":
        """What the agents are told of it: how far and how much, never who carries it."""
        return self.model_copy(update={"vehicles": None}) if self.briefed and self.active else None

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        if self.vehicles is not None and len(set(self.vehicles)) < len(self.vehicles):
            raise ValueError("vehicles names one twice: expected each at most once")
        return self


class ThreatSensor(Config):
    """What each aircraft has to notice dangers that it was not told of: a warning receiver."""

    range: float = Field(0.0, ge=0.0, le=1e5, description="slant range that it reaches [m]; 0: off")
    probability: float = Field(
        1.0, gt=0.0, le=1.0, description="of noticing each danger in range, per decision step"
    )
    noise: float = Field(
        10.0, gt=0.0, le=1e4, description="1 sigma per axis of where a vehicle carries it [m]"
    )
    needs_sight: bool = Field(False, description="a building in between hides the danger")


class RiskConfig(Config):
    """Threats and no-fly regions, threats that vehicles carry, and what notices them."""

    regions: tuple[RiskRegion, ...] = Field(
        (), description="each a table: kind, shape, rate, heights, briefed"
    )
    carried: CarriedThreat = CarriedThreat()
    sensor: ThreatSensor = ThreatSensor()

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
        """Of which regions the agents are told before the start."""
        return tuple(region for region in self.regions if region.briefed)


def region_arrays(regions: Sequence[RiskRegion]) -> Regions:
    """Regions as kernels take them.

    Parameters
    ----------
    regions : sequence of RiskRegion

    Returns
    -------
    Regions
    """
    box, disc = np.zeros((len(regions), 6)), np.zeros((len(regions), 3))
    first = np.zeros(len(regions) + 1, dtype=np.int64)
    corners: list[Point] = []
    for k, region in enumerate(regions):
        if region.polygon is not None:
            corners += region.polygon
            low, high = np.min(region.polygon, axis=0), np.max(region.polygon, axis=0)
        else:
            # The configuration has seen to it that what is no polygon is a disc.
            center, radius = np.array(region.center), region.radius or 0.0
            low, high = center - radius, center + radius
            disc[k] = (*center, radius)
        ceiling = np.inf if region.ceiling is None else region.ceiling
        box[k] = (low[0], high[0], low[1], high[1], region.floor, ceiling)
        first[k + 1] = len(corners)
    return Regions(box, disc, first, np.array(corners, dtype=np.float64).reshape(-1, 2))
