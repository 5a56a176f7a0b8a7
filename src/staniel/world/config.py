"""What drives through the city, the wind over it, and how the team starts and fails."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["Fault", "FaultRates", "Faults", "Launch", "Traffic", "Wind"]

Metres = Annotated[float, Field(gt=0.0, le=1000.0)]
Speed = Annotated[float, Field(gt=0.0, le=40.0)]


class Traffic(Config):
    """Vehicles: differential-drive wanderers (thesis 4.2), road followers, or recorded tracks."""

    kind: Literal["wander", "roads", "replay"] = Field("wander", description="how they drive")
    count: int = Field(4, ge=0, le=10_000, description="vehicles; the team is not told how many")
    speed: float = Field(2.0, ge=0.0, le=40.0, description="on a clear path [m/s]")
    speed_range: tuple[Speed, Speed] | None = Field(
        None, description="instead of speed: each vehicle's own, lowest and highest [m/s]"
    )
    radius: float = Field(1.0, gt=0.0, le=10.0, description="of the body's disc [m]")
    axle: float = Field(1.2, gt=0.0, le=10.0, description="distance between the wheels b [m]")
    feeler_length: float = Field(5.0, gt=0.0, le=100.0, description="from the body's edge [m]")
    feeler_angle_deg: float = Field(20.0, gt=0.0, lt=90.0, description="off the heading [deg]")
    turn_rate_deg: float = Field(60.0, gt=0.0, le=360.0, description="turning away [deg/s]")
    cruise_distance: Metres = Field(30.0, description="mean way straight on before a drift [m]")
    drift_distance: Metres = Field(15.0, description="mean way of a drift to one side [m]")
    drift_radius: Metres = Field(10.0, description="of the arc of a drift [m]")
    lane_offset: float = Field(1.5, ge=0.0, le=20.0, description="right of a road's middle [m]")
    max_acceleration: float = Field(2.0, gt=0.0, le=20.0, description="on roads [m/s²]")
    stop_interval: float = Field(0.0, ge=0.0, le=1e5, description="mean between stops, 0: none [s]")
    stop_duration: float = Field(15.0, ge=0.0, le=1e5, description="mean of a stop on a road [s]")
    patience: float = Field(4.0, gt=0.0, le=1000.0, description="of a blocked road follower [s]")
    replay: str | None = Field(None, min_length=1, description="CSV file of recorded tracks")
    replay_knots: float = Field(0.5, gt=0.0, le=60.0, description="positions are averaged over [s]")

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.speed_range is not None and self.speed_range[0] > self.speed_range[1]:
            raise ValueError(
                f"speed_range = {list(self.speed_range)}: expected the lower bound first"
            )
        if (self.kind == "replay") != (self.replay is not None):
            raise ValueError(
                'replay is missing: kind = "replay" needs a CSV file'
                if self.replay is None
                else f'replay = "{self.replay}" does not belong to kind = "{self.kind}": '
                'expected kind = "replay"'
            )
        return self


class Wind(Config):
    """The mean wind, and gusts as an aircraft feels them flying through turbulence."""

    speed: float = Field(0.0, ge=0.0, le=50.0, description="of the mean wind [m/s]")
    from_deg: float = Field(
        0.0, ge=-360.0, le=360.0, description="it blows from there: clockwise from north [deg]"
    )
    gusts: bool = Field(False, description="add turbulence, a stream of its own for each aircraft")
    gust_sigma: float | None = Field(
        None, ge=0.0, le=20.0, description="of each component [m/s]; not set: Dryden's"
    )
    gust_length: float | None = Field(
        None, gt=0.0, le=10_000.0, description="length scale [m]; not set: Dryden's"
    )


class Fault(Config):
    """One thing that fails at one time and stays so."""

    time: float = Field(ge=0.0, description="since the start [s]")
    aircraft: int = Field(ge=0, description="its number in the team")
    kind: Literal["camera", "radio", "navigation", "lost"] = Field(description="what fails")


class FaultRates(Config):
    """How often each thing fails: exponential times, each aircraft for itself."""

    camera: float = Field(0.0, ge=0.0, le=3600.0, description="delivers nothing any more [1/h]")
    radio: float = Field(0.0, ge=0.0, le=3600.0, description="neither sends nor hears [1/h]")
    navigation: float = Field(0.0, ge=0.0, le=3600.0, description="begins to drift [1/h]")
    lost: float = Field(0.0, ge=0.0, le=3600.0, description="the aircraft is lost [1/h]")


class Faults(Config):
    """What goes wrong with the aircraft: by a schedule, by chance, or both."""

    schedule: tuple[Fault, ...] = Field((), max_length=10_000, description="what fails when")
    drift_rate: float = Field(
        1.0, ge=0.0, le=100.0, description="of a navigation that drifts, one direction each [m/s]"
    )
    station: float | None = Field(
        None, ge=0.0, description="the ground station, if any, falls silent; not set: never [s]"
    )
    rate_per_hour: FaultRates = FaultRates()


Coordinate = Annotated[float, Field(ge=-1e5, le=1e5)]


class Launch(Config):
    """How the team gets into the air."""

    kind: Literal["air", "hand", "catapult", "strip"] = Field(
        "air", description="in the air around the city at the start, or from the ground"
    )
    places: tuple[tuple[Coordinate, Coordinate], ...] = Field(
        (), max_length=500, description="on the ground, taken in turn: east, north [m]"
    )
    heading_deg: float = Field(
        0.0, ge=-360.0, le=360.0, description="of launch or strip, from east to north [deg]"
    )
    interval: float = Field(10.0, ge=0.0, le=86_400.0, description="between two launches [s]")

    @model_validator(mode="after")
    def _places_on_the_ground(self) -> Self:
        if self.kind != "air" and not self.places:
            raise ValueError(f'places is empty: kind = "{self.kind}" needs at least one place')
        return self
