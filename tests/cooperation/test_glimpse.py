"""A second look at what a search saw for a moment, for a bounded time."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from staniel.cooperation.glimpse import FASTEST, MOST, NEAR, REST, Glimpse

STAY = 12.0


def test_it_stays_where_something_was_seen_and_no_longer_than_asked():
    glimpse = Glimpse(STAY)
    assert glimpse.place(0.0) is None
    glimpse.note(1.0, [])
    assert glimpse.place(1.0) is None
    glimpse.note(5.0, [(30.0, 40.0)])
    assert glimpse.place(5.0) == glimpse.place(5.0 + STAY - 0.1) == (30.0, 40.0)
    assert glimpse.place(5.0 + STAY) is None


def test_what_is_seen_near_it_again_prolongs_the_stay_and_moves_the_place():
    glimpse = Glimpse(STAY)
    glimpse.note(0.0, [(0.0, 0.0)])
    near, far = NEAR + 4.0 * FASTEST - 0.1, NEAR + 4.0 * FASTEST + 0.1
    glimpse.note(4.0, [(far, 0.0)])
    assert glimpse.place(4.0) == (0.0, 0.0)
    glimpse.note(4.0, [(near, 0.0)])
    assert glimpse.place(4.0 + STAY - 0.1) == (near, 0.0)
    assert glimpse.place(4.0 + STAY) is None


def test_after_a_stay_in_vain_it_flies_on_before_it_looks_again():
    glimpse = Glimpse(STAY)
    glimpse.note(0.0, [(0.0, 0.0)])
    over = STAY + REST * STAY
    glimpse.note(over - 0.1, [(90.0, 0.0)])
    assert glimpse.place(over - 0.1) is None
    glimpse.note(over, [(90.0, 0.0)])
    assert glimpse.place(over) == (90.0, 0.0)


def test_a_track_that_appears_there_ends_the_stay_and_leaves_the_next_free():
    glimpse = Glimpse(STAY)
    glimpse.note(10.0, [(0.0, 0.0)])
    reach = NEAR + 3.0 * FASTEST
    glimpse.note(13.0, [], [(reach + 1.0, 0.0)])
    assert glimpse.place(13.0) == (0.0, 0.0)
    glimpse.note(13.0, [], [(reach - 1.0, 0.0)])
    assert glimpse.place(13.0) is None
    glimpse.note(14.0, [(70.0, 0.0)])
    assert glimpse.place(14.0) == (70.0, 0.0)


def test_of_no_time_nothing_is_looked_at():
    glimpse = Glimpse(0.0)
    for k in range(50):
        glimpse.note(float(k), [(0.0, 0.0)])
        assert glimpse.place(float(k)) is None


@given(st.floats(4.0, 60.0), st.integers(0, 2**32), st.floats(0.05, 3.0))
def test_false_alarms_take_two_thirds_of_the_search_at_most(stay, seed, rate):
    """However many there are, all over the camera's view; and one stay ends in time."""
    random, glimpse, stays = np.random.default_rng(seed), Glimpse(stay), []
    for k in range(2000):
        glimpse.note(float(k), random.uniform(-140.0, 140.0, (random.poisson(rate), 2)).tolist())
        stays.append(glimpse.place(float(k)) is not None)
    share = 1.0 / (1.0 + REST)
    # Whole seconds: a stay may be a second longer, and a rest a second shorter.
    assert np.mean(stays) <= share + (1.0 - share) * 2.0 / stay + MOST * stay / 2000.0
    longest = max((len(run) for run in "".join(" x"[s] for s in stays).split()), default=0)
    assert longest <= math.ceil(MOST * stay) + 1
