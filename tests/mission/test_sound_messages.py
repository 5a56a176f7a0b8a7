"""What a team says in a mission is sound, goes through a wire, and passes every gate."""

from staniel.cooperation import Gate
from staniel.datatypes.malformed import fault_of
from staniel.datatypes.wire import decode, encode, wire_size
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble

RISK = {
    "regions": [
        {"kind": "threat", "center": [300.0, 300.0], "radius": 60.0, "rate": 0.1, "briefed": False}
    ],
    "carried": {"radius": 60.0, "rate": 0.1},
    "sensor": {"range": 200.0},
}


def test_all_that_is_said_in_a_mission_is_sound_and_admitted():
    scenario = load_scenario(
        "downtown", minutes=1.0, risk=RISK, cooperation={"assistance": "always"}
    )
    mission = assemble(scenario, build_city(scenario.city, scenario.seed))
    team = range(len(mission.agents))
    gates = [Gate(agent, team=team) for agent in team]
    kinds = set()
    for frame in mission.frames():
        for delivery in frame.deliveries:
            message = delivery.message
            kinds.add(message.kind)
            assert fault_of(message) is None
            packet = encode(message)
            assert len(packet) == wire_size(message)
            assert decode(packet).sequence == message.sequence
            for agent in delivery.heard_by:
                assert gates[agent].admit(frame.truth.time, [message]) == [message]
    assert not any(sum(gate.dropped.values()) for gate in gates)
    assert {"heartbeat", "report", "warn", "announce", "award"} <= kinds
