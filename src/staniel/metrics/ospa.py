"""How far a set of estimates is from the set of what is there, per member: the OSPA metric."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.metrics.checks import checked_cutoff, checked_order, checked_positions
from staniel.metrics.gospa import CUTOFF, ORDER, gospa_of_squares

__all__ = ["Ospa", "ospa", "ospa_of_gospa"]


class Ospa(NamedTuple):
    """An OSPA distance and its parts: ``distance**order == localisation + cardinality``.

    Attributes
    ----------
    distance : float [m]
        Between 0 and the cut-off.
    localisation : float [m^order]
        Of the best pairs, each farther apart than the cut-off counted as that far.
    cardinality : float [m^order]
        Of the members that one set has more than the other.
    """

    distance: float
    localisation: float
    cardinality: float


def ospa(
    truth: ArrayLike, estimates: ArrayLike, *, cutoff: float = CUTOFF, order: float = ORDER
) -> Ospa:
    r"""Optimal sub-pattern assignment metric.

    Parameters
    ----------
    truth : (n, 2) array_like [m]
        True positions; n may be 0.
    estimates : (m, 2) array_like [m]
        Estimated positions; m may be 0.
    cutoff : float [m]
        c, greater than 0.
    order : float [-]
        p, at least 1.

    Returns
    -------
    Ospa
        The distance and its two parts.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite, `cutoff` not positive or `order` below 1.

    Notes
    -----
    .. math:: d = \Big[\frac{1}{n}\Big(\min_\pi \sum_{i=1}^{m} \min(c, \lVert x_i -
              y_{\pi(i)}\rVert)^p + c^p\,(n - m)\Big)\Big]^{1/p}

    over all ways :math:`\pi` to give each of the m members of the smaller set one of the n of the
    larger; 0 of two empty sets (Schuhmacher, Vo and Vo 2008, eq. 3 and 4). It averages over the
    larger set: one more target missed among many costs little, and `gospa` tells a missed one from
    a false one.

    Examples
    --------
    One vehicle found 3 m off, one missed:

    >>> ospa([[0.0, 0.0], [90.0, 0.0]], [[3.0, 0.0]])
    Ospa(distance=14.300349646075091, localisation=4.5, cardinality=200.0)
    """
    x, y = checked_positions(truth, "truth"), checked_positions(estimates, "estimates")
    squares = ((x[:, None, :] - y[None, :, :]) ** 2).sum(axis=2)
    parts = gospa_of_squares(squares, checked_cutoff(cutoff), checked_order(order))
    larger, surplus = max(len(x), len(y), 1), abs(len(x) - len(y))
    # Pairs at the cut-off, which GOSPA counts as one missed and one false.
    cut = 2.0 * min(parts.missed, parts.false)
    return Ospa(
        float(ospa_of_gospa(parts, larger, order)),
        (parts.localisation + cut) / larger,
        cutoff**order * surplus / larger,
    )


def ospa_of_gospa(parts: ArrayLike, larger: ArrayLike, order: float) -> NDArray[Any]:
    """OSPA distance from the parts of GOSPA with the same cut-off and order.

    Both have the same best pairs. Of GOSPA's missed and false members, which cost half a cut-off
    power each, the more numerous ones are those of the larger set that OSPA counts at a whole one.

    Parameters
    ----------
    parts : (..., 4) array_like
        As `staniel.metrics.Gospa`.
    larger : (...) array_like
        Members of the larger set, at least 1.
    order : float [-]

    Returns
    -------
    (...) float array [m]
    """
    _, localisation, missed, false = np.moveaxis(np.asarray(parts, dtype=np.float64), -1, 0)
    power = (localisation + 2.0 * np.maximum(missed, false)) / np.asarray(larger)
    distance: NDArray[Any] = power ** (1.0 / order)
    return distance
