"""Free agents join a holder by heartbeats alone, and surplus helpers leave."""

from staniel.cooperation import CooperationConfig, Helping
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import Heartbeat

ONE, TWO = TrackId(1.0, 0, 1), TrackId(2.0, 1, 1)
POSE = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0)
CONFIG = CooperationConfig(helpers=1, lease=8.0)


def beat(sender, time=0.0, *, holds=None, helps=None, at=(50.0, 0.0), sequence=1):
    return Heartbeat(
        sender, sequence, time, pose=POSE, role="pursue" if holds else "search", goal=at,
        target=holds, target_position=at if holds else None, cost=1.0, helps=helps,
    )  # fmt: skip


def test_a_free_agent_joins_the_nearest_holder_and_a_busy_one_nobody():
    inbox = [beat(0, holds=ONE, at=(300.0, 0.0)), beat(1, holds=TWO, at=(100.0, 40.0))]
    free, busy = Helping(5, CONFIG), Helping(6, CONFIG)
    free.step(0.0, POSE, True, inbox)
    busy.step(0.0, POSE, False, inbox)
    assert (free.target, free.position) == (TWO, (100.0, 40.0))
    assert busy.target is None
    free.step(1.0, POSE, False, [])
    assert free.target is None


def test_nobody_helps_where_the_scenario_wants_no_helpers():
    helping = Helping(5, CooperationConfig())
    helping.step(0.0, POSE, True, [beat(0, holds=ONE)])
    assert helping.target is None


def test_of_two_that_join_at_once_the_greater_id_leaves_and_finds_another():
    first, second = Helping(3, CONFIG), Helping(4, CONFIG)
    held = [beat(0, holds=ONE), beat(1, holds=TWO, at=(400.0, 0.0))]
    for helping in (first, second):
        helping.step(0.0, POSE, True, held)
        assert helping.target == ONE
    first.step(1.0, POSE, True, [beat(4, 0.0, helps=ONE)])
    second.step(1.0, POSE, True, [beat(3, 0.0, helps=ONE)])
    assert first.target == ONE
    assert second.target == TWO


def test_silence_ends_it_and_so_does_a_holder_that_lets_go():
    helping = Helping(5, CONFIG)
    helping.step(0.0, POSE, True, [beat(0, holds=ONE)])
    helping.step(8.0, POSE, True, [])
    assert helping.target == ONE
    helping.step(8.1, POSE, True, [])
    assert helping.target is None
    helping.step(9.0, POSE, True, [beat(0, 9.0, holds=ONE, sequence=9)])
    helping.step(10.0, POSE, True, [beat(0, 10.0, sequence=10)])
    assert helping.target is None


def test_partners_are_all_others_on_the_target_by_the_newest_word_of_each():
    helping = Helping(5, CONFIG)
    newest = beat(2, 1.0, helps=ONE, sequence=3)
    holder, old = beat(0, 0.5, holds=ONE), beat(2, 0.0, helps=TWO, sequence=2)
    helping.step(1.0, POSE, True, [holder, newest, old, beat(1, 0.0, holds=TWO)])
    assert helping.partners(ONE) == [holder, newest]
