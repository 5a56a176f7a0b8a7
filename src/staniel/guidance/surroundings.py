"""One aircraft's memory of the buildings around it: what its lidar saw, and what its chart says."""

import math

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.lidar import LidarScan
from staniel.kernels.occupancy import Tops, Window, forget, mark, tops

__all__ = ["Surroundings"]

CELL = 3.0
"""Side of a cell [m]: neighbouring beams a degree apart leave no gap within 170 m."""

REACH = 150.0
"""Half the side of the window [m]: the way of eight seconds, and room for a circle on the way."""

START = 20.0
"""Around the place where it first looks an aircraft takes the air to be clear [m]."""

ROOF_MARGIN = 2.0
"""Height kept above the roofs of the chart [m]."""


class Surroundings:
    """A window of cells around one aircraft.

    Parameters
    ----------
    chart : City
        The map that the agent holds; blank if it has no building. Of a chart that is not blank
        every part is believed, and what the lidar meets is added.
    clearance : float [m]
        Kept from walls.
    reach : float [m]
        How far a beam that does not come back has passed: the lidar's range.
    safe_altitude : float, optional [m]
        No building reaches it, as far as the team was told. Not given: that of the chart's tallest
        roof, or unknown.
    """

    def __init__(
        self, chart: City, clearance: float, reach: float, safe_altitude: float | None
    ) -> None:
        n = 2 * math.ceil(REACH / CELL)
        self._window = Window(*(np.full((n, n), fill, np.float32) for fill in _EMPTY))
        self._corner = np.full(2, -(2**40))
        self._chart, self._clearance, self._reach = chart, clearance, reach
        self._roofs = np.ascontiguousarray(chart.heights, dtype=np.float64)
        self._blank = len(self._roofs) == 0
        known = math.inf if self._blank else chart.tallest + ROOF_MARGIN
        self.ceiling = known if safe_altitude is None else safe_altitude
        self._looked = False

    def step(self, pose: Pose, scan: LidarScan | None) -> Tops:
        """Take note of a scan, and say where not to fly.

        Parameters
        ----------
        pose : Pose
        scan : LidarScan, optional
            None from an aircraft that has no lidar: then what nobody looked at is open.

        Returns
        -------
        Tops
        """
        half = len(self._window.passed) // 2
        corner = np.array([math.floor(pose.x / CELL) - half, math.floor(pose.y / CELL) - half])
        forget(
            self._window,
            self._corner,
            corner,
            CELL,
            self._chart.walls,
            self._roofs,
            ROOF_MARGIN,
        )
        self._corner = corner
        if scan is not None:
            if not self._looked:
                self._begin(pose)
            mark(
                self._window,
                corner,
                CELL,
                scan.pose.z,
                np.ascontiguousarray(scan.origins),
                scan.pose.heading + scan.angles,
                scan.ranges,
                self._reach,
                scan.sigma,
            )
        return tops(
            self._window,
            corner,
            CELL,
            self._clearance,
            self.ceiling,
            self._blank and self._looked,
        )

    def _begin(self, pose: Pose) -> None:
        """Take the place where it looks for the first time to be clear: it got there."""
        self._looked = True
        passed, n = self._window.passed, len(self._window.passed)
        most = math.ceil(START / CELL)
        for i, j in np.ndindex(2 * most + 1, 2 * most + 1):
            east, north = math.floor(pose.x / CELL) + i - most, math.floor(pose.y / CELL) + j - most
            if math.hypot(i - most, j - most) * CELL <= START:
                passed[east % n, north % n] = pose.z


_EMPTY = (np.inf, -np.inf, -np.inf)
