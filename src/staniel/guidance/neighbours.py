"""Where other aircraft may be, from what they last said of themselves; the older, the less sure."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyBanks
from staniel.datatypes.equipment import GRAVITY, Airframe
from staniel.datatypes.message import Heartbeat
from staniel.guidance.config import GuidanceConfig
from staniel.kernels.avoidance import Others
from staniel.kernels.flight import fly

__all__ = ["FORGET", "Neighbours"]

Floats = NDArray[np.float64]

FORGET = 30.0
"""Who was not heard for so long may be anywhere, and is no longer reckoned with [s]."""

_STEP, _HORIZON = 0.25, 20.0  # of the times for which places are expected [s]
_BUFFER = 4.0  # beside the separation: what a decision step and an autopilot leave open [m]
_TURNING = 0.35  # of the sharpest turn: what another may do that nobody expects
_MOST = 18.0  # ... and how far that takes it before it, too, gives way [m]
_ASTRAY = 8.0  # how much less is known of a place with each second of silence [m/s]
_HEARD = 1.5  # a word that is not older is news [s]
_CLIMB = 0.5, 3.0  # what is not known of its height grows by [m/s], up to [m]
_GIVES_WAY = 5.0  # how near in time one that has to give way is reckoned with [s]
_NOWHERE = 1e-9  # what is kept from one that is not reckoned with [m]


class _Heard(NamedTuple):
    """What one aircraft said, and where that leads: (t, 3) at multiples of `_STEP` from then."""

    time: float
    pose: Pose
    flown: Floats
    straight: Floats


class Neighbours:
    """The other aircraft, as one of them knows them.

    Each is expected to fly on what it said that it flies, or straight ahead: it may have been told
    otherwise since. What is kept from both places is the separation and more: what an unexpected
    turn makes of it, growing with the time since it was last heard, so that silence makes careful.

    Parameters
    ----------
    own : int
        Who knows them. Of two aircraft the one with the higher number gives way: it looks far
        ahead for the other, which reckons with it only when it comes near, or falls silent. Both
        do so in the end.
    airframe : Airframe
        The others are taken to fly alike.
    config : GuidanceConfig
    """

    def __init__(self, own: int, airframe: Airframe, config: GuidanceConfig) -> None:
        self._own, self._separation = own, config.separation
        self._sideways = _TURNING * GRAVITY * math.tan(airframe.max_bank)
        self._limits = limits([airframe], config.following, config.approach)
        self._heard: dict[int, _Heard] = {}

    def step(self, time: float, heartbeats: Iterable[Heartbeat], wind: tuple[float, float]) -> None:
        """Take note of what was heard, and forget who was not heard for too long.

        Parameters
        ----------
        time : float [s]
        heartbeats : iterable of Heartbeat
        wind : (float, float) [m/s]
            The air that carries them all, to east and north.
        """
        for word in sorted(heartbeats, key=lambda word: word.time):
            before = self._heard.get(word.sender)
            if word.sender == self._own or (before is not None and before.time >= word.time):
                continue
            climb = 0.0
            if before is not None:
                climb = (word.pose.z - before.pose.z) / (word.time - before.time)
            flown, straight = self._expected(word, climb, wind)
            self._heard[word.sender] = _Heard(word.time, word.pose, flown, straight)
        self._heard = {
            who: heard for who, heard in self._heard.items() if time - heard.time <= FORGET
        }

    def _expected(
        self, word: Heartbeat, climb: float, wind: tuple[float, float]
    ) -> tuple[Floats, Floats]:
        """Where what it flies leads, and where it comes straight ahead."""
        steps = round((FORGET + _HORIZON) / _STEP)
        start, rates = np.array([word.pose]), np.array([climb])
        air = np.empty((steps, 1, 2))
        air[:] = wind
        level = FlyBanks((0.0,), 1.0, word.pose.speed, word.pose.z)
        ways = []
        for command in (word.command or level, level):
            row = encode([command])
            row[0, 2] = row[0, 2] if word.command is None else word.command.altitude
            path, _ = fly(start, rates, row, self._limits, air, _STEP, steps)
            ways.append(np.concatenate([start[:, :3], path[:, 0, :3]]))
        return ways[0], ways[1]

    def poses(self) -> list[Pose]:
        """What was last heard of each, in the order of their numbers."""
        return [self._heard[who].pose for who in sorted(self._heard)]

    def at(self, time: float, pose: Pose, reach: float) -> Others:
        """Those that may come near, as the kernels read them.

        Parameters
        ----------
        time : float [s]
        pose : Pose
            Of the aircraft itself.
        reach : float [m]
            Who was heard farther away than this is left out.

        Returns
        -------
        Others
        """
        ahead = np.arange(0.0, _HORIZON, _STEP)
        places, apart = [], []
        for who in sorted(self._heard):
            heard = self._heard[who]
            silent = time - heard.time
            if math.hypot(heard.pose.x - pose.x, heard.pose.y - pose.y) > reach:
                continue
            now = round(silent / _STEP)
            gives_way = who > self._own and silent <= _HEARD
            keep = self._apart(silent, ahead, gives_way)
            for way in (heard.flown, heard.straight):
                places.append(way[now : now + len(ahead)])
                apart.append(keep)
        shape = (-1, len(ahead))
        return Others(
            np.array(places, dtype=np.float64).reshape(*shape, 3),
            np.array(apart, dtype=np.float64).reshape(*shape, 2),
            _STEP,
        )

    def _apart(self, silent: float, ahead: Floats, gives_way: bool) -> Floats:
        """(t, 2) what to keep, level and in height, from one that is silent for so long [m]."""
        since = silent + ahead
        turned = np.minimum(0.5 * self._sideways * since**2, _MOST)
        apart = np.empty((len(ahead), 2))
        apart[:, 0] = self._separation + _BUFFER + turned + _ASTRAY * max(silent - _HEARD, 0.0)
        rate, most = _CLIMB
        apart[:, 1] = self._separation + np.minimum(rate * since, most)
        if gives_way:
            apart[ahead > _GIVES_WAY] = _NOWHERE
        return apart
