"""Dubins paths against circles and tangents in long double, word by word, and flown to their goals.

The oracle knows no normalised formulas: it puts circles beside the poses, lays tangents to them or
a third circle between them, and measures arcs. Where the shortest length jumps, an answer has to
lie between that of the numbers as they are and that of an oracle which takes a turn of all but a
whole circle for none.
"""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from staniel.kernels.dubins import (
    LRL,
    LSL,
    LSR,
    RLR,
    RSL,
    RSR,
    SNAP,
    sample,
    shortest,
    shortest_length,
)

TURNS = {
    LSL: (1, 0, 1),
    RSR: (-1, 0, -1),
    LSR: (1, 0, -1),
    RSL: (-1, 0, 1),
    RLR: (-1, 1, -1),
    LRL: (1, -1, 1),
}
Long = np.longdouble
PI = 4 * np.arctan(Long(1))
place = st.floats(-300.0, 300.0)
course = st.floats(-math.pi, math.pi)


def arc(angle, arm, slack):
    """A turn in [0, 2 pi); one that is short of a circle by slack on its arm is none."""
    turn = np.mod(angle, 2 * PI)
    return np.where((2 * PI - turn) * arm <= slack, Long(0), turn)


def same_turns(side, dx, dy, c0, c1, slack):
    straight, heading = np.hypot(dx, dy), np.arctan2(dy, dx)
    total = arc(side * (c1 - c0), 1, slack)
    first = arc(side * (heading - c0), straight, slack)
    last = total - first
    fits = -last * straight <= slack
    return total + straight + np.where((last < 0) & ~fits, 2 * PI, 0)


def opposite_turns(side, dx, dy, c0, c1, slack):
    distance = np.hypot(dx, dy)
    straight = np.sqrt(np.maximum(distance**2 - 4, 0))
    heading = np.arctan2(dy, dx) + side * np.arctan2(Long(2), straight)
    first = arc(side * (heading - c0), straight + 2, slack)
    last = arc(side * (heading - c1), straight + 2, slack)
    return np.where(distance**2 - 4 >= -4 * slack, first + straight + last, np.inf)


def three_turns(side, dx, dy, c0, c1, slack):
    """With the middle circle on either side of the line between the outer ones."""
    distance, bearing = np.hypot(dx, dy), np.arctan2(dy, dx)
    corner = np.arctan2(np.sqrt(np.maximum(4 - distance**2 / 4, 0)), distance / 2)
    lengths = []
    for hand in (1, -1):
        out, back = bearing + hand * corner, bearing + PI - hand * corner
        first = arc(side * (out - c0) + PI / 2, distance + 2, slack)
        middle = np.mod(side * (out - back), 2 * PI)
        last = arc(side * (c1 - back) - PI / 2, distance + 2, slack)
        lengths.append(first + np.where(middle == 0, 2 * PI, middle) + last)
    return np.where(distance <= 4, np.minimum(*lengths), np.inf)


def oracle(starts, goals, radius, slack=0.0):
    """(6, n) lengths of all words [m]; slack in radii, see `arc`."""
    (x0, y0, c0), (x1, y1, c1) = (np.asarray(p, dtype=Long).T for p in (starts, goals))
    x, y = (x1 - x0) / radius, (y1 - y0) / radius
    half, mean = (c1 - c0) / 2, (c0 + c1) / 2
    rows = []
    for first, middle, last in TURNS.values():
        if first == last:  # Differences of close sines and cosines keep their digits like this.
            dx = x - first * 2 * np.sin(half) * np.cos(mean)
            dy = y - first * 2 * np.sin(half) * np.sin(mean)
        else:
            dx = x - last * np.sin(c1) + first * np.sin(c0)
            dy = y + last * np.cos(c1) - first * np.cos(c0)
        kind = three_turns if middle else same_turns if first == last else opposite_turns
        rows.append(radius * kind(first, dx, dy, c0, c1, slack))
    return np.array(rows)


def fly(starts, words, segments, radius):
    """Poses after all three pieces, on exact arcs."""
    x, y, c = np.array(starts, dtype=Long).T
    sides = np.array(list(TURNS.values()))[words]
    for k in range(3):
        side, way = sides[:, k], np.asarray(segments[:, k], dtype=Long)
        to = c + side * way / radius
        straight = side == 0
        x = x + np.where(straight, way * np.cos(c), side * radius * (np.sin(to) - np.sin(c)))
        y = y + np.where(straight, way * np.sin(c), side * radius * (np.cos(c) - np.cos(to)))
        c = to
    return x, y, c


def check(starts, goals, radius):
    """Every path flies to its goal, no word beats it, and its length is the oracle's to 1e-12."""
    starts = np.ascontiguousarray(np.broadcast_to(starts, np.shape(goals)), dtype=float)
    goals = np.ascontiguousarray(goals, dtype=float)
    length, words, segments = shortest(starts, goals, radius)
    x, y, c = fly(starts, words, segments, radius)
    miss = np.hypot(x - goals[:, 0], y - goals[:, 1])
    scale = np.hypot(*(goals - starts)[:, :2].T) + radius
    assert (miss < 1e-12 * scale).all()
    assert (np.abs(np.mod(c - goals[:, 2] + PI, 2 * PI) - PI) < 1e-12).all()
    assert (segments >= 0.0).all()
    assert np.allclose(segments.sum(axis=1), length, rtol=1e-15, atol=1e-15 * radius)
    turned = np.abs(np.mod(goals[:, 2] - starts[:, 2] + PI, 2 * PI) - PI)
    slack = 2 * SNAP * (scale / radius - 1 + turned + 0.02)
    exact, lenient = (oracle(starts, goals, radius, s).min(axis=0) for s in (0.0, slack))
    assert (length <= exact * (1 + 1e-12) + 1e-15 * radius).all()
    assert (length >= lenient * (1 - 1e-12) - 1e-15 * radius).all()
    return length, words, lenient < exact * (1 - 1e-12)


def poses(rng, n, reach):
    return np.column_stack([rng.uniform(-reach, reach, (n, 2)), rng.uniform(-4.0, 4.0, n)])


@pytest.mark.parametrize("reach", [1e-6, 1.0, 30.0, 60.0, 150.0, 1e4])
def test_random_poses(reach):
    rng = np.random.default_rng(1)
    starts, goals = poses(rng, 20_000, reach), poses(rng, 20_000, reach)
    _, words, jumps = check(starts, goals, 30.0)
    assert not jumps.any()
    assert set(words) >= {LSL, RSR, LSR, RSL} or reach < 2.0
    assert {RLR, LRL} <= set(words) or reach > 1e3


@pytest.mark.parametrize("size", [1e-1, 1e-3, 1e-5])
def test_short_ways_keep_their_digits(size):
    """The relative error is that of long ways: nothing is a small difference of large numbers."""
    rng = np.random.default_rng(2)
    starts = np.column_stack([np.zeros((20_000, 2)), rng.uniform(-3.0, 3.0, 20_000)])
    segments = size * rng.uniform(0.0, 1.0, (20_000, 3))
    goals = np.column_stack(fly(starts, rng.integers(0, 4, 20_000), segments, 1.0)).astype(float)
    length, *_ = check(starts, goals, 1.0)
    assert (length <= 3.0 * size).all()
    assert np.allclose(length, oracle(starts, goals, 1.0).min(axis=0), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("word", TURNS)
@pytest.mark.parametrize("missing", [0, 1, 2])
def test_goals_on_the_edges_of_words(word, missing):
    """Goals reached by two pieces, rounded: where turns vanish, and words begin to exist."""
    rng = np.random.default_rng(3)
    starts = poses(rng, 5000, 100.0)
    segments = 30.0 * rng.uniform(0.0, 1.0, (5000, 3)) * (6.0, 4.0, 6.0)
    segments[:, missing] = 0.0
    goals = np.column_stack(fly(starts, np.full(5000, word), segments, 30.0)).astype(float)
    length, *_ = check(starts, goals, 30.0)
    # Without snapping, rounding would have cost some of them a circle.
    assert (length <= segments.sum(axis=1) * (1 + 1e-12)).all()


@pytest.mark.parametrize("course0", [0.0, math.pi / 2.0, math.pi, -math.pi / 2.0, 1.0])
def test_lattice_of_degenerate_poses(course0):
    """Equal, opposite, tangent circles, circles 2 and 4 radii apart, all at multiples of pi/12."""
    ways, courses = np.arange(-6, 7) * 0.5, np.arange(-12, 13) * (math.pi / 12.0)
    x, y, c = (axis.ravel() for axis in np.meshgrid(ways, ways, courses, indexing="ij"))
    for radius in (1.0, 0.5, 30.0):
        check((0.0, 0.0, course0), np.column_stack([radius * x, radius * y, c]), radius)


@pytest.mark.parametrize(
    ("goal", "length", "words"),
    [
        ((0.0, 0.0, 0.0), 0.0, {LSL}),
        ((0.0, 0.0, 2.0 * math.pi), 0.0, {LSL, RSR, LSR, RSL}),
        ((100.0, 0.0, 0.0), 100.0, {LSL}),
        ((100.0, 0.0, -2.0 * math.pi), 100.0, {LSL, RSR, LSR, RSL}),
        ((0.0, 60.0, math.pi), 30.0 * math.pi, {LSL, LSR, RSL, RLR}),
        ((0.0, -60.0, math.pi), 30.0 * math.pi, {RSR, LSR, RSL, LRL}),
        ((0.0, 0.0, math.pi), 70.0 * math.pi, {RLR, LRL}),
        # Right under the start's left circle, a quarter turn on; then both circles touch.
        ((30.0, 30.0, math.pi / 2.0), 15.0 * math.pi, {LSL, LSR, RSL}),
        ((60.0, 60.0, 0.0), 30.0 * math.pi, {LSR}),
        # Straight back: turn, meet one's own track, turn.
        ((-300.0, 0.0, 0.0), 300.0 + 60.0 * math.pi, {LSL, RSR}),
    ],
)
def test_known_lengths(goal, length, words):
    found, word, segments = shortest(np.zeros((1, 3)), np.array([goal]), 30.0)
    assert found[0] == pytest.approx(length, rel=1e-14, abs=1e-13)
    assert word[0] in words
    if goal == (0.0, 0.0, 0.0):
        assert not segments.any()
    assert shortest_length(0.0, 0.0, 0.0, *goal, 30.0) == found[0]


@settings(max_examples=300, deadline=None)
@given(place, place, course, place, place, course, st.floats(5.0, 80.0))
@example(0.0, 0.0, 0.0, 5.0, 20.0, math.pi, 30.0)
@example(0.0, 0.0, 0.0, 1e-300, 0.0, 0.0, 30.0)
@example(0.0, 0.0, 0.0, 0.0, 5e-324, 0.0, 30.0)
@example(0.0, 0.0, 0.0, 1e-15, 1e-15, -1e-15, 1.0)
def test_no_word_beats_the_path_that_flies_to_its_goal(x0, y0, c0, x1, y1, c1, radius):
    check((x0, y0, c0), [(x1, y1, c1)], radius)


def test_courses_of_many_turns():
    rng = np.random.default_rng(4)
    starts, goals = poses(rng, 5000, 60.0), poses(rng, 5000, 60.0)
    starts[:, 2] *= 2e5
    goals[:, 2] *= 2e5
    check(starts, goals, 30.0)


def test_reversed_and_mirrored_paths_are_as_long():
    rng = np.random.default_rng(5)
    starts, goals = poses(rng, 5000, 60.0), poses(rng, 5000, 60.0)
    length, words, _ = shortest(starts, goals, 30.0)
    turned = np.array([0.0, 0.0, math.pi])
    back, *_ = shortest(goals + turned, starts + turned, 30.0)
    assert np.allclose(back, length, rtol=1e-12)
    mirrored, others, _ = shortest(starts * (1, -1, -1), goals * (1, -1, -1), 30.0)
    assert np.array_equal(mirrored, length)
    pairs = {LSL: RSR, RSR: LSL, LSR: RSL, RSL: LSR, RLR: LRL, LRL: RLR}
    assert [pairs[word] for word in words.tolist()] == others.tolist()


def test_an_answer_does_not_depend_on_its_neighbours():
    """To the last bit: alone, in a full block, in the rest of one, among far and close goals."""
    rng = np.random.default_rng(6)
    goals = np.vstack([poses(rng, 300, 40.0), poses(rng, 300, 2000.0)])
    start = np.array([[1.0, 2.0, 0.5]])
    together = shortest(start, goals, 25.0)
    assert all(map(np.array_equal, together, shortest(np.repeat(start, 600, 0), goals, 25.0)))
    order = rng.permutation(600)
    mixed = shortest(start, goals[order], 25.0)
    for whole, other in zip(together, mixed, strict=True):
        assert np.array_equal(whole[order], other)
    for k in range(0, 600, 7):
        alone = shortest(start, goals[k : k + 1], 25.0)
        assert all(
            np.array_equal(whole[k : k + 1], one)
            for whole, one in zip(together, alone, strict=True)
        )


def test_what_is_not_finite_has_no_finite_length():
    for k in range(6):
        for bad in (np.nan, np.inf, -np.inf, 1e300):
            pair = np.array([[0.0, 0.0, 0.0], [50.0, 10.0, 1.0]])
            pair[k // 3, k % 3] = bad
            assert not np.isfinite(shortest(pair[:1], pair[1:], 30.0)[0][0])


def test_samples_are_on_the_path_and_so_far_apart_as_asked():
    rng = np.random.default_rng(7)
    starts, goals = poses(rng, 200, 60.0), poses(rng, 200, 60.0)
    length, words, segments = shortest(starts, goals, 30.0)
    at = np.linspace(0.0, 1.1, 400) * length[:, None]
    points = sample(starts, words, segments, 30.0, at)
    for k in (0, 40, 150, 300):
        # What is flown up to a way: the pieces, cut off there.
        ends = np.minimum(np.cumsum(segments, axis=1), at[:, k : k + 1])
        x, y, c = fly(starts, words, np.diff(ends, axis=1, prepend=0.0), 30.0)
        assert np.allclose(points[:, k, :2], np.column_stack([x, y]), rtol=0.0, atol=1e-9)
        assert np.allclose(np.mod(points[:, k, 2] - c + PI, 2 * PI), float(PI), atol=1e-9)
    assert (np.abs(points[:, :, 2]) <= math.pi).all()
    assert np.abs(points[:, -1, :2] - goals[:, :2]).max() < 1e-9
    chords = np.hypot(*np.diff(points[:, :, :2], axis=1).T)
    assert (chords <= np.diff(at, axis=1).T + 1e-9).all()
