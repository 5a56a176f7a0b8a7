"""Names of targets agree in the whole team, over a channel that loses, repeats and reorders."""

import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from amounts import amount
from staniel.datatypes.belief import Sighting, TrackId
from staniel.tracking import Aliases, Tracker, TrackingConfig

SEEDS = amount(16, full=40)
R = 2.25 * np.eye(2)
LIGHT = TrackingConfig(particles=200)
OLD, YOUNG, YOUNGER = TrackId(2.0, 0, 1), TrackId(2.0, 1, 1), TrackId(5.0, 0, 2)


class Told(NamedTuple):
    sender: int
    time: float
    sightings: tuple
    names: tuple


class Mind:
    """What an agent does with sightings and reports, without a camera and a radio."""

    def __init__(self, number, seed):
        self.number = number
        self.tracker = Tracker(LIGHT, rng=100 * seed + number, founder=number)
        self.aliases = Aliases()

    def step(self, time, own, reports, held=()):
        seen = [*own, *(sighting for report in reports for sighting in report.sightings)]
        tracks = self.tracker.step(time, seen)
        told = [
            (report.sender, report.time, mine, name)
            for report in reports
            for sighting, name in zip(report.sightings, report.names, strict=True)
            if name is not None and (mine := self.tracker.owner_of(sighting)) is not None
        ]
        for old, new in self.aliases.step(told, [track.id for track in tracks], held):
            self.tracker.rename(old, new)
        names = tuple(self.tracker.owner_of(sighting) for sighting in own)
        return Told(self.number, time, tuple(own), names)


def targets(seed, count, steps):
    """(steps, count, 2): 60 m apart at first, at 2 to 6 m/s, each with a turn of its own."""
    g = np.random.default_rng(seed)
    speed, course = g.uniform(2.0, 6.0, count), g.uniform(-math.pi, math.pi, count)
    rate, time = g.uniform(-0.05, 0.05, count), np.arange(steps)[:, None]
    way = course + rate * time
    walk = np.cumsum(speed[:, None] * np.stack([np.cos(way), np.sin(way)], axis=2), axis=0)
    return walk + np.array([[200.0 * (i % 3), 200.0 * (i // 3)] for i in range(count)])


def fly(seed, agents, count=4, steps=80, loss=0.5, order=1, chance=0.6):
    """Names by step, agent and target (None where an agent has no track there), and the minds.

    Each agent sees each target with `chance` a step, in a subset of its own that changes every five
    steps. A report reaches another agent 1 to 3 steps later, a third of them twice, in any order.
    """
    path = targets(seed, count, steps)
    minds = [Mind(number, seed) for number in range(agents)]
    waiting = defaultdict(list)
    history = []
    for k, places in enumerate(path):
        said = {}
        for number in range(agents)[::order]:
            g = np.random.default_rng((seed, k, number))
            sees = np.random.default_rng((seed, k // 5, number)).random(count) < chance
            own = [
                Sighting(float(k), p + g.normal(0.0, 1.5, 2), R, reporter=number)
                for p, here in zip(places, sees, strict=True)
                if here and g.random() < 0.9
            ]
            inbox = waiting.pop((k, number), [])
            inbox = [inbox[i] for i in g.permutation(len(inbox))]
            said[number] = minds[number].step(float(k), own, inbox[::order])
        for sender, report in sorted(said.items()):
            for receiver in range(agents):
                g = np.random.default_rng((seed, k, sender, receiver))
                if receiver != sender and g.random() >= loss:
                    for _ in range(2 if g.random() < 0.3 else 1):
                        waiting[k + int(g.integers(1, 4)), receiver].append(report)
        history.append([[named(mind.tracker, p) for p in places] for mind in minds])
        for mind in minds:
            names = [track.id for track in mind.tracker.estimates]
            assert len(set(names)) == len(names)
    return history, minds


def named(tracker, place):
    apart = [(math.dist(t.position, place), t.id) for t in tracker.estimates]
    return min(((d, name) for d, name in apart if d < 8.0), default=(0.0, None))[1]


def agreed(names):
    """Whether everybody who has a track of a target calls it the same, and no two are alike."""
    sets = [{mine[i] for mine in names if mine[i] is not None} for i in range(len(names[0]))]
    used = [name for one in sets for name in one]
    return all(len(one) <= 1 for one in sets) and len(set(used)) == len(used)


def first_agreed(history):
    """Step from which on all names agree to the end."""
    wrong = [k for k, names in enumerate(history) if not agreed(names)]
    return wrong[-1] + 1 if wrong else 0


def disagreements(history):
    """How long each target had more than one name at a stretch [steps]."""
    runs = []
    for i in range(len(history[0][0])):
        lasting = 0
        for names in [*history, [[None] * len(history[0][0])]]:
            if len({mine[i] for mine in names if mine[i] is not None}) > 1:
                lasting += 1
            elif lasting:
                runs.append(lasting)
                lasting = 0
    return runs


# ---------------------------------------------------------------- teams


def test_the_owner_of_a_sighting_does_not_depend_on_the_order_of_the_call():
    tracker = Tracker(LIGHT, rng=0)
    for k in range(5):
        west, east = Sighting(k, [0.0, 0.0], R), Sighting(k, [100.0, 0.0], R)
        tracker.step(k, [east, west])
    owners = [tracker.owner_of(west), tracker.owner_of(east)]
    near = sorted(tracker.estimates, key=lambda track: track.position[0])
    assert owners == [track.id for track in near]


@pytest.mark.parametrize("agents", [3, 4, 5])
def test_names_agree_in_the_whole_team(agents):
    """No target has two names for more than 50 steps at a stretch, nine in ten for at most 30."""
    runs, ends = [], 0
    for seed in range(SEEDS):
        history, _ = fly(seed, agents)
        runs += disagreements(history)
        ends += agreed(history[-1])
    assert max(runs) <= 50
    assert np.percentile(runs, 90) <= 30
    assert ends == SEEDS


def test_nobody_cares_in_which_order_agents_step_and_reports_come():
    for seed in range(3):
        one, minds = fly(seed, 4)
        two, others = fly(seed, 4, order=-1)
        assert one == two
        for mind, other in zip(minds, others, strict=True):
            for a, b in zip(mind.tracker.estimates, other.tracker.estimates, strict=True):
                assert (a.id, a.position.tobytes()) == (b.id, b.position.tobytes())


# ---------------------------------------------------------------- one agent


def told(sender, time, own, theirs):
    return sender, float(time), own, theirs


def test_three_reports_in_a_row_of_one_sender_rename():
    aliases = Aliases()
    assert aliases.step([told(1, 0, YOUNG, OLD)], {YOUNG}) == []
    assert aliases.step([told(1, 1, YOUNG, OLD)], {YOUNG}) == []
    assert aliases.step([told(1, 2, YOUNG, OLD)], {YOUNG}) == [(YOUNG, OLD)]


def test_three_senders_with_one_report_each_do_not():
    aliases = Aliases()
    for sender in range(3):
        assert aliases.step([told(sender, 0, YOUNG, OLD)], {YOUNG}) == []


def test_a_wrong_association_now_and_then_does_not_rename():
    aliases = Aliases()
    for k in range(60):
        theirs = OLD if k % 3 else YOUNG
        assert aliases.step([told(1, k, YOUNG, theirs)], {YOUNG}) == []


def test_copies_and_what_comes_late_do_not_count():
    aliases = Aliases()
    for time in (5, 5, 5, 3, 4, 5, 2):
        assert aliases.step([told(1, time, YOUNG, OLD)], {YOUNG}) == []


def test_the_younger_name_is_never_taken_over():
    aliases = Aliases()
    for k in range(10):
        assert aliases.step([told(1, k, YOUNG, YOUNGER)], {YOUNG}) == []


def test_held_names_do_not_change_until_they_are_let_go():
    aliases = Aliases()
    for k in range(10):
        assert aliases.step([told(1, k, YOUNG, OLD)], {YOUNG}, {YOUNG}) == []
    assert aliases.step([told(1, 10, YOUNG, OLD)], {YOUNG}) == [(YOUNG, OLD)]


def test_the_name_of_another_own_track_is_not_taken():
    aliases = Aliases()
    for k in range(10):
        assert aliases.step([told(1, k, YOUNG, OLD)], {YOUNG, OLD}) == []


def test_of_two_tracks_that_are_to_have_one_name_one_gets_it():
    aliases = Aliases()
    both = {YOUNG, YOUNGER}
    for k in range(3):
        new = aliases.step([told(1, k, YOUNG, OLD), told(1, k, YOUNGER, OLD)], both)
    assert new == [(YOUNG, OLD)]


names = st.builds(TrackId, st.sampled_from([0.0, 1.0]), st.integers(0, 2), st.just(1))
heard = st.tuples(st.integers(0, 2), st.integers(0, 6).map(float), names, names)


@given(
    st.lists(st.lists(heard, max_size=6), max_size=12),
    st.sets(names, max_size=4),
    st.sets(names, max_size=2),
    st.randoms(use_true_random=False),
)
@settings(max_examples=200, deadline=None)
def test_whatever_is_heard_names_stay_apart_and_grow_no_younger(steps, live, held, shuffle):
    one, two = Aliases(), Aliases()
    for reports in steps:
        mixed = list(reports)
        shuffle.shuffle(mixed)
        renames = one.step(reports, live, held)
        assert two.step(mixed, live, held) == renames
        for old, new in renames:
            assert new < old
            assert old in live
            assert old not in held
            assert new not in live
            live = (live - {old}) | {new}
