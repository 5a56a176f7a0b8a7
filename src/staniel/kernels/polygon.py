"""Is a point inside a polygon? By counting the edges that a ray to the east crosses."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["in_polygon", "inside_polygon", "warm"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@njit(cache=True, error_model="numpy")
def in_polygon(polygon: Floats, x: float, y: float) -> bool:
    r"""Whether a point is inside a polygon, thesis figure 4.6 with every case decided.

    Parameters
    ----------
    polygon : (k, 2) float array [m]
        Corners in either sense, the first not repeated; need not be convex. Fewer than 3: nothing
        is inside. Of one that crosses itself, what is enclosed an odd number of times is inside.
    x, y : float [m]

    Returns
    -------
    bool
        On the boundary a point is where its neighbour slightly east, and by far less north, is:
        inside on a west or south side, outside on an east or north one. So of polygons that tile
        a plane exactly one holds each point.

    Notes
    -----
    An edge is crossed if one end is above y and the other is not, and the point is strictly west of
    it. Ends are taken from south to north, so that an edge that two polygons share is judged from
    the same rounded numbers in both.
    """
    odd = False
    k = polygon.shape[0]
    x0, y0 = (polygon[k - 1, 0], polygon[k - 1, 1]) if k else (0.0, 0.0)
    for i in range(k):
        x1, y1 = polygon[i, 0], polygon[i, 1]
        if (y0 <= y) != (y1 <= y):
            if y0 < y1:
                left = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
            else:
                left = (x0 - x1) * (y - y1) - (y0 - y1) * (x - x1)
            if left > 0.0:
                odd = not odd
        x0, y0 = x1, y1
    return odd


@njit(cache=True, error_model="numpy")
def inside_polygon(polygon: Floats, points: Floats) -> Bools:
    """Which points are inside a polygon, by the rule of `in_polygon`.

    Parameters
    ----------
    polygon : (k, 2) float array [m]
    points : (m, 2) float array [m]

    Returns
    -------
    (m,) bool array
    """
    m = points.shape[0]
    inside = np.zeros(m, dtype=np.bool_)
    for i in range(m):
        inside[i] = in_polygon(polygon, points[i, 0], points[i, 1])
    return inside


def warm() -> None:
    """Compile, or load from the disk cache, what this module is called with."""
    inside_polygon(np.zeros((3, 2)), np.zeros((1, 2)))
