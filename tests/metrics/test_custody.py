"""Who held what, against a slow reading of the same record."""

import math

import numpy as np
import pytest

import staniel
from staniel.metrics.custody import custody, longest_run, takeover_times


@pytest.fixture(scope="module")
def run():
    """A mission with a partition, a radio that dies and an aircraft that is lost."""
    faults = [
        {"time": 60.0, "aircraft": 1, "kind": "radio"},
        {"time": 80.0, "aircraft": 3, "kind": "lost"},
        {"time": 90.0, "aircraft": 2, "kind": "camera"},
    ]
    scenario = staniel.load_scenario(
        "downtown",
        seed=10,
        minutes=2.5,
        city={"size": [400.0, 400.0]},
        guidance={"pursuit": "carrot", "glimpse_time": 0.0},
        faults={"schedule": faults},
        radio={
            "loss": 0.3,
            "range": 450.0,
            "partitions": [{"start": 30.0, "end": 55.0, "groups": [[0, 1], [2, 3]]}],
        },
    )
    return staniel.fly(scenario).record


def slow(record):
    """Held, doubled and orphaned by loops and words."""
    n, agents = record.aircraft.shape[:2]
    vehicles = record.vehicles.shape[1]
    doubled = np.zeros((n, vehicles), dtype=bool)
    orphaned = np.zeros_like(doubled)
    for k, time in enumerate(record.times.tolist()):
        condition = record.condition[k]

        def talk(a, b, k=k, time=time, condition=condition):
            apart = 30.0 <= time < 55.0 and (a < 2) != (b < 2)
            works = all(condition[i, 2] > 0 and condition[i, 3] > 0 for i in (a, b))
            way = math.dist(record.aircraft[k, a, :3], record.aircraft[k, b, :3])
            return a != b and works and not apart and way <= 450.0

        targets = {
            row["agent"]: row["target"]
            for row in record.decisions
            if abs(row["time"] - time) < 1e-6
        }
        patrols = {
            row["agent"]
            for row in record.decisions
            if abs(row["time"] - time) < 1e-6 and row["role"] == "patrol"
        }
        known, held, called = set(), set(), set()
        tracks = record.tracks[np.abs(record.tracks["time"] - time) < 1e-6]
        for row in tracks:
            ways = [math.dist((row["x"], row["y"]), v[:2]) for v in record.vehicles[k]]
            vehicle = int(np.argmin(ways))
            if ways[vehicle] <= 15.0:
                known.add((row["agent"], vehicle))
                called.add((row["id"], vehicle))
                if targets.get(row["agent"]) == row["id"]:
                    held.add((row["agent"], vehicle))
        for agent, name in targets.items():
            if not any(row["agent"] == agent and row["id"] == name for row in tracks):
                held |= {(agent, vehicle) for other, vehicle in called if other == name}
        free = {
            a
            for a in range(agents)
            if targets.get(a, "") == ""
            and a not in patrols
            and condition[a, 1]
            and condition[a, 2]
            and condition[a, 3]
        }
        for vehicle in range(vehicles):
            holders = [a for a, v in held if v == vehicle]
            doubled[k, vehicle] = any(talk(a, b) for a in holders for b in holders)
            orphaned[k, vehicle] = not holders and any(
                a == b or talk(a, b) for a, v in known if v == vehicle for b in free
            )
    return doubled, orphaned


def test_against_a_slow_reading(run):
    kept = custody(run)
    doubled, orphaned = slow(run)
    np.testing.assert_array_equal(kept.doubled, doubled)
    np.testing.assert_array_equal(kept.orphaned, orphaned)
    assert kept.held.any(axis=(0, 1)).sum() >= 2
    assert orphaned.any()
    assert (kept.held & ~kept.known).any()  # One is on its way to what it was awarded.


def test_the_longest_run():
    flags = np.array([[1, 0], [1, 1], [0, 1], [1, 1], [1, 0]], dtype=bool)
    assert longest_run(flags, 0.5) == 1.5
    assert longest_run(np.zeros((4, 2), dtype=bool), 1.0) == 0.0
    assert longest_run(np.zeros((4, 0), dtype=bool), 1.0) == 0.0


def test_how_long_a_lost_holders_target_waits(run):
    kept = custody(run)
    loss = 80.0
    before = int(np.flatnonzero(run.times < loss)[-1])
    mine = np.flatnonzero(kept.watched[before, 3])
    found = takeover_times(run, kept, loss, 3)
    assert len(found) == len(mine)
    for vehicle, wait in zip(mine, found, strict=True):
        watched = kept.watched[:, :3, vehicle].any(axis=1)
        others = [k for k in range(before + 1, len(run.times)) if watched[k]]
        assert wait == (run.times[others[0]] - loss if others else math.inf)
    assert takeover_times(run, kept, 0.0, 3) == []
