"""The footprint of a body-fixed camera on the ground, as a polygon to draw."""

import math

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Pose
from staniel.kernels.footprint import camera_axis

__all__ = ["footprint_polygon"]

Floats = NDArray[np.float64]


def footprint_polygon(pose: Pose, half_aperture: float, range_: float, points: int = 64) -> Floats:
    r"""Boundary of the ground that is in the camera's closed cone and within its slant range.

    An ellipse, or, where the cone or the range reaches its end, a conic section clipped by a circle
    around the point straight below. Buildings do not enter.

    Parameters
    ----------
    pose : Pose
        Of the camera.
    half_aperture : float [rad]
        In (0, pi/2).
    range_ : float [m]
        Greatest slant range, greater than 0.
    points : int
        Corners of the polygon, at least 3.

    Returns
    -------
    (points, 2) float array [m]
        East and north, convex, counter-clockwise, the first not repeated; every corner on the
        boundary. (0, 2) where the camera sees no ground.

    Notes
    -----
    From a point c inside, in the middle of the plane of symmetry, a ray c + t u leaves the cone
    where :math:`(v \cdot a)^2 = \cos^2\alpha\, |v|^2` with v from the camera and a its axis, and
    the range where :math:`|v|^2 = r^2`; the nearer of the two is the boundary. Thesis eq. 4.2, 4.3
    and 4.10 to 4.19 (corrected): solved on the cone itself, it needs no case for a hyperbola.

    Examples
    --------
    Level flight at 50 m with 45°: a circle of radius 50 m.

    >>> corners = footprint_polygon(Pose(0.0, 0.0, 50.0, 0.0, 0.0, 15.0), math.radians(45.0), 200.0)
    >>> bool(np.allclose(np.hypot(corners[:, 0], corners[:, 1]), 50.0))
    True
    """
    bank, height = pose.bank, pose.z
    if not 0.0 < height <= range_:
        return np.zeros((0, 2))
    # Angles from straight down in the plane of symmetry, positive to the right.
    end = math.acos(height / range_)
    low, high = max(bank - half_aperture, -end), min(bank + half_aperture, end)
    if low >= high:
        return np.zeros((0, 2))
    near, far = height * math.tan(low), height * math.tan(high)
    right = np.array([math.sin(pose.heading), -math.cos(pose.heading)])
    forward = np.array([math.cos(pose.heading), math.sin(pose.heading)])
    axis = np.array(camera_axis(pose.heading, bank))
    middle = np.append(0.5 * (near + far) * right, -height)
    cosine2 = math.cos(half_aperture) ** 2
    width = _exits(middle, forward[None], axis, cosine2, range_)[0]
    # Directions of evenly spaced points on an ellipse of about the footprint's proportions.
    turn = np.arange(points) * (2.0 * math.pi / points)
    rays = np.outer(width * np.cos(turn), forward)
    rays -= np.outer(0.5 * (far - near) * np.sin(turn), right)
    rays /= np.hypot(rays[:, 0], rays[:, 1])[:, None]
    ways = _exits(middle, rays, axis, cosine2, range_)
    corners: Floats = np.array([pose.x, pose.y]) + middle[:2] + ways[:, None] * rays
    return corners


def _exits(middle: Floats, rays: Floats, axis: Floats, cosine2: float, range_: float) -> Floats:
    """(n,) ways from the inner point `middle` (from the camera) along (n, 2) unit rays."""
    along, slope = float(middle @ axis), rays @ axis[:2]
    lead = rays @ middle[:2]
    square = float(middle @ middle)
    # a t² + 2 b t + c = 0 with c >= 0 inside: the smallest positive root, if there is one.
    a, b = slope * slope - cosine2, slope * along - cosine2 * lead
    c = max(along * along - cosine2 * square, 0.0)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        cone = np.where(b < 0.0, c / (root - b), np.where(a < 0.0, -(b + root) / a, np.inf))
    ball = np.sqrt(np.maximum(lead * lead + range_ * range_ - square, 0.0)) - lead
    return np.asarray(np.minimum(cone, ball))
