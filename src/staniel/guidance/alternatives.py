"""What could be flown instead of what was commanded, as rows for the kernels."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe
from staniel.kernels.flight import BANKS, COMMAND_WIDTH, LINE, ORBIT

__all__ = ["alternatives", "last_resorts"]

Floats = NDArray[np.float64]

_LEGS = 24  # directions
_LENGTH = 300.0  # of a leg [m]
_UP = 12.0  # a change of height that gets out of another's way [m]
_NEAR = 1.0  # heights nearer than this are one [m]

# What an alternative counts as longer than its way is [m].
_DETOUR = 5.0  # any
_LEFT = 1.0  # to the left: among equals everybody turns right
_FICKLE = 25.0  # a radian off the direction taken before
_SPEED = 30.0  # not at the speed commanded
_HEIGHT = 40.0  # not at the height commanded, but at the present one
_CLIMB = 80.0  # climbing
_AGAIN = 1e4  # the circle verified before: what is left when nothing else is


def alternatives(
    pose: Pose,
    level: float,
    wanted: Floats,
    airframe: Airframe,
    heading: float | None,
    escape: Floats | None,
) -> tuple[Floats, Floats]:
    """What is wanted, and everything that may come near to it.

    Parameters
    ----------
    pose : Pose
    level : float [m]
        Height at which the aircraft would soon be level.
    wanted : (COMMAND_WIDTH,) float array
        Row of the command.
    airframe : Airframe
    heading : float or None [rad]
        Direction of the leg that was flown instead a step ago.
    escape : (COMMAND_WIDTH,) float array or None
        The circle verified a step ago.

    Returns
    -------
    rows : (m, COMMAND_WIDTH) float array
        The first is what is wanted.
    longer : (m,) float array [m]
        What each counts as longer than its way.
    """
    heights = [(float(wanted[2]), 0.0)]
    if abs(level - wanted[2]) > _NEAR:
        heights.append((level, _HEIGHT))
    rows, longer = [wanted[None]], [np.zeros(1)]

    def add(more: Floats, counts: Floats | float) -> None:
        rows.append(more)
        longer.append(np.broadcast_to(np.asarray(counts, dtype=np.float64), len(more)))

    for height, counts in (*heights[1:], (pose.z + _UP, _CLIMB)):
        add(_changed(wanted, 2, height), counts)
    add(_changed(wanted, 1, airframe.min_speed, airframe.max_speed), _SPEED)
    legs, turned = _legs(pose, airframe.speed, heading)
    for height, counts in heights:
        if wanted[0] == ORBIT:
            orbits = _orbits(wanted, airframe)
            orbits[:, 2] = height
            add(orbits, _DETOUR + counts)
        legs[:, 2] = height
        add(legs.copy(), _DETOUR + counts + turned)
    if escape is not None:
        add(escape[None], _AGAIN)
    return np.concatenate(rows), np.concatenate(longer)


def last_resorts(pose: Pose, level: float, airframe: Airframe, escape: Floats | None) -> Floats:
    """Sharp and slow turns, and climbs: for when nothing else can be verified.

    Parameters
    ----------
    pose, level, airframe, escape
        As in `alternatives`.

    Returns
    -------
    (m, COMMAND_WIDTH) float array
        The circle verified before is the first.
    """
    legs, _ = _legs(pose, airframe.min_speed, None)
    turns = np.zeros((3, COMMAND_WIDTH))
    turns[:, 0], turns[:, 1] = BANKS, airframe.min_speed
    turns[:, 3], turns[:, 4] = 1.0, 1.0
    turns[:, 5] = (-airframe.max_bank, airframe.max_bank, 0.0)
    rows = np.concatenate([turns, legs] * 2)
    rows[: len(rows) // 2, 2] = level
    rows[len(rows) // 2 :, 2] = pose.z + _UP
    return rows if escape is None else np.concatenate([escape[None], rows])


def _changed(row: Floats, column: int, *values: float) -> Floats:
    """The row once for each value of a column."""
    rows = np.repeat(row[None], len(values), axis=0)
    rows[:, column] = values
    return rows


def _orbits(wanted: Floats, airframe: Airframe) -> Floats:
    """Round the same center, both ways, by three radii."""
    rows = np.repeat(wanted[None], 6, axis=0)
    rows[:, 5] = 1.1 * airframe.min_turn_radius * np.array((1.0, 1.0, 1.5, 1.5, 2.2, 2.2))
    rows[:, 6] = (-1.0, 1.0) * 3
    return rows


def _legs(pose: Pose, speed: float, heading: float | None) -> tuple[Floats, Floats]:
    """Legs to all sides, and what each counts as longer."""
    angles = 2.0 * math.pi / _LEGS * np.arange(_LEGS)
    rows = np.zeros((_LEGS, COMMAND_WIDTH))
    rows[:, 0], rows[:, 1] = LINE, speed
    rows[:, 3], rows[:, 4] = pose.x, pose.y
    rows[:, 5] = pose.x + _LENGTH * np.cos(angles)
    rows[:, 6] = pose.y + _LENGTH * np.sin(angles)
    longer = np.where(np.sin(angles - pose.heading) > 0.0, _LEFT, 0.0)
    if heading is not None:
        longer += _FICKLE * np.arccos(np.clip(np.cos(angles - heading), -1.0, 1.0))
    return rows, longer
