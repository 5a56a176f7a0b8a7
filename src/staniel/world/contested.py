"""Which stretches of road are contested, and by which others.

On the ways that vehicles take, corner to corner and round the fillets, places are set out. Two of
them contest each other where two vehicles could not stand on both, unless one leads to the other
at once.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.headway import ASIDE
from staniel.kernels.routes import SHARP, Roads
from staniel.world.lanes import Legs

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["with_stretches"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_STEP = 0.5  # between two places [m]
_MARGIN = ASIDE + 0.5 * _STEP  # beyond two radii: what drivers take for in the way, between places
_POCKET = 2.0  # a shorter stretch between two contested ones is no place to wait [m]
_PIECE = 8.0  # no stretch is longer [m]
_ROUNDS = 50  # of filling pockets, which settles in two or three


class _Places(NamedTuple):
    """Points on the ways, the arc to which each belongs, and how far before its end it counts."""

    points: Floats
    arcs: Ints
    short: Floats


def with_stretches(roads: Roads, legs: Legs, before: Ints, after: Ints, radius: float) -> Roads:
    """The roads with their contested stretches, and the rivals of each.

    Parameters
    ----------
    roads : Roads
        Complete but for those.
    legs : Legs
    before, after : (k,) int array
        Which arc may follow which.
    radius : float [m]
        Of a vehicle.

    Returns
    -------
    Roads
    """
    along = roads.nodes[roads.arcs[:, 1]] - roads.nodes[roads.arcs[:, 0]]
    counts = np.ceil(np.hypot(along[:, 0], along[:, 1]) / _STEP).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)])
    arc = np.repeat(np.arange(len(counts)), counts)
    place = roads.corners[roads.arcs[before, 4] + roads.arcs[after, 3]]
    here = first[before] + _cell(place[:, 2], counts[before])
    there = first[after] + _cell(place[:, 2] + place[:, 3], counts[after])
    within = np.flatnonzero(arc[1:] == arc[:-1])
    links = np.concatenate([np.stack([within + 1, within], 1), np.stack([here, there], 1)])
    ways = _ways(roads, legs, radius)
    cells = first[ways.arcs] + _cell(ways.short, counts[ways.arcs])
    meet = _meetings(ways, cells, len(arc), radius)
    # Who turns round at a dead end passes itself: nobody else has room there.
    onward = np.concatenate([np.ones(len(within), np.bool_), roads.arcs[before, 2] != after])
    leads = _leading(links[onward], len(arc), radius)
    pairs = _cells(meet - meet.multiply(leads + leads.T))
    aside = []
    for ends, turned in ((before, False), (after, True)):
        # Past a fork one may bar the other way; before a junction, who comes from elsewhere.
        alone = np.bincount(ends, minlength=len(counts))[ends] == 1
        only = onward & np.concatenate([np.ones(len(within), np.bool_), alone])
        led = meet.multiply(leads)
        some = _cells(led - led.multiply(_leading(links[only], len(arc), radius)))
        aside.append(some[:, ::-1] if turned else some)
    contested = np.zeros(len(arc), dtype=np.bool_)
    contested[pairs.ravel()] = True
    _spread(contested, links, np.concatenate(aside))
    return _in_stretches(roads, contested, pairs, first)


def _cell(short: Floats, count: Ints) -> Ints:
    """Which of an arc's cells, counted backward from its end node, is so far before that."""
    return np.clip(np.floor(short / _STEP).astype(np.int64), 0, count - 1)


def _ways(roads: Roads, legs: Legs, radius: float) -> _Places:
    """Places on all ways: legs, fillets, and from lane to lane at dead ends."""
    a, b = legs.first, legs.second
    turned = roads.arcs[legs.arcs[a], 2] == legs.arcs[b]
    ends = (legs.starts + legs.ways)[a]
    parts = [
        _along(roads, legs.starts, legs.ways, legs.arcs),
        _along(roads, ends[turned], (legs.starts[b] - ends)[turned], legs.arcs[b][turned]),
        _round_fillets(roads, ends, legs.ways[a], legs.ways[b], legs.arcs[a], legs.arcs[b], radius),
    ]
    return _Places(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _short_of(roads: Roads, arc: Ints, points: Floats) -> Floats:
    """How far each point is before the node that its arc leads to, along the arc [m]."""
    ends = roads.ends[arc]
    short: Floats = ((ends[:, :2] - points) * ends[:, 2:]).sum(axis=1)
    return short


def _along(roads: Roads, start: Floats, leg: Floats, arc: Ints) -> _Places:
    """Places on straight legs, their ends included."""
    counts = np.maximum(np.ceil(np.hypot(leg[:, 0], leg[:, 1]) / _STEP).astype(np.int64), 1) + 1
    i = np.repeat(np.arange(len(leg)), counts)
    nth = np.arange(len(i)) - np.repeat(np.cumsum(counts) - counts, counts)
    points = start[i] + (nth / (counts[i] - 1))[:, None] * leg[i]
    return _Places(points, arc[i], _short_of(roads, arc[i], points))


def _round_fillets(
    roads: Roads,
    corner: Floats,
    leg: Floats,
    onward: Floats,
    arc: Ints,
    then: Ints,
    radius: float,
) -> _Places:
    """Places on the fillets between two legs each, as `staniel.kernels.routes` plans them."""
    reach, second = np.hypot(leg[:, 0], leg[:, 1]), np.hypot(onward[:, 0], onward[:, 1])
    turn = np.arctan2(
        leg[:, 0] * onward[:, 1] - leg[:, 1] * onward[:, 0], (leg * onward).sum(axis=1)
    )
    cut = np.minimum(3.0 * radius, np.minimum(reach, 0.5 * second))
    use = (np.abs(turn) > 0.01) & (np.abs(turn) < SHARP) & (cut >= 0.3 * radius)
    u, turn, cut = leg[use] / reach[use, None], turn[use], cut[use]
    curve = cut / np.tan(0.5 * np.abs(turn))
    normal = np.stack([-u[:, 1], u[:, 0]], axis=1) * np.sign(turn)[:, None]
    begin = corner[use] - cut[:, None] * u
    points, arcs, short = [], [], []
    steps = max(int(np.ceil(6.0 * radius / _STEP)), 2)
    for share in (np.arange(steps) + 0.5) / steps:
        angle = share * np.abs(turn)
        ahead, aside = curve * np.sin(angle), curve * (1.0 - np.cos(angle))
        points.append(begin + ahead[:, None] * u + aside[:, None] * normal)
        on = (arc if share < 0.5 else then)[use]
        arcs.append(on)
        # As the drivers count: as if each leg went on straight to the corner.
        short.append(_short_of(roads, on, corner[use]) + cut * (1.0 - 2.0 * share))
    return _Places(np.concatenate(points), np.concatenate(arcs), np.concatenate(short))


def _meetings(ways: _Places, cells: Ints, n: int, radius: float) -> "csr_array":
    """Symmetric: cells of different arcs of which one vehicle each would touch."""
    from scipy import sparse, spatial  # they take a while to import, and few cities have roads

    tree = spatial.cKDTree(ways.points)
    pairs = tree.query_pairs(2.0 * radius + _MARGIN, output_type="ndarray")
    pairs = cells[pairs[ways.arcs[pairs[:, 0]] != ways.arcs[pairs[:, 1]]]]
    one = np.ones(len(pairs), dtype=np.bool_)
    meet = sparse.csr_array((one, (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    both: csr_array = meet + meet.T
    return both


def _leading(links: Ints, n: int, radius: float) -> "csr_array":
    """From which cell one comes to which within the length of two bodies."""
    from scipy import sparse

    one = np.ones(len(links), dtype=np.bool_)
    step = sparse.csr_array((one, (links[:, 0], links[:, 1])), shape=(n, n))
    leads = sparse.eye_array(n, dtype=np.bool_, format="csr")
    for _ in range(int(1.5 * (2.0 * radius + _MARGIN) / _STEP)):
        leads = leads + leads @ step
    return leads


def _cells(pairs: "csr_array") -> Ints:
    """(k, 2) Row and column of each element."""
    return np.stack(pairs.nonzero(), axis=1).astype(np.int64)


def _spread(contested: Bools, links: Ints, aside: Ints) -> None:
    """Make contested, in place, where nobody could wait after all.

    Between two contested cells, what is too short; and what is beside a contested cell.
    """
    a, b = links.T
    most = int(_POCKET / _STEP)
    for _ in range(_ROUNDS):
        before = contested.copy()
        contested[aside[contested[aside[:, 0]], 1]] = True
        ahead = np.where(contested, 0, most + 1)
        behind = ahead.copy()
        for _ in range(most):
            np.minimum.at(ahead, a, ahead[b] + 1)
            np.minimum.at(behind, b, behind[a] + 1)
            ahead[contested] = behind[contested] = 0
        contested |= ahead + behind - 1 < most
        if (contested == before).all():
            return


def _in_stretches(roads: Roads, contested: Bools, pairs: Ints, first: Ints) -> Roads:
    """With the runs of contested cells of each arc, and the rivals of each run."""
    cells = len(contested)
    arc = np.repeat(np.arange(len(first) - 1), np.diff(first))
    at = np.arange(cells)
    new = np.ones(cells, dtype=np.bool_)
    new[1:] = (arc[1:] != arc[:-1]) | ~contested[:-1]
    # Long ones in pieces: who has left one lets others cross it.
    since = at - np.maximum.accumulate(np.where(new, at, 0))
    new |= since % int(_PIECE / _STEP) == 0
    begins = np.flatnonzero(contested & new)
    last = np.append(new[1:] | ~contested[1:], True)
    ends = np.flatnonzero(contested & last)
    # Cells count backward: the last of a run is come to first.
    order = np.lexsort((-begins, arc[begins]))
    begins, ends = begins[order], ends[order]
    base, count = first[arc[begins]], len(begins)
    # Corners lie somewhat beyond an arc's ends, or before them.
    top = np.where(ends + 1 == first[arc[begins] + 1], np.inf, _STEP * (ends - base + 1))
    bottom = np.where(begins == base, -np.inf, _STEP * (begins - base))
    run = np.zeros(cells, dtype=np.int64)
    run[begins] = np.arange(count)
    run = run[np.maximum.accumulate(np.where(contested & new, at, 0))]
    rivals = np.unique(run[pairs], axis=0)
    return roads._replace(
        stretch=_bounds(arc[begins], len(first) - 1),
        contested=np.stack([top, bottom], axis=1),
        first_rival=_bounds(rivals[:, 0], count),
        rivals=np.ascontiguousarray(rivals[:, 1]),
    )


def _bounds(owners: Ints, count: int) -> Ints:
    """Where the elements of each of `count` owners begin and end, sorted by owner."""
    many = np.bincount(owners, minlength=count)
    return np.concatenate([[0], np.cumsum(many)]).astype(np.int64)
