"""What an aircraft that fails does, and what the others do without it (thesis 7.2)."""

import math

import numpy as np
import pytest

import staniel
from staniel.datatypes.message import Announce, Bid, Heartbeat, Release
from staniel.metrics.custody import custody, takeover_times
from staniel.scenario.assemble import assemble
from staniel.scenario.build import build_city

FAILS = 80.0
BOUND = 22.0  # s: a heartbeat, the lease, one auction


def scenario(kind, seed, minutes=3.0, **changes):
    faults = {"schedule": [{"time": FAILS, "aircraft": 0, "kind": kind}]}
    changes = {
        "city": {"size": [400.0, 400.0], "density": 0.2},
        "vehicles": {"count": 2},
        "guidance": {"pursuit": "carrot"},
        "faults": faults,
    } | changes
    return staniel.load_scenario("downtown", seed=seed, minutes=minutes, **changes)


def frames(scenario):
    return list(assemble(scenario, build_city(scenario.city, scenario.seed)).frames())


def seed_where_it_holds(kind):
    """A seed in which aircraft 0 holds something when it fails, and that run's record."""
    for seed in range(30):
        record = staniel.fly(scenario(kind, seed)).record
        kept = custody(record)
        before = int(np.flatnonzero(record.times < FAILS)[-1])
        if kept.watched[before, 0].any():
            return seed, record, kept
    raise AssertionError("aircraft 0 never holds anything")


@pytest.mark.parametrize("kind", ["camera", "radio", "lost"])
def test_what_a_failing_holder_held_is_held_by_another_within_the_bound(kind):
    _, record, kept = seed_where_it_holds(kind)
    waits = takeover_times(record, kept, FAILS, 0)
    assert waits
    assert max(waits) <= BOUND


def test_a_blind_aircraft_stands_by_and_takes_nothing():
    seed, *_ = seed_where_it_holds("camera")
    flown = [frame for frame in frames(scenario("camera", seed)) if frame.truth.time >= FAILS]
    assert all(frame.beliefs[0].target is None for frame in flown[2:])
    assert {frame.beliefs[0].role for frame in flown[40:]} == {"standby"}
    mine = [d.message for frame in flown[1:] for d in frame.deliveries if d.message.sender == 0]
    assert {m.health for m in mine if isinstance(m, Heartbeat)} == {"blind"}
    assert any(isinstance(m, Release) and not m.lost for m in mine)
    assert not any(
        isinstance(m, Bid) or (isinstance(m, Announce) and math.isfinite(m.cost)) for m in mine
    )


def test_a_radio_dead_aircraft_goes_on_alone():
    seed, *_ = seed_where_it_holds("radio")
    late = [frame for frame in frames(scenario("radio", seed)) if frame.truth.time > FAILS + 1.0]
    held = [frame.beliefs[0].target for frame in late]
    assert sum(target is not None for target in held) > len(held) / 2
    assert not any(0 in d.heard_by or (d.message.sender == 0 and d.heard_by)
                   for frame in late for d in frame.deliveries)  # fmt: skip


def test_a_weak_aircraft_is_relieved():
    """Six minutes of energy: below a tenth of it another takes over what it holds."""
    changes = {"aircraft": {"endurance_minutes": 4.0}, "cooperation": {"weak_below": 0.5}}
    flown = frames(scenario("lost", 1, 3.0, faults={}, **changes))
    weak = [frame for frame in flown if frame.truth.condition[0, 0] < 0.5]
    words = [d.message for frame in weak for d in frame.deliveries]
    assert {m.health for m in words if isinstance(m, Heartbeat)} >= {"weak"}
    # All are weak together: nobody bids, and who holds goes on holding.
    assert not any(isinstance(m, Bid) for m in words[len(words) // 4 :])
    assert any(belief.target is not None for belief in weak[-1].beliefs)
