"""The ways that vehicles take along the arcs of a road network: leg after leg, and how fast."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.routes import SHARP, SLIGHT, Roads
from staniel.world.config import Traffic

__all__ = ["Legs", "entry_speeds", "joined", "legs_of", "may_follow"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FASTEST = 40.0  # [m/s]
_ROUNDS = 200  # of the search for entry speeds, which mostly settles in ten


class Legs(NamedTuple):
    """Straight ways along one arc each, from its corner with the arc before to that with the next.

    Who turns round at a dead end begins its way back on the other lane, and who comes to an arc
    only by turning round elsewhere at the arc's first node.
    """

    arcs: Ints
    """(n,)"""
    starts: Floats
    """(n, 2)"""
    ways: Floats
    """(n, 2) from the start to the end."""
    into: Ints
    """(n,) by which corner, an index of `before` and `after`, one comes; -1 for none."""
    out: Ints
    """(n,) by which one goes."""
    first: Ints
    """(m,) leg that `second` may follow."""
    second: Ints
    """(m,)"""


def may_follow(arcs: Ints, first: Ints, leaving: Ints) -> tuple[Ints, Ints]:
    """Arcs of which the second may follow the first: back only where there is no other way."""
    before = np.repeat(np.arange(len(arcs)), np.diff(first)[arcs[:, 1]])
    choices = [leaving[first[node] : first[node + 1]] for node in arcs[:, 1]]
    after = np.concatenate(choices) if choices else np.zeros(0, dtype=np.int64)
    onward = after != arcs[before, 2]
    onward |= (np.bincount(before[onward], minlength=len(arcs)) == 0)[before]
    return before[onward], after[onward]


def joined(a: Ints, b: Ints) -> tuple[Ints, Ints]:
    """All i and j with ``a[i] == b[j]``."""
    order = np.argsort(b, kind="stable")
    low, high = np.searchsorted(b[order], a), np.searchsorted(b[order], a, side="right")
    i = np.repeat(np.arange(len(a)), high - low)
    within = np.arange(len(i)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
    return i, order[low[i] + within]


def legs_of(roads: Roads, before: Ints, after: Ints) -> Legs:
    """All legs, for arcs of which `after` may follow `before`."""
    arcs, corner = roads.arcs, roads.corners[roads.arcs[before, 4] + roads.arcs[after, 3], :2]
    into, out = joined(after, before)
    back = arcs[before[into], 2] == after[into]
    middle = roads.nodes[arcs[after[into], 0]]
    starts = np.where(back[:, None], 2.0 * middle - corner[into], corner[into])
    lone = np.flatnonzero(np.bincount(after, minlength=len(arcs))[before] == 0)
    starts = np.concatenate([starts, roads.nodes[arcs[before[lone], 0]]])
    into = np.concatenate([into, np.full(len(lone), -1)])
    out = np.concatenate([out, lone])
    return Legs(before[out], starts, corner[out] - starts, into, out, *joined(out, into))


def entry_speeds(legs: Legs, arcs: Ints, traffic: Traffic) -> Floats:
    """Greatest speed on entering each arc with which every corner after it can be taken [m/s].

    The least solution, over the legs of each arc, of v² = min over the legs that may follow of
    min(v_corner, v_next)² + 2 a s, where s is what the fillets at both ends leave of the leg.
    """
    a, b = legs.first, legs.second
    length, course = np.hypot(*legs.ways.T), np.arctan2(legs.ways[:, 1], legs.ways[:, 0])
    turn = np.abs((course[b] - course[a] + math.pi) % (2.0 * math.pi) - math.pi)
    # Of a leg the fillet before may have taken half already.
    widest = np.minimum(3.0 * traffic.radius, 0.5 * length)
    cut = np.minimum(widest[a], widest[b])
    round_it = math.radians(traffic.turn_rate_deg) * cut / np.tan(0.5 * np.clip(turn, 1e-3, 3.1))
    in_place = np.where(turn < SLIGHT, np.inf, 0.0)
    rounded = (turn < SHARP) & (cut >= 0.3 * traffic.radius)
    rounded &= arcs[legs.arcs[a], 2] != legs.arcs[b]
    corner, cut = np.where(rounded, round_it, in_place), np.where(rounded, cut, 0.0)
    entry = np.full(len(length), _FASTEST)
    gain = 2.0 * traffic.max_acceleration * np.maximum(length[a] - widest[a] - cut, 0.0)
    for _ in range(_ROUNDS):
        new = np.full(len(length), _FASTEST)
        np.minimum.at(new, a, np.sqrt(np.minimum(corner, entry[b]) ** 2 + gain))
        if np.array_equal(new, entry):
            break
        entry = new
    slowest = np.full(len(arcs), _FASTEST)
    np.minimum.at(slowest, legs.arcs, entry)
    return slowest
