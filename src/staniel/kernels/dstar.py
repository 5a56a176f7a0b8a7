"""D*-Lite: the cheapest way on a grid, mended where it has changed (Koenig and Likhachev 2002).

The search runs from the goal to where the aircraft is. When cells become blocked or free only what
depends on them is worked on again. This is the optimised version without the queue's own removal:
an entry of the heap counts if its key is still the vertex's.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.cells import Cells, warm_cells
from staniel.kernels.field import step_cost

__all__ = ["Memory", "begin", "mend", "repair", "walk", "warm"]

Floats = NDArray[np.float64]
Numbers = NDArray[np.int32]

_EIGHT = np.array(
    [[0, 1], [1, 1], [1, 0], [1, -1], [0, -1], [-1, -1], [-1, 0], [-1, 1]], dtype=np.int64
)
_LEAST = 1e-6  # costs nearer than that are equal: sums in other orders differ [m]


class Memory(NamedTuple):
    """What is kept from one repair to the next; arrays are changed in place."""

    cost: Floats
    """(rows, columns) g, cost to the goal as it was last settled."""
    seen: Floats
    """(rows, columns) rhs, cost to the goal over the best neighbour."""
    keys: Floats
    """(capacity, 2) heap of keys; row 0 first."""
    items: Numbers
    """(capacity,) cell of each entry."""
    entered: Floats
    """(rows, columns, 2) key under which a cell is in the heap; not a number: it is not."""
    numbers: NDArray[np.int64]
    """(4,) entries in the heap; goal cell; cell of the last repair; cells worked on so far."""
    drift: Floats
    """(1,) k_m: how far the aircraft has come, which keeps old keys comparable."""


@njit(cache=True, error_model="numpy")
def _before(keys: Floats, a: int, b: int) -> bool:
    return bool(keys[a, 0] < keys[b, 0] or (keys[a, 0] == keys[b, 0] and keys[a, 1] < keys[b, 1]))


@njit(cache=True, error_model="numpy")
def _swap(memory: Memory, a: int, b: int) -> None:
    keys, items = memory.keys, memory.items
    keys[a, 0], keys[b, 0] = keys[b, 0], keys[a, 0]
    keys[a, 1], keys[b, 1] = keys[b, 1], keys[a, 1]
    items[a], items[b] = items[b], items[a]


@njit(cache=True, error_model="numpy")
def _enter(memory: Memory, j: int, i: int, first: float, second: float) -> None:
    """Put a cell into the heap under a key; an entry under another key no longer counts."""
    memory.entered[j, i, 0], memory.entered[j, i, 1] = first, second
    at = memory.numbers[0]
    if at == memory.items.size:
        _compact(memory)
        at = memory.numbers[0]
    memory.keys[at, 0], memory.keys[at, 1] = first, second
    memory.items[at] = j * memory.cost.shape[1] + i
    memory.numbers[0] += 1
    while at > 0 and _before(memory.keys, at, (at - 1) >> 1):
        _swap(memory, at, (at - 1) >> 1)
        at = (at - 1) >> 1


@njit(cache=True, error_model="numpy")
def _sink(memory: Memory, at: int, size: int) -> None:
    while 2 * at + 1 < size:
        below = 2 * at + 1
        if below + 1 < size and _before(memory.keys, below + 1, below):
            below += 1
        if not _before(memory.keys, below, at):
            return
        _swap(memory, at, below)
        at = below


@njit(cache=True, error_model="numpy")
def _drop(memory: Memory) -> None:
    """Take the first entry off."""
    memory.numbers[0] -= 1
    size = memory.numbers[0]
    _swap(memory, 0, size)
    _sink(memory, 0, size)


@njit(cache=True, error_model="numpy")
def _valid(memory: Memory, at: int) -> bool:
    columns = memory.cost.shape[1]
    j, i = memory.items[at] // columns, memory.items[at] % columns
    return bool(
        memory.entered[j, i, 0] == memory.keys[at, 0]
        and memory.entered[j, i, 1] == memory.keys[at, 1]
    )


@njit(cache=True, error_model="numpy")
def _compact(memory: Memory) -> None:
    """Drop entries that no longer count: one a cell is left at most, for which there is room."""
    columns = memory.cost.shape[1]
    kept = 0
    for at in range(memory.numbers[0]):
        j, i = memory.items[at] // columns, memory.items[at] % columns
        if _valid(memory, at):
            first, second = memory.keys[at, 0], memory.keys[at, 1]
            memory.entered[j, i, 0] = math.nan  # its copies do not count
            memory.keys[kept, 0], memory.keys[kept, 1] = first, second
            memory.items[kept] = j * columns + i
            kept += 1
    for at in range(kept):
        j, i = memory.items[at] // columns, memory.items[at] % columns
        memory.entered[j, i, 0], memory.entered[j, i, 1] = memory.keys[at, 0], memory.keys[at, 1]
    memory.numbers[0] = kept
    for at in range(kept // 2, -1, -1):
        _sink(memory, at, kept)


@njit(cache=True, error_model="numpy")
def _far(memory: Memory, cells: Cells, j: int, i: int, at: int) -> float:
    """Cost in the open between a cell and cell number `at`, along eight directions."""
    columns = memory.cost.shape[1]
    dj, di = abs(j - at // columns), abs(i - at % columns)
    far: float = cells.cell * (max(dj, di) + (math.sqrt(2.0) - 1.0) * min(dj, di))
    return far


@njit(cache=True, error_model="numpy")
def _update(memory: Memory, cells: Cells, j: int, i: int, start: int) -> None:
    """Look at a cell's neighbours again, and queue it where it is not what it was."""
    cost, seen = memory.cost, memory.seen
    rows, columns = cost.shape
    if j * columns + i != memory.numbers[1]:
        best = math.inf
        for k in range(8):
            b, a = j + _EIGHT[k, 0], i + _EIGHT[k, 1]
            if 0 <= b < rows and 0 <= a < columns:
                through = cost[b, a] + step_cost(cells, j, i, _EIGHT[k, 0], _EIGHT[k, 1])
                best = min(best, through)
        seen[j, i] = best
    if cost[j, i] == seen[j, i] or abs(cost[j, i] - seen[j, i]) <= _LEAST:
        memory.entered[j, i, 0] = math.nan
        return
    least = min(cost[j, i], seen[j, i])
    first = least + _far(memory, cells, j, i, start) + memory.drift[0]
    if memory.entered[j, i, 0] != first or memory.entered[j, i, 1] != least:
        _enter(memory, j, i, first, least)


@njit(cache=True, error_model="numpy")
def begin(cells: Cells, goal: int) -> Memory:
    """A memory that knows only the goal, a cell's number: row times columns plus column."""
    rows, columns = cells.price.shape
    capacity = 4 * rows * columns + 8
    memory = Memory(
        np.full((rows, columns), np.inf),
        np.full((rows, columns), np.inf),
        np.empty((capacity, 2)),
        np.empty(capacity, dtype=np.int32),
        np.full((rows, columns, 2), np.nan),
        np.array([0, goal, goal, 0]),
        np.zeros(1),
    )
    memory.seen[goal // columns, goal % columns] = 0.0
    _enter(memory, goal // columns, goal % columns, 0.0, 0.0)
    return memory


@njit(cache=True, error_model="numpy")
def mend(memory: Memory, cells: Cells, changed: Numbers, start: int) -> None:
    """Take note of cells (n,) whose prices in `cells` are new, before `repair` from `start`."""
    rows, columns = memory.cost.shape
    last = memory.numbers[2]
    memory.drift[0] += _far(memory, cells, start // columns, start % columns, last)
    memory.numbers[2] = start
    for n in range(changed.size):
        j, i = changed[n] // columns, changed[n] % columns
        for dj in range(-1, 2):
            for di in range(-1, 2):
                if 0 <= j + dj < rows and 0 <= i + di < columns:
                    _update(memory, cells, j + dj, i + di, start)


@njit(cache=True, error_model="numpy")
def repair(memory: Memory, cells: Cells, start: int) -> float:
    """Work until the cost from cell number `start` is right, and return it; infinite: no way."""
    cost, seen = memory.cost, memory.seen
    rows, columns = cost.shape
    y, x = start // columns, start % columns
    while memory.numbers[0] > 0:
        if not _valid(memory, 0):
            _drop(memory)
            continue
        least = min(cost[y, x], seen[y, x])
        # What is on a way of equal cost may be about to become dearer: ties are worked on.
        settled = abs(seen[y, x] - cost[y, x]) <= _LEAST or seen[y, x] == cost[y, x]
        if memory.keys[0, 0] > least + memory.drift[0] + _LEAST and settled:
            break
        j, i = memory.items[0] // columns, memory.items[0] % columns
        first, second = memory.keys[0, 0], memory.keys[0, 1]
        _drop(memory)
        memory.entered[j, i, 0] = math.nan
        now = min(cost[j, i], seen[j, i])
        key = now + _far(memory, cells, j, i, start) + memory.drift[0]
        if first < key or (first == key and second < now):
            _enter(memory, j, i, key, now)
            continue
        memory.numbers[3] += 1
        raised = cost[j, i] <= seen[j, i]
        cost[j, i] = math.inf if raised else seen[j, i]
        for dj in range(-1, 2):
            for di in range(-1, 2):
                own = dj == 0 and di == 0
                if (raised or not own) and 0 <= j + dj < rows and 0 <= i + di < columns:
                    _update(memory, cells, j + dj, i + di, start)
    return float(min(cost[y, x], seen[y, x]))


@njit(cache=True, error_model="numpy")
def walk(memory: Memory, cells: Cells, start: int) -> Numbers:
    """Cells from `start` to the goal, downhill; empty where there is no way."""
    rows, columns = memory.cost.shape
    way = np.empty(rows * columns, dtype=np.int32)
    j, i = start // columns, start % columns
    for count in range(way.size):
        way[count] = j * columns + i
        if way[count] == memory.numbers[1]:
            return way[: count + 1]
        best, to = math.inf, -1
        for k in range(8):
            b, a = j + _EIGHT[k, 0], i + _EIGHT[k, 1]
            if 0 <= b < rows and 0 <= a < columns:
                through = memory.cost[b, a] + step_cost(cells, j, i, _EIGHT[k, 0], _EIGHT[k, 1])
                if through < best:
                    best, to = through, k
        if to < 0:
            break
        j, i = j + _EIGHT[to, 0], i + _EIGHT[to, 1]
    return way[:0]


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    cells = warm_cells()
    memory = begin(cells, 15)
    repair(memory, cells, 0)
    mend(memory, cells, np.array([5], dtype=np.int32), 0)
    walk(memory, cells, 0)
