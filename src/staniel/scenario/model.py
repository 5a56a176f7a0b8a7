"""What a scenario holds: the rooms' own sections, composed into one frozen, checked whole."""

from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from staniel.cooperation.config import CooperationConfig
from staniel.datatypes.clock import Clock
from staniel.datatypes.config import Config
from staniel.datatypes.equipment import Airframe, Camera, Lidar, RadioSet
from staniel.datatypes.risk import RiskConfig
from staniel.guidance.config import GuidanceConfig
from staniel.tracking.config import TrackingConfig
from staniel.world.config import Faults, Launch, Traffic, Wind

__all__ = ["CITY_KEYS", "Aircraft", "CitySource", "Group", "Scenario"]

_Kind = TypeVar("_Kind", bound=Config)

Metres = Annotated[float, Field(gt=0.0, le=1e5)]


def _low_first(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise ValueError("expected the lower bound first")
    return pair


Range = Annotated[tuple[Metres, Metres], AfterValidator(_low_first)]

CITY_KEYS = {
    "generate": ("size", "density", "block", "heights", "seed"),
    "image": ("file", "cell", "heights", "seed"),
    "grid": ("file", "cell", "heights", "seed"),
    "open": ("size",),
    "geojson": ("file", "frame", "roads", "heights", "seed"),
}
"""Which keys of the city belong to which source; every other one is refused there."""


class CitySource(Config):
    """Where the map comes from: generated, or read from a file, or open ground."""

    source: Literal["generate", "image", "grid", "geojson", "open"] = Field(
        "generate", description="kind of map"
    )
    size: tuple[Metres, Metres] = Field((600.0, 600.0), description="east, north [m]")
    density: float = Field(0.42, gt=0.0, le=0.8, description="built share of the ground")
    block: Range = Field((40.0, 60.0), description="shortest, longest side of a block [m]")
    file: str | None = Field(None, min_length=1, description="image, Moving AI .map, or GeoJSON")
    cell: Metres | None = Field(None, description="metres per pixel or grid cell")
    frame: Literal["auto", "wgs84", "metres"] = Field("auto", description="of the coordinates")
    roads: str | None = Field(None, min_length=1, description="GeoJSON with roads; optional")
    heights: Range = Field((10.0, 40.0), description="lowest and highest roof [m]")
    seed: int | None = Field(None, ge=0, description="of the city; not set: the scenario's seed")

    @model_validator(mode="after")
    def _keys_of_this_source(self) -> Self:
        own = CITY_KEYS[self.source]
        for key in CitySource.model_fields:
            strange = key != "source" and key not in own
            if strange and key in self.model_fields_set and getattr(self, key) is not None:
                raise ValueError(
                    f"{key} does not belong to "
                    f'source = "{self.source}": expected only {", ".join(own)}'
                )
        if self.source != "generate":
            for key, meaning in (("file", "a file name"), ("cell", "metres per cell (--cell)")):
                if key in own and getattr(self, key) is None:
                    raise ValueError(f'{key} is missing: source = "{self.source}" needs {meaning}')
        return self

    @model_serializer(mode="wrap")
    def _only_own_keys(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        own = ("source", *CITY_KEYS[self.source])
        return {key: value for key, value in serialize(self).items() if key in own}


class Aircraft(Airframe):
    """The team: how many aircraft, and what they are where no group says otherwise."""

    count: int = Field(4, ge=1, le=500, description="aircraft in the team")


class Group(Config):
    """Aircraft of one kind in a team of several kinds."""

    count: int = Field(ge=1, le=500, description="aircraft of this kind")
    aircraft: dict[str, float] = Field(
        {}, max_length=50, description="what differs from the section aircraft, by its keys"
    )
    camera: dict[str, float | str] = Field(
        {}, max_length=50, description="what differs from the section camera, by its keys"
    )


class Scenario(Config):
    """One mission, complete: with its seed it determines a run to the last bit."""

    name: str = Field(
        "mission",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        max_length=64,
        description="also names the run's folder",
    )
    description: str = Field("", max_length=2000, description="one sentence for lists")
    seed: int = Field(0, ge=0, lt=2**63, description="of everything random in the run")
    minutes: float = Field(10.0, gt=0.0, le=1440.0, description="mission time [min]")
    chart: Literal["known", "blank"] = Field("known", description="do agents hold the city's map")

    groups: tuple[Group, ...] = Field(
        (), max_length=500, description="kinds of aircraft, in turn; empty: all of one kind"
    )

    clock: Clock = Clock()
    city: CitySource = CitySource()
    vehicles: Traffic = Traffic()
    aircraft: Aircraft = Aircraft()
    launch: Launch = Launch()
    faults: Faults = Faults()
    wind: Wind = Wind()
    camera: Camera = Camera()
    lidar: Lidar = Lidar()
    radio: RadioSet = RadioSet()
    risk: RiskConfig = RiskConfig()
    tracking: TrackingConfig = TrackingConfig()
    cooperation: CooperationConfig = CooperationConfig()
    guidance: GuidanceConfig = GuidanceConfig()

    @model_validator(mode="after")
    def _at_least_one_decision(self) -> Self:
        if self.minutes * 60.0 < self.clock.decision_step:
            raise ValueError(
                f"minutes = {self.minutes:g} is shorter than one "
                f"clock.decision_step = {self.clock.decision_step:g} s"
            )
        return self

    @model_validator(mode="after")
    def _who_is_named_is_there(self) -> Self:
        named = (
            (f"radio.partitions[{k}].groups", member, self.aircraft.count, "aircraft")
            for k, partition in enumerate(self.radio.partitions)
            for group in partition.groups
            for member in group
        )
        failing = (
            (f"faults.schedule[{k}]", fault.aircraft, self.aircraft.count, "aircraft")
            for k, fault in enumerate(self.faults.schedule)
        )
        carriers = self.risk.carried.vehicles or ()
        carrying = (
            ("risk.carried.vehicles", carrier, self.vehicles.count, "vehicle")
            for carrier in carriers
        )
        for key, number, count, what in (*named, *failing, *carrying):
            if number >= count:
                raise ValueError(
                    f"{key} names {what} {number}, but there are {count}: expected numbers below"
                )
        return self

    @model_validator(mode="after")
    def _what_is_avoided_can_be_seen(self) -> Self:
        if self.guidance.avoidance == "saunders" and self.lidar.mount == "none":
            raise ValueError(
                'guidance.avoidance = "saunders" sees buildings by lidar alone: '
                'expected lidar.mount = "scanner" or "rangefinder"'
            )
        return self

    @model_validator(mode="after")
    def _groups_make_the_team(self) -> Self:
        if self.groups:
            together = sum(group.count for group in self.groups)
            if together != self.aircraft.count:
                raise ValueError(
                    f"groups have {together} aircraft together, but aircraft.count = "
                    f"{self.aircraft.count}: expected the same"
                )
            for number in range(len(self.groups)):
                self._kind(number, "aircraft", Airframe)
                self._kind(number, "camera", Camera)
        return self

    @property
    def airframes(self) -> tuple[Airframe, ...]:
        """What each aircraft of the team is, in the order of the team, each in its own layer."""
        team: tuple[Airframe, ...] = (self.aircraft,) * self.aircraft.count
        if self.groups:
            team = tuple(
                airframe
                for number, group in enumerate(self.groups)
                for airframe in (self._kind(number, "aircraft", Airframe),) * group.count
            )
        spacing = self.guidance.layers
        if spacing == 0.0:
            return team
        return tuple(
            airframe.model_copy(update={"altitude": airframe.altitude + spacing * number})
            for number, airframe in enumerate(team)
        )

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """What each aircraft of the team carries, in the order of the team."""
        if not self.groups:
            return (self.camera,) * self.aircraft.count
        return tuple(
            camera
            for number, group in enumerate(self.groups)
            for camera in (self._kind(number, "camera", Camera),) * group.count
        )

    def _kind(self, number: int, section: str, kind: type[_Kind]) -> _Kind:
        """A section as one group has it: the team's, but for what the group says otherwise."""
        common = getattr(self, section).model_dump(exclude={"count"})
        try:
            return kind(**(common | getattr(self.groups[number], section)))
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            key = ".".join((section, *map(str, first["loc"])))
            raise ValueError(f"groups[{number}].{key}: {first['msg']}") from None
