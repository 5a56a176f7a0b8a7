"""The door of the Dubins paths: what it takes, what it refuses, what it hands out."""

import math

import numpy as np
import pytest

from staniel.errors import StanielError
from staniel.guidance import Word, shortest
from staniel.kernels import dubins


def poses(seed, n, reach=80.0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-reach, reach, (n, 2)), rng.uniform(-3.0, 3.0, n)])


def test_pairs_and_single_poses():
    starts, goals = poses(0, 20), poses(1, 20)
    pairs = shortest(starts, goals, 30.0)
    assert len(pairs) == 20
    assert (pairs.length.shape, pairs.word.shape, pairs.segments.shape) == ((20,), (20,), (20, 3))
    one = shortest(starts[3], goals, 30.0)
    assert one.length[3] == pairs.length[3]
    many = shortest(starts, goals[5].tolist(), 30)
    assert many.length[5] == pairs.length[5]
    single = shortest(starts[2], goals[2], 30.0)
    assert single.length == pairs.length[2:3]
    assert np.array_equal(single.segments, pairs.segments[2:3])
    for none in (shortest(np.zeros((0, 3)), goals[0], 30.0), shortest(starts[0], goals[:0], 30.0)):
        assert len(none) == 0
        assert none.sample([1.0, 2.0]).shape == (0, 2, 3)
        assert none.spaced(1.0) == []


def test_other_types_and_layouts_are_the_same_numbers():
    starts, goals = np.round(poses(2, 30)), np.round(poses(3, 30))
    plain = shortest(starts, goals, 30.0).length
    for kind in (np.int64, np.float32):
        assert np.array_equal(plain, shortest(starts.astype(kind), goals.astype(kind), 30).length)
    wide = np.zeros((60, 6))
    wide[::2, ::2] = goals
    assert np.array_equal(plain, shortest(np.asfortranarray(starts), wide[::2, ::2], 30.0).length)


def test_words_have_names():
    assert [word.name for word in Word] == ["LSL", "RSR", "LSR", "RSL", "RLR", "LRL"]
    for word in Word:
        assert word == getattr(dubins, word.name)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_a_radius_that_is_none_is_refused(radius):
    with pytest.raises(StanielError, match=r"radius = .*: expected a finite number above 0 m"):
        shortest(np.zeros(3), np.ones(3), radius)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_pose_that_is_not_finite_is_named(bad, column):
    starts, goals = poses(4, 600), poses(5, 600)
    goals[517, column] = bad
    with pytest.raises(StanielError, match=r"goals\[517\] = \[.*\]: expected finite x, y"):
        shortest(starts, goals, 30.0)
    with pytest.raises(StanielError, match=r"starts\[517\] = "):
        shortest(goals, starts, 30.0)
    with pytest.raises(StanielError, match=r"starts\[0\] = "):
        shortest(goals[517], starts, 30.0)


def test_other_bad_input_is_refused():
    pair = np.zeros((2, 3))
    with pytest.raises(StanielError, match=r"goals: expected \(n, 3\) or \(3,\).*got \(2, 2\)"):
        shortest(pair, pair[:, :2], 30.0)
    with pytest.raises(StanielError, match=r"starts: expected .*got \(1, 2, 3\)"):
        shortest(pair[None], pair, 30.0)
    with pytest.raises(StanielError, match=r"starts: expected .*got \(1,\)"):
        shortest(1.0, pair, 30.0)
    with pytest.raises(StanielError, match="as many of each, or one, got 2 and 3"):
        shortest(pair, np.zeros((3, 3)), 30.0)
    with pytest.raises(StanielError, match=r"goals\[0\] = .*course within ±1e\+06 rad"):
        shortest(pair[0], [0.0, 0.0, 2e6], 30.0)
    with pytest.raises(StanielError, match="pair 1 is too far apart"):
        shortest(pair, [[0.0, 0.0, 0.0], [1e200, 0.0, 0.0]], 30.0)


def test_samples():
    paths = shortest(poses(6, 40), goals := poses(7, 40), 20.0)
    assert np.array_equal(paths.sample(0.0)[:, :2], paths.starts[:, :2])
    at = np.linspace(0.0, 300.0, 7)
    same = paths.sample(at)
    assert same.shape == (40, 7, 3)
    assert np.array_equal(same, paths.sample(np.tile(at, (40, 1))))
    assert np.array_equal(same[:, 3], paths.sample(at[3]))
    ends = paths.sample(paths.length[:, None])[:, 0]
    assert np.abs(ends - goals).max() < 1e-9
    assert np.abs(paths.sample(1e9) - goals).max() < 1e-9
    for bad in (-1.0, math.nan, math.inf):
        with pytest.raises(StanielError, match="at: expected finite numbers of at least 0 m"):
            paths.sample([0.0, bad])
    for shape in ((3, 2), (2, 40, 2)):
        with pytest.raises(StanielError, match=r"at: expected a number, \(k,\) or \(40, k\)"):
            paths.sample(np.zeros(shape))


def test_spaced_poses_lead_from_start_to_goal():
    start, goals = np.array([1.0, 2.0, 0.5]), poses(8, 30)
    goals[0] = start
    paths = shortest(start, goals, 20.0)
    for points, goal, length in zip(paths.spaced(7.0), goals, paths.length, strict=True):
        assert np.abs(points[[0, -1]] - [start, goal]).max() < 1e-9
        steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
        assert len(points) == math.ceil(length / 7.0) + 1
        assert (steps <= 7.0 + 1e-9).all()
        # Turning, the course between two points is no steeper than the radius allows.
        bends = np.abs(np.remainder(np.diff(points[:, 2]) + math.pi, math.tau) - math.pi)
        assert (bends <= 7.0 / 20.0 + 1e-9).all()
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(StanielError, match="spacing = "):
            paths.spaced(bad)
