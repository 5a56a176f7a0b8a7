"""The protocol on a bus: agents that stand still, targets that all of them track."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.cooperation import Allocation, CooperationConfig, Price, Task
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import (
    Acknowledge,
    Announce,
    Award,
    Bid,
    Handover,
    Heartbeat,
    Release,
    Revoke,
)
from team_bus import Bus


def test_lowest_dubins_distance_wins():
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi), (0, 400, 0.0)], [(200, 0)])
    bus.run(6)
    costs = [bus.cost(agent, 0) for agent in range(3)]
    assert bus.holders(0) == [int(np.argmin(costs))]


def test_a_tie_goes_to_the_higher_id():
    # Mirror images: the same Dubins distance.
    bus = Bus([(0, 100, 0.0), (0, -100, 0.0), (900, 900, 0.0)], [(300, 0)])
    assert bus.cost(0, 0) == pytest.approx(bus.cost(1, 0), abs=1e-9)
    bus.poses[1] = bus.poses[1]._replace(x=0.0)
    bus.run(6)
    assert bus.holders(0) == [1]


def test_each_message_is_numbered_once_by_its_sender():
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0)], [(100, 50), (200, 90)]).run(10)
    for agent in (0, 1):
        numbers = [m.sequence for m in bus.log if m.sender == agent]
        assert all(a < b for a, b in pairwise(numbers))


def test_a_busy_agent_does_not_bid():
    bus = Bus([(0, 0, 0.0), (500, 500, 0.0)], [(50, 0)], seers={0: {0, 1}})
    bus.run(6)
    assert bus.holders(0) == [0]
    bus.log.clear()
    bus.targets[1] = (0.0, 60.0)
    bus.seers[1] = {1}
    for agent in (0, 1):
        bus.names[agent, 1] = TrackId(7.0, agent, 1)
    bus.run(6)
    assert not [m for m in bus.said(Bid) if m.sender == 0]
    assert bus.holders(1) == [1]


def test_two_names_for_one_target_become_the_holders():
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0), (0, 500, 0.0)], [(200, 0)]).run(10)
    (holder,) = bus.holders(0)
    assert len({bus.names[agent, 0] for agent in range(3)}) == 1
    assert bus.sides[holder].holding.id == bus.names[holder, 0]


def test_a_silent_holder_loses_its_lease_and_the_target_is_auctioned_again():
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0)], [(50, 0)]).run(6)
    (holder,) = bus.holders(0)
    bus.dead.add(holder)
    bus.run(int(bus.config.lease) + 2 * bus.config.bid_wait + 2)
    assert bus.holders(0) == [1 - holder]


def test_an_auction_of_a_held_target_is_revoked():
    # Agent 1 never hears who holds the target: heartbeats reach it only after it announced.
    bus = Bus([(0, 0, 0.0), (100, 0, 0.0)], [(50, 0)], seers={0: {0}})
    bus.dead.add(1)
    bus.run(6)
    assert bus.holders(0) == [0]
    bus.dead.clear()
    bus.seers[0] = {0, 1}
    bus.inboxes[1] = []
    bus.run(5)
    assert bus.said(Announce)[-1].sender == 1
    assert bus.said(Revoke)
    assert bus.holders(0) == [0]


def test_a_much_better_placed_free_agent_takes_over():
    bus = Bus([(0, 0, 0.0), (900, 0, math.pi)], [(100, 0)]).run(6)
    assert bus.holders(0) == [0]
    bus.targets[0] = (850.0, 0.0)
    bus.run(8)
    assert bus.cost(1, 0) + bus.config.handover_margin < bus.cost(0, 0)
    assert bus.holders(0) == [1]


def test_a_slightly_better_placed_one_does_not():
    bus = Bus([(0, 0, 0.0), (40, 0, 0.0)], [(20, 0)]).run(6)
    assert bus.holders(0) == [0]
    bus.targets[0] = (200.0, 0.0)
    assert bus.cost(1, 0) < bus.cost(0, 0)
    bus.run(8)
    assert bus.holders(0) == [0]


def test_giving_up_frees_the_target_for_all():
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0)], [(50, 0)]).run(6)
    message = bus.sides[0].give_up()
    assert isinstance(message, Release)
    assert message.lost
    with pytest.raises(ValueError, match="holds no target"):
        bus.sides[0].give_up()


def test_an_auction_without_a_free_agent_pauses():
    bus = Bus([(0, 0, 0.0)], [(50, 0), (80, 0)]).run(30)
    announced = [m for m in bus.said(Announce) if m.target == bus.names[0, 1]]
    assert 2 <= len(announced) <= 4
    assert all(math.isinf(m.cost) for m in announced[1:])
    assert all(m.target == bus.names[0, 0] for m in bus.said(Award))


@settings(max_examples=40, deadline=None)
@given(
    st.integers(2, 6),
    st.integers(1, 6),
    st.sampled_from([0.0, 0.2, 0.5]),
    st.integers(0, 2**32),
)
def test_every_target_gets_one_holder_in_spite_of_losses(agents, targets, loss, seed):
    rng = np.random.default_rng(seed)
    poses = [(*rng.uniform(0, 600, 2), rng.uniform(-3, 3)) for _ in range(agents)]
    places = [(100.0 * k + 30.0, *rng.uniform(0, 600, 1)) for k in range(targets)]
    bus = Bus(poses, places, loss=loss, seed=seed).run(60)
    # A double holder ends when one hears the other: wait for it, within a bounded time.
    for _ in range(40):
        counts = [len(bus.holders(k)) for k in range(targets)]
        if max(counts) <= 1 and sum(counts) == min(agents, targets):
            break
        bus.tick()
    assert max(counts) <= 1
    assert sum(counts) == min(agents, targets)
    assert all(
        isinstance(
            m, Acknowledge | Announce | Award | Bid | Handover | Heartbeat | Release | Revoke
        )
        for m in bus.log
    )


def test_copies_and_late_words_change_nothing():
    """Twice, or after what the same agent said later: the newest word of each stands."""
    pose, target = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), TrackId(0.0, 1, 1)
    side = Allocation(0, CooperationConfig(), step=1.0)
    task = Task(target, (50.0, 0.0), 0.0, 50.0, True)

    def prices(goals):
        return [Price(math.dist(goal.position, (0.0, 0.0))) for goal in goals]

    def beat(sequence, time, held):
        place = None if held is None else (50.0, 0.0)
        return Heartbeat(
            1, sequence, time, pose=pose, role="pursue", goal=(0.0, 0.0), target=held,
            target_position=place, cost=9.0,
        )  # fmt: skip

    def auctions(*inbox, time):
        return [m for m in side.step(time, pose, [task], inbox, prices) if isinstance(m, Announce)]

    # Who holds the target lets go of it; its older claim comes late, and then once more.
    assert not auctions(beat(1, 1.0, target), time=2.0)
    release = Release(1, 4, 3.0, target=target, position=(50.0, 0.0), lost=False)
    assert auctions(release, beat(3, 2.0, target), time=4.0)
    # A release that a later claim has overtaken does not end it.
    assert not auctions(beat(9, 7.0, target), time=8.0)
    late = Release(1, 8, 6.0, target=target, position=(50.0, 0.0), lost=False)
    assert not auctions(late, time=9.0)
