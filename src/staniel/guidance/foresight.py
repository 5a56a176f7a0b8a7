"""How much of a target an aircraft will see if it flies on as it does now."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import Command, FlyBanks
from staniel.datatypes.equipment import GRAVITY, Airframe, Camera
from staniel.kernels.footprint import camera_axes, look

__all__ = ["predicted_visibility"]

_AHEAD = (2.0, 4.0, 6.0)
"""Instants looked at [s]."""

_STEP = 0.5
"""Of the flight between them [s]."""


def predicted_visibility(
    pose: Pose,
    command: Command,
    cloud: NDArray[np.float64],
    airframe: Airframe,
    camera: Camera,
    chart: City,
    aim: tuple[float, float],
) -> float:
    """Share of a belief that the camera will have in view over the next seconds.

    Parameters
    ----------
    pose : Pose
        The aircraft's.
    command : Command
        What it flies: banks are flown as told, the rest as the bank of now.
    cloud : (n, 4) float array
        The belief: x, y [m], vx, vy [m/s].
    airframe, camera : Airframe, Camera
    chart : City
        What hides targets, as far as the agent knows.
    aim : (float, float) [m]
        Where a gimbal looks; NaN without one.

    Returns
    -------
    float
        In [0, 1], the mean over the instants looked at.
    """
    seen = 0.0
    for ahead, eye in zip(_AHEAD, _flight(pose, command, airframe), strict=True):
        points = np.full((len(cloud), 3), camera.target_height)
        points[:, :2] = cloud[:, :2] + ahead * cloud[:, 2:]
        eyes = np.array([eye])
        axes = camera_axes(eyes, np.array([aim]), camera.mounting)
        seen += look(chart.walls, eyes, axes, points, camera.half_aperture, camera.range).mean()
    return seen / len(_AHEAD)


def _flight(pose: Pose, command: Command, airframe: Airframe) -> list[Pose]:
    """Poses at the instants looked at, in calm air and without the lag of the roll."""
    x, y, z, heading, bank, speed = pose
    poses = []
    for k in range(1, round(_AHEAD[-1] / _STEP) + 1):
        if isinstance(command, FlyBanks):
            bank = command.banks[min(int((k - 1) * _STEP / command.hold), len(command.banks) - 1)]
        turn = GRAVITY / max(speed, airframe.min_speed) * math.tan(bank) * _STEP
        x += speed * _STEP * math.cos(heading + turn / 2.0)
        y += speed * _STEP * math.sin(heading + turn / 2.0)
        heading += turn
        if k * _STEP in _AHEAD:
            poses.append(Pose(x, y, z, heading, bank, speed))
    return poses
