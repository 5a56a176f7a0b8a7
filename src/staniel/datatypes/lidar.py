"""What a lidar or a laser rangefinder returns: ranges along level beams."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # a percept holds a scan
    from staniel.datatypes.belief import Pose

__all__ = ["LidarScan"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LidarScan:
    """Ranges of one aircraft's beams, all in the horizontal plane at its height.

    A scanner measures all of them at once from one place. What a rangefinder measured on its way
    is one scan, too: then each beam has an origin of its own.

    Parameters
    ----------
    time : float [s]
        When the scan was complete.
    pose : Pose
        Where the aircraft held itself to be then.
    angles : (n,) array_like [rad]
        Of the beams off `pose.heading`, positive to the left.
    ranges : (n,) array_like [m]
        At least 0; infinite where nothing came back.
    sigma : float [m]
        Standard deviation of a range, at least 0.
    origins : (n, 2) array_like [m], optional
        Where each beam left, east and north. Not given: at `pose`.

    Raises
    ------
    ValueError
        Shapes that do not match, a value that is not finite (but for a range) or below 0.

    Examples
    --------
    >>> from staniel.datatypes.belief import Pose
    >>> pose = Pose(10.0, 20.0, 15.0, math.pi / 2, 0.0, 15.0)
    >>> LidarScan(0.0, pose, [-0.1, 0.0], [math.inf, 30.0], 0.1).points()
    array([[10., 50.]])
    """

    time: float
    pose: "Pose"
    angles: Floats
    ranges: Floats
    sigma: float
    origins: Floats = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        angles = np.asarray(self.angles, dtype=np.float64)
        ranges = np.asarray(self.ranges, dtype=np.float64)
        origins = np.asarray(self.origins, dtype=np.float64)
        if len(origins) == 0:
            origins = np.broadcast_to((self.pose.x, self.pose.y), (len(angles), 2))
        if angles.ndim != 1 or ranges.shape != angles.shape or origins.shape != (len(angles), 2):
            raise ValueError(
                f"LidarScan has angles {angles.shape}, ranges {ranges.shape}, "
                f"origins {origins.shape}: expected (n,), (n,), (n, 2)"
            )
        if not math.isfinite(float(angles.sum()) + float(origins.sum())):  # one spoils the sum
            raise ValueError("LidarScan.angles and LidarScan.origins: expected finite numbers")
        if len(ranges) and not ranges.min() >= 0.0:  # not a number, neither
            raise ValueError("LidarScan.ranges: expected metres of at least 0, or infinity")
        if not 0.0 <= self.sigma < math.inf:
            raise ValueError(f"LidarScan.sigma = {self.sigma}: expected metres of at least 0")
        object.__setattr__(self, "angles", angles)
        object.__setattr__(self, "ranges", ranges)
        object.__setattr__(self, "origins", origins)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LidarScan):
            return NotImplemented
        return (self.time, self.pose, self.sigma) == (other.time, other.pose, other.sigma) and all(
            np.array_equal(mine, theirs)
            for mine, theirs in (
                (self.angles, other.angles),
                (self.ranges, other.ranges),
                (self.origins, other.origins),
            )
        )

    def __hash__(self) -> int:
        return hash((self.time, self.pose, self.sigma, self.ranges.tobytes()))

    @property
    def returned(self) -> NDArray[np.bool_]:
        """(n,) which beams came back."""
        return np.isfinite(self.ranges)

    def directions(self) -> Floats:
        """(n, 2) unit vectors of the beams, east and north."""
        course = self.pose.heading + self.angles
        return np.column_stack((np.cos(course), np.sin(course)))

    def points(self) -> Floats:
        """(m, 2) east and north of what the beams that came back have met [m]."""
        back = self.returned
        points: Floats = self.origins[back] + self.ranges[back, None] * self.directions()[back]
        return points
