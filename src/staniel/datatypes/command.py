"""What an agent asks of its autopilot: a path segment, or a timed sequence of banks."""

import math
from dataclasses import dataclass

__all__ = ["Command", "FlyBanks", "FlyLine", "FlyOrbit", "look_point"]


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


def look_point(command: Command) -> tuple[float, float]:
    """Ground point that a gimballed camera looks at while the command is flown [m].

    The end of a line, the center of an orbit; NaN for banks, which leads it nowhere.

    Examples
    --------
    >>> look_point(FlyLine((0.0, 0.0), (50.0, 20.0), 15.0, 80.0))
    (50.0, 20.0)
    """
    if isinstance(command, FlyLine):
        return command.end
    return command.center if isinstance(command, FlyOrbit) else (math.nan, math.nan)
