"""Latency, jitter, copies, bandwidth, buildings, partitions: against counts, bounds and shapely."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from staniel.city import City
from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import FlyBanks
from staniel.datatypes.equipment import Partition, RadioSet
from staniel.datatypes.message import Award, Bid, Heartbeat, Message, Release, Report, Warn
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.threats import Carrier, Threats
from staniel.datatypes.truth import Truth, nominal
from staniel.datatypes.wire import HEAD, wire_size
from staniel.errors import ScenarioError
from staniel.scenario import load_scenario
from staniel.world import Radio

NEAR = [(0.0, 0.0, 80.0), (1.0, 0.0, 80.0)]


def truth_at(places, time=0.0, working=None):
    aircraft = np.zeros((len(places), 6))
    aircraft[:, :3] = places
    none = np.zeros((0, 4))
    condition = nominal(len(places))
    if working is not None:
        condition[:, 2] = working
    return Truth(round(time), time, aircraft, none, none, aircraft[None], none[None], condition)


def said(sender, count, first=0, time=0.0):
    return [Message(sender, first + k, time) for k in range(count)]


def sure(**options):
    """A radio that loses nothing by distance."""
    return RadioSet(sigma=1e9, range=1e6, **options)


class Air:
    """A radio and everything that was said, delivered and heard on it."""

    def __init__(self, radio, places=NEAR, city=None, step=1.0, key=7):
        self.radio, self.places, self.step = Radio(radio, np.uint64(key), city, step), places, step
        self.tick, self.deliveries = 0, []
        self.heard = [[] for _ in places]  # (time, message) of each aircraft
        self.said = 0
        self.radio.deliver([[] for _ in places], truth_at(places))

    def run(self, outboxes=(), ticks=1, working=None):
        """What is said in this tick is on its way to the next."""
        for turn in range(ticks):
            self.tick += 1
            boxes = list(outboxes) if turn == 0 and outboxes else [[] for _ in self.places]
            self.said += sum(map(len, boxes))
            now = self.tick * self.step
            inboxes, deliveries = self.radio.deliver(boxes, truth_at(self.places, now, working))
            self.deliveries += deliveries
            for heard, inbox in zip(self.heard, inboxes, strict=True):
                heard += [(now, message) for message in inbox]
        return self


@pytest.mark.parametrize(
    ("latency", "step", "ticks"),
    [(0.0, 1.0, 1), (0.2, 1.0, 1), (1.0, 1.0, 1), (1.5, 1.0, 2), (3.0, 1.0, 3), (0.5, 0.2, 3)],
)
def test_latency_rounds_up_to_ticks(latency, step, ticks):
    air = Air(sure(latency=latency), step=step).run([said(0, 3), []], 6)
    assert [time for time, _ in air.heard[1]] == pytest.approx([ticks * step] * 3)
    assert air.heard[0] == []
    assert air.radio.in_flight == 0


@pytest.mark.parametrize("kind", ["uniform", "exponential"])
def test_jitter_has_its_distribution(kind):
    """Fine ticks show the arrival times, rounded up by less than one of them."""
    step, jitter, latency = 0.01, 2.0, 0.5
    radio = sure(latency=latency, jitter=jitter, jitter_kind=kind)
    air = Air(radio, step=step).run([said(0, 2000), []], 4000)
    late = np.array([time for time, _ in air.heard[1]]) - latency
    shape = stats.uniform(0.0, jitter) if kind == "uniform" else stats.expon(scale=jitter)
    assert late.min() > -1e-9
    if kind == "uniform":
        assert len(late) == 2000
        assert late.max() <= jitter + step
    # Rounding up moves the distribution by at most step times its greatest density.
    statistic = stats.kstest(late, shape.cdf).statistic
    assert statistic < step / jitter + stats.kstwobign.ppf(0.99) / math.sqrt(len(late))


def test_messages_overtake_one_another_and_come_in_the_order_of_arrival():
    air = Air(sure(jitter=5.0)).run([said(0, 60), []], 8)
    order = [message.sequence for _, message in air.heard[1]]
    assert sorted(order) == list(range(60))
    assert order != sorted(order)
    # In one inbox, too: a coarse clock hands all of them over at once, in the order of arrival.
    coarse = Air(sure(jitter=5.0), step=10.0).run([said(0, 60), []], 1)
    assert [message.sequence for _, message in coarse.heard[1]] == order


def test_copies_come_as_often_as_they_should():
    air = Air(sure(duplication=0.2, jitter=3.0)).run([said(0, 3000), []], 6)
    copies = len(air.heard[1]) - 3000
    assert stats.binomtest(copies, 3000, 0.2).pvalue > 0.01
    assert all(delivery.heard_by == (1,) for delivery in air.deliveries)
    times = {}
    for time, message in air.heard[1]:
        times.setdefault(message.sequence, []).append(time)
    assert {len(of) for of in times.values()} == {1, 2}
    assert any(len(set(of)) == 2 for of in times.values())  # the second later than the first


def test_sizes_on_the_air():
    pose, name = Pose(0, 0, 0, 0, 0, 0), TrackId(0.0, 0, 1)
    sighting = Sighting(0.0, [0.0, 0.0], np.eye(2))
    assert wire_size(Message(0, 1, 0.0)) == HEAD == 16
    assert wire_size(Report(0, 1, 0.0, sightings=(sighting,) * 3)) == 19 + 3 * 31
    posed = replace(sighting, pose=pose, pose_deviation=2.0)
    assert wire_size(Report(0, 1, 0.0, sightings=(posed,), names=(name,))) == 19 + 31 + 28 + 14
    heartbeat = Heartbeat(
        0, 1, 0.0, pose=pose, role="search", goal=(0, 0), target=None, target_position=None, cost=0
    )
    assert wire_size(heartbeat) == 55
    assert wire_size(replace(heartbeat, target=name, target_position=(0, 0))) == 55 + 14 + 8
    banks = FlyBanks((0.1, 0.2), 1.0, 15.0, 80.0)
    assert wire_size(replace(heartbeat, command=banks)) == 55 + 13 + 1 + 2 * 2
    led = replace(banks, look=(3.0, 4.0))
    assert wire_size(replace(heartbeat, command=led)) == 55 + 13 + 1 + 2 * 2 + 8
    assert wire_size(Bid(0, 1, 0.0, targets=(name,), auctioneers=(1,), costs=(1.0,))) == 19 + 20
    assert wire_size(Award(0, 1, 0.0, target=name, position=(0, 0), winner=1, cost=1.0)) == 46
    assert wire_size(Release(0, 1, 0.0, target=name, position=(0, 0), lost=True)) == 47
    disc = RiskRegion(kind="threat", center=(0.0, 0.0), radius=9.0, rate=1.0)
    ban = RiskRegion(kind="no-fly", polygon=((0, 0), (9, 0), (9, 9), (0, 9)))
    carrier = Carrier(0.0, [0.0, 0.0], np.eye(2), 60.0, 0.5)
    warning = Warn(0, 1, 0.0, threats=Threats((disc, ban), (carrier,) * 2))
    assert wire_size(warning) == 20 + (9 + 8 + 24) + (9 + 2 + 16 * 4) + 2 * 38


def test_bandwidth_sends_one_after_the_other():
    # 16 bytes at 8 byte/s: one message every 2 s; the other sender has a rate of its own.
    air = Air(sure(bandwidth=8.0)).run([said(0, 4), said(1, 1)], 10)
    assert [(t, m.sequence) for t, m in air.heard[1]] == [(2, 0), (4, 1), (6, 2), (8, 3)]
    assert [t for t, _ in air.heard[0]] == [2]
    # Idle time is not saved up.
    air.run([said(0, 2, first=4), []], 6)
    assert [t for t, _ in air.heard[1][4:]] == [12, 14]


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 6), min_size=3, max_size=3), min_size=1, max_size=12),
    st.floats(4.0, 200.0),
    st.integers(1, 8),
    st.floats(0.0, 1.0),
)
def test_nothing_is_lost_silently(plan, bandwidth, limit, loss):
    """Said = on the air + dropped + waiting; heard receptions and those in flight add up too."""
    radio = RadioSet(
        sigma=900.0, bandwidth=bandwidth, queue_limit=limit, jitter=2.5, latency=0.7,
        duplication=loss / 2,
    )  # fmt: skip
    air = Air(radio, places=[(0.0, 0, 80.0), (500.0, 0, 80.0), (0, 900.0, 80.0)])
    numbers = [0, 0, 0]
    for counts in plan:
        boxes = []
        for sender, count in enumerate(counts):
            boxes.append(said(sender, count, first=numbers[sender]))
            numbers[sender] += count
        air.run(boxes)
        dropped = [d for d in air.deliveries if d.receivers == 0]
        on_air = [d for d in air.deliveries if d.receivers == 2]
        assert air.said == len(on_air) + len(dropped) + air.radio.waiting
        assert all(d.heard_by == () for d in dropped)
        assert air.radio.waiting <= 3 * limit
        reached = sum(len(d.heard_by) for d in on_air)
        first_copies = len({(i, m) for i, box in enumerate(air.heard) for _, m in box})
        assert first_copies <= reached <= sum(map(len, air.heard)) + air.radio.in_flight
    air.run(ticks=400)
    assert air.radio.waiting == air.radio.in_flight == 0
    heard = {(i, m) for i, box in enumerate(air.heard) for _, m in box}
    assert heard == {(i, d.message) for d in air.deliveries for i in d.heard_by}
    for sender in range(3):
        order = [d.message.sequence for d in air.deliveries if d.message.sender == sender]
        assert sorted(order) == list(range(numbers[sender]))


def test_a_partition_forms_and_heals():
    places = [(float(k), 0.0, 80.0) for k in range(5)]
    cut = Partition(start=3.0, end=6.0, groups=((0, 1), (2,)))
    air = Air(sure(partitions=(cut,)), places)
    for tick in range(9):
        air.run([said(k, 1, first=tick) for k in range(5)])
    groups = [0, 0, 1, 2, 2]  # who is in none is in one more, together
    for me in range(5):
        for other in range(5):
            times = [t for t, m in air.heard[me] if m.sender == other]
            # Handed over at 3, 4, 5, and at 6 what was said at 5: all of that is cut.
            whole = [1, 2, 7, 8, 9] if groups[me] != groups[other] else list(range(1, 10))
            assert times == ([] if me == other else whole)


def test_what_is_in_flight_when_a_partition_forms_does_not_cross():
    cut = Partition(start=2.5, end=4.0, groups=((0,), (1,)))
    air = Air(sure(partitions=(cut,), latency=1.4))
    for tick in range(6):
        air.run([said(0, 1, first=tick), []])
    # Said at 0 it arrives at 1.4 and is heard at 2; said at 1, 2 and 3 it would be at 3, 4 and 5.
    air.run(ticks=3)
    assert [m.sequence for _, m in air.heard[1]] == [0, 4, 5]
    assert [d.heard_by for d in air.deliveries] == [(1,), (), (), (), (1,), (1,)]


def test_buildings_take_their_share_where_shapely_says_they_stand():
    rng = np.random.default_rng(4)
    city = City.generate(size=(400.0, 400.0), density=0.35, seed=3)
    places = np.column_stack((rng.uniform(0, 400, (14, 2)), rng.uniform(1.0, 45.0, 14)))
    air = Air(sure(building_loss=1.0), [tuple(p) for p in places], city)
    air.run([said(k, 1) for k in range(14)])
    blocked = 0
    for d in air.deliveries:
        me = d.message.sender
        for other in set(range(14)) - {me}:
            hidden = hides(city, places[me], places[other])
            assert (other in d.heard_by) != hidden, (me, other)
            blocked += hidden
    assert 30 < blocked < 150


def hides(city, a, b):
    """Slow oracle: is any part of the segment inside a building and below its roof?"""
    for outline, roof in zip(city.outlines, city.heights, strict=True):
        inside = shapely.LineString([a[:2], b[:2]]).intersection(outline)
        for part in shapely.get_parts(inside):
            along = [math.dist(a[:2], c[:2]) for c in part.coords]
            ends = [a[2] + (b[2] - a[2]) * s / math.dist(a[:2], b[:2]) for s in along]
            if part.length > 1e-9 and min(ends) < roof:
                return True
    return False


def test_half_of_what_a_building_hides_is_lost():
    city = City.from_outlines([shapely.box(40, 40, 60, 60)], [30.0], (100.0, 100.0))
    places = [(10.0, 50.0, 10.0), (90.0, 50.0, 10.0), (10.0, 90.0, 10.0)]
    air = Air(sure(building_loss=0.3), places, city).run([said(0, 4000), [], []])
    assert len(air.heard[2]) == 4000
    assert stats.binomtest(len(air.heard[1]), 4000, 0.7).pvalue > 0.01


def test_a_dead_radio_neither_sends_nor_hears():
    for radio in (sure(), sure(latency=2.0)):
        air = Air(radio, [*NEAR, (2.0, 0.0, 80.0)])
        air.run([said(0, 2), said(1, 2), []], 4, working=[1, 0, 1])
        assert [len(box) for box in air.heard] == [0, 0, 2]
        assert [d.receivers for d in air.deliveries] == [2, 2, 0, 0]
    # It dies with messages in its queue and on their way to it.
    air = Air(sure(bandwidth=16.0, latency=2.0)).run([said(0, 4), said(1, 1)])
    air.run(ticks=6, working=[1, 0])
    assert air.heard[1] == []
    air = Air(sure(bandwidth=8.0)).run([said(0, 4), []])
    air.run(ticks=9, working=[0, 1])
    assert air.heard[1] == []
    assert (air.radio.waiting, len(air.deliveries)) == (0, 4)


def test_everything_on_but_without_effect_is_the_plain_radio():
    places = [(400.0 * k, 0.0, 80.0) for k in range(4)]
    plain = Air(RadioSet(), places)
    never = Partition(start=1e5, end=2e5, groups=((0,), (1,)))
    full = Air(RadioSet(latency=1e-3, partitions=(never,)), places)
    for tick in range(20):
        boxes = [said(k, 5, first=5 * tick) for k in range(4)]
        plain.run(boxes)
        full.run(boxes)
    full.run()
    assert plain.deliveries == full.deliveries
    assert [m for _, m in plain.heard[2]] == [m for t, m in full.heard[2]]


def test_the_same_key_gives_the_same_air_and_who_else_talks_changes_nothing():
    radio = RadioSet(latency=0.5, jitter=2.0, duplication=0.3)
    places = [(0.0, 0, 80.0), (500.0, 0, 80.0)]
    alone = Air(radio, places).run([said(0, 300), []], 5)
    again = Air(radio, places).run([said(0, 300), []], 5)
    more = Air(radio, [*places, (0, 700.0, 80.0)]).run([said(0, 300), said(1, 9), said(2, 90)], 5)
    assert alone.heard == again.heard
    assert alone.heard[1] == [(t, m) for t, m in more.heard[1] if m.sender == 0]


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("radio.latency", -1.0, "radio.latency = -1.0: expected at least 0"),
        ("radio.duplication", 1.5, "expected at most 1"),
        ("radio.building_loss", float("nan"), "radio.building_loss"),
        ("radio.bandwidth", -5, "expected at least 0"),
        ("radio.queue_limit", 0, "expected at least 1"),
        ("radio.jitter_kind", "normal", "'uniform' or 'exponential'"),
        (
            "radio.partitions",
            [{"start": 5.0, "end": 5.0, "groups": [[0]]}],
            "end = 5 must be later",
        ),
        ("radio.partitions", [{"start": 0.0, "end": 5.0, "groups": [[0, 1], [1]]}], "1 twice"),
        ("radio.partitions", [{"start": 0.0, "end": 5.0, "groups": [[7]]}], "names aircraft 7"),
        ("radio.partitions", [{"start": 0.0, "groups": [[0]]}], "partitions[0].end: missing"),
        ("radio.partitions", [{"start": 0.0, "ende": 1.0, "groups": [[0]]}], 'mean "end"'),
    ],
)
def test_bad_values_are_refused_by_name(key, value, text):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("downtown", **{key: value})
    assert text in str(caught.value)


def test_the_line_of_the_second_table_of_a_list_is_named(tmp_path):
    file = tmp_path / "two.toml"
    table = "[[radio.partitions]]\nstart = 1\nend = {}\ngroups = [[0]]\n"
    file.write_text("[radio]\nlatency = 1\n" + table.format(2) + table.format(0.5))
    with pytest.raises(ScenarioError, match=r"two\.toml, line 9: radio\.partitions\[1\]\.end = 0"):
        load_scenario(file)


def test_the_default_range_is_more_than_four_times_the_sensing_radius():
    downtown = load_scenario("downtown")
    assert downtown.radio.range > 4.0 * downtown.camera.range
