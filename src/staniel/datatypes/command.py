"""What an agent asks of its autopilot: a path segment, or a timed sequence of banks."""

from dataclasses import dataclass

__all__ = ["Command", "FlyBanks", "FlyLine", "FlyOrbit"]


@dataclass(frozen=True, slots=True)
class FlyLine:
    """Follow the straight line from `start` through `end` (and on beyond it).

    Positions in metres east and north, airspeed in m/s, altitude in metres above ground.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    speed: float
    altitude: float


@dataclass(frozen=True, slots=True)
class FlyOrbit:
    """Circle `center` at `radius` [m]; `turn` +1 is counter-clockwise from above, -1 clockwise."""

    center: tuple[float, float]
    radius: float
    turn: int
    speed: float
    altitude: float


@dataclass(frozen=True, slots=True)
class FlyBanks:
    """Hold each bank [rad, left positive] for `hold` seconds in turn, then the last one."""

    banks: tuple[float, ...]
    hold: float
    speed: float
    altitude: float


Command = FlyLine | FlyOrbit | FlyBanks
