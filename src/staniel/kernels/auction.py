"""Who gets what at least cost: an auction with scaled steps, and an exact finish.

Rows bid for columns. With prices p of the columns, column j costs row i in all c[i, j] + p[j]. Rows
and columns are in *ε-complementary slackness* when each row's own column costs it at most ε more
than the cheapest, and no column that nobody has is dearer than any that somebody has. A whole
assignment in it costs at most n ε more than the least (Bertsekas 1988; Bertsekas and Castañon 1992
for more columns than rows).
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.chains import NOBODY, augment

__all__ = ["assign", "optimal", "scaled", "survey", "warm"]

Array = NDArray[Any]

_COARSE = 0.25  # first step of the scaling, of the range of the costs
_FINER = 0.2  # each step of the one before
_ROUNDS = 2  # of bids without a step
_BIDS = 2  # a row in each of these rounds
_WAR = 0.125  # share of rows left over by these rounds that tells of a price war
_MANY = 256  # rows that scaling is worth its start for


@njit(cache=True, error_model="numpy")
def _best_two(costs: Array, prices: Array) -> tuple[int, float, float]:
    """The cheapest column of a row, what it costs in all, and what the next one does."""
    at, best, second = 0, np.inf, np.inf
    for j in range(costs.size):
        total = costs[j] + prices[j]
        if total < second:
            if total < best:
                at, best, second = j, total, best
            else:
                second = total
    return at, best, second


@njit(cache=True, error_model="numpy")
def _forward(cost: Array, prices: Array, columns: Array, rows: Array, step: float) -> None:
    """Bids of the rows that have nothing, one by one, until each has a column (Gauss-Seidel).

    A bid raises the price until the column is `step` dearer than the bidder's second best.
    """
    waiting = np.empty(columns.size, np.int64)
    count = 0
    for i in range(columns.size - 1, -1, -1):
        if columns[i] == NOBODY:
            waiting[count] = i
            count += 1
    while count:
        i = waiting[count - 1]
        at, best, second = _best_two(cost[i], prices)
        prices[at] += step + (second - best if prices.size > 1 else 0.0)
        outbid = rows[at]
        rows[at], columns[i] = i, at
        if outbid == NOBODY:
            count -= 1
        else:
            columns[outbid] = NOBODY
            waiting[count - 1] = outbid


@njit(cache=True, error_model="numpy")
def _reverse(cost: Array, prices: Array, columns: Array, rows: Array, step: float) -> None:
    """Columns left over lower their prices to the least of those taken, or find a taker.

    With more columns than rows a column may be dear from an earlier phase and yet go to nobody;
    such a price says nothing of what the column is worth.
    """
    n, m = cost.shape
    totals = np.empty(n)
    floor = np.inf
    for i in range(n):
        totals[i] = cost[i, columns[i]] + prices[columns[i]]
        floor = min(floor, prices[columns[i]])
    for first in range(m):
        j = first
        while rows[j] == NOBODY:
            taker, best, second = 0, -np.inf, -np.inf
            for i in range(n):
                worth = totals[i] - cost[i, j]
                if worth > second:
                    if worth > best:
                        taker, best, second = i, worth, best
                    else:
                        second = worth
            if prices[j] <= floor or best <= floor + step:
                prices[j] = floor
                break
            cut = min(best - floor, best - second + step)
            prices[j] = max(floor, best - cut)
            totals[taker] -= cut
            old = columns[taker]
            columns[taker], rows[j], rows[old] = j, taker, NOBODY
            # The column given up is looked at now, or when its turn comes.
            j = old if old <= first else j


@njit(cache=True, error_model="numpy")
def scaled(cost: Array, epsilon: float) -> tuple[Array, Array]:
    """Forward and reverse auction with ever smaller steps: at most n ε above the least cost.

    Parameters
    ----------
    cost : (n, m) float64 array
        Finite, n <= m, n > 0.
    epsilon : float
        Of the last phase; above the rounding error of the prices.

    Returns
    -------
    columns : (n,) int64 array
    prices : (m,) float64 array
        The least is 0, and so are those of columns that nobody has.
    """
    n, m = cost.shape
    prices = np.zeros(m)
    columns, rows = np.empty(n, np.int64), np.empty(m, np.int64)
    step = max(epsilon, _COARSE * (cost.max() - cost.min()))
    while True:
        columns[:], rows[:] = NOBODY, NOBODY
        _forward(cost, prices, columns, rows, step)
        if n < m:
            _reverse(cost, prices, columns, rows, step)
        if step <= epsilon:
            break
        step = max(epsilon, _FINER * step)
    prices -= prices.min()
    return columns, prices


@njit(cache=True, error_model="numpy")
def _least_of_columns(cost: Array, prices: Array, columns: Array, rows: Array) -> None:
    """Start of a square: each column as cheap as its least row allows, and to that row."""
    n = columns.size
    at = np.zeros(n, np.int64)
    prices[:] = cost[0]
    for i in range(1, n):
        for j in range(n):
            less = cost[i, j] < prices[j]
            prices[j] = cost[i, j] if less else prices[j]
            at[j] = i if less else at[j]
    for j in range(n - 1, -1, -1):
        prices[j] = -prices[j]
        if columns[at[j]] == NOBODY:
            columns[at[j]], rows[j] = j, at[j]


@njit(cache=True, error_model="numpy")
def _bid_without_step(cost: Array, prices: Array, columns: Array, rows: Array) -> bool:
    """Bids with ε = 0, a limited number; a tie for a column that is taken is left alone.

    Returns whether the limit, and nothing else, ended every round.
    """
    n = columns.size
    waiting = np.empty(n, np.int64)
    spent = True
    for _ in range(_ROUNDS):
        count = 0
        for i in range(n):
            if columns[i] == NOBODY:
                waiting[count] = i
                count += 1
        turn, bids = 0, 0
        while turn < count and bids < _BIDS * n:
            bids += 1
            i = waiting[turn]
            turn += 1
            at, best, second = _best_two(cost[i], prices)
            outbid = rows[at]
            if outbid != NOBODY:
                if not best < second < np.inf:
                    continue
                turn -= 1
                waiting[turn] = outbid
                columns[outbid] = NOBODY
            rows[at], columns[i] = i, at
            if second < np.inf:
                prices[at] += second - best
        spent &= turn < count
    return spent


@njit(cache=True, error_model="numpy")
def _keep_exact(cost: Array, prices: Array, columns: Array, rows: Array) -> None:
    """Take from each row what is not exactly its best; its best where that is free."""
    for i in range(columns.size):
        j = columns[i]
        at, best, _ = _best_two(cost[i], prices)
        if cost[i, j] + prices[j] > best:
            rows[j], columns[i] = NOBODY, NOBODY
            if rows[at] == NOBODY:
                rows[at], columns[i] = i, at


@njit(cache=True, error_model="numpy")
def optimal(cost: Array) -> tuple[Array, Array]:
    """The least cost, to rounding: bids without a step, then shortest chains of changes.

    Where many rows of a square are left over by the bids they are in a price war, and the auction
    with scaled steps comes between.

    Parameters
    ----------
    cost : (n, m) float64 array
        Finite, C-contiguous, n <= m, n > 0.

    Returns
    -------
    columns : (n,) int64 array
    prices : (m,) float64 array
        The least is 0, and so are those of columns that nobody has.
    """
    n, m = cost.shape
    prices = np.zeros(m)
    columns, rows = np.full(n, NOBODY), np.full(m, NOBODY)
    if n == m:
        _least_of_columns(cost, prices, columns, rows)
    war = _bid_without_step(cost, prices, columns, rows)
    if war and n == m >= _MANY and (columns == NOBODY).sum() > _WAR * n:
        columns, prices = scaled(cost, (cost.max() - cost.min()) / n)
        for i in range(n):
            rows[columns[i]] = i
        _keep_exact(cost, prices, columns, rows)
    if columns.min() == NOBODY:
        augment(cost, prices, columns, rows)
    prices -= prices.min()
    return columns, prices


@njit(cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _cheapest(costs: Array, prices: Array) -> float:
    """What the cheapest column of a row costs in all, without a branch."""
    best = np.inf
    for j in range(costs.size):
        best = min(best, costs[j] + prices[j])
    return best


@njit(cache=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _range(flat: Array) -> tuple[float, float]:
    """Least and greatest finite one of some costs without NaN and -inf."""
    low, high = np.inf, -np.inf
    for k in range(flat.size):
        value = flat[k]
        low = min(low, value)
        high = max(high, value if value < np.inf else -np.inf)
    return low, high


@njit(cache=True, error_model="numpy")
def survey(cost: Array) -> tuple[float, float, int, int]:
    """Least and greatest finite cost, how many are +inf, and the first that is no cost, or -1."""
    flat = cost.ravel()
    forbidden, good = 0, 0
    for k in range(flat.size):
        forbidden += flat[k] == np.inf
        good += flat[k] > -np.inf
    wrong = -1
    if good < flat.size:
        wrong = 0
        while flat[wrong] > -np.inf:
            wrong += 1
    low, high = _range(flat[:wrong] if wrong >= 0 else flat)
    return low, high, forbidden, wrong


@njit(cache=True, error_model="numpy")
def _whole(cost: Array, epsilon: float, barred: float) -> tuple[Array, Array]:
    """Assignment of all rows, n <= m, +inf counting as `barred`."""
    if barred < np.inf:
        cost = np.minimum(cost, barred)
    if epsilon > 0.0:
        return scaled(cost, epsilon)
    return optimal(cost)


@njit(cache=True, error_model="numpy")
def assign(
    cost: Array, epsilon: float, barred: float, rounding: float
) -> tuple[Array, Array, Array, float]:
    """As many rows and columns together as can be, at the least cost; any shape, +inf forbids.

    Parameters
    ----------
    cost : (n, m) float64 array
        C-contiguous, not empty.
    epsilon : float
        0 for the least cost.
    barred : float
        What +inf counts as: more than a whole assignment; +inf where there is none.
    rounding : float
        Of a cost and a price, for `happy`.

    Returns
    -------
    columns : (n,) int64 array
        -1 where a row has none.
    prices : (m,) float64 array
        The least is 0.
    happy : (n,) bool array
        Whose column is within `epsilon` of its cheapest.
    total : float
    """
    n, m = cost.shape
    if n <= m:
        columns, prices = _whole(cost, epsilon, barred)
    else:
        columns, prices = np.full(n, NOBODY), np.empty(m)
        owners, worths = _whole(np.ascontiguousarray(cost.T), epsilon, barred)
        for j in range(m):
            columns[owners[j]] = j
            # As bidders the columns paid in all the least of cost plus row price: this is worth
            # that much less to a row.
            least = np.inf
            for i in range(n):
                least = min(least, min(cost[i, j], barred) + worths[i])
            prices[j] = -least
        prices -= prices.min()
    happy = np.zeros(n, np.bool_)
    total = 0.0
    for i in range(n):
        j = columns[i]
        if j != NOBODY and cost[i, j] == np.inf:
            columns[i] = NOBODY
        elif j != NOBODY:
            total += cost[i, j]
            best = _cheapest(cost[i], prices)
            happy[i] = cost[i, j] + prices[j] <= best + epsilon + rounding
    return columns, prices, happy, total


def warm() -> None:
    """Compile, or load from the cache, on a few costs."""
    cost = np.array([[1.0, 2.0], [np.inf, 1.0], [3.0, 1.0]])
    survey(cost)
    for epsilon in (0.0, 0.1):
        assign(cost, epsilon, 100.0, 0.0)
