"""The protocol's promises: every pattern of losses on small teams, and what each rule is for."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from staniel.cooperation import CooperationConfig
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Acknowledge, Announce, Award, Handover, Release, Revoke
from team_bus import Bus

SETTLED = 8  # ticks: a heartbeat each way, or an auction where both had let go


class Scripted(Bus):
    """A bus that loses what a script says, tick after tick, and then nothing."""

    def __init__(self, poses, targets, script, **options):
        super().__init__(poses, targets, **options)
        self.script = script

    def loses(self, message, receiver):
        pattern = self.script.get(round(self.time), ())
        return (message.sender, receiver) in pattern


def hold(bus, agents, target=0):
    """Let some agents hold a target, each by its own name, as after a partition."""
    for agent in agents:
        bus.sides[agent]._ledger.hold(bus.names[agent, target], bus.targets[target])


def links(count):
    return [(a, b) for a in range(count) for b in range(count) if a != b]


def subsets(items):
    return itertools.chain.from_iterable(
        itertools.combinations(items, size) for size in range(len(items) + 1)
    )


@pytest.mark.parametrize("ahead", [0, 1])
def test_two_holders_become_one_whatever_is_lost(ahead):
    """All 4^4 patterns of losses over four ticks, from two holders under two names."""
    patterns = list(subsets(links(2)))
    for lost in itertools.product(patterns, repeat=4):
        poses = [(0, 0, 0.0), (300, 0, math.pi)]
        bus = Scripted(poses, [(60.0 + 180.0 * ahead, 0.0)], dict(enumerate(lost, 1)))
        hold(bus, (0, 1))
        held = []
        for _ in range(4 + SETTLED):
            bus.tick()
            held.append(len(bus.holders(0)))
        assert held[-1] == 1, lost
        assert 0 not in held, lost  # they never both yield


def test_three_holders_become_one_whatever_is_lost():
    """All 2^6 patterns of losses in each of two ticks, from three holders."""
    poses = [(0, 0, 0.0), (300, 0, math.pi), (0, 260, -1.0)]
    patterns = list(subsets(links(3)))
    for first, second in itertools.product(patterns, patterns[::3]):
        bus = Scripted(poses, [(100.0, 40.0)], {1: first, 2: second})
        hold(bus, (0, 1, 2))
        bus.run(2 + SETTLED)
        assert len(bus.holders(0)) == 1, (first, second)


@given(st.lists(st.sets(st.sampled_from(links(2))), min_size=12, max_size=12), st.data())
@settings(max_examples=150, deadline=None)
def test_crossing_costs_do_not_make_both_yield(lost, data):
    """Two holders whose costs cross while messages get lost: somebody always holds it."""
    bus = Scripted([(0, 0, 0.0), (400, 0, math.pi)], [(200, 0)], dict(enumerate(lost, 1)))
    hold(bus, (0, 1))
    for _ in range(12):
        bus.targets[0] = (data.draw(st.floats(20.0, 380.0)), 0.0)
        for side in bus.sides:
            if side.holding is not None:
                side._ledger.follow_holding()
        bus.tick()
        assert bus.holders(0)


@given(
    st.lists(st.sets(st.sampled_from(links(2))), max_size=4),
    st.floats(0.01, 0.99),
    st.sampled_from([0, 1]),
    st.floats(20.0, 380.0),
)
@settings(max_examples=100, deadline=None)
def test_holders_that_never_speak_at_one_instant_become_one(lost, offset, late, place):
    bus = Scripted([(0, 0, 0.0), (400, 0, math.pi)], [(place, 0.0)], dict(enumerate(lost, 1)))
    bus.offsets[late] = offset
    hold(bus, (0, 1))
    for _ in range(4 + SETTLED):
        bus.tick()
        assert bus.holders(0)
    assert len(bus.holders(0)) == 1


def test_a_handover_leaves_no_gap():
    bus = Bus([(0, 0, 0.0), (900, 0, math.pi)], [(100, 0)]).run(6)
    assert bus.holders(0) == [0]
    bus.targets[0] = (850.0, 0.0)
    for _ in range(10):
        bus.tick()
        assert bus.holders(0)
    assert bus.holders(0) == [1]
    assert bus.said(Handover)
    assert not bus.said(Revoke)


def test_a_winner_acknowledges_and_a_lost_award_is_said_again():
    """The award is lost on its first way; the auctioneer says the same once more."""

    class Deaf(Bus):
        awards = 0

        def loses(self, message, receiver):
            if isinstance(message, Award) and receiver == message.winner:
                self.awards += 1
                return self.awards == 1
            return False

    bus = Deaf([(0, 0, 0.0), (300, 0, 0.0)], [(290, 30)], seers={0: {0}})
    bus.trackers[0] = {0}
    bus.run(12)
    first, second = bus.said(Award)[:2]
    assert (first.target, first.winner, first.cost, first.bids) == (
        second.target, second.winner, second.cost, second.bids,
    )  # fmt: skip
    assert first.sequence < second.sequence
    assert bus.holders(0) == [1]
    assert [(m.sender, m.auctioneer) for m in bus.said(Acknowledge)] == [(1, 0)]


def test_who_is_awarded_two_declines_one_and_the_next_bidder_gets_it():
    config = CooperationConfig(award="lowest")
    # Agent 2 is nearest to both targets, each announced by another.
    poses = [(-300, 0, 0.0), (300, 0, math.pi), (0, 10, 0.0), (0, -200, 0.0)]
    bus = Bus(poses, [(-40, 0), (40, 0)], seers={0: {0}, 1: {1}}, config=config)
    for agent, k in bus.names:
        bus.names[agent, k] = TrackId(0.0, k, 1)
    bus.run(14)
    assert any(not m.lost for m in bus.said(Release))
    assert sorted(len(bus.holders(k)) for k in (0, 1)) == [1, 1]


def test_awards_tell_the_bids_they_come_from():
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi), (0, 400, 0.0)], [(200, 0)]).run(6)
    award = bus.said(Award)[0]
    costs = {offer.bidder: offer.cost for offer in award.bids}
    assert costs == pytest.approx({k: bus.cost(k, 0) for k in range(3)})
    assert award.cost == min(costs.values())


def test_a_free_agent_takes_what_it_only_heard_of():
    """Agent 0 knows two targets and can hold one; agent 1 has seen none and tracks none."""
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0)], [(50, 0), (0, 60)], seers={0: {0}, 1: {0}})
    bus.trackers = {0: {0}, 1: {0}}

    class Half(type(bus)):
        def loses(self, message, receiver):
            # Announcements, bids and awards of agent 0 never arrive: heartbeats have to do.
            return message.kind not in ("heartbeat",)

    bus.__class__ = Half
    bus.run(16)
    assert bus.sides[1].holding is not None
    assert sorted(len(bus.holders(k)) for k in (0, 1)) == [1, 1]


def test_a_blind_holder_lets_go_and_a_blind_agent_takes_nothing():
    bus = Bus([(0, 0, 0.0), (300, 0, 0.0)], [(50, 0)]).run(6)
    assert bus.holders(0) == [0]
    bus.health[0] = "blind"
    bus.seers[0] = {1}
    bus.run(10)
    assert bus.holders(0) == [1]
    bus.health[1] = "blind"
    bus.seers[0] = set()
    bus.run(30)
    assert bus.holders(0) == []


def test_a_weak_holder_keeps_the_target_until_another_has_it():
    bus = Bus([(0, 0, 0.0), (600, 0, 0.0)], [(50, 0)]).run(6)
    assert bus.holders(0) == [0]
    bus.health[0] = "weak"
    for _ in range(14):
        bus.tick()
        assert bus.holders(0)
    assert bus.holders(0) == [1]
    # With nobody else it goes on watching.
    alone = Bus([(0, 0, 0.0)], [(50, 0)]).run(6)
    alone.health[0] = "weak"
    assert alone.run(40).holders(0) == [0]


def test_who_does_not_cooperate_follows_the_nearest_that_it_sees_and_says_nothing():
    bus = Bus([(0, 0, 0.0), (10, 0, 0.0)], [(50, 0), (400, 0)])
    bus.alone = {0, 1}
    bus.run(5)
    assert bus.holders(0) == [0, 1]
    assert {m.kind for m in bus.log} == {"heartbeat"}


def test_holders_patrol_while_streets_are_overdue_and_then_take_targets_again():
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi)], [(50, 0), (250, 0)]).run(10)
    held = [side.holding.since for side in bus.sides]
    awarded = len(bus.said(Award))
    bus.overdue = 0.3
    began = []
    for _ in range(40):
        bus.tick()
        began += [bus.time for side in bus.sides if side.patrolling]
    assert min(began) >= min(held) + bus.config.revisit_dwell
    assert all(side.patrolling and side.holding is None for side in bus.sides)
    assert len(bus.said(Award)) == awarded  # nobody takes one meanwhile
    bus.overdue = 0.07  # not enough yet
    bus.run(5)
    assert all(side.patrolling for side in bus.sides)
    bus.overdue = 0.01
    bus.run(12)
    assert sorted(bus.holders(0) + bus.holders(1)) == [0, 1]


def test_nobody_patrols_where_another_is_free():
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi)], [(50, 0)]).run(10)
    bus.overdue = 0.5
    bus.run(60)
    assert not any(side.patrolling for side in bus.sides)
    assert len(bus.holders(0)) == 1


def test_names_that_a_holder_uses_the_other_way_round_are_exchanged():
    """Two vehicles passed close by, and each agent knows them by the other's names."""
    one, two = TrackId(0.0, 0, 1), TrackId(0.0, 0, 2)
    names = {(0, 0): one, (0, 1): two, (1, 0): two, (1, 1): one}
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi)], [(100, 0), (120, 0)], names=names)
    hold(bus, (0,), 0)
    bus.run(3)
    assert bus.names[1, 0] == bus.names[0, 0]
    assert bus.names[1, 1] == bus.names[0, 1]
    bus.run(8)
    assert [bus.holders(0), bus.holders(1)] in ([[0], [1]], [[1], [0]])


def test_exchanged_names_take_their_trails_along_and_end_auctions_at_the_wrong_place():
    one, two = TrackId(0.0, 0, 1), TrackId(0.0, 0, 2)
    names = {(0, 0): one, (0, 1): two, (1, 0): two, (1, 1): one}
    bus = Bus([(0, 0, 0.0), (300, 0, math.pi)], [(100, 0), (120, 0)], names=names)
    bus.run(1)
    ledger = bus.sides[1]._ledger
    assert {one, two} & set(ledger.auctions)
    before = dict(ledger._trails._trails)
    ledger.uncross(one, (100.0, 0.0))
    assert not {one, two} & set(ledger.auctions)
    assert ledger._trails._trails == {one: before[two], two: before[one]}


def test_an_awarded_auction_goes_on_when_another_announces_the_target():
    bus = Bus([(0, 0, 0.0), (60, 0, 0.0)], [(100, 0)], seers={0: {0}})
    ledger = bus.sides[0]._ledger
    while not any(auction.award for auction in ledger.auctions.values()):
        bus.tick()
        assert bus.time < 20.0
    ((name, auction),) = ledger.auctions.items()
    award = auction.award
    word = Announce(2, 1, bus.time, target=name, position=(100, 0), course=0.0, cost=1.0)
    bus.inboxes[0] = [word]
    bus.dead.add(1)
    bus.run(3)
    assert ledger.auctions[name].award == award
    assert ledger.auctions[name].tries == 2


# -- several auctions at once ----------------------------------------------------------------------

SPREAD = [(60.0 * k, 170.0 * (k % 3), 0.5 * k) for k in range(5)]
FOUND = [(250.0 - 55.0 * k, 90.0 * k) for k in range(5)]


def found_at_once(script=None):
    """Five agents; each has just found one target that the others know nothing of."""
    names = {(agent, k): TrackId(0.0, k, 1) for agent in range(5) for k in range(5)}
    seers = {k: {k} for k in range(5)}
    bus = Scripted(SPREAD, FOUND, script or {}, seers=seers, names=names)
    bus.trackers = seers
    return bus


def holders_of(bus):
    return [bus.holders(k) for k in range(5)]


def least(bus):
    costs = np.array([[bus.cost(agent, k) for k in range(5)] for agent in range(5)])
    agents, targets = linear_sum_assignment(costs)
    return [[int(agents[targets == k][0])] for k in range(5)]


def test_of_auctions_that_end_together_the_highest_auctioneer_settles_all():
    bus = found_at_once().run(4)
    assert {m.sender for m in bus.said(Award)} == {4}
    assert len(bus.said(Award)) == 5
    assert holders_of(bus) == least(bus)


def test_a_bid_that_does_not_reach_the_others_makes_no_difference():
    lost = {2: [(a, b) for a, b in links(5) if b != 4]}
    bus = found_at_once(lost).run(4)
    assert holders_of(bus) == least(bus)


def test_who_does_not_hear_the_leader_awards_a_step_later_itself():
    """Nobody hears agent 4 from its bid on: all others take the first of those left for leader."""
    silent = {tick: [(4, k) for k in range(4)] for tick in range(2, 40)}
    bus = found_at_once(silent)
    said = {}
    for _ in range(12):
        bus.tick()
        bus.trackers = {k: {k, *agents} for k, agents in enumerate(holders_of(bus))}
        for m in bus.log:
            if isinstance(m, Award) and m.sender != 4:
                said.setdefault(m.sender, bus.time)
        bus.log.clear()
    assert set(said.values()) == {4.0}  # at 3 they waited for the word of agent 4
    held = [[agent for agent in agents if agent != 4] for agents in holders_of(bus)]
    assert sorted(itertools.chain(*held)) == [0, 1, 2, 3]
    assert max(map(len, held)) == 1


def test_an_auction_that_is_awarded_already_keeps_nobody_from_another():
    """Its winner does not answer; who is left is still free for what is found meanwhile."""
    bus = Scripted([(0, 0, 0.0), (285, 0, 0.0), (200, -90, 0.0)], [(290, 0), (20, 310)], {})
    bus.seers = bus.trackers = {0: {0}, 1: {0}}
    bus.health = {0: "weak"}  # it bids for nothing itself
    bus.trackers[1] = set()
    bus.script = {tick: [(0, 1)] for tick in range(3, 12)}  # agent 1 hears of no award
    bus.run(3)
    assert [m.winner for m in bus.said(Award)] == [1]
    bus.trackers[1] = {0}
    bus.run(3)
    second = [m for m in bus.said(Award) if m.target == bus.names[0, 1]]
    assert [m.winner for m in second] == [2]


def test_the_auctioneer_repeats_what_the_leader_awarded():
    """The leader's award does not reach its winner; who announced the target says it again."""
    winner, target = next((h[0], k) for k, h in enumerate(least(found_at_once())) if h != [k])
    assert target != 4
    bus = found_at_once({3: [(4, winner)]}).run(5)
    again = [m for m in bus.said(Award) if m.target == bus.names[target, target]]
    assert [m.sender for m in again] == [4, target]
    assert (again[0].winner, again[0].cost, again[0].bids) == (
        again[1].winner, again[1].cost, again[1].bids,
    )  # fmt: skip
    assert holders_of(bus.run(1)) == least(bus)
