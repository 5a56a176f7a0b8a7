"""The conic in which a camera's cone meets level ground (thesis eq. 4.3 to 4.19, corrected)."""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["ConicKind", "classify", "ellipse_moments", "ellipse_polygon", "ground_conic", "moved"]

Floats = NDArray[np.float64]

ConicKind = Literal["ellipse", "parabola", "hyperbola", "none"]

_SINGULAR = 1e-12
"""Ratio of the two eigenvalues of a parabola's quadratic part, which rounding leaves above 0."""


def ground_conic(
    origin: ArrayLike, axis: ArrayLike, half_aperture: float, height: float = 0.0
) -> Floats:
    r"""Matrix of the conic in which a double cone meets the plane at `height`.

    Parameters
    ----------
    origin : (3,) float array [m]
        Apex of the cone: east, north, height.
    axis : (3,) float array
        Unit vector along which the camera looks.
    half_aperture : float [rad]
        In (0, pi/2).
    height : float [m]
        Of the plane.

    Returns
    -------
    (3, 3) float array
        Symmetric :math:`C = [[C_R, C_T], [C_T^T, C_\delta]]`. With p = (east, north, 1),
        :math:`p^T C p` is 0 on the cone, greater inside either of its sheets, smaller outside.

    Notes
    -----
    :math:`M = d d^T - \cos^2\alpha\, I` with :math:`\alpha` the half-aperture, thesis eq. 4.3
    (corrected); the plane is spanned by east and north from the point of the plane at east 0,
    north 0, eq. 4.4 to 4.9.
    """
    apex, d = np.asarray(origin, dtype=np.float64), np.asarray(axis, dtype=np.float64)
    M = np.outer(d, d) - math.cos(half_aperture) ** 2 * np.eye(3)
    plane = np.array([[1.0, 0.0, -apex[0]], [0.0, 1.0, -apex[1]], [0.0, 0.0, height - apex[2]]])
    return np.asarray(plane.T @ M @ plane)


def moved(conic: Floats, east: float, north: float) -> Floats:
    """The same conic after a move by (east, north) [m]; (3, 3) in, (3, 3) out."""
    back = np.array([[1.0, 0.0, -east], [0.0, 1.0, -north], [0.0, 0.0, 1.0]])
    return np.asarray(back.T @ conic @ back)


def classify(conic: Floats) -> ConicKind:
    r"""What curve a conic's matrix describes.

    Parameters
    ----------
    conic : (3, 3) float array
        Symmetric; best with its origin near the curve, where rounding is least.

    Returns
    -------
    {"ellipse", "parabola", "hyperbola", "none"}
        "none" for a curve without real points, and for single points and lines.

    Notes
    -----
    A parabola where :math:`C_R` is singular, which is asked first so that it is never inverted; an
    ellipse where both eigenvalues of :math:`C_R` have the sign opposite to the canonical constant
    :math:`C_c(3, 3) = C_\delta - C_T^T C_R^{-1} C_T`, a hyperbola where they differ in sign: thesis
    eq. 4.10 to 4.16 (corrected).

    Examples
    --------
    The unit circle, x² = y, and x² - y² = 1.

    >>> classify(np.diag([1.0, 1.0, -1.0]))
    'ellipse'
    >>> classify(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -0.5], [0.0, -0.5, 0.0]]))
    'parabola'
    >>> classify(np.diag([1.0, -1.0, -1.0]))
    'hyperbola'
    """
    lengths, R = np.linalg.eigh(conic[:2, :2])
    small, large = sorted(np.abs(lengths).tolist())
    if large == 0.0:
        return "none"
    if small <= _SINGULAR * large:
        flat = R[:, int(np.argmin(np.abs(lengths)))]
        return "parabola" if float(flat @ conic[:2, 2]) != 0.0 else "none"
    constant = _canonical(conic, lengths, R)[1]
    if constant == 0.0:
        return "none"
    if lengths[0] * lengths[1] < 0.0:
        return "hyperbola"
    return "ellipse" if lengths[0] * constant < 0.0 else "none"


def ellipse_moments(conic: Floats) -> tuple[Floats, Floats]:
    r"""Centre and shape of an ellipse, thesis eq. 4.10 to 4.18 (corrected).

    Parameters
    ----------
    conic : (3, 3) float array
        One that `classify` calls an ellipse.

    Returns
    -------
    mean : (2,) float array [m]
        Its centre T.
    covariance : (2, 2) float array [m²]
        :math:`\Sigma = R\, \mathrm{diag}(a^2, b^2) R^T` with the half axes a and b: the ellipse is
        where :math:`(x - T)^T \Sigma^{-1} (x - T) = 1`.

    Examples
    --------
    A camera at 50 m, level, half-aperture 45°: a circle of radius 50 m.

    >>> conic = ground_conic((7.0, 0.0, 50.0), (0.0, 0.0, -1.0), math.radians(45.0))
    >>> mean, covariance = ellipse_moments(conic)
    >>> bool(np.allclose(mean, [7.0, 0.0])), np.sqrt(np.diag(covariance)).round(6).tolist()
    (True, [50.0, 50.0])
    """
    lengths, R = np.linalg.eigh(conic[:2, :2])
    T, constant = _canonical(conic, lengths, R)
    return T, np.asarray(R @ np.diag(-constant / lengths) @ R.T)


def ellipse_polygon(
    mean: Floats, covariance: Floats, points: int = 64, *, start: float = 0.0
) -> Floats:
    r"""Corners on an ellipse, thesis eq. 4.19 (corrected).

    Parameters
    ----------
    mean : (2,) float array [m]
    covariance : (2, 2) float array [m²]
        As `ellipse_moments` gives them.
    points : int
        Corners, at least 3.
    start : float [rad]
        Parameter of the first corner.

    Returns
    -------
    (points, 2) float array [m]
        :math:`T + \Sigma^{1/2} (\cos s, \sin s)^T` at even steps of s, with the principal square
        root: convex, counter-clockwise, the first not repeated.
    """
    squares, R = np.linalg.eigh(covariance)
    root = R @ np.diag(np.sqrt(squares)) @ R.T
    s = start + np.arange(points) * (2.0 * math.pi / points)
    return np.asarray(mean + np.column_stack([np.cos(s), np.sin(s)]) @ root)


def _canonical(conic: Floats, lengths: Floats, R: Floats) -> tuple[Floats, float]:
    """Centre T and constant C_c(3, 3) of a conic whose C_R has no eigenvalue 0."""
    T = -(R @ ((R.T @ conic[:2, 2]) / lengths))
    return T, float(conic[2, 2] + conic[:2, 2] @ T)
