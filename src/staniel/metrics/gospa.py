"""How far a set of estimates is from the set of what is there: the GOSPA metric."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.metrics.checks import checked_cutoff, checked_order, checked_positions

__all__ = ["CUTOFF", "ORDER", "Gospa", "gospa"]

CUTOFF = 20.0
"""Cut-off c [m]: a pair farther apart than this counts as one missed and one false."""

ORDER = 2.0
"""Order p."""


class Gospa(NamedTuple):
    """A GOSPA distance and its parts: ``distance**order == localisation + missed + false``.

    Attributes
    ----------
    distance : float [m]
    localisation : float [m^order]
        Sum of the assigned pairs' distances, each to the power of `order`.
    missed : float [m^order]
        ``cutoff**order / 2`` for each true position without an estimate.
    false : float [m^order]
        ``cutoff**order / 2`` for each estimate without a true position.
    """

    distance: float
    localisation: float
    missed: float
    false: float


def gospa(
    truth: ArrayLike, estimates: ArrayLike, *, cutoff: float = CUTOFF, order: float = ORDER
) -> Gospa:
    r"""Generalised optimal sub-pattern assignment metric with :math:`\alpha = 2`.

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
    Gospa
        The distance and its three parts.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite, `cutoff` not positive or `order` below 1.

    Notes
    -----
    .. math:: d = \Big[\min_\gamma \sum_{(i,j)\in\gamma} \lVert x_i - y_j\rVert^p
              + \tfrac{c^p}{2}\,(n + m - 2|\gamma|)\Big]^{1/p}

    over all partial one-to-one assignments :math:`\gamma` (Rahmathullah, García-Fernández and
    Svensson 2017, proposition 1). A pair is worth its place as long as it is closer than c.

    Examples
    --------
    One vehicle found 3 m off, one missed:

    >>> gospa([[0.0, 0.0], [90.0, 0.0]], [[3.0, 0.0]])
    Gospa(distance=14.45683229480096, localisation=9.0, missed=200.0, false=0.0)
    """
    x, y = checked_positions(truth, "truth"), checked_positions(estimates, "estimates")
    squares = ((x[:, None, :] - y[None, :, :]) ** 2).sum(axis=2)
    return gospa_of_squares(squares, checked_cutoff(cutoff), checked_order(order))


def gospa_of_squares(squares: NDArray[np.float64], cutoff: float, order: float) -> Gospa:
    """GOSPA from the (n, m) squared distances [m²]; nothing is checked."""
    from scipy.optimize import linear_sum_assignment

    n, m = squares.shape
    most = cutoff**order
    localisation, pairs = 0.0, 0
    if n and m:
        costs = np.minimum(squares ** (0.5 * order), most)
        chosen = costs[linear_sum_assignment(costs)]
        chosen = chosen[chosen < most]
        localisation, pairs = float(chosen.sum()), len(chosen)
    missed, false = 0.5 * most * (n - pairs), 0.5 * most * (m - pairs)
    distance = (localisation + missed + false) ** (1.0 / order)
    return Gospa(distance, localisation, missed, false)
