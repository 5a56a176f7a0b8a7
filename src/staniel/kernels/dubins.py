"""Shortest paths of bounded curvature between many pairs of poses: the six Dubins words.

Thesis eq. 5.45-5.64 with the corrections (all six words, east-north-up). In units of the radius and
in the frame of the start, the goal is at (x, y) with the course d. The vector between the centers
of the two left circles is (x - sin d, y - 1 + cos d), of the two right ones (x + sin d,
y + 1 - cos d), and every word follows from these two: the straight of LSL is the first of them; the
centers of LSR are two radii farther down than those of the right circles; RLR has the triangle with
the sides 2, 2 and the distance of the right centers. RSR, RSL and LRL are their mirror images.

The pairs go in blocks through stages, each a loop over one `scratch` array without branches or
library calls, so that it runs on vectors. Three turns are tried for those pairs alone that they
could serve, or for the whole block where these are many.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.trigonometry import atan2, cosines, from_half_turns, from_turns

__all__ = [
    "LRL",
    "LSL",
    "LSR",
    "RLR",
    "RSL",
    "RSR",
    "SNAP",
    "WIDEST",
    "sample",
    "shortest",
    "shortest_length",
    "warm",
]

Floats = NDArray[np.float64]
Words = NDArray[np.int8]
Indices = NDArray[np.int64]

LSL, RSR, LSR, RSL, RLR, LRL = range(6)

SNAP = 1e-13
"""How far beside its goal a path may end, in units of distance plus the radius times the difference
of the courses: what is rounding makes no whole circle out of no turn, and no word impossible."""
_LEAST = 0.02  # ... and at least so much of it, in radii, for poses that are all but equal

WIDEST = 1e6
"""Courses beyond this are not reduced to a circle exactly enough [rad]."""

# Turns of the words: 1 to the left, -1 to the right.
_SIDES = np.array(
    [(1.0, 0.0, 1.0), (-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), (-1.0, 0.0, 1.0), (-1.0, 1.0, -1.0),
     (1.0, -1.0, 1.0)]
)  # fmt: skip

_PI, _TWO_PI, _QUARTER_PI = math.pi, 2.0 * math.pi, 0.25 * math.pi

_BLOCK = 256
# Rows of the scratch array. The poses:
_X0, _Y0, _COURSE0, _X1, _Y1, _COURSE1 = range(6)
# vectors, of which four are the headings of the straights of LSL, RSR, LSR and RSL;
_VECTOR_X, _VECTOR_Y = 6, 10
# straights of LSR and RSL, and what they are the square roots of;
_LSR, _RSL, _LSR_SQUARE, _RSL_SQUARE = range(14, 18)
# the goal's course, what is snapped, distances between the left and the right centers, angles of
# the four vectors, half the middle turns of LRL and RLR;
_TURN, _SLACK, _LEFT, _RIGHT, _ANGLE, _HALF = 18, 19, 20, 21, 22, 26
# the best word.
_BEST, _WORD, _FIRST, _MIDDLE, _LAST = range(28, 33)
_ROWS = 33


@njit(cache=True, error_model="numpy", forceinline=True)
def _turn(angle: float, arm: float, slack: float) -> float:
    """A turn in [0, 2 pi) from its angle in [-pi, 2 pi).

    Just below no turn at all it is none, if that moves what turns on an arm by less than slack.
    """
    short = max(-angle, 0.0)
    return angle + (short if short * arm <= slack else _TWO_PI)


@njit(cache=True, error_model="numpy", forceinline=True)
def _same_turns(
    angle: float, straight: float, total: float, slack: float
) -> tuple[float, float, float]:
    """LSL with the straight at an angle: its length, first and last turn."""
    first = _turn(angle, straight, slack)
    last = total - first
    over = max(-last, 0.0)
    fits = over * straight <= slack
    first -= over if fits else 0.0
    last += over if fits else _TWO_PI
    return first + straight + last, first, last


@njit(cache=True, error_model="numpy", forceinline=True)
def _opposite_turns(
    angle: float, straight: float, square: float, turn: float, slack: float
) -> tuple[float, float, float]:
    """LSR with the straight at an angle: its length, first and last turn."""
    arm = straight + 2.0
    first = _turn(angle, arm, slack)
    last = _turn(from_turns(angle - turn), arm, slack)
    # A square just below zero is rounding of zero: it moves the centers by a quarter of itself.
    exists = square >= -4.0 * slack
    return first + straight + last if exists else np.inf, first, last


@njit(cache=True, error_model="numpy", forceinline=True)
def _three_turns(
    angle: float, distance: float, half: float, turn: float, slack: float
) -> tuple[float, float, float]:
    """RLR with centers at a distance and a bearing, and half its middle turn: as above."""
    arm = distance + 2.0
    first = _turn(half - angle, arm, slack)
    last = _turn(half + from_turns(angle - turn), arm, slack)
    return np.inf if distance > 4.0 else first + 2.0 * half + last, first, last


@njit(cache=True, error_model="numpy")
def _gather(starts: Floats, goals: Floats, first: int, n: int, b: Floats) -> None:
    """Pairs of poses into columns; one start may serve all goals."""
    step = 1 if starts.shape[0] > 1 else 0
    for i in range(n):
        for k in range(3):
            b[_X0 + k, i] = starts[step * (first + i), k]
            b[_X1 + k, i] = goals[first + i, k]


@njit(cache=True, error_model="numpy")
def _centers(n: int, radius: float, b: Floats) -> None:
    """Vectors between the circles' centers in the frame of the start, in radii."""
    scale = 1.0 / radius
    for i in range(n):
        c0, c1 = b[_COURSE0, i], b[_COURSE1, i]
        half_turns, rest = from_half_turns(c0)
        cos, sin = cosines(rest)
        sign = scale - 2.0 * scale * (half_turns - 2.0 * np.floor(0.5 * half_turns))
        cos, sin = sign * cos, sign * sin
        dx, dy = b[_X1, i] - b[_X0, i], b[_Y1, i] - b[_Y0, i]
        x, y = dx * cos + dy * sin, dy * cos - dx * sin
        # The difference of the courses and its rounding error (Knuth's two-sum).
        turn = c1 - c0
        back = turn - c1
        error = (c1 - (turn - back)) - (c0 + back)
        turn = from_turns(turn) + error
        # By the half angle: differences of close courses keep all their digits.
        cos, sin = cosines(0.5 * turn)
        sine, versine = 2.0 * sin * cos, 2.0 * sin * sin
        b[_VECTOR_X, i], b[_VECTOR_Y, i] = x - sine, y - versine
        b[_VECTOR_X + 1, i], b[_VECTOR_Y + 1, i] = x + sine, y + versine
        wide = np.inf if max(abs(c0), abs(c1)) > WIDEST else 0.0
        b[_TURN, i] = turn
        b[_SLACK, i] = SNAP * (abs(x) + abs(y) + abs(turn) + _LEAST + wide)


@njit(cache=True, error_model="numpy")
def _straights(n: int, b: Floats) -> None:
    """Lengths of the straights, and vectors whose angles their headings are."""
    for i in range(n):
        x, y = b[_VECTOR_X, i], b[_VECTOR_Y, i]
        square = x * x + y * y
        b[_LEFT, i] = math.sqrt(square)
        square += 4.0 * y
        straight = math.sqrt(max(square, 0.0))
        b[_RSL_SQUARE, i], b[_RSL, i] = square, straight
        b[_VECTOR_Y + 3, i] = 2.0 * (x - straight) - straight * y
        b[_VECTOR_X + 3, i] = straight * x + 4.0 + 2.0 * y

        x, y = b[_VECTOR_X + 1, i], b[_VECTOR_Y + 1, i]
        square = x * x + y * y
        b[_RIGHT, i] = math.sqrt(square)
        square -= 4.0 * y
        straight = math.sqrt(max(square, 0.0))
        b[_LSR_SQUARE, i], b[_LSR, i] = square, straight
        b[_VECTOR_Y + 2, i] = 2.0 * (x - straight) + straight * y
        b[_VECTOR_X + 2, i] = straight * x + 4.0 - 2.0 * y


@njit(cache=True, error_model="numpy")
def _angles(rows: int, to: int, n: int, b: Floats) -> None:
    """Angles of the first of the vectors, into rows from `to` on."""
    for k in range(rows):
        for i in range(n):
            b[to + k, i] = atan2(b[_VECTOR_Y + k, i], b[_VECTOR_X + k, i])


@njit(cache=True, error_model="numpy")
def _best_straight(n: int, b: Floats) -> None:
    """The shortest of the words with a straight: two turns the same way, then the others."""
    for i in range(n):
        turn, slack = b[_TURN, i], b[_SLACK, i]
        middle, word = b[_LEFT, i], float(LSL)
        best, first, last = _same_turns(b[_ANGLE, i], middle, _turn(turn, 1.0, slack), slack)

        straight = b[_RIGHT, i]
        length, t, q = _same_turns(-b[_ANGLE + 1, i], straight, _turn(-turn, 1.0, slack), slack)
        less = length < best
        best, word = length if less else best, float(RSR) if less else word
        first, middle, last = (
            t if less else first,
            straight if less else middle,
            q if less else last,
        )

        straight = b[_LSR, i]
        length, t, q = _opposite_turns(b[_ANGLE + 2, i], straight, b[_LSR_SQUARE, i], turn, slack)
        less = length < best
        best, word = length if less else best, float(LSR) if less else word
        first, middle, last = (
            t if less else first,
            straight if less else middle,
            q if less else last,
        )

        straight = b[_RSL, i]
        length, t, q = _opposite_turns(b[_ANGLE + 3, i], straight, b[_RSL_SQUARE, i], -turn, slack)
        less = length < best
        best, word = length if less else best, float(RSL) if less else word
        first, middle, last = (
            t if less else first,
            straight if less else middle,
            q if less else last,
        )

        b[_BEST, i], b[_WORD, i] = best, word
        b[_FIRST, i], b[_MIDDLE, i], b[_LAST, i] = first, middle, last


@njit(cache=True, error_model="numpy")
def _close(n: int, b: Floats, who: Indices) -> int:
    """Columns that three turns could serve better, and how many.

    The middle turn alone is 2 pi - 2 asin(distance / 4), at least 2 pi - pi distance / 4.
    """
    m = 0
    for i in range(n):
        low, high = min(b[_LEFT, i], b[_RIGHT, i]), max(b[_LEFT, i], b[_RIGHT, i])
        who[m] = i
        m += (low <= 4.0) & (b[_BEST, i] > _TWO_PI - _QUARTER_PI * high)
    return m


@njit(cache=True, error_model="numpy")
def _best_turns(n: int, b: Floats) -> None:
    """Three turns where they are shorter."""
    for k in range(2):
        for i in range(n):
            distance = b[_LEFT + k, i]
            b[_VECTOR_Y + k, i] = distance
            b[_VECTOR_X + k, i] = -math.sqrt(max(16.0 - distance * distance, 0.0))
    _angles(2, _HALF, n, b)
    for i in range(n):
        turn, slack = b[_TURN, i], b[_SLACK, i]
        best, word = b[_BEST, i], b[_WORD, i]
        first, middle, last = b[_FIRST, i], b[_MIDDLE, i], b[_LAST, i]

        half = b[_HALF + 1, i]
        length, t, q = _three_turns(b[_ANGLE + 1, i], b[_RIGHT, i], half, turn, slack)
        less = length < best
        best, word = length if less else best, float(RLR) if less else word
        first, middle, last = (
            t if less else first,
            2.0 * half if less else middle,
            q if less else last,
        )

        half = b[_HALF, i]
        length, t, q = _three_turns(-b[_ANGLE, i], b[_LEFT, i], half, -turn, slack)
        less = length < best
        best, word = length if less else best, float(LRL) if less else word
        first, middle, last = (
            t if less else first,
            2.0 * half if less else middle,
            q if less else last,
        )

        b[_BEST, i], b[_WORD, i] = best, word
        b[_FIRST, i], b[_MIDDLE, i], b[_LAST, i] = first, middle, last


@njit(cache=True, error_model="numpy")
def shortest(starts: Floats, goals: Floats, radius: float) -> tuple[Floats, Words, Floats]:
    """Shortest path of each pair of poses.

    Parameters
    ----------
    starts : (n, 3) or (1, 3) float array
        x, y [m], course [rad]; one start serves all goals.
    goals : (n, 3) float array
    radius : float [m]
        Of the tightest turn.

    Returns
    -------
    lengths : (n,) float array [m]
        Not finite where a pose is not, where a course is beyond `WIDEST`, or on overflow.
    words : (n,) int8 array
        Constants of this module; of words equally long the first.
    segments : (n, 3) float array [m]
        Lengths of the three pieces.
    """
    n = goals.shape[0]
    length, words, segments = np.empty(n), np.empty(n, dtype=np.int8), np.empty((n, 3))
    b, near = np.empty((_ROWS, _BLOCK)), np.empty((_ROWS, _BLOCK))
    who = np.empty(_BLOCK + 1, dtype=np.int64)
    for first in range(0, n, _BLOCK):
        m = min(_BLOCK, n - first)
        _gather(starts, goals, first, m, b)
        _centers(m, radius, b)
        _straights(m, b)
        _angles(4, _ANGLE, m, b)
        _best_straight(m, b)
        close = _close(m, b, who)
        if 3 * close > m:
            _best_turns(m, b)
        else:  # Few of them: together, in columns side by side.
            for row in range(_TURN, _LAST + 1):
                for k in range(close):
                    near[row, k] = b[row, who[k]]
            _best_turns(close, near)
            for row in range(_BEST, _LAST + 1):
                for k in range(close):
                    b[row, who[k]] = near[row, k]
        for i in range(m):
            # What is not finite in the poses makes the slack so, and the length.
            length[first + i] = radius * (b[_BEST, i] + 0.0 * b[_SLACK, i])
            words[first + i] = np.int8(b[_WORD, i])
            segments[first + i, 0] = radius * b[_FIRST, i]
            segments[first + i, 1] = radius * b[_MIDDLE, i]
            segments[first + i, 2] = radius * b[_LAST, i]
    return length, words, segments


@njit(cache=True, error_model="numpy", forceinline=True)
def _ahead(
    x: float, y: float, course: float, side: float, way: float, radius: float
) -> tuple[float, float, float]:
    """A pose, some way along a turn to the left (1), the right (-1), or straight on (0)."""
    half = 0.5 * side * way / radius
    # The chord of an arc; of a straight its length.
    chord = way if side == 0.0 else 2.0 * radius * math.sin(abs(half))
    x, y = x + chord * math.cos(course + half), y + chord * math.sin(course + half)
    return x, y, course + 2.0 * half


@njit(cache=True, error_model="numpy")
def sample(starts: Floats, words: Words, segments: Floats, radius: float, at: Floats) -> Floats:
    """Poses along paths.

    Parameters
    ----------
    starts : (n, 3) or (1, 3) float array
    words : (n,) int8 array
    segments : (n, 3) float array [m]
    radius : float [m]
    at : (n, k) or (1, k) float array [m]
        Ways from the starts, at least 0; beyond its end a path stays there.

    Returns
    -------
    (n, k, 3) float array
        x, y [m], course in (-pi, pi].
    """
    n, count = words.shape[0], at.shape[1]
    out = np.empty((n, count, 3))
    for i in range(n):
        start, ways = starts[i if starts.shape[0] > 1 else 0], at[i if at.shape[0] > 1 else 0]
        sides, pieces = _SIDES[words[i]], segments[i]
        one = _ahead(start[0], start[1], start[2], sides[0], pieces[0], radius)
        two = _ahead(one[0], one[1], one[2], sides[1], pieces[1], radius)
        for k in range(count):
            way = ways[k]
            if way <= pieces[0]:
                pose = _ahead(start[0], start[1], start[2], sides[0], way, radius)
            elif way <= pieces[0] + pieces[1]:
                pose = _ahead(one[0], one[1], one[2], sides[1], way - pieces[0], radius)
            else:
                way = min(way - pieces[0] - pieces[1], pieces[2])
                pose = _ahead(two[0], two[1], two[2], sides[2], way, radius)
            course = from_turns(pose[2])
            out[i, k, 0], out[i, k, 1] = pose[0], pose[1]
            out[i, k, 2] = _PI if course <= -_PI else course
    return out


def shortest_length(
    x0: float, y0: float, course0: float, x1: float, y1: float, course1: float, radius: float
) -> float:
    """Length of the shortest path between two poses [m]."""
    starts, goals = np.array([[x0, y0, course0]]), np.array([[x1, y1, course1]])
    return float(shortest(starts, goals, radius)[0][0])


def warm() -> None:
    """Compile, or load from the cache, what a flight calls."""
    shortest_length(0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0)
