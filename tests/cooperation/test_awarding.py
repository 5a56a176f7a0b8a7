"""Who is awarded what: the lowest, and the best for all, against scipy and by messages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from staniel.cooperation import CooperationConfig, Task
from staniel.cooperation.awarding import best_for_all, lowest, offers_of
from staniel.cooperation.table import UnheldTable
from staniel.cooperation.trails import Trails
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Bid, Offer, Unheld
from team_bus import Bus

NAMES = [TrackId(0.0, 50, k) for k in range(6)]


def bids_of(costs):
    """One bid a row, on all finite columns."""
    bids = []
    for row, line in enumerate(costs):
        some = np.flatnonzero(np.isfinite(line)).tolist()
        if some:
            names = tuple(NAMES[k] for k in some)
            bids.append(Bid(row, 1, 0.0, names, (50,) * len(some), tuple(line[some].tolist())))
    return bids


def test_the_lowest_wins_and_ties_go_to_the_higher_id():
    offers = {k: Offer(k, cost) for k, cost in ((0, 5.0), (1, 3.0), (2, 3.0))}
    assert lowest(offers).bidder == 2
    assert lowest({}) is None


def test_the_last_of_several_bids_counts():
    bids = [Bid(1, k, 0.0, (NAMES[0],), (50,), (cost,)) for k, cost in ((1, 9.0), (2, 4.0))]
    assert offers_of(NAMES[:2], bids) == {NAMES[0]: {1: Offer(1, 4.0)}, NAMES[1]: {}}
    assert offers_of((), bids) == {}


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32))
def test_settled_together_targets_cost_the_least_there_is(rows, columns, seed):
    rng = np.random.default_rng(seed)
    costs = rng.uniform(0.0, 100.0, (rows, columns))
    costs[rng.random(costs.shape) < 0.2] = np.inf  # no bid for these
    winners = best_for_all(offers_of(NAMES[:columns], bids_of(costs)))
    found = [(offer.bidder, NAMES.index(name)) for name, offer in winners.items()]
    assert len({bidder for bidder, _ in found}) == len(found)
    assert all(winners[NAMES[k]].cost == costs[bidder, k] for bidder, k in found)
    # As many as can be, at the least cost of all ways to do so.
    barred = np.where(np.isinf(costs), 1e6, costs)
    best = barred[linear_sum_assignment(barred)]
    assert len(found) == (best < 1e6).sum()
    assert sum(costs[k] for k in found) == pytest.approx(best[best < 1e6].sum())


@pytest.mark.parametrize("seed", range(5))
def test_a_team_shares_new_targets_out_at_the_least_cost_by_messages(seed):
    rng = np.random.default_rng(seed)
    poses = [(*rng.uniform(0, 900, 2), rng.uniform(-3, 3)) for _ in range(6)]
    places = [(150.0 * k, *rng.uniform(0, 900, 1)) for k in range(6)]
    names = {(agent, k): TrackId(0.0, k, 1) for agent in range(6) for k in range(6)}
    bus = Bus(poses, places, seers={k: {k} for k in range(6)}, names=names)
    bus.trackers = {k: {k} for k in range(6)}
    bus.run(4)
    costs = np.array([[bus.cost(agent, k) for k in range(6)] for agent in range(6)])
    holders = [bus.holders(k) for k in range(6)]
    assert all(len(held) == 1 for held in holders)
    got = sum(costs[held[0], k] for k, held in enumerate(holders))
    assert got == pytest.approx(costs[linear_sum_assignment(costs)].sum())


def test_single_auctions_cost_more():
    """Over the same teams: the thesis' rule against the joint one."""
    ratios = []
    for seed in range(12):
        got = {}
        for rule in ("lowest", "joint"):
            rng = np.random.default_rng(seed)
            poses = [(*rng.uniform(0, 900, 2), rng.uniform(-3, 3)) for _ in range(8)]
            places = [(120.0 * k, *rng.uniform(0, 900, 1)) for k in range(8)]
            names = {(agent, k): TrackId(0.0, k, 1) for agent in range(8) for k in range(8)}
            seers = {k: {k} for k in range(8)}
            config = CooperationConfig(award=rule, handover_margin=1e5)
            bus = Bus(poses, places, seers=seers, names=names, config=config)
            bus.trackers = seers
            bus.run(40)
            held = [bus.holders(k) for k in range(8)]
            assert all(len(agents) == 1 for agents in held)
            got[rule] = sum(bus.cost(agents[0], k) for k, agents in enumerate(held))
        ratios.append(got["lowest"] / got["joint"])
    assert min(ratios) >= 1.0 - 1e-9
    assert np.mean(ratios) > 1.03


def test_unheld_targets_the_newer_sighting_stands_and_the_buried_stay_buried():
    table = UnheldTable(memory=100.0)
    old, new = Unheld(NAMES[0], (0.0, 0.0), 0.0, 5.0), Unheld(NAMES[0], (9.0, 0.0), 0.0, 8.0)
    assert table.hear((old, new, old), 10.0) == []
    assert table.all == [new]
    table.bury(NAMES[0], 12.0)
    assert table.hear((new,), 13.0) == [new]
    assert table.all == []
    later = new._replace(seen=14.0)
    assert table.hear((later,), 15.0) == []
    assert table.told == (later,)
    table.forget(115.0)
    assert table.all == []


def test_a_track_that_was_there_explains_an_old_word():
    trails = Trails(memory=60.0, near=12.0)
    for second in range(10, 30):
        trails.note(float(second), [Task(NAMES[0], (2.0 * second, 0.0), 0.0, 1.0, True)])
    speeds = {NAMES[0]: 2.0}
    there = Unheld(NAMES[1], (42.0, 3.0), 0.0, 20.0)
    assert trails.explained([there], speeds) == [there]
    assert trails.explained([there._replace(seen=29.0)], speeds) == []  # 16 m off by then
    assert trails.explained([there._replace(position=(42.0, 30.0))], speeds) == []
    before = Unheld(NAMES[1], (0.0, 10.0), 0.0, 5.0)
    assert trails.explained([before], speeds) == [before]  # it can have come from there
    assert trails.explained([before._replace(position=(0.0, 60.0))], speeds) == []
    assert trails.explained([there._replace(target=NAMES[0])], speeds) == []
