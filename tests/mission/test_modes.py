"""Decentralised, centralised or neither: the same agents, and what the station is for."""

import numpy as np
import pytest

import staniel
from staniel.datatypes.message import Award, Beacon
from staniel.metrics.custody import custody, longest_run
from staniel.scenario.assemble import assemble
from staniel.scenario.build import build_city

CITY = {"size": [400.0, 400.0]}


def scenario(mode, minutes=3.0, seed=2, **changes):
    changes = {"city": CITY, "guidance": {"pursuit": "carrot"}} | changes
    return staniel.load_scenario(
        "downtown", seed=seed, minutes=minutes, cooperation={"mode": mode}, **changes
    )


def said(scenario):
    """All messages of a mission."""
    mission = assemble(scenario, build_city(scenario.city, scenario.seed))
    return [delivery.message for frame in mission.frames() for delivery in frame.deliveries]


@pytest.fixture(scope="module")
def led():
    return said(scenario("centralised"))


def test_in_the_centralised_mode_the_station_alone_awards(led):
    kinds = {(m.kind, m.sender) for m in led}
    assert {sender for kind, sender in kinds if kind in ("award", "beacon")} == {4}
    assert not {kind for kind, _ in kinds} & {"announce", "bid", "revoke", "handover"}
    assert {m.winner for m in led if isinstance(m, Award)} == {0, 1, 2, 3}
    assert sum(isinstance(m, Beacon) for m in led) == 180


@pytest.mark.parametrize("mode", ["decentralised", "centralised"])
def test_nobody_is_held_twice_for_long_and_nobody_waits(mode):
    kept = custody(staniel.fly(scenario(mode)).record)
    bound = 22.0  # s: a heartbeat, the lease, one auction
    assert longest_run(kept.doubled, 1.0) <= bound
    assert longest_run(kept.orphaned, 1.0) <= bound
    assert kept.held.any(axis=(0, 1)).all()


def test_without_the_station_they_auction_by_themselves():
    silent, lease = 60.0, 8.0
    messages = said(scenario("centralised", faults={"station": silent}, vehicles={"count": 6}))
    own = [m for m in messages if m.kind in ("announce", "bid", "award") and m.sender < 4]
    assert own
    assert min(m.time for m in own) >= silent + lease - 1.0


def test_who_does_not_cooperate_shares_nothing_out():
    messages = said(scenario("none"))
    assert {m.kind for m in messages} <= {"heartbeat", "report", "looked"}


def test_the_team_beats_none_where_targets_are_as_many_as_aircraft():
    """Greedy aircraft crowd on the same targets: fewer are in sight."""

    def seen(mode):
        figures = [
            staniel.fly(scenario(mode, 4.0, seed)).metrics["team"]["visible_fraction"]
            for seed in range(4)
        ]
        return float(np.mean(figures))

    assert seen("decentralised") > seen("none")


def test_the_same_seed_gives_the_same_run_in_every_mode():
    for mode in ("centralised", "none"):
        first, second = (staniel.fly(scenario(mode, 1.0)).record for _ in range(2))
        np.testing.assert_array_equal(first.aircraft, second.aircraft)
        assert first.messages.tobytes() == second.messages.tobytes()
