"""What an aircraft finds out about its own motion: the wind that carries it, and its climb."""

import math

from staniel.datatypes.belief import Pose

__all__ = ["Drift"]

_CALM = 0.5  # less wind than this is taken for none: a turn's chord looks like as much [m/s]
_GAIN = 0.3  # of the newest estimate
_ODD = 0.3  # farther off the expected height than this, what was expected is wrong [m]


class Drift:
    """Wind and climb rate, from one pose to the next.

    Parameters
    ----------
    step : float [s]
        Between two poses.

    Attributes
    ----------
    wind : (float, float) [m/s]
        To east and north, smoothed.
    climb : float [m/s]

    Examples
    --------
    Heading east, and carried north:

    >>> drift = Drift(1.0)
    >>> for k in range(40):
    ...     drift.step(Pose(15.0 * k, 3.0 * k, 80.0, 0.0, 0.0, 15.0))
    >>> round(drift.wind[1], 3), drift.climb
    (3.0, 0.0)
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._before: Pose | None = None
        self._expected: tuple[float, float] | None = None
        self._raw = (0.0, 0.0)
        self.wind, self.climb = (0.0, 0.0), 0.0

    def expect(self, height: float, climb: float) -> None:
        """What the next pose should show: height [m] and climb rate [m/s]."""
        self._expected = (height, climb)

    def step(self, pose: Pose) -> None:
        """Take note of a pose, one step after the last."""
        before, self._before = self._before, pose
        if before is None:
            return
        east, north = pose.x - before.x, pose.y - before.y
        for end in (before, pose):
            east -= 0.5 * self._step * end.speed * math.cos(end.heading)
            north -= 0.5 * self._step * end.speed * math.sin(end.heading)
        x, y = self._raw
        x += _GAIN * (east / self._step - x)
        y += _GAIN * (north / self._step - y)
        self._raw = (x, y)
        self.wind = self._raw if math.hypot(x, y) > _CALM else (0.0, 0.0)
        height, climb = self._expected or (math.inf, 0.0)
        told = abs(pose.z - height) <= _ODD
        self.climb = climb if told else (pose.z - before.z) / self._step
