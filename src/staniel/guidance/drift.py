"""What an aircraft finds out about its own motion: the wind that carries it, and its climb."""

import math
from collections.abc import Sequence

from staniel.datatypes.belief import Pose

__all__ = ["Drift"]

_CALM = 0.2  # less wind than this is taken for none: noise of the navigation [m/s]
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
    ...     pose = Pose(15.0 * k, 3.0 * k, 80.0, 0.0, 0.0, 15.0)
    ...     drift.step(pose)
    ...     east, north = drift.wind
    ...     there = (pose.x + 15.0 + east, pose.y + north, *pose[2:])
    ...     drift.expect(there, 0.0)
    >>> round(drift.wind[1], 3), drift.climb
    (3.0, 0.0)
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._before: Pose | None = None
        self._expected: tuple[Sequence[float], float] | None = None
        self._raw = (0.0, 0.0)
        self.wind, self.climb = (0.0, 0.0), 0.0

    def expect(self, there: Sequence[float], climb: float) -> None:
        """What the next pose should be with this wind, x, y and z [m] first, and its climb [m/s].

        Where it turns out to lie otherwise, the wind is another.
        """
        self._expected = (there, climb)

    def step(self, pose: Pose) -> None:
        """Take note of a pose, one step after the last."""
        before, self._before = self._before, pose
        if before is None or self._expected is None:
            return
        there, climb = self._expected
        x, y = self._raw
        x += _GAIN * (self.wind[0] + (pose.x - there[0]) / self._step - x)
        y += _GAIN * (self.wind[1] + (pose.y - there[1]) / self._step - y)
        self._raw = (x, y)
        self.wind = self._raw if math.hypot(x, y) > _CALM else (0.0, 0.0)
        told = abs(pose.z - there[2]) <= _ODD
        self.climb = climb if told else (pose.z - before.z) / self._step
