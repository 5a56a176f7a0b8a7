r"""Rounding the corners of a route: arcs tangent to both legs, and what where they do not fit.

Thesis 5.4.1, east-north-up, in the plane. The angle between two legs is taken from the turn, which
is exact where the arc cosine of eq. 5.39 is not: :math:`\varrho = \pi - |\theta|`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.datatypes.checks import checked_places, checked_positive

__all__ = [
    "Fillet",
    "checked_route",
    "fillet",
    "fillet_radii",
    "filleted_length",
    "route_length",
    "turns",
]

Floats = NDArray[np.float64]
Point = tuple[float, float]

_STRAIGHT = 1e-6  # a smaller turn [rad] is none, and a greater one than pi less this a reversal
_APART = 1e-3  # of consecutive waypoints, at least [m]


class Fillet(NamedTuple):
    """An arc that replaces a corner.

    Attributes
    ----------
    center : (float, float) [m]
    radius : float [m]
    turn : {+1, -1}
        +1 counter-clockwise.
    entry, exit : (float, float) [m]
        Where it touches the leg before the corner and the one after it.
    sweep : float [rad]
        Angle that is turned, in (0, pi).
    """

    center: Point
    radius: float
    turn: int
    entry: Point
    exit: Point
    sweep: float


def fillet(before: ArrayLike, corner: ArrayLike, after: ArrayLike, radius: float) -> Fillet | None:
    r"""The arc of a radius that is tangent to both legs of a corner.

    Parameters
    ----------
    before, corner, after : (2,) array_like [m]
        Three consecutive waypoints. Legs are taken to be long enough.
    radius : float [m]
        Greater than 0.

    Returns
    -------
    Fillet or None
        None where the legs are in line or reverse: there is nothing to round.

    Raises
    ------
    ValueError
        Waypoints that coincide or are not finite, a radius that is not positive.

    Notes
    -----
    Thesis eq. 5.39-5.42 (corrected): with :math:`\varrho` the angle between the legs,

    .. math::
        c &= w_i - \frac{R}{\sin(\varrho/2)} \frac{q_{i-1} - q_i}{\|q_{i-1} - q_i\|} \\
        r_1 &= w_i - \frac{R}{\tan(\varrho/2)} q_{i-1}, \quad
        r_2 = w_i + \frac{R}{\tan(\varrho/2)} q_i

    Examples
    --------
    A corner to the north:

    >>> arc = fillet([0.0, 0.0], [100.0, 0.0], [100.0, 100.0], 40.0)
    >>> np.round([arc.center, arc.entry, arc.exit], 6).tolist(), arc.turn
    ([[60.0, 40.0], [60.0, 0.0], [100.0, 40.0]], 1)
    """
    points = checked_route(np.array([before, corner, after], dtype=np.float64))
    radius = checked_positive(radius, "radius")
    theta = float(turns(points)[0])
    sweep = abs(theta)
    if not _STRAIGHT < sweep < math.pi - _STRAIGHT:
        return None
    q0, q1 = _directions(points)
    reach = radius * math.tan(0.5 * sweep)  # R / tan(varrho/2)
    inward = (q1 - q0) / math.hypot(*(q1 - q0))
    center = points[1] + radius / math.cos(0.5 * sweep) * inward
    entry, leave = points[1] - reach * q0, points[1] + reach * q1
    turn = 1 if theta > 0.0 else -1
    return Fillet(_point(center), radius, turn, _point(entry), _point(leave), sweep)


def fillet_radii(waypoints: ArrayLike, radius: float, min_radius: float) -> Floats:
    """Radius of the fillet at each inner waypoint, where legs may be too short for all of them.

    A leg that is too short for the two fillets at its ends shrinks both by the same factor. A
    radius that would have to be less than `min_radius` is given up: that waypoint is flown over,
    which leaves the leg to the other one. Of several the one that needs most room for its radius
    goes first, and then the rest are fitted anew.

    Parameters
    ----------
    waypoints : (n, 2) array_like [m]
        At least 2.
    radius : float [m]
        Wanted, at least `min_radius`.
    min_radius : float [m]
        Tightest that can be flown, greater than 0.

    Returns
    -------
    (n - 2,) float array [m]
        In [`min_radius`, `radius`], or 0 where there is no fillet: legs in line, a reversal, or a
        corner that is flown over.

    Raises
    ------
    ValueError
        Fewer than two waypoints, consecutive ones that coincide, a value that is not finite, a
        radius that is too small.

    Examples
    --------
    Legs of 300, 60 and 300 m with two corners of 90 degrees:

    >>> route = [[0.0, 0.0], [300.0, 0.0], [300.0, 60.0], [0.0, 60.0]]
    >>> fillet_radii(route, 50.0, 20.0), fillet_radii(route, 50.0, 40.0)
    (array([30., 30.]), array([ 0., 50.]))
    """
    points = checked_route(waypoints)
    least = checked_positive(min_radius, "min_radius")
    wanted = checked_positive(radius, "radius")
    if wanted < least:
        raise ValueError(f"radius = {wanted:g} m: expected at least min_radius = {least:g} m")
    legs = np.hypot(*np.diff(points, axis=0).T)
    sweeps = np.abs(turns(points))
    # Length that a fillet of the wanted radius takes of each of its legs; none at the ends.
    reach = np.zeros(len(points))
    reach[1:-1] = wanted * np.tan(0.5 * np.minimum(sweeps, math.pi - _STRAIGHT))
    reach[1:-1][(sweeps <= _STRAIGHT) | (sweeps >= math.pi - _STRAIGHT)] = 0.0
    while True:
        room = np.ones(len(legs))
        needed = reach[:-1] + reach[1:]
        np.divide(legs, needed, out=room, where=needed > legs)
        share = np.minimum(room[:-1], room[1:])
        tight = (reach[1:-1] > 0.0) & (wanted * share < least * (1.0 - 1e-12))
        if not tight.any():
            break
        reach[1 + int(np.argmax(np.where(tight, reach[1:-1], 0.0)))] = 0.0
    return np.where(reach[1:-1] > 0.0, wanted * share, 0.0)


def route_length(waypoints: ArrayLike) -> float:
    """Length of the straight legs from waypoint to waypoint [m] (thesis eq. 5.43).

    Raises
    ------
    ValueError
        Fewer than two waypoints, consecutive ones that coincide, a value that is not finite.

    Examples
    --------
    >>> route_length([[0.0, 0.0], [30.0, 40.0], [30.0, 140.0]])
    150.0
    """
    return float(np.hypot(*np.diff(checked_route(waypoints), axis=0).T).sum())


def filleted_length(waypoints: ArrayLike, radii: ArrayLike) -> float:
    r"""Length of a route whose corners are rounded (thesis eq. 5.44, corrected).

    Parameters
    ----------
    waypoints : (n, 2) array_like [m]
    radii : (n - 2,) array_like [m]
        As `fillet_radii` gives them; 0 is a corner that stays.

    Returns
    -------
    float [m]

    Raises
    ------
    ValueError
        As `route_length`; not one radius an inner waypoint, or a negative one.

    Notes
    -----
    :math:`W + \sum_i R_i(\pi - \varrho_i) - 2R_i/\tan(\varrho_i/2)` over the inner waypoints.

    Examples
    --------
    >>> route = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]]
    >>> round(filleted_length(route, [40.0]) - (60.0 + 20.0 * np.pi + 60.0), 9)
    0.0
    """
    points = checked_route(waypoints)
    rounded = np.asarray(radii, dtype=np.float64)
    if rounded.shape != (len(points) - 2,) or not (rounded >= 0.0).all():
        raise ValueError(f"radii = {rounded.tolist()}: expected {len(points) - 2}, none negative")
    sweeps = np.where(rounded > 0.0, np.abs(turns(points)), 0.0)
    saved = float((rounded * (sweeps - 2.0 * np.tan(0.5 * sweeps))).sum())
    return route_length(points) + saved


def turns(points: Floats) -> Floats:
    """Turn at each inner waypoint of (n, 2) checked ones [rad], in [-pi, pi], left positive."""
    q = _directions(points)
    cross = q[:-1, 0] * q[1:, 1] - q[:-1, 1] * q[1:, 0]
    angles: Floats = np.arctan2(cross, (q[:-1] * q[1:]).sum(axis=1))
    return angles


def checked_route(waypoints: ArrayLike) -> Floats:
    """Waypoints as an (n, 2) array.

    Raises
    ------
    ValueError
        Another shape, a value that is not finite, fewer than two, consecutive ones that are less
        than 1 mm apart.
    """
    points = checked_places(waypoints, "waypoints")
    if len(points) < 2:
        raise ValueError(f"waypoints: got {len(points)}, expected at least 2")
    near = np.hypot(*np.diff(points, axis=0).T) < _APART
    if near.any():
        first = int(np.argmax(near))
        raise ValueError(
            f"waypoints[{first}] and waypoints[{first + 1}] coincide at "
            f"{points[first].tolist()}: expected them at least {_APART:g} m apart"
        )
    return points


def _directions(points: Floats) -> Floats:
    """Unit vectors along the legs, (n - 1, 2)."""
    legs = np.diff(points, axis=0)
    units: Floats = legs / np.hypot(legs[:, 0], legs[:, 1])[:, None]
    return units


def _point(place: Floats) -> Point:
    return float(place[0]), float(place[1])
