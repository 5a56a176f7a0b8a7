"""The team over a radio that is late, repeats itself and is shadowed: it still finds vehicles."""

import numpy as np
import pytest

import staniel
from staniel.datatypes.message import Announce, Award, Bid
from staniel.recording import read_record
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble

POOR = {
    "sigma": 4000.0,  # distance takes next to nothing, wherever they fly
    "latency": 1.5,
    "jitter": 2.0,
    "duplication": 0.2,
    "building_loss": 0.5,
    "bandwidth": 2000.0,
    "partitions": [{"start": 60.0, "end": 90.0, "groups": [[0, 1], [2, 3]]}],
}


@pytest.fixture(scope="module")
def poor(tmp_path_factory):
    out = tmp_path_factory.mktemp("poor") / "run"
    run = staniel.fly(load_scenario("downtown", minutes=3.0, radio=POOR), out=out)
    return run, read_record(out)


def test_the_team_finds_vehicles_all_the_same(poor):
    run, _ = poor
    found = [t for t in run.metrics["targets"] if t["found_at"] is not None]
    assert len(found) >= 2
    assert run.metrics["team"]["auctions"] > 0
    assert run.metrics["complete"]


def test_no_message_crosses_the_partition_and_the_links_say_who_heard_whom(poor):
    run, record = poor
    team, messages = run.metrics["team"], record.messages
    assert int(record.links.sum()) == team["messages_delivered"]
    assert np.array_equal(
        record.links.sum(axis=1),
        [messages["heard"][messages["sender"] == k].sum() for k in range(4)],
    )
    during = messages[(messages["time"] >= 60.0) & (messages["time"] < 90.0)]
    assert len(during) > 100
    assert during["heard"].max() <= 1
    shares = np.array(team["links"], dtype=float)
    assert np.isnan(shares.diagonal()).all()
    # A sixth of the time half the team is cut off.
    assert np.nanmax(shares[:2, 2:]) < 31 / 36 < np.nanmax(shares[:2, :2])
    assert all(0.4 < aircraft["heard_share"] < 1.0 for aircraft in run.metrics["aircraft"])


def test_it_is_the_same_run_again(poor, tmp_path):
    run, _ = poor
    again = staniel.fly(load_scenario("downtown", minutes=3.0, radio=POOR), out=tmp_path / "run")
    metrics = {key: value for key, value in run.metrics.items() if key != "real_time_factor"}
    assert metrics == {k: v for k, v in again.metrics.items() if k != "real_time_factor"}


def test_the_receptions_name_everyone_who_heard(poor):
    _, record = poor
    rows, hearers = record.receptions.T
    assert (np.diff(rows) >= 0).all()
    assert np.array_equal(
        np.bincount(rows, minlength=len(record.messages)), record.messages["heard"]
    )
    assert (record.messages["sender"][rows] != hearers).all()
    links = np.zeros_like(record.links)
    np.add.at(links, (record.messages["sender"][rows], hearers), 1)
    assert np.array_equal(links, record.links)


@pytest.mark.parametrize(("latency", "hop"), [(0.0, 1), (1.0, 1), (1.2, 2), (4.0, 4)])
def test_bids_come_in_time_however_slow_the_radio_is(latency, hop):
    """Who is nearer than the finder of a target is awarded it: it was heard before the award."""
    bids = sold = 0
    waits = []
    for seed in range(4):
        scenario = load_scenario(
            "downtown",
            seed=seed,
            minutes=2.0,
            radio={"latency": latency},
            guidance={"pursuit": "carrot"},
        )
        mission = assemble(scenario, build_city(scenario.city, scenario.seed))
        opened = {}
        for frame in mission.frames():
            for delivery in frame.deliveries:
                message = delivery.message
                match message:
                    case Announce():
                        opened[message.sender, message.target] = message.time
                    case Bid():
                        bids += 1
                    case Award() if (message.sender, message.target) in opened:
                        # Two ticks as by default, and what two hops take beyond a tick each; what
                        # comes later is the same award said again. A hop more where it waited in
                        # vain for the word of another, whose auction ended as well.
                        waited = message.time - opened.pop((message.sender, message.target))
                        waits.append(waited - 2.0 - 2.0 * (hop - 1))
                        sold += message.winner != message.sender
    assert bids > 0
    assert sold > 0
    assert set(waits) <= {0.0, float(hop)}
    assert waits.count(0.0) > len(waits) / 2
