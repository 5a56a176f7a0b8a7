"""What threats mean at a place: how near a region is, what is inside it, how surely one is reached.

The sensor's draws are here, too: each named by a key, the aircraft, the tick and the danger.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.polygon import in_polygon
from staniel.kernels.random import fold, uniform
from staniel.kernels.risk import Regions

__all__ = ["inside_regions", "is_near", "nearest_points", "reach_chances", "sensor_draws", "warm"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]

_DRAWS = 3  # counters of each danger: one for noticing it, two for the noise
_SMALLEST = 1e-6  # a variance below this is taken for it: a millimetre [m²]
_FAR = 6.0  # standard deviations beyond which a Gaussian has no mass: below 1e-8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # on [-1, 1]


@njit(cache=True, error_model="numpy")
def _within(regions: Regions, k: int, x: float, y: float) -> bool:
    """Whether (x, y) is over the ground shape of region k."""
    radius, held = regions.disc[k, 2], False
    if radius > 0.0:
        dx, dy = x - regions.disc[k, 0], y - regions.disc[k, 1]
        held = dx * dx + dy * dy <= radius * radius
    else:
        held = in_polygon(regions.corners[regions.first[k] : regions.first[k + 1]], x, y)
    return held


@njit(cache=True, error_model="numpy")
def _nearest(regions: Regions, k: int, x: float, y: float) -> tuple[float, float]:
    """The point of region k's ground shape that is nearest to (x, y)."""
    if _within(regions, k, x, y):
        return x, y
    return _rim(regions, k, x, y)


@njit(cache=True, error_model="numpy")
def _rim(regions: Regions, k: int, x: float, y: float) -> tuple[float, float]:
    """The point of the outline of region k's ground shape that is nearest to (x, y)."""
    radius = regions.disc[k, 2]
    if radius > 0.0:
        cx, cy = regions.disc[k, 0], regions.disc[k, 1]
        away = math.hypot(x - cx, y - cy)
        if away == 0.0:
            return cx + radius, cy
        share = radius / away
        return cx + share * (x - cx), cy + share * (y - cy)
    corners = regions.corners[regions.first[k] : regions.first[k + 1]]
    n = corners.shape[0]
    least, best_x, best_y = math.inf, x, y
    px, py = corners[n - 1, 0], corners[n - 1, 1]
    for c in range(n):
        qx, qy = corners[c, 0], corners[c, 1]
        ex, ey = qx - px, qy - py
        square = ex * ex + ey * ey
        share = ((x - px) * ex + (y - py) * ey) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        nx, ny = px + share * ex, py + share * ey
        distance = (nx - x) ** 2 + (ny - y) ** 2
        if distance < least:
            least, best_x, best_y = distance, nx, ny
        px, py = qx, qy
    return best_x, best_y


@njit(cache=True, error_model="numpy")
def is_near(
    regions: Regions, k: int, x: float, y: float, z: float, margin: float, outside: bool
) -> bool:
    """Whether a place is in region k grown by a margin; or not in it shrunk by the margin.

    Parameters
    ----------
    regions : Regions
    k : int
    x, y, z : float [m]
    margin : float [m]
        Level distance; heights are grown, or shrunk, by as much.
    outside : bool
        What is asked for is the complement of the region.

    Returns
    -------
    bool
    """
    box = regions.box[k]
    grown = -margin if outside else margin
    held = box[4] - grown <= z <= box[5] + grown
    held = held and box[0] - grown <= x <= box[1] + grown and box[2] - grown <= y <= box[3] + grown
    if held:
        held = _within(regions, k, x, y)
        if held == outside:
            rim_x, rim_y = _rim(regions, k, x, y)
            near = (rim_x - x) ** 2 + (rim_y - y) ** 2 < margin * margin
            held = bool(held != near)
    return bool(held != outside)


@njit(cache=True, error_model="numpy")
def nearest_points(places: Floats, regions: Regions, reach: float) -> Floats:
    """The point of each region's volume that is nearest to each place, where that is in reach.

    Parameters
    ----------
    places : (n, 3) float array [m]
    regions : Regions
    reach : float [m]
        Greatest distance in space.

    Returns
    -------
    (n, r, 3) float array [m]
        The place itself where it is inside; NaN where no point of the volume is within `reach`.
    """
    n, r = places.shape[0], regions.box.shape[0]
    points = np.full((n, r, 3), np.nan)
    for i in range(n):
        x, y, z = places[i, 0], places[i, 1], places[i, 2]
        for k in range(r):
            box = regions.box[k]
            height = min(max(z, box[4]), box[5])
            aside = max(box[0] - x, x - box[1], 0.0)
            along = max(box[2] - y, y - box[3], 0.0)
            square = (height - z) ** 2
            if aside * aside + along * along + square > reach * reach:
                continue
            nx, ny = _nearest(regions, k, x, y)
            if (nx - x) ** 2 + (ny - y) ** 2 + square <= reach * reach:
                points[i, k, 0], points[i, k, 1], points[i, k, 2] = nx, ny, height
    return points


@njit(cache=True, error_model="numpy")
def inside_regions(places: Floats, regions: Regions) -> Bools:
    """(n, r) whether each place (n, 3) [m] is in the volume of each region."""
    n, r = places.shape[0], regions.box.shape[0]
    inside = np.zeros((n, r), dtype=np.bool_)
    for i in range(n):
        x, y, z = places[i, 0], places[i, 1], places[i, 2]
        for k in range(r):
            box = regions.box[k]
            if box[0] <= x <= box[1] and box[2] <= y <= box[3] and box[4] <= z <= box[5]:
                inside[i, k] = _within(regions, k, x, y)
    return inside


@njit(cache=True, error_model="numpy")
def _below(value: float) -> float:
    """Standard normal distribution function."""
    return 0.5 * math.erfc(-value / math.sqrt(2.0))


@njit(cache=True, error_model="numpy")
def _strips(
    first: float, last: float, x: float, y: float, narrow: float, wide: float, radius: float
) -> float:
    """What `_disc_mass` sums, between two angles of the strips."""
    middle, half = 0.5 * (first + last), 0.5 * (last - first)
    if half <= 0.0:
        return 0.0
    mass = 0.0
    for k in range(_NODES.shape[0]):
        angle = middle + half * _NODES[k]
        rim = radius * math.cos(angle)
        off = (radius * math.sin(angle) - x) / narrow
        strip = _below((rim - y) / wide) - _below((-rim - y) / wide)
        mass += _WEIGHTS[k] * rim * math.exp(-0.5 * off * off) * strip
    return half * mass / (narrow * math.sqrt(2.0 * math.pi))


@njit(cache=True, error_model="numpy")
def _disc_mass(x: float, y: float, narrow: float, wide: float, radius: float) -> float:
    """Mass within `radius` of the origin of a Gaussian at (x, y), standard deviations by axis.

    Over strips across the narrower axis x, at radius sin(angle), so that nothing is steep at the
    rim. The strips of the middle hold all of the Gaussian across, and those beyond hold nothing of
    it: only those between are summed.
    """
    low, high = max(-radius, x - _FAR * narrow), min(radius, x + _FAR * narrow)
    if low >= high:
        return 0.0
    first, last = math.asin(low / radius), math.asin(high / radius)
    full = math.acos(min(1.0, (abs(y) + _FAR * wide) / radius))
    empty = math.acos(min(1.0, max(0.0, (abs(y) - _FAR * wide) / radius)))
    mass = _strips(max(first, -empty), min(last, -full), x, y, narrow, wide, radius)
    mass += _strips(max(first, full), min(last, empty), x, y, narrow, wide, radius)
    west, east = max(low, -radius * math.sin(full)), min(high, radius * math.sin(full))
    if west < east:
        mass += _below((east - x) / narrow) - _below((west - x) / narrow)
    return min(1.0, mass)


@njit(cache=True, error_model="numpy")
def reach_chances(places: Floats, carriers: Floats) -> Floats:
    """Probability that each place is within the slant range of each carrier, whose place is unsure.

    Parameters
    ----------
    places : (n, 3) float array [m]
    carriers : (c, 6) float array
        Mean x, y [m] on the ground, covariance xx, xy, yy [m²] of a Gaussian, radius [m].

    Returns
    -------
    (n, c) float array
        The Gaussian's mass in the disc that the ball around the place cuts out of the ground,
        within 1e-6.
    """
    n, c = places.shape[0], carriers.shape[0]
    chances = np.zeros((n, c))
    for j in range(c):
        xx, xy, yy, radius = carriers[j, 2], carriers[j, 3], carriers[j, 4], carriers[j, 5]
        bend = math.hypot(0.5 * (xx - yy), xy)
        wide = math.sqrt(max(0.5 * (xx + yy) + bend, _SMALLEST))
        narrow = math.sqrt(max(0.5 * (xx + yy) - bend, _SMALLEST))
        turn = 0.5 * math.atan2(2.0 * xy, xx - yy)  # of the wider axis
        cosine, sine = math.cos(turn), math.sin(turn)
        for i in range(n):
            square = radius * radius - places[i, 2] * places[i, 2]
            if square <= 0.0:
                continue
            disc = math.sqrt(square)
            dx, dy = carriers[j, 0] - places[i, 0], carriers[j, 1] - places[i, 1]
            distance = math.hypot(dx, dy)
            if distance + _FAR * wide <= disc:
                chances[i, j] = 1.0
            elif distance - _FAR * wide < disc:
                along, across = dx * cosine + dy * sine, dy * cosine - dx * sine
                chances[i, j] = _disc_mass(across, along, narrow, wide, disc)
    return chances


@njit(cache=True, error_model="numpy")
def sensor_draws(key: np.uint64, tick: int, who: Indices, what: Indices) -> Floats:
    """Draws of aircraft `who` about dangers `what` in one tick.

    Parameters
    ----------
    key : uint64
    tick : int
    who, what : (m,) int array

    Returns
    -------
    (m, 3) float array
        A number uniform in [0, 1) and two standard normals (Box and Muller).
    """
    m = who.shape[0]
    draws = np.empty((m, 3))
    for k in range(m):
        stream = fold(fold(key, who[k]), tick)
        counter = _DRAWS * what[k]
        draws[k, 0] = uniform(stream, counter)
        size = math.sqrt(-2.0 * math.log(1.0 - uniform(stream, counter + 1)))
        angle = 2.0 * math.pi * uniform(stream, counter + 2)
        draws[k, 1], draws[k, 2] = size * math.cos(angle), size * math.sin(angle)
    return draws


def warm() -> None:
    """Compile, or load from the disk cache, what this module is called with."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    box = np.array([[0.0, 1.0, 0.0, 1.0, 0.0, np.inf]])
    regions = Regions(box, np.zeros((1, 3)), np.array([0, 4]), square)
    places, index = np.zeros((1, 3)), np.zeros(1, dtype=np.int64)
    nearest_points(places, regions, 1.0)
    inside_regions(places, regions)
    reach_chances(places, np.array([[0.0, 0.0, 1.0, 0.0, 1.0, 1.0]]))
    sensor_draws(np.uint64(0), 0, index, index)
