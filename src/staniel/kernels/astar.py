"""A* over Dubins primitives: left, straight or right, among the cells of a grid (thesis 5.5).

A state is a cell and one of n courses; in it stands the exact pose of the cheapest way found there,
so that what is found is flown exactly. From time to time a whole Dubins path to the goal is tried,
which is how a search ends.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.cells import Cells, advanced, line_cost, piece_cost, warm_cells
from staniel.kernels.field import cost_to
from staniel.kernels.heap import pop, push
from staniel.kernels.shots import shot, shot_cost

__all__ = ["FOUND", "GAVE_UP", "NO_WAY", "Motion", "search", "warm"]

Floats = NDArray[np.float64]

FOUND, NO_WAY, GAVE_UP = range(3)

_STRAIGHT = 1.5  # length of a straight primitive in cells: it always leaves its cell
_NEAR = 8.0  # within so many radii of the goal every state tries to get there at once


class Motion(NamedTuple):
    """How the aircraft moves, and how the search does."""

    radius: float
    """Of the tightest turn [m]."""
    courses: int
    """In which it may leave a state, n; an arc turns by one of them."""
    greed: float
    """Factor of the heuristic, at least 1. More finds sooner, and may find worse."""
    limit: int
    """States to expand at most."""


@njit(cache=True, error_model="numpy")
def _moves(course: float, n: int, radius: float, step: float) -> tuple[Floats, Floats]:
    """(n,) courses, and (n, 3, 2) where a right turn, a straight and a left turn from each lead."""
    turn = 2.0 * math.pi / n
    courses, moves = np.empty(n), np.empty((n, 3, 2))
    for k in range(n):
        courses[k] = course + k * turn
        for side in range(-1, 2):
            bend = side / radius
            x, y, _ = advanced(0.0, 0.0, courses[k], bend, step if side == 0 else radius * turn)
            moves[k, side + 1, 0], moves[k, side + 1, 1] = x, y
    return courses, moves


@njit(cache=True, error_model="numpy")
def _attempt(
    cells: Cells, pose: Floats, goal: Floats, radius: float, spent: float, best: float
) -> float:
    """Cost of a way that ends in a whole Dubins path to the goal; infinite if `best` is better."""
    length, word, first, middle, last = shot(
        pose[0], pose[1], pose[2], goal[0], goal[1], goal[2], radius
    )
    if spent + length >= best:
        return math.inf
    return spent + shot_cost(cells, pose[0], pose[1], pose[2], word, first, middle, last, radius)


@njit(cache=True, error_model="numpy")
def _chain(poses: Floats, parents: NDArray[np.int32], node: int, more: int) -> Floats:
    """Poses from the root to a node, and room for `more` behind them."""
    count, at = 1, node
    while parents[at] >= 0:
        at = parents[at]
        count += 1
    chain = np.empty((count + more, 3))
    for k in range(count - 1, -1, -1):
        chain[k] = poses[node]
        node = parents[node]
    return chain


@njit(cache=True, error_model="numpy")
def search(
    cells: Cells, field: Floats, start: Floats, goal: Floats, tolerance: float, motion: Motion
) -> tuple[int, int, float, Floats]:
    """A cheap path from a pose to a pose or a place.

    Parameters
    ----------
    cells : Cells
    field : (rows, columns) float array
        Cost from each cell to the goal's, of `staniel.kernels.field.cost_to`.
    start : (3,) float array
        x, y [m], course [rad].
    goal : (3,) float array
        The course is not a number where it is free.
    tolerance : float [m]
        Nearer than that to a place is there; not of a pose.
    motion : Motion

    Returns
    -------
    outcome : int
        `FOUND`, `NO_WAY` (all that can be reached is searched) or `GAVE_UP` (at the limit).
    expanded : int
    cost : float
        Infinite if nothing was found.
    poses : (m, 3) float array
        Each Dubins' shortest path ahead of the one before; the last is the goal, or where a place
        is reached. Empty if nothing was found.
    """
    rows, columns = cells.price.shape
    n, radius = motion.courses, motion.radius
    turn = 2.0 * math.pi / n
    step = _STRAIGHT * cells.cell
    room = min(rows * columns * n, 3 * motion.limit + 1) + 1
    poses, spent = np.empty((room, 3)), np.empty(room)
    of_course, of_state = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32)
    parents, closed = np.empty(room, dtype=np.int32), np.zeros(room, dtype=np.bool_)
    node_of = np.full(rows * columns * n, -1, dtype=np.int32)
    keys = np.empty(3 * motion.limit + 2)
    items = np.empty(3 * motion.limit + 2, dtype=np.int32)
    courses, moves = _moves(start[2], n, radius, step)
    place = math.isnan(goal[2])
    best, best_node, arrived = math.inf, -1, False
    i, j = int((start[0] - cells.west) / cells.cell), int((start[1] - cells.south) / cells.cell)
    if field[j, i] == math.inf:
        return NO_WAY, 0, math.inf, np.empty((0, 3))
    poses[0], spent[0], of_course[0], parents[0] = start, 0.0, 0, -1
    of_state[0] = (j * columns + i) * n
    node_of[of_state[0]] = 0
    nodes = 1
    size = push(keys, items, 0, motion.greed * field[j, i], 0)
    expanded = 0
    while size > 0:
        key, node = keys[0], items[0]
        if key >= best or expanded >= motion.limit:
            break
        size = pop(keys, items, size)
        if closed[node]:
            continue
        closed[node] = True
        expanded += 1
        x, y, g = poses[node, 0], poses[node, 1], spent[node]
        if place and math.hypot(goal[0] - x, goal[1] - y) <= tolerance and g < best:
            best, best_node, arrived = g, node, True
            continue
        ahead = field[of_state[node] // n // columns, of_state[node] // n % columns]
        if ahead < _NEAR * radius or expanded % 8 == 1:
            cost = _attempt(cells, poses[node], goal, radius, g, best)
            if cost < best:
                best, best_node, arrived = cost, node, False
        k = of_course[node]
        for side in range(-1, 2):
            xb, yb = x + moves[k, side + 1, 0], y + moves[k, side + 1, 1]
            ub, vb = (xb - cells.west) / cells.cell, (yb - cells.south) / cells.cell
            if not (0.0 <= ub < columns and 0.0 <= vb < rows):
                continue
            i, j = int(ub), int(vb)
            ahead = field[j, i]
            if ahead == math.inf:
                continue
            kb = (k + side) % n
            state = (j * columns + i) * n + kb
            known = node_of[state]
            # A metre costs 1 at least.
            least = g + (step if side == 0 else radius * turn)
            if known >= 0 and (closed[known] or spent[known] <= least):
                continue
            if side == 0:
                through = g + line_cost(cells, x, y, xb, yb)
            else:
                through = g + piece_cost(cells, x, y, courses[k], side / radius, radius * turn)
            if through == math.inf or (known >= 0 and spent[known] <= through):
                continue
            if known < 0:
                known = nodes
                nodes += 1
                node_of[state], of_state[known], of_course[known] = known, state, kb
            poses[known, 0], poses[known, 1], poses[known, 2] = xb, yb, courses[kb]
            spent[known], parents[known] = through, node
            ahead = max(ahead, shot(xb, yb, courses[kb], goal[0], goal[1], goal[2], radius)[0])
            if through + ahead < best:
                size = push(keys, items, size, through + motion.greed * ahead, known)
    if best_node < 0:
        outcome = GAVE_UP if expanded >= motion.limit and size > 0 else NO_WAY
        return outcome, expanded, math.inf, np.empty((0, 3))
    chain = _chain(poses, parents, best_node, 0 if arrived else 1)
    if not arrived:
        chain[-1] = goal
    return FOUND, expanded, best, chain


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    cells, start = warm_cells(), np.array((0.5, 0.5, 0.0))
    field = cost_to(cells, 3.5, 0.5)
    search(cells, field, start, np.array((3.5, 0.5, math.nan)), 0.1, Motion(1.0, 8, 1.0, 9))
