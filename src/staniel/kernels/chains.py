"""Shortest chains of changes: they give a row a column at the least extra cost.

A row takes the column of another, which takes that of a third, until one takes a column that nobody
has. Dijkstra's method finds the shortest such chain on reduced costs, which are never negative
(Jonker and Volgenant 1987, "A shortest augmenting path algorithm for dense and sparse linear
assignment problems", Computing 38).
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["NOBODY", "augment", "warm"]

Array = NDArray[Any]

NOBODY = -1
_BLOCK = 16  # columns, a multiple of what a register holds


@njit(cache=True, error_model="numpy", fastmath={"nnan", "nsz"}, forceinline=True)
def _relax_part(
    first: int,
    last: int,
    costs: Array,
    prices: Array,
    less: float,
    i: int,
    ways: Array,
    before: Array,
) -> float:
    """As `_relax`, for some columns."""
    shortest = np.inf
    for j in range(first, last):
        way, had, row = costs[j] + prices[j] - less, ways[j], before[j]
        # Rows are floats here, and `min` is not the same choice again: so neither is a branch.
        before[j] = float(i) if way < had else row
        way = min(way, had)
        ways[j] = way
        shortest = min(shortest, way)
    return shortest


@njit(cache=True, error_model="numpy")
def _relax(
    costs: Array,
    prices: Array,
    less: float,
    i: int,
    ways: Array,
    before: Array,
    shortest_of: Array,
) -> float:
    """Ways to all columns where row `i` shortens them; returns the shortest.

    `shortest_of` becomes that of each block of columns, so that the ends of the shortest are found
    without a look at all columns. A whole block is a loop of a length that the compiler knows.
    """
    shortest, whole = np.inf, costs.size // _BLOCK
    for b in range(whole):
        first = b * _BLOCK
        least = _relax_part(first, first + _BLOCK, costs, prices, less, i, ways, before)
        shortest_of[b] = least
        shortest = min(shortest, least)
    least = _relax_part(whole * _BLOCK, costs.size, costs, prices, less, i, ways, before)
    shortest_of[whole] = least
    return min(shortest, least)


@njit(cache=True, error_model="numpy")
def _close(
    level: float,
    ways: Array,
    open_: Array,
    shortest_of: Array,
    rows: Array,
    closed: Array,
    reached: Array,
    count: int,
) -> tuple[int, int]:
    """A free column at the end of a shortest way, or -1 and all of them onto the list `closed`."""
    first = count
    for b in range(ways.size // _BLOCK + 1):
        if shortest_of[b] != level:
            continue
        for j in range(b * _BLOCK, min(ways.size, (b + 1) * _BLOCK)):
            if ways[j] == level:
                if rows[j] == NOBODY:
                    return j, first
                closed[count], reached[count] = j, level
                count += 1
    for k in range(first, count):
        ways[closed[k]], open_[closed[k]] = np.inf, np.inf
    return NOBODY, count


@njit(cache=True, error_model="numpy")
def augment(cost: Array, prices: Array, columns: Array, rows: Array) -> None:
    """Give each row that has no column one by a shortest chain, in place.

    All others hold the cheapest of their columns, exactly, and do so at the end. Columns as near as
    one another are served in the order found: where costs are often equal this reaches a free one
    soonest.

    Parameters
    ----------
    cost : (n, m) float64 array
        Finite, C-contiguous, n <= m.
    prices : (m,) float64 array
        Column j costs row i in all ``cost[i, j] + prices[j]``.
    columns : (n,) int64 array
        Of each row; `NOBODY` where it has none.
    rows : (m,) int64 array
        Of each column; as `columns`.
    """
    n, m = cost.shape
    floats, closed = np.zeros((5, m + 1)), np.empty(m, np.int64)
    ways, open_, before = floats[0, :m], floats[1], floats[2]
    reached, shortest_of = floats[3], floats[4]
    for start in range(n):
        if columns[start] != NOBODY:
            continue
        ways[:], open_[:m] = np.inf, prices
        turn, count, i, less, level = 0, 0, start, 0.0, -np.inf
        while True:
            shortest = _relax(cost[i], open_, less, i, ways, before, shortest_of)
            if turn == count or shortest <= level:
                level = shortest
                j, count = _close(level, ways, open_, shortest_of, rows, closed, reached, count)
                if j != NOBODY:
                    break
            j = closed[turn]
            i = rows[j]
            less = cost[i, j] + prices[j] - reached[turn]
            turn += 1
        for k in range(count):
            prices[closed[k]] += level - reached[k]
        while columns[start] == NOBODY:
            i = int(before[j])
            rows[j] = i
            columns[i], j = j, columns[i]


def warm() -> None:
    """Compile, or load from the cache, on two rows."""
    columns, rows = np.full(2, NOBODY), np.full(2, NOBODY)
    augment(np.array([[1.0, 2.0], [1.0, 3.0]]), np.zeros(2), columns, rows)
