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
def _joined(cells: Cells, a: Floats, b: Floats, radius: float, most: float) -> float:
    """Cost of the Dubins path from pose to pose; infinite where it is not below `most`."""
    length, word, p, q, r = shot(a[0], a[1], a[2], b[0], b[1], b[2], radius)
    if length >= most:
        return math.inf
    return shot_cost(cells, a[0], a[1], a[2], word, p, q, r, radius)


@njit(cache=True, error_model="numpy")
def _steered(
    nodes: Floats, count: int, sample: Floats, radius: float, stride: float, near: Numbers
) -> tuple[int, Floats]:
    """The node whose Dubins path to the sample is shortest, and the pose one stride along it."""
    found = _closest(nodes, count, sample[0], sample[1], near[:_NEAREST], math.inf)
    nearest, least = 0, math.inf
    for f in range(found):
        a = nodes[near[f]]
        length = shot(a[0], a[1], a[2], sample[0], sample[1], sample[2], radius)[0]
        if length < least:
            nearest, least = near[f], length
    a = nodes[nearest]
    _, word, p, q, r = shot(a[0], a[1], a[2], sample[0], sample[1], sample[2], radius)
    return nearest, _cut(a, word, np.array((p, q, r)), radius, stride)


@njit(cache=True, error_model="numpy")
def _way_to(nodes: Floats, parents: Numbers, last: int, goal: Floats, arrived: bool) -> Floats:
    """Poses from the root to a node, and on to the goal unless that is reached."""
    length, at = 1 if arrived else 2, last
    while parents[at] >= 0:
        at = parents[at]
        length += 1
    poses = np.empty((length, 3))
    k = length - 1
    if not arrived:
        poses[k] = goal
        k -= 1
    while k >= 0:
        poses[k] = nodes[last]
        last = parents[last]
        k -= 1
    return poses


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
    near = np.empty(_MOST_NEAR, dtype=np.int64)
    used, tried = 0, 0
    for s in range(n + 1):
        # The goal from the newest node, the root first.
        if tried < count:
            a = nodes[tried]
            there = math.isnan(goal[2]) and math.hypot(goal[0] - a[0], goal[1] - a[1]) <= tolerance
            to_goal[tried] = 0.0 if there else _joined(cells, a, goal, radius, math.inf)
            tried += 1
            if not optimal and to_goal[tried - 1] < math.inf:
                break
        if s == n:
            break
        used += 1
        parent, new = _steered(nodes, count, samples[s], radius, stride, near)
        best = costs[parent] + _joined(cells, nodes[parent], new, radius, math.inf)
        if best == math.inf:
            continue
        found = 0
        if optimal:
            # So that the balls cover the plane more thinly the more nodes there are.
            reach = max(12.0 * stride * math.sqrt(math.log(count + 1.0) / (count + 1.0)), stride)
            found = _closest(nodes, count, new[0], new[1], near, reach)
        for f in range(found):
            k = near[f]
            cost = costs[k] + _joined(cells, nodes[k], new, radius, best - costs[k])
            if cost < best:
                best, parent = cost, k
        nodes[count], costs[count], parents[count] = new, best, parent
        count += 1
        for f in range(found):
            k = near[f]
            cost = best + _joined(cells, new, nodes[k], radius, costs[k] - best)
            if cost < costs[k]:
                parents[k] = count - 1
                _spread(costs, parents, count, k, costs[k] - cost)
    last = int(np.argmin(costs[:count] + to_goal[:count]))
    total = costs[last] + to_goal[last]
    if total == math.inf:
        return total, used, np.empty((0, 3))
    return total, used, _way_to(nodes, parents, last, goal, to_goal[last] == 0.0)


def warm() -> None:
    """Compile, or load from the cache, on the smallest grid."""
    start, goal = np.array((0.5, 0.5, 0.0)), np.array((3.5, 0.5, 0.0))
    grow(warm_cells(), start, goal, 0.0, 1.0, 1.0, np.array([[2.5, 0.5, 0.0]]), True)
