import math

from hypothesis import given
from hypothesis import strategies as st

from staniel.cooperation.bidder import _first_names
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Announce

places = st.lists(st.tuples(*[st.integers(0, 60).map(float)] * 2), max_size=12)


@given(places, st.sampled_from([0.0, 5.0, 13.0, 100.0]))
def test_of_two_names_at_one_place_the_older_stays(places, near):
    said = [Announce(k, 1, 0.0, TrackId(float(k), k, 1), z, 0.0, 1.0) for k, z in enumerate(places)]
    stays = [
        word
        for k, word in enumerate(said)
        if not any(math.dist(word.position, other.position) <= near for other in said[:k])
    ]
    assert _first_names(said, near) == stays
