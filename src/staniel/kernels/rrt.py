"""Rapidly exploring random trees of Dubins paths, plain and optimal (RRT and RRT*).

LaValle and Kuffner (2001); Karaman and Frazzoli (2011), with a neighbourhood that shrinks with the
logarithm over the number of nodes.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.cells import Cells, advanced, warm_cells
from staniel.kernels.shots import TURNS, shot, shot_cost

__all__ = ["grow", "warm"]

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_NEAREST = 12  # nodes near as the crow flies whose Dubins length is compared
_MOST_NEAR = 40  # neighbours that a new node of the optimal form is joined with


@njit(cache=True, error_model="numpy")
def _closest(nodes: Floats, count: int, x: float, y: float, found: Numbers, reach: float) -> int:
    """The nodes within reach that are nearest, into `found`, nearest first; returns how many."""
    most, size = found.size, 0
    apart = np.empty(most)
    for k in range(count):
        dx, dy = nodes[k, 0] - x, nodes[k, 1] - y
        d = dx * dx + dy * dy
        if d > reach * reach or (size == most and d >= apart[size - 1]):
            continue
        at = size if size < most else most - 1
        while at > 0 and apart[at - 1] > d:
            apart[at], found[at] = apart[at - 1], found[at - 1]
            at -= 1
        apart[at], found[at] = d, k
        size = min(size + 1, most)
    return size


@njit(cache=True, error_model="numpy")
def _cut(pose: Floats, word: int, parts: Floats, radius: float, most: float) -> Floats:
    """Pose after `most` metres of a path, or at its end."""
    x, y, course = pose[0], pose[1], pose[2]
    for k in range(3):
        length = min(parts[k] * radius, most)
        x, y, course = advanced(x, y, course, TURNS[word, k] / radius, length)
        most -= length
    return np.array((x, y, course))


@njit(cache=True, error_model="numpy")
def _spread(costs: Floats, parents: Numbers, count: int, node: int, saved: float) -> None:
    """Take what a node has saved off all that hang on it."""
    stack = np.empty(count, dtype=np.int64)
    stack[0], top = node, 1
    while top > 0:
        top -= 1
        at = stack[top]
        costs[at] -= saved
        for k in range(count):
            if parents[k] == at:
                stack[top] = k
                top += 1


@njit(cache=True, error_model="numpy")
def grow(
    cells: Cells,
    start: Floats,
    goal: Floats,
    tolerance: float,
    radius: float,
    stride: float,
    samples: Floats,
    optimal: bool,
) -> tuple[float, int, Floats]:
    """Grow a tree towards samples, and try the goal from every new node.

    Parameters
    ----------
    cells : Cells
    start, goal : (3,) float array
        The goal's course is not a number where it is free.
    tolerance : float [m]
        Nearer than that to a place is there.
    radius : float [m]
        Of the tightest turn.
    stride : float [m]
        A branch is so long at most.
    samples : (n, 3) float array
        Poses to grow towards, in turn.
    optimal : bool
        Choose the cheapest parent, rewire, and use up all samples; else stop at the first path.

    Returns
    -------
    cost : float
        Infinite if there was no path.
    used : int
        Samples.
    poses : (m, 3) float array
        From the start to the goal, or into its tolerance.
    """
    n = samples.shape[0]
    nodes, costs = np.empty((n + 1, 3)), np.empty(n + 1)
    parents = np.full(n + 1, -1, dtype=np.int64)
    to_goal = np.full(n + 1, np.inf)
    nodes[0], costs[0], count = start, 0.0, 1
    near = np.empty(_MOST_NEAR if optimal else _NEAREST, dtype=np.int64)
    used, tried = 0, 0
    for s in range(n + 1):
        # The goal from the newest node, the root first.
        if tried < count:
            a = nodes[tried]
            if math.isnan(goal[2]) and math.hypot(goal[0] - a[0], goal[1] - a[1]) <= tolerance:
                to_goal[tried] = 0.0
            else:
                _, word, p, q, r = shot(a[0], a[1], a[2], goal[0], goal[1], goal[2], radius)
                to_goal[tried] = shot_cost(cells, a[0], a[1], a[2], word, p, q, r, radius)
            tried += 1
            if not optimal and to_goal[tried - 1] < math.inf:
                break
        if s == n:
            break
        used += 1
        sample = samples[s]
        found = _closest(nodes, count, sample[0], sample[1], near[:_NEAREST], math.inf)
        nearest, least = -1, math.inf
        for f in range(found):
            a = nodes[near[f]]
            length = shot(a[0], a[1], a[2], sample[0], sample[1], sample[2], radius)[0]
            if length < least:
                nearest, least = near[f], length
        a = nodes[nearest]
        _, word, p, q, r = shot(a[0], a[1], a[2], sample[0], sample[1], sample[2], radius)
        new = _cut(a, word, np.array((p, q, r)), radius, stride)
        _, word, p, q, r = shot(a[0], a[1], a[2], new[0], new[1], new[2], radius)
        best = costs[nearest] + shot_cost(cells, a[0], a[1], a[2], word, p, q, r, radius)
        if best == math.inf:
            continue
        parent, found = nearest, 0
        if optimal:
            # So that the balls cover the plane more thinly the more nodes there are.
            reach = max(12.0 * stride * math.sqrt(math.log(count + 1.0) / (count + 1.0)), stride)
            found = _closest(nodes, count, new[0], new[1], near, reach)
            for f in range(found):
                b = nodes[near[f]]
                length, word, p, q, r = shot(b[0], b[1], b[2], new[0], new[1], new[2], radius)
                if costs[near[f]] + length < best:
                    cost = shot_cost(cells, b[0], b[1], b[2], word, p, q, r, radius)
                    if costs[near[f]] + cost < best:
                        best, parent = costs[near[f]] + cost, near[f]
        nodes[count], costs[count], parents[count] = new, best, parent
        count += 1
        for f in range(found):
            b = nodes[near[f]]
            length, word, p, q, r = shot(new[0], new[1], new[2], b[0], b[1], b[2], radius)
            if best + length < costs[near[f]]:
                cost = best + shot_cost(cells, new[0], new[1], new[2], word, p, q, r, radius)
                if cost < costs[near[f]]:
                    parents[near[f]] = count - 1
                    _spread(costs, parents, count, near[f], costs[near[f]] - cost)
    last = int(np.argmin(costs[:count] + to_goal[:count]))
    total = costs[last] + to_goal[last]
    if total == math.inf:
        return total, used, np.empty((0, 3))
    length, at = 1, last
    while parents[at] >= 0:
        at = parents[at]
        length += 1
    more = 1 if to_goal[last] > 0.0 else 0
    poses = np.empty((length + more, 3))
    if more == 1:
        poses[length] = goal
    for k in range(length - 1, -1, -1):
        poses[k] = nodes[last]
        last = parents[last]
    return total, used, poses


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    start, goal = np.array((0.5, 0.5, 0.0)), np.array((3.5, 0.5, 0.0))
    grow(warm_cells(), start, goal, 0.0, 1.0, 1.0, np.array([[2.5, 0.5, 0.0]]), True)
