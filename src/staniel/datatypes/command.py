"""What an agent asks of its autopilot: a path segment, or a timed sequence of banks."""

import math
from dataclasses import dataclass

__all__ = ["Command", "FlyBanks", "FlyLine", "FlyOrbit", "look_point", "way_point"]


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
    """Hold each bank [rad, left positive] for `hold` seconds in turn, then the last one.

    `look` is the ground point that a gimballed camera is to look at meanwhile [m], where it is to
    look at one.
    """

    banks: tuple[float, ...]
    hold: float
    speed: float
    altitude: float
    look: tuple[float, float] | None = None


Command = FlyLine | FlyOrbit | FlyBanks


def way_point(command: Command) -> tuple[float, float]:
    """Ground point that a command leads to [m].

    The end of a line, the center of an orbit; NaN for banks, which lead nowhere.

    Examples
    --------
    >>> way_point(FlyLine((0.0, 0.0), (50.0, 20.0), 15.0, 80.0))
    (50.0, 20.0)
    """
    if isinstance(command, FlyLine):
        return command.end
    return command.center if isinstance(command, FlyOrbit) else (math.nan, math.nan)


def look_point(command: Command) -> tuple[float, float]:
    """Ground point that a gimballed camera looks at while the command is flown [m].

    Where a line or an orbit leads to; what banks name, NaN where they name none.

    Examples
    --------
    >>> look_point(FlyBanks((0.1,), 1.0, 15.0, 80.0, look=(50.0, 20.0)))
    (50.0, 20.0)
    """
    if isinstance(command, FlyBanks) and command.look is not None:
        return command.look
    return way_point(command)
