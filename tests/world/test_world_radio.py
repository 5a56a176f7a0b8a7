"""Delivery against the formula, by counting."""

import math

import numpy as np
import pytest
from scipy import stats

from staniel.datatypes.equipment import RadioSet
from staniel.datatypes.message import Message
from staniel.datatypes.truth import Truth
from staniel.world import Radio


def truth_at(places):
    aircraft = np.zeros((len(places), 6))
    aircraft[:, :3] = places
    none = np.zeros((0, 4))
    return Truth(0, 0.0, aircraft, none, none, aircraft[None], none[None])


def said(sender, count, first=0):
    return [Message(sender, first + k, 0.0) for k in range(count)]


@pytest.mark.parametrize("place", [(400.0, 0.0, 80.0), (600.0, 600.0, 380.0)])
def test_frequency_is_the_formulas(place):
    radio = Radio(RadioSet(), np.uint64(11))
    truth = truth_at([(0.0, 0.0, 80.0), place])
    inboxes, _ = radio.deliver([said(0, 5000), []], truth)
    square = sum((a - b) ** 2 for a, b in zip((0.0, 0.0, 80.0), place, strict=True))
    chance = math.exp(-square / (2 * 800.0**2))
    assert stats.binomtest(len(inboxes[1]), 5000, chance).pvalue > 0.01
    assert inboxes[0] == []


def test_nothing_is_heard_beyond_the_range_and_everything_at_no_distance():
    radio = Radio(RadioSet(sigma=1e6, range=1000.0), np.uint64(1))
    truth = truth_at([(0, 0, 0), (0, 0, 0), (1000.0, 0, 0), (1000.001, 0, 0)])
    inboxes, deliveries = radio.deliver([said(0, 100), [], [], []], truth)
    assert [len(inbox) for inbox in inboxes] == [0, 100, 100, 0]
    assert deliveries[0].heard_by == (1, 2)
    assert deliveries[0].receivers == 3


def test_distance_is_in_space():
    radio = Radio(RadioSet(sigma=1e6, range=100.0), np.uint64(1))
    truth = truth_at([(0, 0, 0), (80.0, 0, 80.0)])
    assert radio.deliver([said(0, 50), []], truth)[0][1] == []


def test_receivers_are_independent_of_one_another():
    radio = Radio(RadioSet(), np.uint64(5))
    truth = truth_at([(0, 0, 0), (700.0, 0, 0), (0, 700.0, 0)])
    _, deliveries = radio.deliver([said(0, 4000), [], []], truth)
    table = np.zeros((2, 2))
    for delivery in deliveries:
        table[int(1 in delivery.heard_by), int(2 in delivery.heard_by)] += 1
    assert stats.chi2_contingency(table).pvalue > 0.01


def test_inboxes_are_in_order_of_sender_and_sequence_and_agree_with_deliveries():
    radio = Radio(RadioSet(), np.uint64(2))
    truth = truth_at([(300.0 * k, 0, 0) for k in range(4)])
    outboxes = [said(k, 20, first=7)[::-1] for k in range(4)]
    inboxes, deliveries = radio.deliver(outboxes, truth)
    order = [(d.message.sender, d.message.sequence) for d in deliveries]
    assert order == sorted(order)
    for i, inbox in enumerate(inboxes):
        assert inbox == [d.message for d in deliveries if i in d.heard_by]
        assert all(message.sender != i for message in inbox)


def test_who_else_flies_or_talks_changes_nothing():
    radio = Radio(RadioSet(), np.uint64(3))
    places = [(0, 0, 0), (800.0, 0, 0), (0, 800.0, 0)]
    few = radio.deliver([said(0, 200), []], truth_at(places[:2]))[0][1]
    many = radio.deliver([said(0, 200), said(1, 9), said(2, 50)], truth_at(places))[0][1]
    assert few == [message for message in many if message.sender == 0]


def test_silence():
    radio = Radio(RadioSet(), np.uint64(0))
    assert radio.deliver([[], []], truth_at([(0, 0, 0), (1, 0, 0)])) == ([[], []], [])


@pytest.mark.parametrize("loss", [0.1, 0.5, 1.0])
def test_a_share_is_lost_whatever_the_distance(loss):
    chance = (1.0 - loss) * math.exp(-(400.0**2) / (2 * 800.0**2))
    radio = Radio(RadioSet(loss=loss), np.uint64(11))
    truth = truth_at([(0.0, 0.0, 80.0), (400.0, 0.0, 80.0), (0.0, 0.0, 80.0)])
    inboxes, _ = radio.deliver([said(0, 5000), [], []], truth)
    assert stats.binomtest(len(inboxes[1]), 5000, chance).pvalue > 0.01
    assert stats.binomtest(len(inboxes[2]), 5000, 1.0 - loss).pvalue > 0.01


def test_more_loss_loses_more_of_the_same_and_none_changes_nothing():
    truth = truth_at([(0.0, 0.0, 80.0), (400.0, 0.0, 80.0)])
    heard = [
        {
            message.sequence
            for message in Radio(radio, np.uint64(3)).deliver([said(0, 900), []], truth)[0][1]
        }
        for radio in (RadioSet(), RadioSet(loss=0.0), RadioSet(loss=0.3), RadioSet(loss=0.6))
    ]
    assert heard[0] == heard[1] > heard[2] > heard[3]
