"""Commands and airframes in the rows that the flight kernel reads."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.command import Command, FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.kernels.flight import BANKS, COMMAND_WIDTH, LINE, MAX_BANKS, ORBIT
from staniel.kernels.following import FOLLOWERS

__all__ = ["decode", "encode", "limits"]


def encode(commands: Sequence[Command]) -> NDArray[np.float64]:
    """Commands as rows for `staniel.kernels.flight.fly`.

    A command counts from the decision instant at which it is given: a bank sequence that is given
    again in the next tick begins anew, so a planner hands in what is left of its plan.

    Parameters
    ----------
    commands : sequence of Command
        One an aircraft.

    Returns
    -------
    (n, COMMAND_WIDTH) float array

    Raises
    ------
    ValueError
        A bank sequence that is empty or longer than `MAX_BANKS`, a hold or an orbit's radius that
        is not positive, a value that is not finite.
    """
    rows = np.zeros((len(commands), COMMAND_WIDTH))
    for i, command in enumerate(commands):
        row = _row(command)
        look = command.look if isinstance(command, FlyBanks) and command.look else ()
        if not all(map(math.isfinite, (*row, *look))):
            raise ValueError(f"command of aircraft {i} = {command}: expected finite numbers")
        rows[i, : len(row)] = row
    return rows


def decode(row: NDArray[np.float64]) -> Command:
    """The command of a row that `encode` could have made; a row has no look.

    Parameters
    ----------
    row : (COMMAND_WIDTH,) float array

    Returns
    -------
    Command

    Examples
    --------
    >>> decode(encode([FlyOrbit((1.0, 2.0), 40.0, -1, 15.0, 80.0)])[0])
    FlyOrbit(center=(1.0, 2.0), radius=40.0, turn=-1, speed=15.0, altitude=80.0)
    """
    kind, speed, altitude, a, b, c, d = row[:7].tolist()
    if kind == LINE:
        return FlyLine((a, b), (c, d), speed, altitude)
    if kind == ORBIT:
        return FlyOrbit((a, b), c, int(d), speed, altitude)
    return FlyBanks(tuple(row[5 : 5 + int(b)].tolist()), a, speed, altitude)


def _row(command: Command) -> tuple[float, ...]:
    if isinstance(command, FlyLine):
        return (LINE, command.speed, command.altitude, *command.start, *command.end)
    if isinstance(command, FlyOrbit):
        if command.radius <= 0.0:
            raise ValueError(f"FlyOrbit.radius = {command.radius}: expected greater than 0 m")
        turn = math.copysign(1.0, command.turn)
        return (ORBIT, command.speed, command.altitude, *command.center, command.radius, turn)
    return _banks(command)


def _banks(command: FlyBanks) -> tuple[float, ...]:
    count = len(command.banks)
    if not 1 <= count <= MAX_BANKS:
        raise ValueError(f"FlyBanks.banks has {count} entries: expected 1 to {MAX_BANKS}")
    if command.hold <= 0.0:
        raise ValueError(f"FlyBanks.hold = {command.hold}: expected greater than 0 s")
    return (BANKS, command.speed, command.altitude, command.hold, count, *command.banks)


def limits(
    airframes: Sequence[Airframe],
    following: str = "carrot",
    approach: float = math.radians(60.0),
) -> NDArray[np.float64]:
    """Rows of limits for `staniel.kernels.flight.fly`: see the head of that module.

    Parameters
    ----------
    airframes : sequence of Airframe
        One an aircraft.
    following : str
        How every autopilot follows lines and orbits, of `staniel.kernels.following.FOLLOWERS`.
    approach : float [rad]
        Greatest angle to a line at which the vector field joins it.

    Returns
    -------
    (n, 13) float array
    """
    law = (FOLLOWERS[following], approach)
    return np.array([(*_limits(airframe), *law) for airframe in airframes], dtype=np.float64)


def _limits(airframe: Airframe) -> tuple[float, ...]:
    return (
        airframe.min_speed,
        airframe.max_speed,
        airframe.max_acceleration,
        airframe.max_climb,
        airframe.max_bank,
        math.radians(airframe.max_roll_rate_deg),
        airframe.roll_gain,
        airframe.course_gain,
        airframe.speed_gain,
        airframe.climb_gain,
        airframe.altitude_gain,
    )
