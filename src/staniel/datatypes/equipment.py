"""What everybody knows about the machines: airframe, camera, radio. Angles here in degrees."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["Airframe", "Camera", "RadioSet", "turn_radius"]

GRAVITY = 9.80665
"""Standard gravity [m/s²]."""

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


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
    """A body-fixed belly camera: a cone around the aircraft's own down axis."""

    half_aperture_deg: float = Field(60.0, gt=0.0, lt=90.0, description="half-aperture [deg]")
    range: Positive = Field(250.0, description="greatest slant range of a detection [m]")
    noise: Positive = Field(1.5, description="1 sigma per axis on the ground straight below [m]")
    detection_probability: float = Field(0.9, gt=0.0, le=1.0, description="per look, if visible")
    clutter: NotNegative = Field(0.1, description="false alarms per look, Poisson mean")
    target_height: NotNegative = Field(1.0, description="where on a vehicle it is seen [m]")

    @property
    def half_aperture(self) -> float:
        """Half-aperture [rad]."""
        return math.radians(self.half_aperture_deg)


class RadioSet(Config):
    """A radio whose messages get lost with distance (thesis eq. 3.5, corrected)."""

    sigma: Positive = Field(800.0, description="p(delivered) = exp(-d²/(2 sigma²)) [m]")
    range: NotNegative = Field(1200.0, description="nothing is heard beyond [m]")


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
