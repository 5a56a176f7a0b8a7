"""What everybody knows about the machines: airframe, camera, radio. Angles here in degrees."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["Airframe", "Camera", "Lidar", "Partition", "RadioSet", "turn_radius"]

GRAVITY = 9.80665
"""Standard gravity [m/s²]."""

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Gain = Annotated[float, Field(gt=0.0, le=10.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Airframe(Config):
    """A small fixed-wing aircraft that turns by banking (thesis eq. 3.3, corrected)."""

    speed: Positive = Field(15.0, description="cruise airspeed [m/s]")
    min_speed: Positive = Field(11.0, description="slowest airspeed [m/s]")
    max_speed: Positive = Field(20.0, description="fastest airspeed [m/s]")
    max_acceleration: Positive = Field(1.5, description="bound of the speed's rate [m/s²]")
    altitude: Positive = Field(80.0, description="flight height above ground [m]")
    max_climb: Positive = Field(3.0, description="bound of the climb rate [m/s]")
    max_bank_deg: float = Field(35.0, gt=0.0, lt=80.0, description="bank limit [deg]")
    max_roll_rate_deg: Positive = Field(60.0, description="roll rate limit [deg/s]")
    roll_gain: Positive = Field(3.0, description="first-order roll response K [1/s]")
    course_gain: Positive = Field(1.2, description="course controller k: turn rate per error [1/s]")
    speed_gain: Gain = Field(1.0, description="first-order airspeed response [1/s]")
    climb_gain: Gain = Field(1.0, description="altitude hold b' on the climb rate [1/s]")
    altitude_gain: Gain = Field(0.25, description="altitude hold b on the altitude [1/s²]")
    endurance_minutes: Positive | None = Field(
        None, description="flight time, straight and level [min]; not set: endless"
    )
    turn_power: float = Field(
        0.5, ge=0.0, le=10.0, description="k of the power 1 + k (load factor² - 1) in a turn"
    )

    @property
    def max_bank(self) -> float:
        """Bank limit [rad]."""
        return math.radians(self.max_bank_deg)

    @property
    def min_turn_radius(self) -> float:
        """Radius of the tightest steady turn at cruise speed [m]."""
        return turn_radius(self.speed, self.max_bank)

    @model_validator(mode="after")
    def _speeds_in_order(self) -> Self:
        if not self.min_speed <= self.speed <= self.max_speed:
            raise ValueError(
                f"speed = {self.speed:g} must lie between min_speed = {self.min_speed:g} "
                f"and max_speed = {self.max_speed:g}"
            )
        return self


class Camera(Config):
    """A camera: a cone around its axis, which is the aircraft's own down axis or another one."""

    mount: Literal["body", "nadir", "tilt", "gimbal"] = Field(
        "body", description="fixed to the body, held straight down, fixed at an angle, or turning"
    )
    tilt_deg: float | None = Field(
        None, ge=-90.0, le=90.0, description='forward of body-down, for mount = "tilt" [deg]'
    )
    cant_deg: float | None = Field(
        None, ge=-90.0, le=90.0, description='left of body-down, for mount = "tilt" [deg]'
    )

    gimbal_limit_deg: float | None = Field(
        None, ge=0.0, le=120.0, description='off body-down, for mount = "gimbal"; not set: 45 [deg]'
    )

    half_aperture_deg: float = Field(60.0, gt=0.0, lt=90.0, description="half-aperture [deg]")
    range: Positive = Field(250.0, description="greatest slant range of a detection [m]")
    noise: Positive = Field(1.5, description="1 sigma per axis on the ground straight below [m]")
    detection_probability: float = Field(0.9, gt=0.0, le=1.0, description="per look, if visible")
    clutter: NotNegative = Field(0.1, description="false alarms per look, Poisson mean")
    target_height: NotNegative = Field(1.0, description="where on a vehicle it is seen [m]")
    detection_falloff: float | None = Field(
        None, gt=0.0, le=100.0, description="k in detection_probability (1 - (s/range)^k)"
    )
    weighting: Literal["flat", "gaussian"] = Field(
        "flat", description="of the detection probability over the image"
    )
    image_width: int = Field(
        0, ge=0, le=100_000, description="pixels across; nearer than two is one; 0: all told apart"
    )
    max_height: Positive | None = Field(
        None, description="above this height nothing is detected [m]"
    )
    frame_interval: float | None = Field(
        None, gt=0.0, le=60.0, description="between two looks; not set: one a decision step [s]"
    )
    delay: float = Field(0.0, ge=0.0, le=60.0, description="from a look to its sightings [s]")

    @property
    def half_aperture(self) -> float:
        """Half-aperture [rad]."""
        return math.radians(self.half_aperture_deg)

    @property
    def mounting(self) -> tuple[float, float, float, float, float, float]:
        """As kernels take it, see `staniel.kernels.footprint.Mount`."""
        swing = 45.0 if self.gimbal_limit_deg is None else self.gimbal_limit_deg
        tilt, cant = math.radians(self.tilt_deg or 0.0), math.radians(self.cant_deg or 0.0)
        return (
            math.sin(tilt),
            math.cos(tilt) * math.sin(cant),
            -math.cos(tilt) * math.cos(cant),
            0.0 if self.mount == "nadir" else 1.0,
            math.inf if self.max_height is None else self.max_height,
            math.radians(swing) if self.mount == "gimbal" else -1.0,
        )

    @property
    def pixel_pair(self) -> float:
        """Angle of two pixels [rad], 0 where `image_width` is: every pixel has an equal angle."""
        return 4.0 * self.half_aperture / self.image_width if self.image_width else 0.0

    @model_validator(mode="after")
    def _angles_of_this_mount(self) -> Self:
        owners = {"tilt_deg": "tilt", "cant_deg": "tilt", "gimbal_limit_deg": "gimbal"}
        for key, mount in owners.items():
            if self.mount != mount and getattr(self, key) is not None:
                raise ValueError(
                    f'{key} does not belong to mount = "{self.mount}": expected mount = "{mount}"'
                )
        return self


class Partition(Config):
    """A time in which the team falls into groups that do not hear one another."""

    start: NotNegative = Field(description="first instant [s]")
    end: Positive = Field(description="healed from this instant on [s]")
    groups: tuple[tuple[Annotated[int, Field(ge=0)], ...], ...] = Field(
        min_length=1, max_length=500, description="aircraft by id; all others are one more group"
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end <= self.start:
            raise ValueError(f"end = {self.end:g} must be later than start = {self.start:g}")
        named = [aircraft for group in self.groups for aircraft in group]
        twice = {aircraft for aircraft in named if named.count(aircraft) > 1}
        if twice:
            raise ValueError(f"groups name aircraft {min(twice)} twice: expected at most once")
        return self


class RadioSet(Config):
    """A radio whose messages get lost with distance (thesis eq. 3.5, corrected)."""

    sigma: Positive = Field(800.0, description="p(delivered) = exp(-d²/(2 sigma²)) [m]")
    range: NotNegative = Field(1200.0, description="nothing is heard beyond [m]")
    latency: float = Field(0.0, ge=0.0, le=600.0, description="of a hop; rounds up to ticks [s]")
    jitter: float = Field(0.0, ge=0.0, le=600.0, description="random part of the latency [s]")
    jitter_kind: Literal["uniform", "exponential"] = Field(
        "uniform", description="jitter is the largest, or the mean"
    )
    duplication: Share = Field(0.0, description="probability that a message heard comes twice")
    bandwidth: NotNegative = Field(0.0, description="of each sender [byte/s]; 0: no limit")
    queue_limit: int = Field(100, ge=1, le=100_000, description="messages waiting at a sender")
    loss: Share = Field(0.0, description="share lost whatever the distance")
    building_loss: Share = Field(0.0, description="share lost through buildings, beside distance")
    partitions: tuple[Partition, ...] = Field(
        (), max_length=1000, description="when the team is cut into groups: start, end, groups"
    )


def turn_radius(speed: float, bank: float) -> float:
    """Radius of a steady coordinated turn, V²/(g tan bank).

    Parameters
    ----------
    speed : float [m/s]
    bank : float [rad]
        Not 0.

    Returns
    -------
    float [m]

    Examples
    --------
    >>> round(turn_radius(15.0, math.radians(35.0)), 1)
    32.8
    """
    return speed * speed / (GRAVITY * abs(math.tan(bank)))


class Lidar(Config):
    """A laser that measures walls at flight height: a scanner's fan, or one beam straight ahead."""

    mount: Literal["none", "scanner", "rangefinder"] = Field("none", description="kind of laser")
    range: float = Field(100.0, gt=0.0, le=5000.0, description="greatest distance of a return [m]")
    aperture_deg: float = Field(180.0, gt=0.0, le=360.0, description="a scanner's full angle [deg]")
    step_deg: float = Field(1.0, ge=0.1, le=360.0, description="between a scanner's beams [deg]")
    noise: NotNegative = Field(0.1, description="1 sigma of a range [m]")
