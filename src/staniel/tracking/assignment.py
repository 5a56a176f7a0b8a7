"""Which sighting is whose, by one of three rules."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.association import marginals

__all__ = ["FREE", "Assignment", "assign"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

FREE = -1
"""Owner of a sighting that is nobody's."""

_SMALL = 1000  # entries of a matrix that costs less than finding the knots in it
_ROUNDS = 30  # of belief propagation
_EVEN = 0.5  # a sighting is the track's that more likely than not caused it


class Assignment(NamedTuple):
    """What of the sightings each track takes.

    Attributes
    ----------
    owners : (m,) int64 array
        The track that each sighting belongs to; `FREE` without one.
    shares : (p,) float64 array
        Of each pair, as `staniel.kernels.weighing.correct` takes them.
    """

    owners: Ints
    shares: Floats


def assign(
    rule: str, pairs: Ints, scores: Floats, open_: Bools, looks: Ints, clutter: float, hit: float
) -> Assignment:
    """Decide on the pairs inside the gates.

    Parameters
    ----------
    rule : {"nearest", "likeliest", "soft"}
        ``nearest`` gives the greatest summed score of each look (global nearest neighbour, by
        scipy's assignment); ``likeliest`` serves the greatest score first (thesis alg. 6.1);
        ``soft`` gives every track a share in all its sightings (in the manner of a joint
        probabilistic data association).
    pairs : (p, 2) int64 array
        Track and sighting.
    scores : (p,) float64 array
        Log likelihoods [log 1/m²].
    open_ : (p,) bool array
        Which pairs have a rival.
    looks : (m,) int64 array
    clutter : float
        Log of the density of false alarms [log 1/m²], which a score has to exceed.
    hit : float
        P_D/(1 - P_D): odds of a target in the gate to be detected.
    """
    return _RULES[rule](pairs, scores, open_, looks, clutter, hit)


def _owned(pairs: Ints, taken: Bools, sightings: int) -> Assignment:
    owners = np.full(sightings, FREE)
    owners[pairs[taken, 1]] = pairs[taken, 0]
    return Assignment(owners, taken.astype(np.float64))


def _nearest(
    pairs: Ints, scores: Floats, open_: Bools, looks: Ints, clutter: float, hit: float
) -> Assignment:
    worth = scores > clutter
    if not open_.any():
        return _owned(pairs, worth, looks.size)
    taken = worth & ~open_
    left = np.flatnonzero(worth & open_)
    look_of = looks[pairs[left, 1]]
    for look in np.unique(look_of).tolist():
        mine = left[look_of == look]
        taken[mine[_best(pairs[mine], scores[mine] - clutter)]] = True
    return _owned(pairs, taken, looks.size)


def _best(pairs: Ints, gains: Floats) -> Ints:
    """Numbers of the pairs, one a track and one a sighting at most, of the greatest sum of gains.

    Where there are many, tracks and sightings that no pair connects are decided apart: a matrix is
    then no larger than a knot of tracks that contest one another's sightings.
    """
    tracks, rows = np.unique(pairs[:, 0], return_inverse=True)
    sightings, columns = np.unique(pairs[:, 1], return_inverse=True)
    if tracks.size * sightings.size <= _SMALL:
        return _matched(rows, columns, gains)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    size = tracks.size + sightings.size
    links = coo_array((np.ones(len(pairs)), (rows, tracks.size + columns)), shape=(size, size))
    _, knot = connected_components(links, directed=False)
    chosen = []
    for label in np.unique(knot[rows]).tolist():
        own = np.flatnonzero(knot[rows] == label)
        _, row = np.unique(rows[own], return_inverse=True)
        _, column = np.unique(columns[own], return_inverse=True)
        chosen.append(own[_matched(row, column, gains[own])])
    return np.concatenate(chosen)


def _matched(rows: Ints, columns: Ints, gains: Floats) -> Ints:
    """As `_best`, by one matrix that has a row and a column of every number up to the greatest."""
    from scipy.optimize import linear_sum_assignment

    if rows.size == 1:
        return np.zeros(1, np.int64)
    shape = int(rows.max()) + 1, int(columns.max()) + 1
    cost, number = np.zeros(shape), np.full(shape, -1)
    cost[rows, columns], number[rows, columns] = -gains, np.arange(rows.size)
    chosen: Ints = number[linear_sum_assignment(cost)]
    return chosen[chosen >= 0]


def _likeliest(
    pairs: Ints, scores: Floats, open_: Bools, looks: Ints, clutter: float, hit: float
) -> Assignment:
    taken = np.zeros(len(pairs), np.bool_)
    served: set[tuple[int, int]] = set()
    given: set[int] = set()
    for p in np.argsort(-scores, kind="stable").tolist():
        if scores[p] <= clutter:
            break
        k, j = pairs[p].tolist()
        place = (k, int(looks[j]))
        if j not in given and place not in served:
            given.add(j)
            served.add(place)
            taken[p] = True
    return _owned(pairs, taken, looks.size)


def _soft(
    pairs: Ints, scores: Floats, open_: Bools, looks: Ints, clutter: float, hit: float
) -> Assignment:
    if not len(pairs):
        return Assignment(np.full(looks.size, FREE), np.zeros(0))
    gains = hit * np.exp(np.minimum(scores - clutter, 600.0))
    shares = marginals(pairs, gains, looks, _ROUNDS)
    weight = shares * gains
    totals: dict[tuple[int, int], float] = {}
    rows = [(int(k), int(looks[j])) for k, j in pairs]
    for row, w in zip(rows, weight.tolist(), strict=True):
        totals[row] = totals.get(row, 1.0) + w
    beliefs = weight / np.array([totals[row] for row in rows])
    owners = _owned(pairs, beliefs > _EVEN, looks.size).owners
    # What is next to nothing is nothing: a track unseen stays unseen.
    return Assignment(owners, np.where(beliefs > 1e-3, shares, 0.0))


_RULES: dict[str, Callable[..., Assignment]] = {
    "nearest": _nearest,
    "likeliest": _likeliest,
    "soft": _soft,
}
