"""Where particles were, against a plain record of every particle's path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.kernels.lineage import SLOTS, advance, descend, places_at

N = 12


class Record:
    """A tracker's bookkeeping, and beside it the paths as lists that are copied whole."""

    def __init__(self, seed, n=N, k=1):
        self.g = np.random.default_rng(seed)
        self.k, self.now, self.head = k, 0.0, 0
        self.state = self.g.normal(0.0, 10.0, (2, 4, n)).astype(np.float32)
        self.past = np.full((2, SLOTS, 2, n), np.nan, np.float32)
        self.ancestors = np.full((2, SLOTS, n), -1, np.int32)
        self.copied = np.zeros((2, SLOTS), np.bool_)
        self.times = np.full(SLOTS, np.nan)
        self.depth = np.zeros(2, np.int64)
        self.paths = [[] for _ in range(n)]

    def move(self, dt):
        """One step of `dt`; of 0 nothing moves, and nothing is written down."""
        if dt == 0.0:
            return
        for i, path in enumerate(self.paths):
            path.append((self.now, *self.state[self.k, :2, i]))
        self.times[self.head % SLOTS] = self.now
        advance(self.past, self.copied, self.depth, self.state, self.k, self.head)
        self.state[self.k] += self.g.normal(0.0, 3.0, self.state[self.k].shape).astype(np.float32)
        self.now += dt
        self.head += 1

    def resample(self):
        chosen = self.g.integers(0, len(self.paths), len(self.paths)).astype(np.int32)
        self.state[self.k] = self.state[self.k][:, chosen]
        self.paths = [list(self.paths[i]) for i in chosen]
        descend(self.ancestors, self.copied, self.k, self.head, chosen)

    def asked(self, time):
        out = np.empty((2, len(self.paths)), np.float32)
        places_at(
            time, self.now, self.state, self.past, self.ancestors, self.copied, self.times,
            self.depth, self.k, self.head, np.empty(len(self.paths), np.int32), out,
        )  # fmt: skip
        return out

    def recorded(self, time):
        """The same from the paths, of which the last seven points count."""
        out = []
        for i, path in enumerate(self.paths):
            x, y, vx, vy = self.state[self.k, :, i]
            after = (self.now, x, y)
            for point in [*reversed(path[-(SLOTS - 1) :]), None]:
                if time >= after[0]:
                    place = after[1:]
                    break
                if point is None:
                    back = np.float32(after[0] - time)
                    place = after[1] - back * vx, after[2] - back * vy
                elif point[0] < time:
                    share = np.float32((after[0] - time) / (after[0] - point[0]))
                    place = [a + share * (b - a) for a, b in zip(after[1:], point[1:], strict=True)]
                    break
                else:
                    after = point
            out.append(place)
        return np.array(out, np.float32).T


def check(record, *times):
    for time in times:
        np.testing.assert_array_equal(record.asked(time), record.recorded(time))


def test_along_their_own_paths_through_several_resamplings():
    record = Record(0)
    for step in range(20):
        record.move(1.0)
        if step >= 2:
            check(record, *(record.now - np.arange(0.0, 10.0, 0.25)))
        if step % 3 != 1:
            record.resample()
    assert len({tuple(path[-6]) for path in record.paths}) < N


def test_straight_back_from_the_oldest_slot():
    record = Record(1)
    for _ in range(9):
        record.move(1.0)
    kept = record.past[1, (record.head - 7) % SLOTS]
    np.testing.assert_array_equal(record.asked(record.now - 7.0), kept)
    np.testing.assert_array_equal(
        record.asked(record.now - 10.0), kept - np.float32(3.0) * record.state[1, 2:]
    )


def test_a_newborn_was_straight_back():
    record = Record(2)
    np.testing.assert_array_equal(
        record.asked(-2.0), record.state[1, :2] - np.float32(2.0) * record.state[1, 2:]
    )


def test_two_resamplings_at_one_time():
    record = Record(3)
    for _ in range(4):
        record.move(1.0)
        record.resample()
        record.resample()
    record.move(1.0)
    check(record, 4.5, 4.0, 3.5, 1.0, -1.0)


@pytest.mark.parametrize("resamplings", [1, 2])
def test_a_second_step_at_one_time_asks_after_the_first_has_resampled(resamplings):
    record = Record(4)
    for _ in range(3):
        record.move(1.0)
    for _ in range(resamplings):
        record.resample()
    record.move(0.0)
    check(record, 3.0, 2.5, 2.0, 1.25, -1.0)


def test_the_other_tracks_are_not_touched():
    record = Record(5)
    for _ in range(3):
        record.move(1.0)
        record.resample()
    assert np.isnan(record.past[0]).all()
    assert (record.ancestors[0] == -1).all()
    assert not record.copied[0].any()
    assert record.depth[0] == 0


@given(
    st.lists(
        st.tuples(st.sampled_from([0.0, 0.25, 1.0, 3.0]), st.integers(0, 2), st.floats(0.0, 12.0)),
        max_size=25,
    ),
    st.integers(0, 5),
)
@settings(max_examples=100, deadline=None)
def test_any_history(steps, seed):
    record = Record(seed, n=5)
    for dt, resamplings, age in steps:
        record.move(dt)
        check(record, record.now - age, *record.times[record.times <= record.now][:3])
        for _ in range(resamplings):
            record.resample()
