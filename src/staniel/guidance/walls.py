"""Walls from lidar returns: lines by total least squares, with what is known of their errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.angles import wrap, wrap_array
from staniel.datatypes.lidar import LidarScan

__all__ = ["WallLine", "fit_line", "fit_walls", "join_scans"]

Floats = NDArray[np.float64]
Point = tuple[float, float]

_SIGMAS = 4.5  # a return farther than this off its line, in standard deviations, splits it
_SURE = 3.7  # ... and all of them together, at this quantile of the normal law (1 in 10 000)
_ROUGH = 0.02  # standard deviation of a wall from a straight line [m]
_GRAZING = math.radians(15.0)  # beams at a smaller angle to a wall do not hold it together


@dataclass(frozen=True, slots=True)
class WallLine:
    """A straight piece of wall: ``x cos(alpha) + y sin(alpha) = rho`` between two ends.

    Attributes
    ----------
    rho : float [m]
        Distance of the line from the frame's origin, at least 0.
    alpha : float [rad]
        Direction from the origin to the nearest point of the line, in (-pi, pi].
    covariance : (2, 2) float array [m², m rad, rad²]
        Of rho and alpha, to the first order. Far from the origin rho hangs on alpha by a long lever
        and is not normal: compare lines by `about`.
    start, end : (float, float) [m]
        The outermost returns, put onto the line, in the order in which they were handed in.
    returns : int
        How many returns it was fitted to.
    """

    rho: float
    alpha: float
    covariance: Floats
    start: Point
    end: Point
    returns: int

    def about(self, point: Point) -> tuple[float, Floats]:
        """How far the line is from a point, and the covariance of that and of alpha.

        Parameters
        ----------
        point : (float, float) [m]
            Near the wall, as the middle between its ends: there the errors are normal.

        Returns
        -------
        distance : float [m]
            In the direction alpha from the point, negative against it.
        covariance : (2, 2) float array [m², m rad, rad²]
            Of the distance and alpha.

        Examples
        --------
        >>> line = fit_line([[5.0, 100.0], [5.0, 102.0]], 0.1)
        >>> distance, covariance = line.about((4.0, 101.0))
        >>> round(distance, 9), np.sqrt(np.diag(line.covariance)), np.sqrt(np.diag(covariance))
        (1.0, array([7.14..., 0.07...]), array([0.07..., 0.07...]))
        """
        cos, sin = math.cos(self.alpha), math.sin(self.alpha)
        lever = point[1] * cos - point[0] * sin
        jacobian = np.array([[1.0, -lever], [0.0, 1.0]])
        moved: Floats = jacobian @ self.covariance @ jacobian.T
        return self.rho - point[0] * cos - point[1] * sin, moved


def fit_line(points: ArrayLike, covariance: ArrayLike) -> WallLine:
    r"""The line through points that have errors in both coordinates.

    Parameters
    ----------
    points : (n, 2) array_like [m]
        Two different places at least; the line is in their frame.
    covariance : float [m] or (n, 2, 2) array_like [m²]
        One standard deviation for both coordinates of all points, or the covariance of each point,
        independent of the others. A point's weight is one over the trace of its covariance.

    Returns
    -------
    WallLine

    Raises
    ------
    ValueError
        A wrong shape, a value that is not finite, a covariance that is negative or 0 for some
        points only, points without a direction: all at one place, or spread evenly to all sides.

    Notes
    -----
    Minimises :math:`\sum w_i (x_i \cos\alpha + y_i \sin\alpha - \rho)^2` (thesis fig. 4.9;
    Arras and Siegwart 1998). With the weighted mean :math:`\bar x, \bar y` and
    :math:`\tan 2\alpha = N/D`, :math:`N = -2 \sum w_i (x_i-\bar x)(y_i-\bar y)`,
    :math:`D = \sum w_i [(y_i-\bar y)^2 - (x_i-\bar x)^2]`,

    .. math::
        d\alpha &= (D\,dN - N\,dD) / 2 (N^2 + D^2) \\
        d\rho &= \cos\alpha\,d\bar x + \sin\alpha\,d\bar y
                 + (\bar y \cos\alpha - \bar x \sin\alpha)\,d\alpha

    carry the points' covariances over to first order.

    Examples
    --------
    >>> line = fit_line([[5.0, 0.0], [5.0, 2.0]], 0.1)
    >>> line.rho, line.alpha, line.end
    (5.0, 0.0, (5.0, 2.0))
    """
    places = np.asarray(points, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 2 or not np.isfinite(places).all():
        raise ValueError(f"points: expected finite numbers (n, 2), got {places.shape}")
    spreads = _spreads(covariance, len(places))
    traces = np.trace(spreads, axis1=1, axis2=2)
    weights = 1.0 / traces if traces.any() else np.ones(len(places))
    weights /= weights.sum()
    mean = weights @ places
    x, y = (places - mean).T
    n, d = 0.0 - 2.0 * float(weights @ (x * y)), float(weights @ (y * y - x * x))
    if math.hypot(n, d) <= 1e-12 * float(weights @ (x * x + y * y)) or len(places) < 2:
        raise ValueError("points: expected places along a line, got no direction")
    alpha = 0.5 * math.atan2(n, d)
    if mean[0] * math.cos(alpha) + mean[1] * math.sin(alpha) < 0.0:
        alpha = wrap(alpha + math.pi)
    normal = np.array((math.cos(alpha), math.sin(alpha)))
    tangent = np.array((-normal[1], normal[0]))
    rho = max(float(mean @ normal), 0.0)  # rounding may take it just below
    # Derivatives by both coordinates of every point, (n, 2).
    by_n = -2.0 * np.column_stack((y, x))
    by_d = 2.0 * np.column_stack((-x, y))
    by_alpha = weights[:, None] * (d * by_n - n * by_d) / (2.0 * (n * n + d * d))
    by_rho = weights[:, None] * normal + float(mean @ tangent) * by_alpha
    jacobian = np.stack((by_rho, by_alpha), axis=1)
    total: Floats = np.einsum("nij,njk,nlk->il", jacobian, spreads, jacobian)
    along = places @ tangent
    backwards = bool(along[-1] < along[0])
    first, last = sorted((float(along.min()), float(along.max())), reverse=backwards)
    start, end = (rho * normal + way * tangent for way in (first, last))
    return WallLine(rho, alpha, total, _point(start), _point(end), len(places))


def fit_walls(scan: LidarScan, *, gap: float = 2.0, fewest: int = 5) -> list[WallLine]:
    """The straight walls in a scan: split and merge.

    The returns, in the order of their bearing from the scan's pose, are parted where neighbours are
    too far from each other to be of one wall, then at corners: as long as the returns are farther
    off their line than the noise of their ranges explains, one of them or all together, at the
    return that is farthest from the chord. Neighbouring lines that one line would serve as well are
    joined again, and the returns at a corner go to the nearer line.

    Parameters
    ----------
    scan : LidarScan
        One fan, or what `join_scans` gathered.
    gap : float [m]
        Neighbours farther apart than this, and than what beams that meet the wall at 15 degrees
        would be, belong to different walls; greater than 0.
    fewest : int
        Lines with fewer returns are dropped, and those hardly longer than the noise; at least 3.

    Returns
    -------
    list of WallLine
        East-north from the scenario's origin, from right to left as the aircraft sees them.

    Raises
    ------
    ValueError
        `gap` or `fewest` out of range.
    """
    if not gap > 0.0 or fewest < 3:
        raise ValueError(f"gap = {gap}, fewest = {fewest}: expected above 0 m, and at least 3")
    points, directions = scan.points(), scan.directions()[scan.returned]
    off = points - (scan.pose.x, scan.pose.y)
    bearing = wrap_array(np.arctan2(off[:, 1], off[:, 0]) - scan.pose.heading)
    order = np.argsort(bearing, kind="stable")
    points, directions = points[order], directions[order]
    spreads = scan.sigma**2 * directions[:, :, None] * directions[:, None, :]
    tolerance = 2.0 * _SIGMAS * math.hypot(scan.sigma, _ROUGH)
    reach = np.hypot(off[:, 0], off[:, 1])[order]
    lines = []
    for a, b in _clusters(points, bearing[order], reach, gap + tolerance):
        cluster = points[a:b], directions[a:b], scan.sigma
        cuts = _cornered(points[a:b], _merged(*cluster, _split(*cluster)))
        for first, last in pairwise(cuts):
            piece = slice(a + first, a + last)
            # A pole, however often it is met, has no direction.
            long = np.ptp(points[piece], axis=0).max() > tolerance
            if last - first >= fewest and long:
                lines.append(fit_line(points[piece], spreads[piece]))
    return lines


def join_scans(scans: Sequence[LidarScan]) -> LidarScan:
    """Several scans of one aircraft as one, held against its last pose.

    Parameters
    ----------
    scans : sequence of LidarScan
        One at least, oldest first.

    Returns
    -------
    LidarScan
        Each beam with its own origin; the time and the pose of the last scan, and the largest
        sigma.

    Raises
    ------
    ValueError
        No scan.
    """
    if not scans:
        raise ValueError("scans: expected one at least")
    last = scans[-1]
    angles = [scan.angles + (scan.pose.heading - last.pose.heading) for scan in scans]
    return LidarScan(
        last.time,
        last.pose,
        wrap_array(np.concatenate(angles)),
        np.concatenate([scan.ranges for scan in scans]),
        max(scan.sigma for scan in scans),
        np.concatenate([scan.origins for scan in scans]),
    )


def _spreads(covariance: ArrayLike, n: int) -> Floats:
    """(n, 2, 2) checked covariances of points."""
    given = np.asarray(covariance, dtype=np.float64)
    spreads = np.broadcast_to(given**2 * np.eye(2), (n, 2, 2)) if given.ndim == 0 else given
    if spreads.shape != (n, 2, 2) or not np.isfinite(spreads).all() or (given < 0.0).all():
        raise ValueError(
            f"covariance: expected a deviation of at least 0, or finite ({n}, 2, 2), "
            f"got {given if given.ndim == 0 else given.shape}"
        )
    traces = np.trace(spreads, axis1=1, axis2=2)
    if (traces <= 0.0).any() and (traces != 0.0).any():
        raise ValueError("covariance: expected all traces above 0, or all of them 0")
    return spreads


def _point(place: Floats) -> Point:
    return float(place[0]), float(place[1])


def _clusters(points: Floats, bearing: Floats, reach: Floats, gap: float) -> list[tuple[int, int]]:
    """Ranges of neighbours that may be of one wall.

    Two returns of one wall, an angle apart, that meet it at an angle of 15 degrees or more, are at
    most ``reach angle / sin(15°)`` apart. An angle much wider than is usual here is a hole.
    """
    if len(points) == 0:
        return []
    apart = np.diff(bearing)
    usual = np.minimum(apart, 1.5 * float(np.median(apart)) if len(apart) else 0.0)
    far = np.maximum(gap, np.minimum(reach[1:], reach[:-1]) * usual / math.sin(_GRAZING))
    steps = np.hypot(*np.diff(points, axis=0).T)
    ends = [0, *(np.flatnonzero(steps > far) + 1).tolist(), len(points)]
    return list(pairwise(ends))


def _through(points: Floats) -> tuple[Floats, Floats]:
    """The mean, and the unit normal of the line through it, by total least squares."""
    mean = points.mean(axis=0)
    x, y = (points - mean).T
    alpha = 0.5 * math.atan2(-2.0 * float(x @ y), float(y @ y - x @ x))
    return mean, np.array((math.cos(alpha), math.sin(alpha)))


def _straight(points: Floats, beams: Floats, sigma: float) -> bool:
    """Whether the noise along the beams explains how far the points are off one line."""
    mean, normal = _through(points)
    squares = ((points - mean) @ normal) ** 2 / ((sigma * (beams @ normal)) ** 2 + _ROUGH**2)
    free = max(len(points) - 2, 1)
    # The quantile of chi-squared by Wilson and Hilferty.
    most = free * (1.0 - 2.0 / (9.0 * free) + _SURE * math.sqrt(2.0 / (9.0 * free))) ** 3
    return bool(squares.max() <= _SIGMAS**2 and squares.sum() <= most)


def _split(points: Floats, beams: Floats, sigma: float) -> list[int]:
    """Cuts, both ends included, between which the points are straight."""
    cuts, todo = {0, len(points)}, [(0, len(points))]
    while todo:
        a, b = todo.pop()
        if b - a < 3 or _straight(points[a:b], beams[a:b], sigma):
            continue
        chord = points[b - 1] - points[a]
        off = points[a + 1 : b - 1] - points[a]
        # From the first point itself where the last one is at the same place.
        aside = np.abs(off[:, 0] * chord[1] - off[:, 1] * chord[0])
        k = a + 1 + int(np.argmax(aside if chord.any() else np.hypot(off[:, 0], off[:, 1])))
        cuts.add(k)
        todo += [(a, k), (k, b)]
    return sorted(cuts)


def _merged(points: Floats, beams: Floats, sigma: float, cuts: list[int]) -> list[int]:
    """The cuts without those that one line needs not."""
    kept = cuts[:1]
    for cut, after in pairwise(cuts[1:]):
        both = slice(kept[-1], after)
        if not _straight(points[both], beams[both], sigma):
            kept.append(cut)
    return [*kept, cuts[-1]]


def _cornered(points: Floats, cuts: list[int]) -> list[int]:
    """The cuts moved to where the lines on both sides meet."""
    moved = list(cuts)
    for i in range(1, len(cuts) - 1):
        a, k, b = moved[i - 1], moved[i], moved[i + 1]
        if min(k - a, b - k) < 3:
            continue
        # The cut's own neighbours may be on the wrong side: lines without them.
        before, after = _through(points[a : k - 1]), _through(points[k + 1 : b])
        # Positive where the line after the corner is nearer.
        nearer = np.abs((points[a:b] - before[0]) @ before[1])
        nearer -= np.abs((points[a:b] - after[0]) @ after[1])
        while k - a > 2 and nearer[k - 1 - a] > 0.0:
            k -= 1
        while b - k > 2 and nearer[k - a] < 0.0:
            k += 1
        moved[i] = k
    return moved
