"""Time that straight pieces of a path spend inside regions and near moving vehicles: exact."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Regions", "inside_times", "near_times", "warm"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


class Regions(NamedTuple):
    """Upright regions as arrays.

    Attributes
    ----------
    box : (r, 6) float array [m]
        West, east, south, north, floor, ceiling (may be infinite).
    disc : (r, 3) float array [m]
        Center and radius; radius 0 where the region is a polygon.
    first : (r + 1,) int array
        Region k has the corners ``first[k]:first[k + 1]``.
    corners : (c, 2) float array [m]
    """

    box: Floats
    disc: Floats
    first: Indices
    corners: Floats


@njit(cache=True, error_model="numpy")
def _within(start: float, way: float, low: float, high: float) -> tuple[float, float]:
    """Part [t0, t1] of [0, 1] in which low <= start + t way <= high; t0 > t1: none."""
    if way == 0.0:
        return (0.0, 1.0) if low <= start <= high else (1.0, 0.0)
    a, b = (low - start) / way, (high - start) / way
    return max(0.0, min(a, b)), min(1.0, max(a, b))


@njit(cache=True, error_model="numpy")
def _in_ball(
    x: float, y: float, z: float, dx: float, dy: float, dz: float, r: float
) -> tuple[float, float]:
    """Part [t0, t1] of [0, 1] in which |(x, y, z) + t (dx, dy, dz)| <= r; t0 > t1: none."""
    a = dx * dx + dy * dy + dz * dz
    c = x * x + y * y + z * z - r * r
    if a == 0.0:
        return (0.0, 1.0) if c <= 0.0 else (1.0, 0.0)
    b = x * dx + y * dy + z * dz
    root = b * b - a * c
    if root <= 0.0:
        return 1.0, 0.0
    half = math.sqrt(root)
    return max(0.0, (-b - half) / a), min(1.0, (-b + half) / a)


@njit(cache=True, error_model="numpy")
def _in_polygon(
    corners: Floats, x: float, y: float, dx: float, dy: float, t0: float, t1: float
) -> float:
    """Share of [t0, t1] in which (x, y) + t (dx, dy) lies inside a simple polygon.

    The winding number at t is the signed sum over the edges that cross the line beyond t; its
    integral is a sum of clipped lengths, one an edge, and needs no sorting of the crossings.
    """
    still = dx == 0.0 and dy == 0.0
    ux, uy = (1.0, 0.0) if still else (dx, dy)
    square = ux * ux + uy * uy
    total = 0.0
    n = corners.shape[0]
    px, py = corners[n - 1, 0] - x, corners[n - 1, 1] - y
    side = ux * py - uy * px
    along = (ux * px + uy * py) / square
    for k in range(n):
        qx, qy = corners[k, 0] - x, corners[k, 1] - y
        side_q = ux * qy - uy * qx
        along_q = (ux * qx + uy * qy) / square
        if (side >= 0.0) != (side_q >= 0.0):
            crossing = along + (along_q - along) * side / (side - side_q)
            sign = 1.0 if side_q >= 0.0 else -1.0
            if still:
                total += sign * (t1 - t0) if crossing > 0.0 else 0.0
            else:
                total += sign * min(max(crossing - t0, 0.0), t1 - t0)
        side, along = side_q, along_q
    return min(abs(total), t1 - t0)


@njit(cache=True, error_model="numpy")
def inside_times(path: Floats, step: float, regions: Regions) -> tuple[Floats, Indices]:
    """How long each aircraft is inside each region, and how often it comes in.

    Parameters
    ----------
    path : (s, n, 6) float array
        x, y, z [m] first: at s instants; straight and even between them. NaN: not in the air.
    step : float [s]
        Between two instants.
    regions : Regions

    Returns
    -------
    seconds : (n, r) float array [s]
        Exact for the straight pieces.
    entries : (n, r) int array
        Maximal runs of pieces that spend time inside: leaving and coming back within two
        neighbouring pieces is not told apart.
    """
    s, n = path.shape[0], path.shape[1]
    r = regions.box.shape[0]
    seconds = np.zeros((n, r))
    entries = np.zeros((n, r), dtype=np.int64)
    was = np.zeros((n, r), dtype=np.bool_)
    for k in range(s - 1):
        for i in range(n):
            x, y, z = path[k, i, 0], path[k, i, 1], path[k, i, 2]
            end_x, end_y, end_z = path[k + 1, i, 0], path[k + 1, i, 1], path[k + 1, i, 2]
            dx, dy, dz = end_x - x, end_y - y, end_z - z
            if math.isnan(dx):
                was[i] = False
                continue
            for j in range(r):
                box = regions.box[j]
                share = 0.0
                if (
                    min(x, end_x) <= box[1]
                    and max(x, end_x) >= box[0]
                    and min(y, end_y) <= box[3]
                    and max(y, end_y) >= box[2]
                ):
                    t0, t1 = _within(z, dz, box[4], box[5])
                    if t0 < t1 and regions.disc[j, 2] > 0.0:
                        rx, ry = x - regions.disc[j, 0], y - regions.disc[j, 1]
                        low, high = _in_ball(rx, ry, 0.0, dx, dy, 0.0, regions.disc[j, 2])
                        share = max(0.0, min(t1, high) - max(t0, low))
                    elif t0 < t1:
                        corners = regions.corners[regions.first[j] : regions.first[j + 1]]
                        share = _in_polygon(corners, x, y, dx, dy, t0, t1)
                if share > 0.0:
                    seconds[i, j] += share * step
                    entries[i, j] += not was[i, j]
                was[i, j] = share > 0.0
    return seconds, entries


@njit(cache=True, error_model="numpy")
def near_times(
    path: Floats, vehicles: Floats, carriers: Indices, radius: float, step: float
) -> Floats:
    """Vehicle-seconds that each aircraft spends within a slant range of carriers on the ground.

    Parameters
    ----------
    path : (s, n, 6) float array
        x, y, z [m] first.
    vehicles : (s, v, 4) float array
        x, y [m] first, at the same instants.
    carriers : (c,) int array
        Who of them counts.
    radius : float [m]
    step : float [s]

    Returns
    -------
    (n,) float array [s]
        Two carriers within range for one second are two; exact where both move straight.
    """
    s, n = path.shape[0], path.shape[1]
    seconds = np.zeros(n)
    for k in range(s - 1):
        for i in range(n):
            z, end_z = path[k, i, 2], path[k + 1, i, 2]
            if math.isnan(z + end_z) or min(z, end_z) > radius:
                continue
            for c in range(carriers.shape[0]):
                j = carriers[c]
                x = path[k, i, 0] - vehicles[k, j, 0]
                y = path[k, i, 1] - vehicles[k, j, 1]
                dx = path[k + 1, i, 0] - vehicles[k + 1, j, 0] - x
                dy = path[k + 1, i, 1] - vehicles[k + 1, j, 1] - y
                low, high = _in_ball(x, y, z, dx, dy, end_z - z, radius)
                seconds[i] += max(0.0, high - low) * step
    return seconds


def warm() -> None:
    """Compile, or load from the disk cache, what this module is called with."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    box = np.array([[0.0, 1.0, 0.0, 1.0, 0.0, np.inf]])
    regions = Regions(box, np.zeros((1, 3)), np.array([0, 4]), square)
    path = np.zeros((2, 1, 6))
    inside_times(path, 1.0, regions)
    near_times(path, np.zeros((2, 1, 4)), np.zeros(1, dtype=np.int64), 1.0, 1.0)
