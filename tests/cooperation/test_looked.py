"""Words on what was looked at: they say it, whatever is lost, late, twice or broken on the way."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.cooperation import SearchMap
from staniel.cooperation.looked import MOST_BYTES, QUANTUM, pack_looked, unpack_looked
from staniel.cooperation.search import NEVER
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.errors import StanielError

TIME = 450.0


def made_up(seed, shape=(30, 30), patch=1):
    """A map with holes, unseen cells and ages that differ every `patch` cells."""
    random = np.random.default_rng(seed)
    looked = random.uniform(-200.0, TIME, shape)
    looked = np.repeat(looked[:, ::patch], patch, axis=1)[:, : shape[1]]
    return np.where(looked < 0.0, NEVER, looked), random.random(shape) < 0.6


def floored(looked):
    return np.where(looked >= 0.0, QUANTUM * np.floor(looked / QUANTUM), -math.inf)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 40),
    st.integers(1, 30),
    st.integers(1, 9),
    st.integers(0, 2000),
)
def test_says_all_of_a_map_of_the_usual_size(seed, rows, columns, patch, first):
    if rows * columns > 980:
        rows = 980 // columns
    looked, streets = made_up(seed, (rows, columns), patch)
    cells, more = pack_looked(looked, streets, TIME, first % (rows * columns))
    assert (len(cells) <= MOST_BYTES, more) == (True, 0)
    told = unpack_looked(cells, (rows, columns), TIME)
    np.testing.assert_array_equal(told[streets], floored(looked)[streets])


@pytest.mark.parametrize(("shape", "patch"), [((120, 90), 1), ((700, 800), 40), ((3, 70_000), 500)])
def test_a_large_map_is_said_in_turns_each_of_bounded_size(shape, patch):
    looked, streets = made_up(3, shape, patch)
    streets[:] = True
    told, first = np.full(shape, -math.inf), 0
    most = math.ceil(looked.size / patch / 800)  # at least so many runs a word
    for _ in range(most + 1):
        cells, first = pack_looked(looked, streets, TIME, first)
        assert len(cells) <= MOST_BYTES
        told = np.maximum(told, unpack_looked(cells, shape, TIME))
    np.testing.assert_array_equal(told, floored(looked))


def test_what_is_older_than_codes_reach_is_left_out():
    looked = np.array([[0.0, 700.0, 900.0, 1000.0]])
    told = unpack_looked(pack_looked(looked, looked >= 0.0, 1000.0)[0], (1, 4), 1000.0)
    assert told.tolist() == [[-math.inf, 700.0, 900.0, 1000.0]]


def test_a_map_that_nobody_looked_at_takes_a_head():
    cells, _ = pack_looked(np.full((500, 500), NEVER), np.ones((500, 500), bool), 0.0)
    assert len(cells) == 17


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=80), st.booleans())
def test_anything_else_is_refused_or_says_something_possible(noise, head):
    cells = struct.pack("<BIIII", 1, 6, 7, 20, 3) + noise if head else noise
    try:
        told = unpack_looked(cells, (6, 7), 45.0)
    except StanielError:
        return
    assert told.shape == (6, 7)
    assert told.max() <= 45.0
    assert (told[told > -math.inf] >= 0.0).all()


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        (b"", "0 bytes"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + b"\x00", "18 bytes"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + bytes(MOST_BYTES), "bytes"),
        (struct.pack("<BIIII", 2, 2, 2, 9, 0), "version = 2"),
        (struct.pack("<BIIII", 1, 2, 3, 9, 0), "2 x 3: expected 2 x 2"),
        (struct.pack("<BIIII", 1, 2, 2, 11, 0), "22 s: expected not after 20"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 4), "from 4"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + b"\x00\x05", "5 cells"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + b"\xfe\xff" * 900, "cells from 0"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + b"\x00\x00", "runs"),
        (struct.pack("<BIIII", 1, 2, 2, 9, 0) + b"\x0a\x01", "before the start"),
    ],
)
def test_a_broken_word_says_what_is_wrong(cells, words):
    with pytest.raises(StanielError, match=words):
        unpack_looked(cells, (2, 2), 20.0)


def new_map(size=(600.0, 600.0)):
    return SearchMap(City.open(size), Airframe(), Camera(), cell=20.0)


def over(x, y):
    return Pose(x, y, 80.0, 0.0, 0.0, 15.0)


@settings(max_examples=30, deadline=None)
@given(st.permutations(range(6)), st.sets(st.integers(0, 5)))
def test_words_in_any_order_and_twice_and_lost_but_the_last_say_the_same(order, lost):
    speaker, plain, shuffled = new_map(), new_map(), new_map()
    words = []
    for k in range(6):
        speaker.look(5.0 * k, over(100.0 * k, 300.0))
        words.append(speaker.pack(5.0 * k))
    for word in words:
        plain.take(word, 30.0)
    for k in order:
        if k not in lost or k == 5:
            shuffled.take(words[k], 30.0)
            shuffled.take(words[k], 30.0)
    np.testing.assert_array_equal(shuffled.ages, plain.ages)
    assert (plain.ages <= speaker.ages).all()
    assert (speaker.ages - plain.ages)[speaker.ages >= 0.0].max() < QUANTUM


def test_a_word_goes_round_by_a_third_and_loses_nothing_on_the_way():
    first, second, third = new_map(), new_map(), new_map()
    first.look(7.0, over(300, 300))
    second.take(first.pack(7.0), 8.0)
    third.take(second.pack(11.0), 12.0)
    np.testing.assert_array_equal(third.ages, second.ages)
    assert third.ages.max() == 6.0
    before = first.ages.copy()
    first.take(third.pack(13.0), 14.0)  # an echo makes nothing older
    np.testing.assert_array_equal(first.ages, before)


def test_a_word_of_another_map_changes_nothing():
    one, other = new_map(), new_map((620.0, 600.0))
    one.look(7.0, over(300, 300))
    with pytest.raises(StanielError, match="30 x 30"):
        other.take(one.pack(7.0), 8.0)
    assert other.ages.max() == NEVER
