"""An agent's door: junk is dropped and counted and leaves no trace; good messages pass once."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from any_message import messages, spoiled, tries
from staniel.agent import Agent, Briefing
from staniel.city import City
from staniel.cooperation import CooperationConfig, Gate
from staniel.cooperation.gate import BURST, COPIES, MOST_SENDERS, PACE, REASONS
from staniel.datatypes.belief import Percept, Pose, Sighting, TrackId
from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.malformed import fault_of
from staniel.datatypes.message import (
    AssistanceEnd,
    Award,
    Bundle,
    Heartbeat,
    Looked,
    Release,
    Report,
)
from staniel.datatypes.wire import encode
from staniel.guidance import GuidanceConfig
from staniel.tracking import TrackingConfig

NAME = TrackId(0.5, 1, 1)
KEY = b"the team's own key"
FORGET = 60.0 + 1.0 + 1.0  # patience, a step, and what clocks may differ by


def word(sequence, time=10.0, sender=1):
    return AssistanceEnd(sender, sequence, time, target=NAME)


def counts(gate):
    return {reason: count for reason, count in gate.dropped.items() if count}


def memory(gate):
    return {k: (v.newest, v.heard, v.at) for k, v in gate._senders.items()}


# -- copies ----------------------------------------------------------------------------------------


def test_each_message_passes_once_in_the_order_in_which_it_comes():
    gate = Gate(0)
    box = [word(5), word(3), word(5), word(4), word(3), word(6)]
    assert [m.sequence for m in gate.admit(10.0, box)] == [5, 3, 4, 6]
    assert gate.admit(11.0, box) == []
    assert counts(gate) == {"replayed": 8}
    assert gate.admit(11.0, [word(5, sender=2)]) == [word(5, sender=2)]


@tries(0.01)
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(1, 2)), max_size=80))
def test_copies_are_known_as_a_slow_oracle_knows_them(stream):
    gate, heard = Gate(0), {1: [], 2: []}
    for sequence, sender in stream:
        numbers = heard[sender]
        newest = max(numbers, default=sequence)
        fresh = sequence not in numbers and -COPIES < sequence - newest <= BURST
        assert bool(gate.admit(10.0, [word(sequence, sender=sender)])) == fresh
        if fresh:
            numbers.append(sequence)


# -- each reason -----------------------------------------------------------------------------------


def test_malformed_and_oversized():
    gate = Gate(0)
    large = Looked(1, 2, 10.0, cells=bytes(40_000))
    assert gate.admit(10.0, [word(-1), None, word(1, time=math.nan), large, word(1)]) == [word(1)]
    assert counts(gate) == {"malformed": 3, "oversized": 1}


def test_forged():
    gate = Gate(0, team=range(4))
    assert gate.admit(10.0, [word(1, sender=0), word(1, sender=4), word(1, sender=3)]) == [
        word(1, sender=3)
    ]
    assert counts(gate) == {"forged": 2}
    assert len(Gate(0).admit(10.0, [word(1, sender=65_534)])) == 1


def test_stale():
    gate = Gate(0, patience=5.0, step=0.5)
    times = [4.9, 5.0, 9.9, 10.0, 11.5, 11.6]
    passed = gate.admit(10.0, [word(k, time=time) for k, time in enumerate(times)])
    assert [m.sequence for m in passed] == [1, 2, 3, 4]
    assert [m.time for m in passed] == [5.0, 9.9, 10.0, 10.0]  # said now at the latest
    assert counts(gate) == {"stale": 2}


def test_nothing_is_told_of_what_is_not_yet():
    """A clock that is ahead: what was seen after now would surprise a tracker."""
    gate = Gate(0)
    seen = Sighting(11.0, [0.0, 0.0], np.eye(2))
    box = [
        Report(1, 1, 11.0, sightings=(seen,)),
        Bundle(1, 2, 11.0, claims=(), heard=((1, 11.0),)),
        Report(1, 3, 11.0, sightings=(replace(seen, time=9.0),)),
        Release(1, 4, 11.0, target=NAME, position=(0.0, 0.0), lost=True, seen=11.0),
    ]
    assert [(m.sequence, m.time) for m in gate.admit(10.0, box)] == [(3, 10.0)]
    assert counts(gate) == {"stale": 3}


def test_packets():
    gate = Gate(0, team=range(4), key=KEY)
    good = [encode(word(k), KEY) for k in range(3)]
    junk = [
        encode(word(9)),
        encode(word(9), b"somebody else's key"),
        encode(word(9, sender=7), KEY),
        encode(word(9, time=700.0), KEY),
        good[0],
        b"",
        b"\xa0",
        bytes(50_000),
        good[1][:-1],
        None,
    ]
    assert gate.open(10.0, [*good, *junk]) == [word(0), word(1), word(2)]
    assert gate.dropped == {
        "malformed": 2,
        "oversized": 1,
        "forged": 5,
        "stale": 1,
        "replayed": 1,
    }


# -- attacks ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [BURST + 101, 1000, 2**32 - 1])
def test_one_false_number_silences_nobody(number):
    """It is refused where it is far off, and harmless where it is not."""
    gate = Gate(0)
    for k in range(5):
        assert gate.admit(float(k), [word(k, time=float(k))])
    gate.admit(5.0, [word(4 + number, time=5.0), word(4 + BURST + int(PACE), time=5.0)])
    for k in range(5, 40):
        assert gate.admit(float(k), [word(k, time=float(k))]), k


def test_a_false_first_number_silences_for_no_longer_than_patience():
    gate = Gate(0)
    assert gate.admit(0.0, [word(2**32 - 1, time=0.0)])
    passed = [k for k in range(1, 100) if gate.admit(float(k), [word(k, time=float(k))])]
    assert passed == list(range(int(FORGET) + 1, 100))


def test_who_was_away_is_heard_again_whatever_it_said_meanwhile():
    for away in (5.0, 50.0, 500.0):
        gate = Gate(0)
        assert gate.admit(10.0, [word(1)])
        assert gate.admit(10.0 + away, [word(1 + round(90 * away), time=10.0 + away)])


@tries(0.01)
@given(st.lists(st.tuples(st.floats(0.0, 40.0), st.integers(0, 9)), max_size=40))
def test_what_is_forgotten_is_not_heard_twice(stream):
    """Copies of all that was said, in any order, over several times the patience."""
    gate, now, passed = Gate(0), 0.0, []
    said = [word(k, time=20.0 * k) for k in range(10)]
    for late, which in stream:
        now += late
        passed += [m.sequence for m in gate.admit(now, [said[which]])]
    assert len(passed) == len(set(passed))


def test_memory_is_bounded_and_those_known_are_still_heard():
    gate = Gate(0)
    assert gate.admit(10.0, [word(1, sender=60_000)])
    gate.admit(10.0, [word(1, sender=sender) for sender in range(1, 5000)])
    assert len(gate._senders) == MOST_SENDERS
    assert counts(gate) == {"forged": 5000 - MOST_SENDERS}
    later = 11.0 + FORGET
    for time, sequence in ((40.0, 2), (later, 3)):
        assert gate.admit(time, [word(sequence, time=time, sender=60_000)])
    assert gate.admit(later, [word(1, time=later, sender=50_000)])  # the others are forgotten
    assert len(gate._senders) == 2


# -- any stream ------------------------------------------------------------------------------------


@st.composite
def streams(draw):
    """What a sound team says, and junk in between, tick by tick."""
    sequence, ticks = {1: 0, 2: 0, 3: 0}, []
    for now in range(draw(st.integers(1, 5))):
        good, junk = [], []
        for sender in draw(st.lists(st.integers(1, 3), max_size=6)):
            sequence[sender] += draw(st.integers(1, 30))
            good.append(word(sequence[sender], time=float(now), sender=sender))
        for _ in range(draw(st.integers(0, 8))):
            bad = draw(messages(times=st.just(float(now)), senders=st.integers(1, 3)) | spoiled())
            junk.append((draw(st.integers(0, len(good))), bad, draw(st.integers(0, 5))))
        ticks.append((good, junk))
    return ticks


def dropped_for_sure(bad, how, now, good, at):
    """`bad`, changed so that nothing can admit it."""
    earlier = [m for m in good[:at] if m.time == now]
    if fault_of(bad) is not None:
        return bad
    if how == 0:
        return replace(bad, sender=0)  # the agent's own name
    if how == 1:
        return replace(bad, sender=9)
    if how == 2:
        return Looked(1, bad.sequence, now, cells=bytes(32_768))
    if how == 3:
        return replace(word(bad.sequence), time=now - 61.0)
    if how == 4:
        return replace(word(bad.sequence), time=now + 2.1)
    return earlier[0] if earlier else word(-1)


@tries(0.01)
@given(streams())
def test_junk_changes_nothing(ticks):
    clean, fouled, total = Gate(0, team=range(4)), Gate(0, team=range(4)), 0
    for now, (good, junk) in enumerate(ticks):
        box = list(good)
        for at, bad, how in sorted(junk, key=lambda entry: -entry[0]):
            box.insert(at, dropped_for_sure(bad, how, float(now), good, at))
        assert fouled.admit(float(now), box) == clean.admit(float(now), good) == good
        assert memory(fouled) == memory(clean)
        total += len(junk)
    assert sum(fouled.dropped.values()) == total
    assert sum(clean.dropped.values()) == 0


@tries(0.01)
@given(st.lists(messages() | spoiled(), max_size=10), st.floats(0.0, 1e5))
def test_whatever_comes_is_admitted_or_counted(box, now):
    gate = Gate(0)
    passed = gate.admit(now, box)
    assert len(passed) + sum(gate.dropped.values()) == len(box)
    assert set(gate.dropped) == set(REASONS)
    assert all(fault_of(m) is None and now - 60.0 <= m.time <= now for m in passed)


@tries(0.01)
@given(st.lists(st.binary(max_size=80) | messages().map(encode), max_size=8))
def test_whatever_packets_come_are_admitted_or_counted(packets):
    gate = Gate(0)
    assert len(gate.open(100.0, packets)) + sum(gate.dropped.values()) == len(packets)


# -- a mind behind the door ------------------------------------------------------------------------

CITY = City.generate(size=(400.0, 400.0), density=0.3, seed=2)


def agent_of(avoidance):
    briefing = Briefing(
        chart=CITY,
        clock=Clock(),
        airframe=Airframe(),
        camera=Camera(),
        tracking=TrackingConfig(particles=100),
        cooperation=CooperationConfig(helpers=1),
        guidance=GuidanceConfig(pursuit="carrot", avoidance=avoidance),
    )
    return Agent(0, briefing, np.random.default_rng(3))


OWN = st.builds(TrackId, st.floats(0.0, 8.0), st.integers(0, 5), st.integers(0, 3))
OWN |= st.builds(TrackId, st.sampled_from([2.0, 3.0]), st.just(0), st.integers(0, 2))


@st.composite
def absurd(draw, now):
    """Sound messages that make no sense, some of them to or about the agent and its targets."""
    told = messages(times=st.just(now), senders=st.integers(1, 9), targets=OWN)
    box = []
    for k, message in enumerate(draw(st.lists(told, max_size=8))):
        about = {"sequence": round(now) * 20 + k}
        for field in ("winner", "auctioneer", "holder", "helper"):
            if hasattr(message, field) and draw(st.booleans()):
                about[field] = 0
        box.append(replace(message, **about))
    if draw(st.booleans()):
        box.append(draw(spoiled()))
    return box


@pytest.mark.parametrize("avoidance", ["none", "predictive"])
def test_an_agent_survives_whatever_it_is_told(avoidance):
    @tries(0.002, least=5)
    @given(st.data())
    def holds(data):
        agent, gate = agent_of(avoidance), Gate(0)
        for k in range(8):
            place = np.array([150.0 + 2.0 * k, 160.0])
            seen = Sighting(float(k), place, 2.0 * np.eye(2), reporter=0)
            pose = Pose(130.0 + 15.0 * k, 150.0, 80.0, 0.0, 0.0, 15.0)
            inbox = gate.admit(float(k), data.draw(absurd(float(k))))
            _, outbox = agent.step(Percept(float(k), pose, (seen,)), inbox)
            assert_sane(agent, outbox)

    holds()


def assert_sane(agent, outbox):
    belief = agent.belief
    for track in belief.tracks:
        numbers = [*track.position, *track.velocity, *track.covariance.ravel(), track.existence]
        assert np.isfinite(numbers).all()
    assert np.isfinite(belief.goal).all()
    assert belief.target is None or isinstance(belief.target, TrackId)
    beat = next(m for m in outbox if isinstance(m, Heartbeat))
    assert beat.target == belief.target  # one at most
    assert [fault_of(m) for m in outbox] == [None] * len(outbox)


def test_a_storm_of_awards_leaves_one_target():
    agent, gate = agent_of("none"), Gate(0)
    pose = Pose(130.0, 150.0, 80.0, 0.0, 0.0, 15.0)
    for k in range(4):
        awards = [
            Award(s, k + 1, float(k), TrackId(0.0, s, k), (10.0 * s, 0.0), winner=0, cost=1.0)
            for s in range(1, 60)
        ]
        _, outbox = agent.step(Percept(float(k), pose, ()), gate.admit(float(k), awards))
        assert_sane(agent, outbox)
