"""D*-Lite on the grid, kept from one chart to the next, and Dubins paths along what it finds."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.guidance.planning.follow import dubins_along, taut
from staniel.guidance.planning.planners import planner
from staniel.guidance.planning.problem import NoPath, Plan, Problem
from staniel.kernels.cells import Cells
from staniel.kernels.dstar import begin, mend, repair, walk

__all__ = ["GridWay", "dstar"]

Floats = NDArray[np.float64]


class GridWay:
    """The cheapest way on a grid to one goal, mended as the grid changes.

    Parameters
    ----------
    cells : Cells
    goal : (float, float) [m]
        On the grid.

    Examples
    --------
    >>> cells = Cells(0.0, 0.0, 1.0, np.ones((3, 5), dtype=np.float32))
    >>> way = GridWay(cells, (4.5, 1.5))
    >>> way.cost((0.5, 1.5))
    4.0
    >>> price = cells.price.copy()
    >>> price[:2, 2] = np.inf
    >>> way.change(cells._replace(price=price), (0.5, 1.5))
    2
    >>> round(way.cost((0.5, 1.5)), 3)
    4.828
    """

    def __init__(self, cells: Cells, goal: tuple[float, float]) -> None:
        self._cells = cells
        self._memory = begin(cells, self._number(goal))
        self._memory.numbers[2] = self._number(goal)

    @property
    def work(self) -> int:
        """Cells worked on so far, each time counted."""
        return int(self._memory.numbers[3])

    def change(self, cells: Cells, start: tuple[float, float]) -> int:
        """Take over another grid of the same shape, from where the aircraft is now.

        Returns
        -------
        int
            How many cells have another price.
        """
        changed = np.flatnonzero(cells.price != self._cells.price).astype(np.int32)
        self._cells = cells
        mend(self._memory, cells, changed, self._number(start))
        return len(changed)

    def cost(self, start: tuple[float, float]) -> float:
        """Of the cheapest way along eight directions from a place; infinite where there is none."""
        number = self._number(start)
        if number != self._memory.numbers[2]:
            mend(self._memory, self._cells, np.empty(0, dtype=np.int32), number)
        return float(repair(self._memory, self._cells, number))

    def way(self, start: tuple[float, float]) -> Floats:
        """(m, 2) places from there to the goal's cell [m]; empty where there is no way."""
        if math.isinf(self.cost(start)):
            return np.empty((0, 2))
        rows, columns = np.divmod(
            walk(self._memory, self._cells, self._number(start)), self._cells.price.shape[1]
        )
        corner = np.array((self._cells.west, self._cells.south))
        return corner + self._cells.cell * (np.column_stack((columns, rows)) + 0.5)

    def _number(self, place: tuple[float, float]) -> int:
        i = int((place[0] - self._cells.west) / self._cells.cell)
        j = int((place[1] - self._cells.south) / self._cells.cell)
        columns: int = self._cells.price.shape[1]
        return j * columns + i


@planner("dstar")
def dstar(problem: Problem, rng: np.random.Generator) -> Plan | NoPath:
    """D*-Lite over the grid, from scratch, with Dubins paths along its way.

    To go on with what it knows when a chart changes, hold a `GridWay`.

    Parameters
    ----------
    problem : Problem
        Its `limit` is not needed: the grid is finite.
    rng : numpy.random.Generator
        Not used.

    Returns
    -------
    Plan or NoPath
        ``"closed"`` where the grid has no way, ``"limit"`` where no turns fit along the way.
    """
    grid = GridWay(problem.cells, (problem.goal[0], problem.goal[1]))
    way = grid.way(problem.start[:2])
    if not len(way):
        return NoPath("closed", grid.work)
    way[0], way[-1] = problem.start[:2], problem.goal[:2]
    if len(way) == 1:
        way = np.array([problem.start[:2], problem.goal[:2]])
    return dubins_along(problem, taut(problem, way), grid.work)
