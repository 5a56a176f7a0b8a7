"""Assignment of a whole team at once, by one that knows all costs."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.errors import StanielError
from staniel.kernels import auction

__all__ = ["Assignment", "assign"]

_LARGEST = 1e100  # cost in size: sums of squares of so many stay finite
_CELLS = 100_000_000  # of a matrix: 0.8 GB
_FINEST = 1e-9  # ε of the largest cost: a smaller one drowns in rounding
_ROUNDING = 1e-13


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """Which row gets which column, and at what prices they agree.

    Attributes
    ----------
    columns : (n,) int64 array
        Column of each row; -1 where it has none.
    prices : (m,) float64 array
        Of the columns, at least 0. Column j costs row i in all ``cost[i, j] + prices[j]``.
    happiness : (n,) bool array
        True where the row's column is, at these prices, within ε of the cheapest; False where it
        has none.
    cost : float
        Sum of the assigned pairs' costs, prices apart.
    """

    columns: NDArray[np.int64]
    prices: NDArray[np.float64]
    happiness: NDArray[np.bool_]
    cost: float


def assign(cost: ArrayLike, epsilon: float | None = None) -> Assignment:
    r"""Assign rows to columns, one to one, at the least cost.

    Parameters
    ----------
    cost : (n, m) array_like
        Of each row for each column, of any sign; +inf forbids a pair.
    epsilon : float, optional
        The auction's last step :math:`\varepsilon`, greater than 0, in the unit of `cost`. Without
        it the answer is exact.

    Returns
    -------
    Assignment
        Of as many pairs as can be, and of all that have so many one that costs least.

    Raises
    ------
    StanielError
        Not a matrix of numbers, NaN or -inf, a finite cost beyond ±1e100, more than 1e8 costs, an
        `epsilon` that is not finite and greater than 0.

    Notes
    -----
    Thesis fig. 7.2 (corrected: costs are minimised; the figure's values are ``-cost``). With
    `epsilon` this is Bertsekas' auction, forward and reverse, its step scaled down to
    :math:`\varepsilon`: the cost is at most :math:`\min(n, m)\,\varepsilon` above the least, so
    the least itself where costs are integers and :math:`\varepsilon < 1/\min(n, m)`. Below 1e-9 of
    the largest cost :math:`\varepsilon` would drown in rounding, and the answer is exact.

    At the prices each row that has a column is within :math:`\varepsilon` of its cheapest, which
    proves the bound. Without forbidden pairs a column that no row has is free of charge; with
    them its price is at most :math:`\varepsilon`.

    Without `epsilon` bids without a step are completed by shortest chains of changes (Jonker and
    Volgenant 1987), which needs no small step and is exact up to rounding.

    Examples
    --------
    The figure's three aircraft (rows) and targets (columns):

    >>> values = np.array([[3.0, 3.0, 6.0], [2.0, 5.0, 3.0], [8.0, 2.0, 7.0]])
    >>> found = assign(-values)
    >>> found.columns
    array([2, 1, 0])
    >>> found.happiness
    array([ True,  True,  True])
    >>> found.cost
    -19.0
    """
    costs = _checked(cost)
    step = 0.0 if epsilon is None else _checked_step(epsilon)
    n, m = costs.shape
    if costs.size == 0:
        return Assignment(np.full(n, -1), np.zeros(m), np.zeros(n, np.bool_), 0.0)
    low, high, forbidden, wrong = auction.survey(costs)
    if wrong >= 0:
        i, j = divmod(wrong, m)
        raise StanielError(f"cost[{i}, {j}] = {costs[i, j]}: expected a finite number or +inf")
    if forbidden == costs.size:
        low = high = 0.0
    if max(-low, high) > _LARGEST:
        raise StanielError(f"cost: expected numbers within ±{_LARGEST:g}, got {low} to {high}")
    barred, largest = math.inf, max(-low, high)
    if forbidden:
        # One pair more is worth any difference of cost among the others, and any n ε.
        barred = high + (min(n, m) + 1) * ((high - low + step) or 1.0)
        largest = max(largest, barred)
    if step < _FINEST * largest:
        step = 0.0
    # Prices are multiples of the step, however small the costs.
    rounding = _ROUNDING * max(n, m) * max(largest, step)
    return Assignment(*auction.assign(costs, step, barred, rounding))


def _checked(cost: ArrayLike) -> NDArray[np.float64]:
    try:
        costs = np.asarray(cost, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise StanielError(f"cost: expected an (n, m) matrix of numbers ({error})") from None
    if costs.ndim != 2:
        raise StanielError(f"cost has shape {costs.shape}: expected (n, m)")
    if costs.size > _CELLS:
        raise StanielError(f"cost has shape {costs.shape}: expected at most {_CELLS} costs")
    return np.ascontiguousarray(costs)


def _checked_step(epsilon: float) -> float:
    try:
        step = float(epsilon)
    except (TypeError, ValueError):
        step = math.nan
    if not 0.0 < step < math.inf:
        raise StanielError(f"epsilon = {epsilon}: expected a finite number greater than 0, or None")
    return step
