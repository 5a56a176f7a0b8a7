"""Existence, patience and the end of tracks, against a plain reading of the rules."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.datatypes.belief import TrackEstimate, TrackId
from staniel.kernels.lives import ended, live_on
from staniel.tracking.roll import Roll

HIT, MISS = 9.0, -0.3


@given(st.integers(1, 6), st.integers(0, 8), st.booleans(), st.booleans(), st.integers(0, 999))
@settings(max_examples=150, deadline=None)
def test_a_step_of_all_tracks(count, sightings, told, moved, seed):
    g = np.random.default_rng(seed)
    odds, unseen = g.normal(0.0, 6.0, count), g.integers(0, 5, count)
    last, evidence = g.uniform(0.0, 9.0, count), g.normal(0.0, 3.0, count)
    hits, owners = g.integers(0, 3, count), g.integers(-1, count, sightings)
    times = g.uniform(5.0, 10.0, sightings)
    rows, values = np.zeros((count, 10)), np.zeros((sightings, 6))
    rows[:, 9], values[:, 0] = evidence, times
    new_odds, new_unseen, new_last = odds.copy(), unseen.copy(), last.copy()
    seen, existence = live_on(
        new_odds, new_unseen, new_last, rows, hits, owners, values, told, moved, HIT, MISS
    )
    for k in range(count):
        own = times[owners == k].tolist()
        assert seen[k] == bool(own)
        assert new_last[k] == max([last[k], *own])
        assert new_unseen[k] == (0 if own else unseen[k] + moved)
        factor = math.exp(evidence[k] + hits[k] * HIT) if hits[k] or told else 1.0
        if not hits[k] and not told and moved:
            factor = math.exp(MISS)
        expected = min(math.exp(odds[k]) * factor, 999.0)
        assert math.exp(new_odds[k]) == pytest.approx(expected)
        assert existence[k] == pytest.approx(expected / (1.0 + expected))


@given(st.integers(1, 6), st.integers(0, 999))
@settings(max_examples=100, deadline=None)
def test_who_is_given_up(count, seed):
    g = np.random.default_rng(seed)
    roots = g.normal(0.0, 15.0, (count, 2, 2))
    covariances = roots @ roots.transpose(0, 2, 1)
    unseen, existence = g.integers(0, 20, count), g.uniform(0.0, 0.1, count)
    over = ended(unseen, existence, covariances.reshape(count, 4), 17, 0.01, 20.0)
    widest = np.sqrt(np.linalg.eigvalsh(covariances)[:, 1])
    assert over.tolist() == ((unseen >= 17) | (existence < 0.01) | (widest > 20.0)).tolist()


def estimate(serial, existence, last_seen):
    where = np.zeros(2)
    name = TrackId(0.0, 0, serial)
    return TrackEstimate(name, 9.0, where, where, np.eye(2), existence, last_seen)


def test_an_heir_has_the_better_of_both():
    roll = Roll()
    roll.enter(estimate(1, 0.5, 3.0))
    roll.enter(estimate(2, 0.9, 7.0))
    roll.unseen[:] = 4, 1
    roll.inherit(0, 1)
    roll.keep([0])
    assert len(roll) == 1
    assert roll.known[0].id == TrackId(0.0, 0, 1)
    assert (roll.last_seen[0], roll.known[0].last_seen, roll.unseen[0]) == (7.0, 7.0, 1)
    assert roll.log_odds[0] == pytest.approx(math.log(9.0))
    roll.rename(0, TrackId(1.0, 5, 5))
    assert roll.known[0].id == roll.names[0] == TrackId(1.0, 5, 5)
