"""Where vehicles turn from one road into another, worked out once for a city.

Columns are those of `staniel.kernels.routes`.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.routes import leg_clear
from staniel.kernels.walls import Walls

__all__ = ["corners"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_NARROWEST = 0.3  # where lanes meet at a sharp turn: 1 + cos of the turn, below which they do not


@njit(cache=True, error_model="numpy")
def corners(
    walls: Walls, nodes: Array, arcs: Indices, first: Indices, leaving: Indices, habits: Array
) -> tuple[Indices, Array]:
    """Where each arc ends, for each arc that may come next, and where an arc's corners begin.

    As far to the right as is free of walls from the middles of both nodes of the arc.
    """
    offset, r = habits[1], habits[0]
    turns = np.empty(arcs.shape[0], dtype=np.int64)
    count = 0
    for a in range(arcs.shape[0]):
        turns[a] = count
        count += first[arcs[a, 1] + 1] - first[arcs[a, 1]]
    places = np.empty((count, 2))
    for a in range(arcs.shape[0]):
        node = arcs[a, 1]
        x, y, px, py = (
            nodes[arcs[a, 0], 0],
            nodes[arcs[a, 0], 1],
            nodes[node, 0],
            nodes[node, 1],
        )
        ux, uy = px - x, py - y
        u = math.hypot(ux, uy)
        for k in range(first[node], first[node + 1]):
            then, place = leaving[k], turns[a] + k - first[node]
            places[place, 0], places[place, 1] = px, py
            if arcs[a, 2] == then:
                continue  # below
            wx, wy = nodes[arcs[then, 1], 0] - px, nodes[arcs[then, 1], 1] - py
            w = math.hypot(wx, wy)
            # Where the two lanes' lines meet, but not far from the node.
            sx, sy = uy / u + wy / w, -ux / u - wx / w
            scale = 1.0 / max(0.5 * (sx * sx + sy * sy), _NARROWEST)
            for part in (1.0, 0.5):
                cx, cy = px + part * offset * scale * sx, py + part * offset * scale * sy
                if leg_clear(walls, x, y, cx, cy, r) and leg_clear(walls, cx, cy, px, py, r):
                    places[place, 0], places[place, 1] = cx, cy
                    break
    _turning_places(nodes, arcs, first, leaving, offset, turns, places)
    # A corner from which not every next one can be reached is moved to the middle of the node.
    moved = True
    while moved:
        moved = False
        for a in range(arcs.shape[0]):
            node = arcs[a, 1]
            for k in range(first[node], first[node + 1]):
                place = turns[a] + k - first[node]
                mx, my = nodes[node, 0], nodes[node, 1]
                if (places[place, 0] != mx or places[place, 1] != my) and not _leads_on(
                    walls, nodes, arcs, first, turns, places, a, leaving[k], place, r
                ):
                    places[place, 0], places[place, 1] = mx, my
                    moved = True
    return turns, places


@njit(cache=True, error_model="numpy")
def _turning_places(
    nodes: Array,
    arcs: Indices,
    first: Indices,
    leaving: Indices,
    offset: float,
    turns: Indices,
    places: Array,
) -> None:
    """Set where one stops at a dead end before one crosses over to go back: on the right."""
    for a in range(arcs.shape[0]):
        node = arcs[a, 1]
        ux, uy = nodes[node, 0] - nodes[arcs[a, 0], 0], nodes[node, 1] - nodes[arcs[a, 0], 1]
        part = offset / math.hypot(ux, uy)
        for k in range(first[node], first[node + 1]):
            if leaving[k] == arcs[a, 2]:
                place = turns[a] + k - first[node]
                places[place, 0] = nodes[node, 0] + part * uy
                places[place, 1] = nodes[node, 1] - part * ux


@njit(cache=True, error_model="numpy")
def _leads_on(
    walls: Walls,
    nodes: Array,
    arcs: Indices,
    first: Indices,
    turns: Indices,
    places: Array,
    arc: int,
    then: int,
    place: int,
    r: float,
) -> bool:
    """Whether a corner can be reached from the arc's first node, and every next corner from it."""
    x, y = places[place, 0], places[place, 1]
    start, node = arcs[arc, 0], arcs[arc, 1]
    if not leg_clear(walls, nodes[start, 0], nodes[start, 1], x, y, r):
        return False
    if then == arcs[arc, 2]:
        qx, qy = 2.0 * nodes[node, 0] - x, 2.0 * nodes[node, 1] - y
        if not leg_clear(walls, x, y, qx, qy, r):
            return False
        x, y = qx, qy
    end = arcs[then, 1]
    for k in range(turns[then], turns[then] + first[end + 1] - first[end]):
        if not leg_clear(walls, x, y, places[k, 0], places[k, 1], r):
            return False
    return True
