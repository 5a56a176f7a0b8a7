"""Whether estimates are as exact as they claim: the normalised estimation error squared."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["anees", "consistency_band", "nees"]

Floats = NDArray[np.float64]


def nees(errors: ArrayLike, covariances: ArrayLike) -> Floats:
    r"""Squared length of each error in the units of its own claimed covariance.

    Parameters
    ----------
    errors : (..., d) array_like
        Estimate less truth.
    covariances : (..., d, d) array_like
        What the estimator claims; symmetric and positive definite.

    Returns
    -------
    (...) float array [-]
        Of a consistent estimator with Gaussian errors a :math:`\chi^2` of d degrees of freedom.

    Raises
    ------
    ValueError
        Shapes that do not match, a value that is not finite, a covariance that is not symmetric
        and positive definite.

    Notes
    -----
    .. math:: \epsilon = (\hat x - x)^T P^{-1} (\hat x - x)

    (Bar-Shalom, Li and Kirubarajan 2001, eq. 5.4.2-1).

    Examples
    --------
    3 m off along an axis with a claimed standard deviation of 1.5 m:

    >>> nees([3.0, 0.0], [[2.25, 0.0], [0.0, 2.25]])
    array(4.)
    """
    e = np.asarray(errors, dtype=np.float64)
    P = np.asarray(covariances, dtype=np.float64)
    if not e.ndim or P.shape != (*e.shape, e.shape[-1]):
        raise ValueError(
            f"covariances has shape {P.shape}: expected errors' {e.shape} and the last once more"
        )
    for name, array in (("errors", e), ("covariances", P)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name}: expected finite numbers")
    if not np.allclose(P, np.swapaxes(P, -1, -2), rtol=1e-9, atol=0.0):
        raise ValueError("covariances: expected symmetric matrices")
    try:
        root = np.linalg.cholesky(P)
    except np.linalg.LinAlgError as problem:
        raise ValueError("covariances: expected positive definite matrices") from problem
    whitened = np.linalg.solve(root, e[..., None])[..., 0]
    return np.asarray((whitened**2).sum(axis=-1))


def anees(values: ArrayLike, dimension: int, *, axis: int | None = None) -> Floats:
    """Average of NEES values per dimension: 1 of a consistent estimator, more of a cocksure one.

    Parameters
    ----------
    values : (...) array_like
        Of `nees`, of independent runs.
    dimension : int
        d, of the errors.
    axis : int, optional
        Over which the runs are; None averages over all.

    Returns
    -------
    float array [-]
        `values` without the axis (Li, Zhao and Li 2001, eq. 8).

    Raises
    ------
    ValueError
        No values at all, or `dimension` below 1.

    Examples
    --------
    >>> anees([4.0, 1.0, 1.0], 2)
    array(1.)
    """
    if dimension < 1:
        raise ValueError(f"dimension = {dimension}: expected at least 1")
    array = np.asarray(values, dtype=np.float64)
    if not array.size:
        raise ValueError("values: expected at least one")
    return np.asarray(array.mean(axis=axis) / dimension)


def consistency_band(count: int, dimension: int, confidence: float = 0.95) -> tuple[float, float]:
    r"""Bounds within which `anees` of a consistent estimator falls, with some probability.

    Parameters
    ----------
    count : int
        Independent values in the average, N.
    dimension : int
        d, of the errors.
    confidence : float [-]
        Probability to fall within; the two tails are equal.

    Returns
    -------
    low, high : float [-]

    Raises
    ------
    ValueError
        `count` or `dimension` below 1, `confidence` not between 0 and 1.

    Notes
    -----
    The sum of N independent values is a :math:`\chi^2` of N d degrees of freedom (Bar-Shalom, Li
    and Kirubarajan 2001, eq. 5.4.2-5). Values of one track at successive times are not independent:
    of them the true band is wider.

    Examples
    --------
    >>> low, high = consistency_band(50, 2)
    >>> round(low, 2), round(high, 2)
    (0.74, 1.3)
    """
    from scipy.stats import chi2

    for name, number in (("count", count), ("dimension", dimension)):
        if number < 1:
            raise ValueError(f"{name} = {number}: expected at least 1")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence = {confidence}: expected a number between 0 and 1")
    freedom = count * dimension
    tail = 0.5 * (1.0 - confidence)
    return float(chi2.ppf(tail, freedom)) / freedom, float(chi2.isf(tail, freedom)) / freedom
