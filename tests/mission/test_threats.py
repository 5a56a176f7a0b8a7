"""Dangers in a mission: who noticed, who was told, who knows; records, figures, other flights."""

import math

import numpy as np
import pytest

import staniel
from staniel.agent import Agent
from staniel.datatypes.message import Warn
from staniel.datatypes.risk import RiskConfig
from staniel.datatypes.threats import Threats
from staniel.errors import RecordError
from staniel.record import THREAT_DTYPE
from staniel.recording import read_record
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble

BRIEFED = {"kind": "no-fly", "polygon": [[0, 0], [60, 0], [60, 60]]}
HIDDEN = [
    {"kind": "threat", "center": [150.0, 150.0], "radius": 30.0, "rate": 0.5, "briefed": False},
    {"kind": "no-fly", "polygon": [[0, 240], [60, 240], [60, 300], [0, 300]], "briefed": False},
    {"kind": "no-fly", "center": [5000.0, 5000.0], "radius": 50.0, "briefed": False},
]
REGIONS = [BRIEFED, *HIDDEN]
CARRIED = {"radius": 90.0, "rate": 0.1, "vehicles": [0]}
SENSOR = {"range": 110.0, "noise": 8.0, "probability": 0.5}


def dangerous(minutes=1.0, seed=2, **changes):
    return load_scenario(
        "village",
        **{
            "minutes": minutes, "seed": seed, "aircraft.count": 3, "risk.regions": REGIONS,
            "risk.carried": CARRIED, "risk.sensor": SENSOR, **changes,
        },
    )  # fmt: skip


def ready(scenario):
    return assemble(scenario, build_city(scenario.city, scenario.seed))


def follow(scenario):
    """Each frame of a mission, with the regions that each agent knows after it."""
    mission = ready(scenario)
    for frame in mission.frames():
        yield frame, [set(agent.dangers.regions) for agent in mission.agents]


def noticed_by(percept):
    return set(percept.threats.regions)


@pytest.mark.parametrize("radio", [{}, {"radio.sigma": 120.0}, {"radio.range": 0.0}])
def test_agents_know_what_they_were_briefed_on_noticed_or_told_and_no_more(radio):
    """An account kept beside the mission, of percepts and deliveries alone."""
    scenario = dangerous(seed=1, **radio)
    told = set(scenario.risk.briefed)
    wanted = [set(told) for _ in range(3)]
    ever_noticed = [set() for _ in range(3)]
    for frame, known in follow(scenario):
        for agent, percept in enumerate(frame.percepts):
            ever_noticed[agent] |= noticed_by(percept)
            wanted[agent] |= noticed_by(percept)
        for delivery in frame.deliveries:
            if isinstance(delivery.message, Warn):
                for agent in delivery.heard_by:
                    wanted[agent] |= set(delivery.message.threats.regions)
        assert known == wanted
    everything, never = set(scenario.risk.regions[:3]), scenario.risk.regions[3]
    assert all(never not in known for known in wanted)
    if radio == {"radio.range": 0.0}:
        assert wanted == [told | own for own in ever_noticed]
        assert wanted != [everything] * 3  # somebody missed something that another noticed
        assert set.union(*wanted) == everything
    elif not radio:
        assert wanted == [everything] * 3
        assert ever_noticed != [everything - told] * 3  # somebody was told


FAR = {"risk.regions": [BRIEFED, HIDDEN[2]], "risk.carried": {}}


@pytest.mark.parametrize("changes", [{"risk.sensor": {}}, FAR])
def test_nobody_knows_what_nobody_noticed_and_nobody_was_told(changes):
    """Without a sensor in the midst of dangers, and with one far from them."""
    scenario = dangerous(minutes=0.5, **changes)
    for frame, known in follow(scenario):
        assert known == [set(scenario.risk.briefed)] * 3
        assert not any(percept.threats for percept in frame.percepts)
        assert not any(isinstance(delivery.message, Warn) for delivery in frame.deliveries)


def test_carriers_are_known_near_where_they_are_to_those_who_were_told():
    scenario = dangerous(**{"risk.regions": []})
    mission, told, counts = ready(scenario), 0, []
    for frame in mission.frames():
        heard = {
            agent
            for delivery in frame.deliveries
            if isinstance(delivery.message, Warn)
            for agent in delivery.heard_by
        }
        for agent in mission.agents:
            carriers = agent.dangers.at(frame.truth.time).carriers
            counts.append(len(carriers))
            if agent.id in heard and not frame.percepts[agent.id].threats:
                told += 1
                off = carriers[:, :2] - frame.truth.vehicles[0, :2]
                sigmas = np.sqrt(carriers[:, 2])  # round: noise and driving have no direction
                assert (np.hypot(*off.T) < 4.0 * sigmas).any()
    assert told > 5
    assert max(counts) == 1
    assert min(counts) == 0


def test_without_a_radio_a_sensor_changes_nobodys_flight():
    def paths(scenario):
        return np.array([frame.truth.aircraft for frame in ready(scenario).frames()])

    silent = {"radio.range": 0.0, "guidance.pursuit": "carrot"}
    assert np.array_equal(
        paths(dangerous(**silent)), paths(dangerous(**silent, **{"risk.sensor": {}}))
    )


def test_who_looks_ahead_flies_by_what_it_noticed_and_not_before():
    silent = {"radio.range": 0.0, "guidance.pursuit": "lookahead"}
    changed = 0
    for seed in range(4):
        sensed = list(ready(dangerous(seed=seed, **silent)).frames())
        blind = list(ready(dangerous(seed=seed, **silent, **{"risk.sensor": {}})).frames())
        for agent in range(3):
            threats = [bool(frame.percepts[agent].threats) for frame in sensed]
            noticed = threats.index(True) if True in threats else len(threats)
            apart = [
                not np.array_equal(a.truth.aircraft[agent], b.truth.aircraft[agent])
                for a, b in zip(sensed, blind, strict=True)
            ]
            assert not any(apart[: noticed + 1])
            changed += any(apart)
    assert changed > 0


def test_the_sensor_does_not_touch_the_other_streams():
    """What cameras see and radios carry until the first warning is what they were."""
    with_sensor, without = dangerous(minutes=0.5), dangerous(minutes=0.5, **{"risk.sensor": {}})
    same = 0
    for a, b in zip(ready(with_sensor).frames(), ready(without).frames(), strict=True):
        assert np.array_equal(a.truth.vehicles, b.truth.vehicles)
        if any(isinstance(delivery.message, Warn) for delivery in a.deliveries):
            break
        same += 1
        assert [p.sightings for p in a.percepts] == [p.sightings for p in b.percepts]
        assert a.deliveries == b.deliveries
    assert same > 0


def test_agents_read_neither_the_truth_nor_the_scenarios_dangers(monkeypatch):
    scenario = dangerous()
    mission = ready(scenario)
    thinking, reads, step, plain = [False], [], Agent.step, RiskConfig.__getattribute__

    def read(self, name):
        reads.append(name)
        assert not thinking[0], f"RiskConfig.{name} was read by an agent"
        return plain(self, name)

    def think(self, percept, inbox):
        thinking[0] = True
        try:
            return step(self, percept, inbox)
        finally:
            thinking[0] = False

    monkeypatch.setattr(RiskConfig, "__getattribute__", read)
    monkeypatch.setattr(Agent, "step", think)
    last = list(mission.frames())[-1]
    assert len(mission.agents[0].dangers.regions) > 1
    assert scenario.risk.regions  # the poison works: this is a read
    assert reads
    own = (last.truth.vehicles, last.truth.vehicle_path, last.truth.aircraft)
    for frame in ready(scenario).frames():
        for percept in frame.percepts:
            for carrier in percept.threats.carriers:
                assert not any(np.shares_memory(carrier.position, array) for array in own)
                assert math.dist(carrier.position, frame.truth.vehicles[0, :2]) > 1e-3


def test_the_briefing_of_carriers_reaches_policies_through_their_tracks():
    scenario = dangerous(
        minutes=2.0, **{"risk.carried": {**CARRIED, "briefed": True}, "risk.sensor": {}}
    )
    mission, seen = ready(scenario), []
    for agent in mission.agents:
        assert agent._briefing.carried.vehicles is None
        policy = agent._pursue

        def spy(pursuit, policy=policy):
            seen.append((pursuit.dangers, pursuit.track))
            return policy(pursuit)

        agent._pursue = spy
    for _ in mission.frames():
        pass
    assert seen
    for dangers, track in seen:
        assert dangers.regions == scenario.risk.briefed
        near = dangers.rate([[*track.position, 30.0]])[0]
        assert near > 0.5 * 0.1 * track.existence
        assert dangers.forbidden([[50.0, 10.0, 80.0], [10.0, 50.0, 80.0]]).tolist() == [True, False]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    out = tmp_path_factory.mktemp("threats") / "run"
    return staniel.fly(dangerous(), out=out)


def test_the_record_says_what_was_noticed_of_what(flown):
    back, scenario = read_record(flown.folder), dangerous()
    wanted = []
    for frame in ready(scenario).frames():
        for agent, (percept, origins) in enumerate(zip(frame.percepts, frame.noticed, strict=True)):
            threats = percept.threats
            assert threats.regions == tuple(
                scenario.risk.regions[k] for k in origins[: len(threats.regions)]
            )
            nowhere = (math.nan,) * 5
            rows = [(percept.time, agent, "region", k, *nowhere) for k in origins]
            for k, carrier in enumerate(threats.carriers, len(threats.regions)):
                spread = (64.0, 0.0, 64.0)
                place = np.round(carrier.position, 3).tolist()
                rows[k] = (percept.time, agent, "carrier", origins[k], *place, *spread)
            wanted += rows
    assert {row[2] for row in wanted} == {"region", "carrier"}
    table = np.array(wanted, dtype=THREAT_DTYPE)
    for name in THREAT_DTYPE.names:
        equal_nan = THREAT_DTYPE[name].kind == "f"
        assert np.array_equal(back.threats[name], table[name], equal_nan=equal_nan), name
    kinds = back.messages["kind"].tolist()
    assert kinds.count("warn") > 10
    assert np.isnan(back.messages["x"][back.messages["kind"] == "warn"]).all()


def test_the_figures_say_when_each_region_was_first_noticed(flown):
    threats = flown.record.threats
    regions = threats[threats["kind"] == "region"]
    noticed = flown.metrics["team"]["risk_noticed"]
    assert [entry["region"] for entry in noticed] == [1, 2, 3]
    for entry in noticed[:2]:
        times = regions["time"][regions["origin"] == entry["region"]]
        assert entry["time"] == times.min()
    assert noticed[2]["time"] is None


def test_the_same_seed_notices_the_same_to_the_last_byte(flown, tmp_path):
    again = staniel.fly(dangerous(), out=tmp_path / "again")
    first, second = (run.folder / "mission.mcap" for run in (flown, again))
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize("wrong", ['"0rigin":0', '"origin":[', '"origin":{'])
def test_a_record_of_threats_that_are_none_is_refused(flown, tmp_path, wrong):
    data = (flown.folder / "mission.mcap").read_bytes()
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(data.replace(b'"carrier","origin":0', f'"carrier",{wrong}'.encode()))
    with pytest.raises(RecordError, match="/staniel/threats"):
        read_record(broken)


def test_warnings_are_empty_handed_only_if_nothing_was_noticed():
    assert not Threats()
    for frame, _ in follow(dangerous(minutes=0.5)):
        for delivery in frame.deliveries:
            if isinstance(delivery.message, Warn):
                assert delivery.message.threats
