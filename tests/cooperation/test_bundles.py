"""Consensus on bundles: everyone agrees, nobody shares a target, and no team does twice as well."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.cooperation.bundles import Bundles, straight
from staniel.datatypes.belief import TrackId
from staniel.datatypes.message import Bundle, Claim
from staniel.errors import StanielError

A, B = TrackId(0.0, 0, 0), TrackId(0.0, 0, 1)


def named(count):
    return [TrackId(0.0, 0, k) for k in range(count)]


def agreed(team):
    """All think the same, and it is what each has in its path."""
    claims = team[0].claims
    won = {target: agent.agent for agent in team for target in agent.path}
    return (
        all(agent.claims == claims for agent in team)
        and won == {target: claim.winner for target, claim in claims.items()}
        and len(won) == sum(len(agent.path) for agent in team)
    )


def play(team, scores, targets, rounds, *, loss=0.0, links=None, rng=None):
    """Rounds of one second until all agree; how many, or None.

    A message is lost to a receiver with the given probability; else it comes twice with half of
    it, and each copy takes up to 3 s more.
    """
    rng = rng or np.random.default_rng(0)
    air = []
    for time in range(rounds):
        inboxes = [[m for due, k, m in air if k == i and due <= time] for i in range(len(team))]
        air = [flight for flight in air if flight[0] > time]
        for i, agent in enumerate(team):
            for message in agent.step(float(time), scores[i], targets, inboxes[i]):
                for k in range(len(team)) if links is None else links[i] & set(range(len(team))):
                    if k != i and rng.random() >= loss:
                        for _ in range(2 if rng.random() < 0.5 * loss else 1):
                            delay = rng.integers(0, 4) if rng.random() < loss else 0
                            air.append((time + 1 + delay, k, message))
        if agreed(team):
            return time
    return None


def additive(gains):
    def make(row):
        return lambda path: float(sum(row[target.serial] for target in path))

    return [make(row) for row in gains]


def covering(sets, weights):
    """Weight of all that the targets of a path cover: submodular."""

    def make(own):
        def score(path):
            covered = np.zeros(len(weights), bool)
            for target in path:
                covered |= own[target.serial]
            return float(weights[covered].sum())

        return score

    return [make(own) for own in sets]


def best_of(scores, targets, capacity):
    """Greatest score of any division of the targets; the order within a path is of no matter."""
    best = 0.0
    for owners in itertools.product(range(-1, len(scores)), repeat=len(targets)):
        paths = [
            tuple(t for t, o in zip(targets, owners, strict=True) if o == i)
            for i in range(len(scores))
        ]
        if max(map(len, paths)) <= capacity:
            best = max(best, sum(s(p) for s, p in zip(scores, paths, strict=True)))
    return best


@settings(deadline=None, max_examples=60)
@given(
    st.integers(1, 6), st.integers(0, 8), st.integers(1, 3), st.integers(0, 10**6), st.booleans()
)
def test_without_loss_all_agree_within_diameter_times_targets(n, m, capacity, seed, line):
    rng = np.random.default_rng(seed)
    targets = named(m)
    scores = additive(rng.integers(1, 9, (n, m)) + 0.0)
    links = [{i - 1, i + 1} for i in range(n)] if line else None
    diameter = max(n - 1, 1) if line else 1
    team = [Bundles(i, capacity) for i in range(n)]
    found = play(team, scores, targets, diameter * min(m, n * capacity) + 2, links=links)
    assert found is not None
    assert sum(len(agent.path) for agent in team) == min(m, n * capacity)


@settings(deadline=None, max_examples=40)
@given(st.integers(2, 5), st.integers(1, 7), st.integers(1, 3), st.integers(0, 10**6))
@pytest.mark.parametrize("loss", [0.0, 0.2, 0.5])
def test_loss_only_delays_the_agreement(loss, n, m, capacity, seed):
    rng = np.random.default_rng(seed)
    targets = named(m)
    places = dict(zip(targets, map(tuple, rng.uniform(0.0, 1000.0, (m, 2))), strict=True))
    starts = map(tuple, rng.uniform(0.0, 1000.0, (n, 2)))
    scores = [straight(start, places, 2000.0) for start in starts]
    team = [Bundles(i, capacity) for i in range(n)]
    found = play(team, scores, targets, 400, loss=loss, rng=rng)
    assert found is not None
    assert sum(len(agent.path) for agent in team) == min(m, n * capacity)


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 3), st.integers(1, 5), st.integers(1, 3), st.integers(0, 10**6))
@pytest.mark.parametrize("kind", ["additive", "covering"])
def test_no_division_is_worth_more_than_twice(kind, n, m, capacity, seed):
    rng = np.random.default_rng(seed)
    targets = named(m)
    if kind == "additive":
        scores = additive(rng.random((n, m)))
    else:
        scores = covering(rng.random((n, m, 12)) < 0.3, rng.random(12))
    team = [Bundles(i, capacity) for i in range(n)]
    assert play(team, scores, targets, 100) is not None
    reached = sum(s(agent.path) for s, agent in zip(scores, team, strict=True))
    assert reached >= 0.5 * best_of(scores, targets, capacity) - 1e-12


def test_additive_scores_give_what_serving_the_greatest_gain_first_gives():
    rng = np.random.default_rng(5)
    gains, targets = rng.random((6, 10)), named(10)
    team = [Bundles(i, 2) for i in range(6)]
    play(team, additive(gains), targets, 50)
    room, owner = [2] * 6, {}
    for i, j in sorted(np.ndindex(6, 10), key=lambda pair: -gains[pair]):
        if room[i] and j not in owner:
            owner[j] = i
            room[i] -= 1
    assert {t.serial: a.agent for a in team for t in a.path} == owner


def test_a_path_is_ordered_by_the_way_not_by_when_it_was_added():
    targets = named(3)
    places = dict(zip(targets, [(300.0, 0.0), (100.0, 0.0), (200.0, 0.0)], strict=True))
    agent = Bundles(0, 3)
    agent.step(0.0, straight((0.0, 0.0), places, 1000.0), targets, [])
    assert [places[target][0] for target in agent.path] == [100.0, 200.0, 300.0]


def test_what_costs_more_than_it_is_worth_is_left():
    agent = Bundles(0, 2)
    agent.step(0.0, straight((0.0, 0.0), {A: (300.0, 0.0), B: (30.0, 0.0)}, 100.0), [A, B], [])
    assert agent.path == (B,)


def test_a_target_that_is_gone_is_given_up():
    agent = Bundles(0, 2)
    score = straight((0.0, 0.0), {A: (30.0, 0.0), B: (60.0, 0.0)}, 100.0)
    agent.step(0.0, score, [A, B], [])
    agent.step(1.0, score, [B], [])
    assert agent.path == (B,)
    assert set(agent.claims) == {B}


def test_silence_where_all_is_known_and_a_word_after_a_while():
    team = [Bundles(i, 1, repeat=5.0) for i in range(2)]
    scores = additive(np.array([[2.0, 1.0], [1.0, 2.0]]))
    play(team, scores, named(2), 5)
    times = (2.0, 5.5, 6.0, 6.5, 10.5, 11.0)
    said = [len(team[0].step(t, scores[0], named(2), [])) for t in times]
    assert said == [0, 0, 1, 0, 0, 1]


def test_copies_and_late_words_change_nothing():
    score = additive(np.array([[1.0, 1.0]]))[0]
    old = Bundle(1, 1, 0.0, (Claim(A, 1, 9.0),), ((1, 0.0),))
    new = Bundle(1, 2, 1.0, (), ((1, 1.0),))
    agent = Bundles(0, 2)
    agent.step(2.0, score, [A, B], [new, old, new])
    held = agent.claims
    agent.step(3.0, score, [A, B], [old])
    assert agent.claims == held
    assert {target: claim.winner for target, claim in held.items()} == {A: 0, B: 0}


@pytest.mark.parametrize(
    ("said", "thinks", "word", "known", "result"),
    [
        # Sender 1, receiver 0, others 2 and 3; word and known: newest times of 2 and 3.
        ((1, 5.0), (0, 4.0), (0, 0), (0, 0), (1, 5.0)),
        ((1, 3.0), (0, 4.0), (0, 0), (0, 0), (0, 4.0)),
        ((1, 4.0), (0, 4.0), (0, 0), (0, 0), (0, 4.0)),
        ((1, 3.0), (1, 4.0), (0, 0), (0, 0), (1, 3.0)),
        ((1, 3.0), (2, 4.0), (2, 0), (1, 0), (1, 3.0)),
        ((1, 3.0), (2, 4.0), (1, 0), (1, 0), (2, 4.0)),
        ((1, 5.0), (2, 4.0), (0, 0), (1, 0), (1, 5.0)),
        ((1, 3.0), None, (0, 0), (0, 0), (1, 3.0)),
        ((0, 3.0), (0, 4.0), (0, 0), (0, 0), (0, 4.0)),
        ((0, 3.0), (1, 4.0), (0, 0), (0, 0), None),
        ((0, 3.0), (2, 4.0), (2, 0), (1, 0), None),
        ((0, 3.0), (2, 4.0), (1, 0), (1, 0), (2, 4.0)),
        ((0, 3.0), None, (0, 0), (0, 0), None),
        ((2, 5.0), (0, 4.0), (2, 0), (1, 0), (2, 5.0)),
        ((2, 3.0), (0, 4.0), (2, 0), (1, 0), (0, 4.0)),
        ((2, 5.0), (0, 4.0), (1, 0), (1, 0), (0, 4.0)),
        ((2, 3.0), (1, 4.0), (2, 0), (1, 0), (2, 3.0)),
        ((2, 3.0), (1, 4.0), (1, 0), (1, 0), None),
        ((2, 3.0), (2, 4.0), (2, 0), (1, 0), (2, 3.0)),
        ((2, 3.0), (2, 4.0), (1, 0), (1, 0), (2, 4.0)),
        ((2, 3.0), (3, 4.0), (2, 2), (1, 1), (2, 3.0)),
        ((2, 5.0), (3, 4.0), (2, 1), (1, 1), (2, 5.0)),
        ((2, 3.0), (3, 4.0), (2, 1), (1, 1), (3, 4.0)),
        ((2, 3.0), (3, 4.0), (0, 2), (1, 1), None),
        ((2, 3.0), (3, 4.0), (1, 2), (1, 1), (3, 4.0)),
        ((2, 3.0), None, (2, 0), (1, 0), (2, 3.0)),
        ((2, 3.0), None, (1, 0), (1, 0), None),
        (None, (0, 4.0), (0, 0), (0, 0), (0, 4.0)),
        (None, (1, 4.0), (0, 0), (0, 0), None),
        (None, (2, 4.0), (2, 0), (1, 0), None),
        (None, (2, 4.0), (1, 0), (1, 0), (2, 4.0)),
    ],
)
def test_the_table(said, thinks, word, known, result):
    def claim(pair):
        return None if pair is None else Claim(A, *pair)

    agent = Bundles(0, 1)
    agent._heard = {2: float(known[0]), 3: float(known[1])}
    words = {1: 9.0, 2: float(word[0]), 3: float(word[1])}
    assert agent._settle(1, claim(said), claim(thinks), words) == claim(result)


@pytest.mark.parametrize(
    ("settings_", "words"),
    [({"capacity": 0}, "capacity = 0"), ({"capacity": 1, "repeat": math.nan}, "repeat = nan")],
)
def test_what_is_refused(settings_, words):
    with pytest.raises(StanielError, match=words):
        Bundles(0, **settings_)
