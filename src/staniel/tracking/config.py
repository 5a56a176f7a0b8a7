"""How an agent tracks: the motion it expects, the sensor it expects, births and deletions."""

from typing import Literal

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["TrackingConfig"]


class TrackingConfig(Config):
    """One particle filter a track (thesis section 6.3)."""

    particles: int = Field(1000, ge=50, le=100_000, description="particles of each track")

    dynamics: Literal["random-controls", "learned", "constant-velocity"] = Field(
        "random-controls", description="how particles move; learned: from the track's own history"
    )
    max_speed: float = Field(25.0, gt=0.0, le=200.0, description="no target is faster [m/s]")
    turn_noise: float = Field(0.15, ge=0.0, le=10.0, description="course's random walk [rad/√s]")
    speed_noise: float = Field(0.1, ge=0.0, le=50.0, description="speed's random walk [m/s/√s]")
    diffusion: float = Field(0.1, ge=0.0, le=100.0, description="position's random walk [m/√s]")
    turn_rate: float = Field(0.04, ge=0.0, le=10.0, description="turns to any course per second")
    restart_rate: float = Field(
        0.03, ge=0.0, le=10.0, description="changes to any speed per second"
    )
    learning_time: float = Field(
        10.0, gt=0.0, le=3600.0, description="of learned dynamics, after which a turn is forgotten"
    )
    acceleration_noise: float = Field(
        1.0, gt=0.0, le=100.0, description="white, of constant-velocity [m/s/√s]"
    )
    streets: bool = Field(True, description="particles keep to the chart's streets")

    filter: Literal["sir", "sis"] = Field("sir", description="sis: never resample")
    resampling: Literal["systematic", "stratified", "multinomial", "residual"] = Field(
        "systematic", description="which particles are copied"
    )
    resample_below: float = Field(
        0.35, ge=0.0, le=1.0, description="share of effective particles that causes resampling"
    )
    kernel: float = Field(
        0.3, ge=0.0, lt=1.0, description="width of a particle, over the cloud's; 0: bootstrap"
    )
    roughening: float = Field(
        0.15, ge=0.0, le=1.0, description="jitter of copies that saw nothing, over the cloud's"
    )

    association: Literal["nearest", "likeliest", "soft"] = Field(
        "nearest", description="globally, one after the other, or by shares"
    )
    detection_probability: float = Field(
        0.9, gt=0.0, lt=1.0, description="of a target in view, per look"
    )
    view_probability: float = Field(
        0.3, ge=0.0, le=1.0, description="of a look at an unseen target per step, if nobody says"
    )
    clutter_density: float = Field(2e-6, gt=0.0, le=1.0, description="false alarms per look and m²")
    gate: float = Field(4.0, gt=0.0, le=100.0, description="of association [sigma]")
    late_limit: float = Field(5.0, ge=0.0, le=60.0, description="an older sighting is ignored [s]")

    birth_spacing: float = Field(2.0, gt=0.0, le=100.0, description="between static particles [m]")
    birth_window: int = Field(3, ge=1, le=20, description="static particles each side of a peak")
    birth_gate: float = Field(
        3.0, gt=0.0, le=100.0, description="noise allowed between two hits [sigma]"
    )
    birth_distance: float = Field(
        6.0, ge=0.0, le=1000.0, description="no birth where a track is as near as this [m]"
    )
    birth_existence: float = Field(
        0.9, gt=0.0, lt=1.0, description="probability that a new track is real"
    )
    least_existence: float = Field(
        0.02, ge=0.0, lt=1.0, description="a track that is less probably real is deleted"
    )
    confirmations: int = Field(3, ge=2, le=20, description="consistent steps before a birth")

    unseen_limit: int = Field(
        17, ge=1, le=10_000, description="steps without a sighting before deletion"
    )
    dispersion_limit: float = Field(
        80.0,
        gt=0.0,
        le=10_000.0,
        description="spread along the longer axis before deletion, 1 sigma [m]",
    )
    remember: float = Field(
        90.0, ge=0.0, le=3600.0, description="a lost target's name is kept for its return [s]"
    )
    newcomers: float = Field(
        2e-6, gt=0.0, le=1.0, description="density of targets that were never seen [1/m²]"
    )
    merge_distance: float = Field(
        3.0, ge=0.0, le=1000.0, description="two tracks as near as this may be one target [m]"
    )
    merge_steps: int = Field(5, ge=1, le=1000, description="and are, after so many steps in a row")
