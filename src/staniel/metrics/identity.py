"""How well tracks keep to their targets over time: CLEAR MOT and the identity scores."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.metrics.checks import checked_positions
from staniel.metrics.correspondence import Correspondence

__all__ = ["GATE", "IdentityScores", "identity_scores", "scores_of"]

GATE = 10.0
"""A track is a target's as long as it is within this distance of it [m]."""


@dataclass(frozen=True, slots=True)
class IdentityScores:
    """Counts over all instants, and the shares that follow from them; None where undefined.

    Attributes
    ----------
    switches : int
        Matches with another track than the target's last match.
    fragmentations : int
        Targets without a track between two matches, counted by their gaps.
    misses, false_positives : int
        Targets without a match, tracks without one.
    mota : float or None [-]
        Accuracy: 1 - (misses + false positives + switches)/targets; at most 1, no least value.
    motp : float or None [m]
        Precision: mean distance of the matches.
    idp, idr, idf1 : float or None [-]
        Precision, recall and F1 of the best lasting assignment of tracks to targets.
    """

    switches: int
    fragmentations: int
    misses: int
    false_positives: int
    mota: float | None
    motp: float | None
    idp: float | None
    idr: float | None
    idf1: float | None


def identity_scores(
    truth: Sequence[tuple[Sequence[Hashable], ArrayLike]],
    tracks: Sequence[tuple[Sequence[Hashable], ArrayLike]],
    *,
    gate: float = GATE,
) -> IdentityScores:
    r"""Score tracks with names against targets with names, over a sequence of instants.

    Parameters
    ----------
    truth : sequence of n (ids, positions)
        Of each instant the k targets that are there: k hashables and (k, 2) array_like [m].
    tracks : sequence of n (ids, positions)
        Of the same instants the m tracks: m hashables and (m, 2) array_like [m].
    gate : float [m]
        A track is a target's only within this distance; greater than 0.

    Returns
    -------
    IdentityScores

    Raises
    ------
    ValueError
        Sequences of different lengths, ids and positions that do not match, one id twice in an
        instant, a value that is not finite, `gate` not positive.

    Notes
    -----
    Matches, switches, MOTA and MOTP are CLEAR MOT (Bernardin and Stiefelhagen 2008), see
    `staniel.metrics.correspondence.Correspondence`; MOTP is the mean distance, as there. The
    identity scores (Ristani et al. 2016, eq. 3 to 6) give each target at most one track for the
    whole sequence, so that the instants in which the two are within the gate are as many as
    possible: IDTP of them. Then

    .. math:: \mathrm{IDP} = \frac{\mathrm{IDTP}}{\#\text{tracks}},\quad
              \mathrm{IDR} = \frac{\mathrm{IDTP}}{\#\text{targets}},\quad
              \mathrm{IDF}_1 = \frac{2\,\mathrm{IDTP}}{\#\text{tracks} + \#\text{targets}}

    with the numbers summed over the instants.

    Examples
    --------
    One target, followed by track "a" for two instants and then by "b":

    >>> truth = [(["car"], [[float(k), 0.0]]) for k in range(3)]
    >>> tracks = [(["a"], [[0.0, 0.0]]), (["a"], [[1.0, 0.0]]), (["b"], [[2.0, 3.0]])]
    >>> scores = identity_scores(truth, tracks)
    >>> scores.switches, round(scores.mota, 3), scores.motp, round(scores.idf1, 3)
    (1, 0.667, 1.0, 0.667)
    """
    if len(truth) != len(tracks):
        raise ValueError(f"tracks has {len(tracks)} instants: expected {len(truth)}, as truth")
    if not (np.isfinite(gate) and gate > 0.0):
        raise ValueError(f"gate = {gate}: expected a number of metres greater than 0")
    found = Correspondence(gate)
    for k, (there, seen) in enumerate(zip(truth, tracks, strict=True)):
        targets, x = _named(there, f"truth[{k}]")
        names, y = _named(seen, f"tracks[{k}]")
        found.update(np.sqrt(((x[:, None] - y) ** 2).sum(axis=2)), targets, names)
    return scores_of(found)


def scores_of(found: Correspondence) -> IdentityScores:
    """The scores of all instants that a correspondence has taken in."""
    targets, tracks = found.targets, found.tracks
    switches, matched = found.switches.total(), found.matched
    misses, false = targets - matched, tracks - matched
    lasting = _lasting(found)
    return IdentityScores(
        switches,
        found.fragmentations,
        misses,
        false,
        1.0 - (misses + false + switches) / targets if targets else None,
        found.distance / matched if matched else None,
        lasting / tracks if tracks else None,
        lasting / targets if targets else None,
        2.0 * lasting / (tracks + targets) if tracks or targets else None,
    )


def _lasting(found: Correspondence) -> int:
    """IDTP: instants that the best lasting assignment of tracks to targets shares."""
    from scipy.optimize import linear_sum_assignment

    row: dict[Hashable, int] = {}
    column: dict[Hashable, int] = {}
    for target, track in found.shared:
        row.setdefault(target, len(row))
        column.setdefault(track, len(column))
    shared = np.zeros((len(row), len(column)))
    for (target, track), instants in found.shared.items():
        shared[row[target], column[track]] = instants
    return int(shared[linear_sum_assignment(shared, maximize=True)].sum())


def _named(
    instant: tuple[Sequence[Hashable], ArrayLike], name: str
) -> tuple[Sequence[Hashable], NDArray[np.float64]]:
    ids, places = instant
    positions = checked_positions(places, f"{name} positions")
    if len(ids) != len(positions):
        raise ValueError(f"{name} has {len(ids)} ids: expected {len(positions)}, as positions")
    if len(set(ids)) != len(ids):
        raise ValueError(f"{name} ids = {list(ids)}: expected each one once")
    return ids, positions
