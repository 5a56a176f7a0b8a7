"""Dubins paths: the shortest ways from pose to pose with a least radius of turn."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from staniel.errors import StanielError
from staniel.kernels import dubins

__all__ = ["Paths", "Word", "shortest"]

Floats = NDArray[np.float64]


class Word(IntEnum):
    """The six words: turns to the left and right, and straights."""

    LSL = dubins.LSL
    RSR = dubins.RSR
    LSR = dubins.LSR
    RSL = dubins.RSL
    RLR = dubins.RLR
    LRL = dubins.LRL


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """n paths of three pieces each.

    Attributes
    ----------
    starts : (n, 3) or (1, 3) float array
        x, y [m], course [rad] of the starts, or of the one start of all paths.
    radius : float [m]
        Of every turn.
    length : (n,) float array [m]
    word : (n,) int8 array
        Values of `Word`: ``Word(paths.word[0]).name`` is "LSL" or another.
    segments : (n, 3) float array [m]
        Lengths of the pieces, in their order; that of a turn is the radius times the angle.
    """

    starts: Floats
    radius: float
    length: Floats
    word: NDArray[np.int8]
    segments: Floats

    def __len__(self) -> int:
        return len(self.length)

    def sample(self, at: ArrayLike) -> Floats:
        """Poses at given ways along the paths.

        Parameters
        ----------
        at : float, (k,) or (n, k) array_like [m]
            Ways from the start, at least 0, the same for all paths or a row for each. Beyond its
            end a path stays at its goal.

        Returns
        -------
        (n, k, 3) float array
            x, y [m], course in (-pi, pi]; (n, 3) for a single way.

        Raises
        ------
        StanielError
            A wrong shape, a way that is negative or not finite.
        """
        given = np.asarray(at, dtype=np.float64)
        ways = np.ascontiguousarray(np.atleast_2d(given))
        if ways.ndim != 2 or (given.ndim == 2 and len(ways) not in (1, len(self))):
            raise StanielError(
                f"at: expected a number, (k,) or ({len(self)}, k) numbers, got {given.shape}"
            )
        if not (np.isfinite(ways) & (ways >= 0.0)).all():
            raise StanielError("at: expected finite numbers of at least 0 m")
        poses = dubins.sample(self.starts, self.word, self.segments, self.radius, ways)
        return poses[:, 0] if given.ndim == 0 else poses

    def spaced(self, spacing: float) -> list[Floats]:
        """Poses along each path, evenly spaced, its start and its goal included.

        Parameters
        ----------
        spacing : float [m]
            At most so far from one to the next, along the path; greater than 0.

        Returns
        -------
        list of (k, 3) float arrays
            One for each path: x, y [m], course in (-pi, pi].

        Raises
        ------
        StanielError
            `spacing` not positive and finite.
        """
        if not 0.0 < spacing < math.inf:
            raise StanielError(f"spacing = {spacing}: expected a finite number above 0 m")
        poses = []
        for i in range(len(self)):
            ways = np.linspace(0.0, self.length[i], math.ceil(self.length[i] / spacing) + 1)
            own = slice(i, i + 1)
            start = self.starts[own] if len(self.starts) > 1 else self.starts
            path = start, self.word[own], self.segments[own]
            poses.append(dubins.sample(*path, self.radius, ways[None])[0])
        return poses


def shortest(starts: ArrayLike, goals: ArrayLike, radius: float) -> Paths:
    r"""Shortest paths of bounded curvature, of all six words.

    Parameters
    ----------
    starts, goals : (n, 3) or (3,) array_like
        x, y [m], course [rad] counter-clockwise from east; a single start serves all goals, a
        single goal all starts. Courses of any number of turns up to 1e6 rad.
    radius : float [m]
        Of the tightest turn, greater than 0.

    Returns
    -------
    Paths
        In the order of the pairs. Of words that are equally long the first of `Word`.

    Raises
    ------
    StanielError
        A wrong shape, a pose that is not finite, a course beyond 1e6 rad, a radius that is not
        positive and finite, poses so far apart that their distance in radii overflows.

    Notes
    -----
    Thesis eq. 5.45-5.64 (corrected). Lengths are exact for the numbers handed in, to a relative
    error of 1e-12 (a few 1e-15 is usual), with two exceptions that lie in the problem:

    - The shortest length jumps where a turn shrinks to nothing and reappears as a whole circle, or
      where a word ceases to exist. A path is taken to be on the short side of a jump if it then
      ends within 1e-13 (d + R |c| + R/50) of its goal, d the distance of the poses, c the
      difference of their courses, R the radius. So rounding in what is handed in, which puts the
      end of a quarter circle a hair inside of it, does not cost a circle.
    - Where RLR or LRL only just exist, their outer circles 4 R apart, length goes with the root
      of what is missing, and a rounding of 1e-16 becomes 1e-8.

    Examples
    --------
    Straight on; half a circle to the left; about face on the spot:

    >>> goals = [[100.0, 0.0, 0.0], [0.0, 60.0, np.pi], [0.0, 0.0, np.pi]]
    >>> paths = shortest([0.0, 0.0, 0.0], goals, radius=30.0)
    >>> [Word(word).name for word in paths.word]
    ['LSL', 'LSL', 'RLR']
    >>> paths.length / (np.pi * 30.0)
    array([1.06103295, 1.        , 2.33333333])
    >>> paths.sample(50.0)[0]
    array([50.,  0.,  0.])
    """
    if not 0.0 < radius < math.inf:
        raise StanielError(f"radius = {radius}: expected a finite number above 0 m")
    given = {"starts": _poses("starts", starts), "goals": _poses("goals", goals)}
    n = max(len(poses) for poses in given.values()) if all(map(len, given.values())) else 0
    if any(len(poses) not in (1, n) for poses in given.values()):
        raise StanielError(
            f"starts, goals: expected as many of each, or one, got {len(given['starts'])} and "
            f"{len(given['goals'])}"
        )
    first, last = given["starts"], given["goals"]
    if len(last) != n:
        last = np.repeat(last, n, axis=0)
    length, word, segments = dubins.shortest(first, last, float(radius))
    if not np.isfinite(length).all():
        raise StanielError(_fault(given, int(np.argmin(np.isfinite(length)))))
    return Paths(first, float(radius), length, word, segments)


def _poses(name: str, given: ArrayLike) -> Floats:
    """One pose or many as (n, 3)."""
    poses = np.ascontiguousarray(given, dtype=np.float64)
    if poses.shape[-1:] != (3,) or poses.ndim > 2:
        raise StanielError(f"{name}: expected (n, 3) or (3,) x, y, course, got {poses.shape}")
    return poses.reshape(-1, 3)


def _fault(given: dict[str, Floats], i: int) -> str:
    """Why pair i has no length."""
    for name, poses in given.items():
        k = i if len(poses) > 1 else 0
        pose = poses[k]
        if not np.isfinite(pose).all() or abs(pose[2]) > dubins.WIDEST:
            return (
                f"{name}[{k}] = {pose.tolist()}: expected finite x, y [m] and a course within "
                f"±{dubins.WIDEST:g} rad"
            )
    return f"starts, goals: pair {i} is too far apart to be measured in radii"
