import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from staniel.kernels.dubins import LRL, LSL, LSR, RLR, RSL, RSR, lengths, shortest

TURNS = {
    LSL: (1, 0, 1),
    RSR: (-1, 0, -1),
    LSR: (1, 0, -1),
    RSL: (-1, 0, 1),
    RLR: (-1, 1, -1),
    LRL: (1, -1, 1),
}
place = st.floats(-300.0, 300.0)
course = st.floats(-math.pi, math.pi)


def fly(pose, word, segments, radius):
    """Integrate a word segment by segment on exact arcs."""
    x, y, c = pose
    for turn, size in zip(TURNS[word], segments, strict=True):
        if turn == 0:
            x, y = x + radius * size * math.cos(c), y + radius * size * math.sin(c)
        else:
            x += turn * radius * (math.sin(c + turn * size) - math.sin(c))
            y -= turn * radius * (math.cos(c + turn * size) - math.cos(c))
            c += turn * size
    return x, y, c


def tangent_length(start, goal, radius, word):
    """Length of a word with a straight, from circles and their tangents: no normalised formulas."""
    (first, _, last), best = TURNS[word], math.inf
    centers = [
        np.array([p[0], p[1]]) + radius * s * np.array([-math.sin(p[2]), math.cos(p[2])])
        for p, s in ((start, first), (goal, last))
    ]
    gap = centers[1] - centers[0]
    distance, bearing = math.hypot(*gap), math.atan2(gap[1], gap[0])
    if first == last:
        heading, straight = bearing, distance
    else:
        if distance < 2.0 * radius:
            return best
        straight = math.sqrt(distance**2 - 4.0 * radius**2)
        heading = bearing + first * math.atan2(2.0 * radius, straight)
    t = (first * (heading - start[2])) % math.tau
    q = (last * (goal[2] - heading)) % math.tau
    return radius * (t + q) + straight


@settings(max_examples=300, deadline=None)
@given(place, place, course, place, place, course, st.floats(5.0, 80.0))
@example(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 30.0)
@example(0.0, 0.0, 0.0, 0.0, 0.0, math.pi, 30.0)
@example(0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 30.0)
@example(0.0, 0.0, 0.0, 0.0, 60.0, math.pi, 30.0)
@example(0.0, 0.0, 0.0, 5.0, 20.0, math.pi, 30.0)
def test_path_reaches_the_goal_and_no_tangent_word_is_shorter(x0, y0, c0, x1, y1, c1, radius):
    length, word, *segments = shortest(x0, y0, c0, x1, y1, c1, radius)
    x, y, c = fly((x0, y0, c0), word, segments, radius)
    assert math.hypot(x - x1, y - y1) < 1e-6
    assert abs(math.remainder(c - c1, math.tau)) < 1e-7
    assert length == pytest.approx(radius * sum(segments), abs=1e-9)
    assert length >= math.hypot(x1 - x0, y1 - y0) - 1e-9
    for other in (LSL, RSR, LSR, RSL):
        assert length <= tangent_length((x0, y0, c0), (x1, y1, c1), radius, other) + 1e-6


def test_known_lengths():
    assert shortest(0, 0, 0, 100, 0, 0, 30.0)[0] == pytest.approx(100.0)
    half_circle = shortest(0, 0, 0, 0, 60, math.pi, 30.0)
    assert half_circle[0] == pytest.approx(30.0 * math.pi)
    # About face on the spot: turning away, all but round, and back: (pi/3 + 5 pi/3 + pi/3) radii.
    assert shortest(0, 0, 0, 0, 0, math.pi, 30.0)[0] == pytest.approx(30.0 * 7.0 * math.pi / 3.0)


def test_three_turns_win_only_for_close_poses():
    rng = np.random.default_rng(3)
    near = [
        shortest(0, 0, 0, *rng.uniform(-30, 30, 2), rng.uniform(-3, 3), 30.0)[1] for _ in range(500)
    ]
    far = [
        shortest(0, 0, 0, *(rng.uniform(130, 300, 2)), rng.uniform(-3, 3), 30.0)[1]
        for _ in range(500)
    ]
    assert {RLR, LRL} <= set(near)
    assert not {RLR, LRL} & set(far)


def test_lengths_of_many_goals_are_those_of_each():
    rng = np.random.default_rng(4)
    goals = np.column_stack([rng.uniform(-200, 200, (20, 2)), rng.uniform(-3, 3, 20)])
    start = np.array([1.0, 2.0, 0.5])
    each = [shortest(*start, *goal, 25.0)[0] for goal in goals]
    assert lengths(start, goals, 25.0) == pytest.approx(each)
