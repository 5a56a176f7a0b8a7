"""Which sighting is whose, by one of three rules."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from staniel.kernels.association import marginals, settled

__all__ = ["FREE", "Assignment", "assign"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

FREE = -1
"""Owner of a sighting that is nobody's."""

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
    rule: str, pairs: Ints, scores: Floats, looks: Ints, clutter: float, hit: float
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
    looks : (m,) int64 array
    clutter : float
        Log of the density of false alarms [log 1/m²], which a score has to exceed.
    hit : float
        P_D/(1 - P_D): odds of a target in the gate to be detected.
    """
    return _RULES[rule](pairs, scores, looks, clutter, hit)


def _owned(pairs: Ints, taken: Bools, sightings: int) -> Assignment:
    owners = np.full(sightings, FREE)
    owners[pairs[taken, 1]] = pairs[taken, 0]
    return Assignment(owners, taken.astype(np.float64))


def _nearest(pairs: Ints, scores: Floats, looks: Ints, clutter: float, hit: float) -> Assignment:
    owners, shares, left = settled(pairs, scores, looks, clutter)
    if left.size:
        taken = left[_best(pairs[left], scores[left] - clutter, looks)]
        owners[pairs[taken, 1]], shares[taken] = pairs[taken, 0], 1.0
    return Assignment(owners, shares)


def _best(pairs: Ints, gains: Floats, looks: Ints) -> Ints:
    """Numbers of the pairs, one a sighting and one a track and look at most, of the greatest gains.

    Tracks and sightings that no pair connects are decided apart: a matrix is no larger than a knot
    of tracks that contest one another's sightings.
    """
    from scipy.optimize import linear_sum_assignment
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # A track is another one in each look.
    _, rows = np.unique(pairs[:, 0] * looks.size + looks[pairs[:, 1]], return_inverse=True)
    _, columns = np.unique(pairs[:, 1], return_inverse=True)
    size = rows.max() + columns.max() + 2
    links = coo_array((np.ones(len(pairs)), (rows, rows.max() + 1 + columns)), shape=(size, size))
    _, knot = connected_components(links, directed=False)
    chosen = []
    for label in np.unique(knot[rows]).tolist():
        own = np.flatnonzero(knot[rows] == label)
        _, row = np.unique(rows[own], return_inverse=True)
        _, column = np.unique(columns[own], return_inverse=True)
        shape = row.max() + 1, column.max() + 1
        cost, number = np.zeros(shape), np.full(shape, -1)
        cost[row, column], number[row, column] = -gains[own], np.arange(own.size)
        best = number[linear_sum_assignment(cost)]
        chosen.append(own[best[best >= 0]])
    return np.concatenate(chosen)


def _likeliest(pairs: Ints, scores: Floats, looks: Ints, clutter: float, hit: float) -> Assignment:
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


def _soft(pairs: Ints, scores: Floats, looks: Ints, clutter: float, hit: float) -> Assignment:
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
