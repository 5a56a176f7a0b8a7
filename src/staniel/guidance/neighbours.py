"""Where other aircraft may be, from what they last said of themselves; the older, the less sure."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import GRAVITY, Airframe
from staniel.datatypes.message import Heartbeat
from staniel.kernels.avoidance import Others

__all__ = ["FORGET", "Neighbours"]

Floats = NDArray[np.float64]

FORGET = 30.0
"""An aircraft that was not heard for so long may be anywhere, and is no longer reckoned with [s]."""

_STEP, _HORIZON = 0.25, 20.0  # of the times for which places are expected [s]
_BUFFER = 4.0  # beside the separation: what a decision step and an autopilot leave open [m]
_TURNING = 0.35  # of the sharpest turn: what another may do that nobody expects
_MOST = 18.0  # ... and how far that takes it before it, too, gives way [m]
_ASTRAY = 2.5  # how much less is known of a place with each second of silence [m/s]
_HEARD = 1.5  # a word that is not older is news [s]
_CLIMBING = 4.0  # how long another is taken to go on climbing [s]
_CLIMB = 0.5, 3.0  # what is not known of its height grows by [m/s], up to [m]
_GIVES_WAY = 4.0  # how near in time one that has to give way is reckoned with [s]


class _Heard(NamedTuple):
    time: float
    pose: Pose
    climb: float


class Neighbours:
    """The other aircraft, as one of them knows them.

    Each is expected to keep its turn and its speed, and its climb for some seconds. What is kept
    from that place is the separation and more: what an unexpected turn makes of it, growing
    with the time since it was last heard, so that silence makes careful.

    Parameters
    ----------
    own : int
        Who knows them. Of two aircraft the one with the higher number gives way: it looks far
        ahead for the other, which reckons with it only when it comes near. Both do so in the end.
    airframe : Airframe
        The others are taken to fly alike.
    separation : float [m]
    """

    def __init__(self, own: int, airframe: Airframe, separation: float) -> None:
        self._own, self._separation = own, separation
        self._sideways = _TURNING * GRAVITY * math.tan(airframe.max_bank)
        self._heard: dict[int, _Heard] = {}

    def step(self, time: float, heartbeats: Iterable[Heartbeat]) -> None:
        """Take note of what was heard, and forget who was not heard for too long."""
        for word in sorted(heartbeats, key=lambda word: word.time):
            before = self._heard.get(word.sender)
            if word.sender == self._own or (before is not None and before.time >= word.time):
                continue
            climb = 0.0
            if before is not None:
                climb = (word.pose.z - before.pose.z) / (word.time - before.time)
            self._heard[word.sender] = _Heard(word.time, word.pose, climb)
        self._heard = {
            who: heard for who, heard in self._heard.items() if time - heard.time <= FORGET
        }

    def poses(self) -> list[Pose]:
        """What was last heard of each, in the order of their numbers."""
        return [self._heard[who].pose for who in sorted(self._heard)]

    def at(self, time: float, pose: Pose, reach: float, wind: tuple[float, float]) -> Others:
        """Those that may come near, as the kernels read them.

        Parameters
        ----------
        time : float [s]
        pose : Pose
            Of the aircraft itself.
        reach : float [m]
            Who is expected farther away than this is left out.
        wind : (float, float) [m/s]
            The air that carries them all, to east and north.

        Returns
        -------
        Others
        """
        ahead = np.arange(0.0, _HORIZON + _STEP, _STEP)
        places, apart = [], []
        for who in sorted(self._heard):
            heard = self._heard[who]
            silent = time - heard.time
            place = _expected(heard, silent + ahead, wind)
            if math.hypot(place[0, 0] - pose.x, place[0, 1] - pose.y) > reach:
                continue
            places.append(place)
            apart.append(self._apart(silent, ahead, who > self._own))
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
            apart[ahead > _GIVES_WAY] = 1e-9
        return apart


def _expected(heard: _Heard, since: Floats, wind: tuple[float, float]) -> Floats:
    """(t, 3) places so long after the last word [m]."""
    pose = heard.pose
    rate = GRAVITY / pose.speed * math.tan(pose.bank)
    if abs(rate) < 1e-3:
        along, aside = pose.speed * since, np.zeros_like(since)
    else:
        along = pose.speed / rate * np.sin(rate * since)
        aside = pose.speed / rate * (1.0 - np.cos(rate * since))
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    places = np.empty((len(since), 3))
    places[:, 0] = pose.x + along * cos - aside * sin + wind[0] * since
    places[:, 1] = pose.y + along * sin + aside * cos + wind[1] * since
    places[:, 2] = pose.z + heard.climb * np.minimum(since, _CLIMBING)
    return places
