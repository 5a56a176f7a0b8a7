"""Where one may fly at one height: a grid of cells, free or blocked, and by what."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.risk import RiskRegion
from staniel.errors import PlanningError
from staniel.guidance.dangers import Dangers
from staniel.guidance.walls import WallLine
from staniel.kernels.cells import Cells

__all__ = ["BUILDING", "FREE", "NO_FLY", "WALL", "Obstacles"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
States = NDArray[np.uint8]

FREE, BUILDING, NO_FLY, WALL = 0, 1, 2, 3
_WHAT = {BUILDING: "a building", NO_FLY: "a no-fly region", WALL: "a wall that a lidar measured"}

MOST_CELLS = 4_000_000

_HAIR = 1e-9  # a cell just as far off as the clearance is free [m]


@dataclass(frozen=True, eq=False)
class Obstacles:
    """What is in the way at one flight height, inflated by the clearance that is kept from it.

    A cell is blocked if any place in it is nearer than `clearance` to an obstacle. So whatever
    stays in free cells keeps the clearance, and a gap narrower than twice the clearance and two
    cells may be closed although one could pass.

    Attributes
    ----------
    west, south : float [m]
        Of the grid's corner.
    cell : float [m]
        Side of a cell.
    altitude : float [m]
        Above the ground.
    clearance : float [m]
        Greater than 0.
    state : (rows, columns) uint8 array
        `FREE`, or what blocks the cell: `BUILDING`, `NO_FLY` or `WALL`; row 0 is the south edge.
        Outside the grid nobody may fly.
    """

    west: float
    south: float
    cell: float
    altitude: float
    clearance: float
    state: States

    @classmethod
    def open(
        cls,
        size: tuple[float, float],
        *,
        altitude: float,
        clearance: float,
        cell: float = 4.0,
        margin: float = 0.0,
    ) -> "Obstacles":
        """Free air over a rectangle.

        Parameters
        ----------
        size : (float, float) [m]
            East and north extent from the origin.
        altitude : float [m]
        clearance : float [m]
            To keep from what will be put in, greater than 0.
        cell : float [m]
        margin : float [m]
            Free air all round the rectangle, at least 0.

        Raises
        ------
        PlanningError
            A value that is out of range or not finite, or more than four million cells.

        Examples
        --------
        >>> Obstacles.open((100.0, 60.0), altitude=50.0, clearance=3.0).state.shape
        (15, 25)
        """
        for name, value, least in (
            ("size", min(size), 0.0),
            ("cell", cell, 0.0),
            ("clearance", clearance, 0.0),
            ("altitude", altitude, -1e5),
            ("margin", margin, -1e-300),
        ):
            if not least < value < math.inf:
                raise PlanningError(f"{name} = {value}: expected metres greater than {least:g}")
        extent = [(side + 2.0 * margin) / cell for side in size]
        if not extent[0] * extent[1] <= MOST_CELLS:
            raise PlanningError(
                f"cell = {cell:g}: expected at most {MOST_CELLS:,} cells, "
                f"got {extent[0]:.0f} x {extent[1]:.0f}"
            )
        columns, rows = (math.ceil(n - 1e-9) for n in extent)
        state = np.zeros((rows, columns), dtype=np.uint8)
        return cls(-margin, -margin, float(cell), float(altitude), float(clearance), state)

    @classmethod
    def from_city(
        cls,
        city: City,
        *,
        altitude: float,
        clearance: float,
        cell: float = 4.0,
        margin: float = 0.0,
    ) -> "Obstacles":
        """The buildings of a chart that reach up to the flight height, less the clearance.

        Parameters
        ----------
        city : City
            An agent's chart.
        altitude, clearance, cell, margin
            As in `open`. A roof must be `clearance` below the altitude to be flown over.

        Raises
        ------
        PlanningError
            As `open`.

        Examples
        --------
        >>> house = shapely.box(40.0, 40.0, 60.0, 60.0)
        >>> city = City.from_outlines([house], heights=[20.0], size=(100.0, 100.0))
        >>> low, high = (
        ...     Obstacles.from_city(city, altitude=z, clearance=3.0) for z in (22.0, 24.0)
        ... )
        >>> int(low.blocked.sum()), int(high.blocked.sum())
        (49, 0)
        """
        empty = cls.open(
            city.size, altitude=altitude, clearance=clearance, cell=cell, margin=margin
        )
        tall = np.flatnonzero(city.heights > altitude - clearance)
        return empty.with_shapes([city.outlines[k] for k in tall], BUILDING)

    def with_shapes(
        self, shapes: Sequence[shapely.Geometry], kind: int, reach: float | Floats = 0.0
    ) -> "Obstacles":
        """A copy in which everything nearer to a shape than `reach` and the clearance is blocked.

        Parameters
        ----------
        shapes : sequence of n shapely geometries [m]
        kind : {BUILDING, NO_FLY, WALL}
        reach : float or (n,) float array [m]
        """
        state = self.state.copy()
        rows, columns = state.shape
        distances = np.broadcast_to(np.asarray(reach) + self.clearance, (len(shapes),))
        for shape, distance in zip(shapes, distances.tolist(), strict=True):
            low_x, low_y, high_x, high_y = shapely.bounds(shape).tolist()
            i0 = max(math.floor((low_x - distance - self.west) / self.cell), 0)
            j0 = max(math.floor((low_y - distance - self.south) / self.cell), 0)
            i1 = min(math.floor((high_x + distance - self.west) / self.cell) + 1, columns)
            j1 = min(math.floor((high_y + distance - self.south) / self.cell) + 1, rows)
            if i0 >= i1 or j0 >= j1:
                continue
            x = self.west + self.cell * np.arange(i0, i1)
            y = self.south + self.cell * np.arange(j0, j1)[:, None]
            boxes = shapely.box(x, y, x + self.cell, y + self.cell)
            shapely.prepare(shape)
            near = shapely.dwithin(shape, boxes, distance - _HAIR)
            part = state[j0:j1, i0:i1]
            part[near & (part == FREE)] = kind
        return replace(self, state=state)

    def with_regions(self, regions: Sequence[RiskRegion]) -> "Obstacles":
        """A copy in which the no-fly regions at this altitude are blocked; threats are not."""
        here = [
            region
            for region in regions
            if region.kind == "no-fly"
            and region.floor - self.clearance < self.altitude
            and (region.ceiling is None or self.altitude < region.ceiling + self.clearance)
        ]
        shapes = [
            shapely.Polygon(region.polygon)
            if region.center is None
            else shapely.Point(region.center)
            for region in here
        ]
        return self.with_shapes(shapes, NO_FLY, np.array([region.radius or 0.0 for region in here]))

    def with_walls(self, lines: Sequence[WallLine]) -> "Obstacles":
        """A copy in which wall lines are blocked, such as `staniel.guidance.walls` fits."""
        return self.with_shapes([shapely.LineString((w.start, w.end)) for w in lines], WALL)

    @property
    def blocked(self) -> Bools:
        """(rows, columns) where nobody may fly."""
        blocked: Bools = self.state != FREE
        return blocked

    @cached_property
    def distance(self) -> Floats:
        """(rows, columns) from the middle of each cell to that of the nearest blocked cell [m].

        0 in blocked cells; the grid's outside is blocked.
        """
        from scipy.ndimage import distance_transform_edt  # half a second, only here

        away = distance_transform_edt(np.pad(~self.blocked, 1))
        distance: Floats = self.cell * np.asarray(away)[1:-1, 1:-1]
        return distance

    @property
    def middles(self) -> Floats:
        """(rows, columns, 2) east and north of the middle of each cell [m]."""
        rows, columns = self.state.shape
        x = self.west + self.cell * (np.arange(columns) + 0.5)
        y = self.south + self.cell * (np.arange(rows) + 0.5)
        return np.stack(np.meshgrid(x, y), axis=-1)

    def what_blocks(self, x: float, y: float) -> str | None:
        """What is in the way at a place [m], in words; None where it is free."""
        rows, columns = self.state.shape
        i, j = (x - self.west) / self.cell, (y - self.south) / self.cell
        if not (0.0 <= i < columns and 0.0 <= j < rows):
            return "the edge of the area"
        return _WHAT.get(int(self.state[int(j), int(i)]))

    def exposure_rates(self, dangers: Dangers) -> Floats:
        """(rows, columns) expected exposure per second in the middle of each cell [1/s]."""
        middles = self.middles.reshape(-1, 2)
        heights = np.full(len(middles), self.altitude)
        return dangers.rate(np.column_stack((middles, heights))).reshape(self.state.shape)

    def cells(self, extra: Floats | None = None) -> Cells:
        """As kernels take it: a metre costs 1, and `extra` (rows, columns) more where given."""
        price = np.where(self.blocked, np.inf, 1.0 if extra is None else 1.0 + extra)
        return Cells(self.west, self.south, self.cell, price.astype(np.float32))
