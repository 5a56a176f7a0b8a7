import math
from itertools import count

import pytest

from staniel.city import City
from staniel.cooperation import CooperationConfig, Searcher
from staniel.datatypes.belief import Health, Percept, Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Looked

CITY = City.open((400.0, 300.0))
DOWN = (math.nan, math.nan)


def searcher(agent=0, **config):
    return Searcher(
        agent, CITY, Airframe(), Camera(), CooperationConfig(**config), glimpse_time=12.0
    )


def percept(time, x=200.0, y=150.0, *, camera=True):
    return Percept(time, Pose(x, y, 80.0, 0.0, 0.0, 15.0), (), health=Health(camera=camera))


def test_what_one_looked_at_another_need_not():
    one, other = searcher(0), searcher(1)
    one.look_around(percept(100.0), DOWN, [])
    (word,) = one.tell(100.0, count(7).__next__)
    assert (word.sender, word.sequence, word.time) == (0, 7, 100.0)
    alone = other.leg(100.0, percept(100.0).pose, lambda: ())[1]
    other.forget_goal()
    other.look_around(percept(100.0, camera=False), DOWN, [word])
    told = other.leg(100.0, percept(100.0).pose, lambda: ())[1]
    assert math.dist(alone, (200.0, 150.0)) < 50.0 < math.dist(told, (200.0, 150.0))
    assert other.refused == 0


def test_a_blind_one_looks_at_nothing():
    blind, other = (searcher(k, revisit_after=50.0) for k in range(2))
    blind.look_around(percept(100.0, camera=False), DOWN, [])
    other.look_around(percept(100.0), DOWN, [])
    assert blind.overdue(120.0) == 1.0 > other.overdue(120.0)


def test_it_tells_at_intervals_or_not_at_all():
    numbers = count(1).__next__
    one = searcher(share_every=5.0)
    assert [len(one.tell(float(t), numbers)) for t in range(11)] == [1, 0, 0, 0, 0] * 2 + [1]
    assert searcher(share_every=0.0).tell(0.0, numbers) == []


@pytest.mark.parametrize("cells", [b"", b"\x01" * 19])
def test_what_is_no_word_is_counted(cells):
    one = searcher()
    one.look_around(percept(5.0, camera=False), DOWN, [Looked(1, 1, 5.0, cells=cells)])
    assert one.refused == 1


def test_it_stays_where_it_saw_what_no_track_explains():
    one = searcher()
    near = CooperationConfig().same_target
    assert one.second_look(1.0, [(50.0, 50.0)], [(50.0, 50.0 + 0.9 * near)]) is None
    assert one.second_look(2.0, [(50.0, 50.0)], [(50.0, 50.0 + 1.1 * near)]) == (50.0, 50.0)
    assert one.second_look(5.0, [], []) == (50.0, 50.0)
    assert one.second_look(6.0, [], [(55.0, 50.0)]) is None
