"""The footprint of a camera on the ground: the conic, and the polygon within range."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.city.conic import ConicKind, classify, ellipse_moments, ground_conic, moved
from staniel.datatypes.belief import Pose
from staniel.kernels.footprint import camera_axis

__all__ = ["Footprint", "footprint", "footprint_polygon"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """Where a camera's cone meets level ground.

    Attributes
    ----------
    kind : {"ellipse", "parabola", "hyperbola", "none"}
        Of the cone's own edge on the ground, whatever the range; "none" where the cone does not
        reach the ground at all.
    conic : (3, 3) float array
        Symmetric; with p = (east, north, 1) [m], p' conic p is 0 on the cone's edge and greater
        inside. Of a hyperbola only the branch before the camera counts.
    polygon : (k, 2) float array [m]
        Boundary of the ground in the closed cone and within slant range, east and north, convex,
        counter-clockwise, the first not repeated; (0, 2) where there is none.
    mean : (2,) float array [m], or None
        Centre of an ellipse, clipped by the range or not; None for any other kind.
    covariance : (2, 2) float array [m²], or None
        Of an ellipse: its half axes are the square roots of the eigenvalues.
    """

    kind: ConicKind
    conic: Floats
    polygon: Floats
    mean: Floats | None
    covariance: Floats | None


def footprint(
    pose: Pose,
    half_aperture: float,
    range_: float,
    *,
    height: float = 0.0,
    axis: ArrayLike | None = None,
    points: int = 64,
) -> Footprint:
    r"""Where a camera's cone meets the ground, as a conic and as a polygon.

    Parameters
    ----------
    pose : Pose
        Of the camera.
    half_aperture : float [rad]
        In (0, pi/2).
    range_ : float [m]
        Greatest slant range, greater than 0.
    height : float [m]
        Of the level on which it is wanted, such as that at which vehicles are seen.
    axis : (3,) array_like, optional
        Direction in which the camera looks, of any length; that of a camera fixed in the belly if
        not given.
    points : int
        Corners of the polygon, at least 3.

    Returns
    -------
    Footprint

    Raises
    ------
    ValueError
        A value out of its range, or not finite.

    Notes
    -----
    Thesis eq. 4.2 to 4.19 (corrected). All algebra is done around the point straight below the
    camera, where rounding is least.

    Examples
    --------
    A 30° bank of a camera with 60° half-aperture: one edge of the cone is level.

    >>> pose = Pose(0.0, 0.0, 80.0, 0.0, math.radians(30.0), 15.0)
    >>> footprint(pose, math.radians(60.0), 250.0).kind
    'parabola'
    """
    _check(pose, half_aperture, range_, height, points)
    direction = np.array(camera_axis(pose.heading, pose.bank)) if axis is None else _unit(axis)
    depth = pose.z - height
    local = ground_conic((0.0, 0.0, depth), direction, half_aperture)
    tilt = math.atan2(math.hypot(direction[0], direction[1]), -direction[2])
    reaches = depth > 0.0 and tilt - half_aperture < 0.5 * math.pi
    kind = classify(local) if reaches else "none"
    mean = covariance = None
    if kind == "ellipse":
        centre, covariance = ellipse_moments(local)
        mean = centre + np.array([pose.x, pose.y])
    above = pose._replace(z=depth)
    polygon = footprint_polygon(
        above, half_aperture, range_, points, None if axis is None else direction
    )
    return Footprint(kind, moved(local, pose.x, pose.y), polygon, mean, covariance)


def footprint_polygon(
    pose: Pose,
    half_aperture: float,
    range_: float,
    points: int = 64,
    axis: Floats | None = None,
) -> Floats:
    r"""Boundary of the ground that is in the camera's closed cone and within its slant range.

    An ellipse, or, where the cone or the range reaches its end, a conic section clipped by a circle
    around the point straight below. Buildings do not enter. Checks nothing.

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
    axis : (3,) float array, optional
        Unit vector along which the camera looks, of NaN for one that sees nothing; that of a camera
        fixed in the belly if not given.

    Returns
    -------
    (points, 2) float array [m]
        East and north, convex, counter-clockwise, the first not repeated; every corner on the
        boundary. (0, 2) where the camera sees no ground.

    Notes
    -----
    From a point c inside, in the middle of the plane of symmetry, a ray c + t u leaves the cone
    where :math:`(v \cdot a)^2 = \cos^2\alpha\, |v|^2` with v from the camera and a its axis, and
    the range where :math:`|v|^2 = r^2`; the nearer of the two is the boundary. Solved on the cone
    itself, it needs no case for a hyperbola. For an ellipse within range these are the corners of
    thesis eq. 4.19 (corrected), begun a quarter turn left of where the camera swings.

    Examples
    --------
    Level flight at 50 m with 45°: a circle of radius 50 m.

    >>> corners = footprint_polygon(Pose(0.0, 0.0, 50.0, 0.0, 0.0, 15.0), math.radians(45.0), 200.0)
    >>> bool(np.allclose(np.hypot(corners[:, 0], corners[:, 1]), 50.0))
    True
    """
    depth = pose.z
    if not 0.0 < depth <= range_:
        return np.zeros((0, 2))
    # The axis' angle from straight down, positive towards the level unit vector `across`.
    if axis is None:
        axis = np.array(camera_axis(pose.heading, pose.bank))
        tilt, across = pose.bank, np.array([math.sin(pose.heading), -math.cos(pose.heading)])
    else:
        aside = math.hypot(axis[0], axis[1])
        tilt = math.atan2(aside, -axis[2])
        across = axis[:2] / aside if aside > 0.0 else np.array([1.0, 0.0])
    # Angles from straight down in the plane of symmetry.
    end = math.acos(depth / range_)
    low, high = max(tilt - half_aperture, -end), min(tilt + half_aperture, end)
    if not low < high:
        return np.zeros((0, 2))
    near, far = depth * math.tan(low), depth * math.tan(high)
    ahead = np.array([-across[1], across[0]])
    middle = np.append(0.5 * (near + far) * across, -depth)
    cosine2 = math.cos(half_aperture) ** 2
    width = _exits(middle, ahead[None], axis, cosine2, range_)[0]
    # Directions of evenly spaced points on an ellipse of about the footprint's proportions.
    turn = np.arange(points) * (2.0 * math.pi / points)
    rays = np.outer(width * np.cos(turn), ahead)
    rays -= np.outer(0.5 * (far - near) * np.sin(turn), across)
    rays /= np.hypot(rays[:, 0], rays[:, 1])[:, None]
    ways = _exits(middle, rays, axis, cosine2, range_)
    return np.asarray(np.array([pose.x, pose.y]) + middle[:2] + ways[:, None] * rays)


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


def _unit(axis: ArrayLike) -> Floats:
    """The direction as a unit vector, or a ValueError."""
    direction = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(direction))
    if direction.shape != (3,) or not 0.0 < length < math.inf:
        raise ValueError(f"axis must be 3 finite numbers that are not all 0, got {axis!r}")
    return np.asarray(direction / length)


def _check(pose: Pose, half_aperture: float, range_: float, height: float, points: int) -> None:
    if not all(map(math.isfinite, pose)):
        raise ValueError(f"pose must be finite, got {pose!r}")
    if not 0.0 < half_aperture < 0.5 * math.pi:
        raise ValueError(f"half_aperture must be in (0, pi/2) rad, got {half_aperture!r}")
    if not 0.0 < range_ < math.inf:
        raise ValueError(f"range_ must be finite and greater than 0 m, got {range_!r}")
    if not math.isfinite(height):
        raise ValueError(f"height must be finite, got {height!r}")
    if points < 3:
        raise ValueError(f"points must be at least 3, got {points!r}")
