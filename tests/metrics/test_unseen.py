"""Why unseen: each cause by hand, and at random against a slow oracle."""

import json

import numpy as np
import pytest
import unseen_oracle
from handmade import (
    block_city,
    decision,
    drive,
    hover,
    make_record,
    message,
    parked,
    sighting,
    track,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.datatypes.truth import CAMERA, FLYING, LOST, nominal
from staniel.errors import RecordError
from staniel.metrics import Cause, compute_metrics, unwatched
from staniel.metrics.following import follow
from staniel.metrics.visible import visible_decisions

HERE = parked(500.0, 500.0)
ABOVE, AFAR = hover(500.0, 500.0), hover(900.0, 500.0)


def causes(*, vehicle=0, **parts):
    """Keys of the causes of one vehicle, a second each; the slow oracle agrees."""
    record = make_record(**parts)
    result = unwatched(record)
    keys = [[Cause(code).key for code in row] for row in result.cause.tolist()]
    assert keys == unseen_oracle.causes(record)
    return [row[vehicle] for row in keys]


def held(agent, instants, *, x=500.0, y=500.0, name="0-0"):
    """An agent believes in a track at (x, y), and holds it, at each instant."""
    return {
        "tracks": [track(float(t), agent, name, x, y) for t in instants],
        "decisions": [decision(float(t), agent, name) for t in instants],
    }


def both(*parts):
    return {
        key: sorted((row for part in parts for row in part[key]), key=lambda row: row["time"])
        for key in ("tracks", "decisions")
    }


def failing(column, aircraft, since, count=2):
    """Conditions in which one thing of one aircraft fails; a lost one has nothing left."""

    def condition(time):
        rows = nominal(count)
        if time >= since:
            rows[aircraft, column] = 0.0
            if column == FLYING:
                rows[aircraft, CAMERA], rows[aircraft, LOST] = 0.0, 1.0
        return rows

    return condition


# -- one by one ------------------------------------------------------------------------------------


def test_watched_is_in_plain_sight_with_a_track_near_whoever_is_assigned():
    near = [track(float(t), 0, "0-0", 506.0, 508.0) for t in range(4)]
    assert causes(seconds=3, aircraft=[ABOVE], vehicles=[HERE], tracks=near) == ["watched"] * 3
    far = [track(float(t), 0, "0-0", 506.0, 508.1) for t in range(4)]
    assert "watched" not in causes(seconds=3, aircraft=[ABOVE], vehicles=[HERE], tracks=far)
    hidden = {"seconds": 3, "aircraft": [AFAR], "vehicles": [HERE], "tracks": near}
    assert "watched" not in causes(**hidden)


def test_nobody_is_assigned_while_no_held_track_was_ever_near():
    ghost = held(0, range(4), x=700.0)
    assert causes(seconds=3, aircraft=[ABOVE], vehicles=[HERE], **ghost) == ["nobody_assigned"] * 3


@pytest.mark.parametrize(
    ("x", "cause"),
    [(740.0, "out_of_range"), (730.0, "outside_footprint"), (640.0, "outside_footprint")],
)
def test_range_comes_before_the_footprint(x, cause):
    # The range of 250 m ends 237 m away, the disc of the level camera 137 m away.
    parts = held(0, range(3))
    assert causes(seconds=2, aircraft=[hover(x, 500.0)], vehicles=[HERE], **parts) == [cause] * 2


def test_a_camera_above_its_ceiling_has_no_footprint():
    parts = held(0, range(3))
    high = {"seconds": 2, "aircraft": [ABOVE], "vehicles": [HERE], **parts}
    assert causes(**high) == ["watched"] * 2
    result = unwatched(make_record(**high, camera={"max_height": 79.0}))
    assert result.cause.ravel().tolist() == [Cause.OUTSIDE_FOOTPRINT] * 2


def test_a_building_hides_what_is_in_range_and_in_the_footprint():
    parts = held(0, range(3), x=525.0)
    shadow = {"aircraft": [hover(440.0, 500.0)], "vehicles": [parked(525.0, 500.0)]}
    assert causes(seconds=2, city=block_city(), **shadow, **parts) == ["building"] * 2


def test_of_several_that_are_assigned_the_one_that_lacks_least_gives_the_cause():
    parts = both(held(0, range(3)), held(1, range(3), name="1-0"))
    pair = {"seconds": 2, "vehicles": [HERE], **parts}
    assert causes(aircraft=[AFAR, hover(690.0, 500.0)], **pair) == ["outside_footprint"] * 2
    # An onlooker that is nearer, but not assigned, does not count.
    alone = {"seconds": 2, "vehicles": [HERE], **held(0, range(3))}
    assert causes(aircraft=[AFAR, hover(690.0, 500.0)], **alone) == ["out_of_range"] * 2


def diverged(**parts):
    """Aircraft 0 is above and holds a track that leaves the vehicle after the start."""
    rows = both(held(0, [0]), held(0, range(1, 4), x=530.0))
    return causes(seconds=3, vehicles=[HERE], **rows, **parts)


def test_seconds_without_a_sighting_are_missed_detections_and_the_others_lost_tracks():
    cause = diverged(aircraft=[ABOVE], sightings=[sighting(0.0, 0), sighting(2.0, 0)])
    assert cause == ["missed_detection", "track_lost", "missed_detection"]
    others = [sighting(2.0, -1), sighting(2.0, 1)]  # a false alarm, and another vehicle
    assert diverged(aircraft=[ABOVE], sightings=others) == ["missed_detection"] * 3


def test_a_picture_counts_until_the_next_one_is_due_whenever_it_comes():
    looks = [sighting(0.8, 0), sighting(2.8, 0)]
    every_other = {"frame_interval": 2.0, "delay": 1.5}
    assert diverged(aircraft=[ABOVE], sightings=looks)[1] == "missed_detection"
    cause = diverged(aircraft=[ABOVE], sightings=looks, camera=every_other)
    assert cause == ["track_lost"] * 3


def test_the_message_was_lost_when_only_others_saw_it_and_no_report_came_through():
    # Aircraft 1 sees the vehicle at 1, 2 and 3 s; aircraft 0, that is assigned, hears at 2 s only.
    # What was said at 3 s stands in no tick: whether it is heard is not known.
    reports = [message(t, 1, int(t), "report", receivers=1, heard=0) for t in (1.0, 2.0)]
    heartbeat = message(1.0, 1, 9, "heartbeat", receivers=1, heard=1)
    team = {
        "aircraft": [AFAR, ABOVE],
        "sightings": [sighting(t, 0, reporter=1) for t in (1.0, 2.0, 3.0)],
        "messages": [heartbeat, *reports],
    }
    assert diverged(**team, receptions=[(0, 0), (2, 0)]) == [
        "message_lost", "track_lost", "track_lost",
    ]  # fmt: skip
    assert diverged(**team, receptions=[(0, 0)])[1] == "message_lost"
    assert diverged(**team) == ["track_lost"] * 3  # nobody knows who heard what
    own = [*team["sightings"], sighting(1.0, 0, reporter=0)]
    assert diverged(**{**team, "sightings": own}, receptions=[(0, 0)])[0] == "track_lost"


def test_a_delayed_picture_is_in_the_report_of_when_it_is_there():
    team = {
        "aircraft": [AFAR, ABOVE],
        "sightings": [sighting(1.0, 0, reporter=1)],
        "messages": [message(t, 1, int(t), "report", receivers=1) for t in (1.0, 2.0)],
        "camera": {"delay": 0.7},
    }
    assert diverged(**team, receptions=[(1, 0)])[0] == "track_lost"
    assert diverged(**team, receptions=[(0, 0)])[0] == "message_lost"


# -- lost aircraft ---------------------------------------------------------------------------------


def test_lost_with_its_aircraft_until_another_is_assigned():
    parts = both(held(0, range(3)), held(1, range(5, 7), name="1-0"))
    team = {"seconds": 6, "aircraft": [AFAR, AFAR], "vehicles": [HERE], **parts}
    cause = causes(**team, condition=failing(FLYING, 0, 3.0))
    assert cause == ["out_of_range"] * 2 + ["aircraft_lost"] * 2 + ["out_of_range"] * 2


def test_what_an_aircraft_gave_up_in_time_is_not_lost_with_it():
    team = {"seconds": 4, "aircraft": [AFAR, AFAR], "vehicles": [HERE], **held(0, range(2))}
    assert causes(**team, condition=failing(FLYING, 0, 3.0))[1:] == ["nobody_assigned"] * 3


def test_with_a_second_aircraft_assigned_nothing_is_lost():
    parts = both(held(0, range(2)), held(1, range(4)))
    team = {"seconds": 3, "aircraft": [ABOVE, AFAR], "vehicles": [HERE], **parts}
    cause = causes(**team, condition=failing(FLYING, 0, 2.0))
    assert cause == ["watched", "out_of_range", "out_of_range"]


def test_an_aircraft_whose_camera_is_dead_is_lost_to_its_vehicle():
    team = {"seconds": 3, "aircraft": [ABOVE, AFAR], "vehicles": [HERE], **held(0, range(4))}
    cause = causes(**team, condition=failing(CAMERA, 0, 2.0))
    assert cause == ["watched", "aircraft_lost", "aircraft_lost"]


# -- whose track is it -----------------------------------------------------------------------------


def test_a_track_stays_with_its_vehicle_until_it_is_away_from_it_and_near_another():
    # It passes from the first vehicle to the second, 12 m apart: near both from 2 to 10 m on.
    path = [500.0, 507.0, 509.0, 511.0, 540.0]
    parts = both(*(held(0, [t], x=x) for t, x in enumerate(path)))
    record = make_record(seconds=4, aircraft=[AFAR], vehicles=[HERE, parked(512.0, 500.0)], **parts)
    assert unwatched(record).assigned.ravel().tolist() == [0, 0, 1, 1]


def test_what_an_agent_never_saw_near_is_what_the_others_saw_last():
    seen = [track(0.0, 1, "1-0", 500.0, 500.0), track(2.0, 2, "1-0", 600.0, 500.0)]
    own = [track(3.0, 0, "1-0", 500.0, 500.0)]
    record = make_record(
        seconds=5,
        aircraft=[AFAR] * 3,
        vehicles=[HERE, parked(600.0, 500.0)],
        tracks=seen + own,
        decisions=[decision(float(t), 0, "1-0") for t in range(1, 6)],
    )
    assert unwatched(record).assigned[:, 0].tolist() == [0, 1, 0, 0, 0]
    assert (unwatched(record).assigned[:, 1:] == -1).all()


# -- everything at once ----------------------------------------------------------------------------


def some_record(seed):
    """Aircraft, vehicles, beliefs, sightings, reports and failures, all by chance."""
    random = np.random.default_rng(seed)
    count, seconds = int(random.integers(1, 5)), 8
    places = random.uniform([400, 400, 60], [600, 600, 130], (count, 3)).tolist()
    starts = random.uniform(440, 560, (3, 2)).tolist()
    movers = [drive(x, y, random.uniform(-3, 3), 1.0) for x, y in starts]
    names, instants = ["0-0", "0-1", "1-0"], np.arange(seconds + 1.0).tolist()
    tracks, decisions, sightings, messages, receptions = [], [], [], [], []
    for time in instants:
        for agent in range(count):
            for name, (x, y) in zip(names, starts, strict=True):
                if random.random() < 0.4:
                    off = random.choice([3.0, 20.0])
                    tracks.append(track(time, agent, name, *random.normal((x, y), off)))
            target = random.choice(["", *names], p=[0.1, 0.3, 0.3, 0.3])
            decisions.append(decision(time, agent, str(target)))
            origins = [v for v in range(-1, 3) if random.random() < 0.3]
            sightings += [sighting(time, v, reporter=agent) for v in origins]
            if origins and time < seconds:
                hearers = [a for a in range(count) if a != agent and random.random() < 0.4]
                receptions += [(len(messages), a) for a in hearers]
                messages.append(message(time, agent, len(messages), "report"))
    failures = random.exponential(30.0, (count, 2))

    def condition(time):
        rows = nominal(count)
        rows[:, FLYING] = failures[:, 0] > time
        rows[:, CAMERA] = rows[:, FLYING] * (failures[:, 1] > time)
        rows[:, LOST] = 1.0 - rows[:, FLYING]
        return rows

    return make_record(
        seconds=seconds,
        aircraft=[hover(*place) for place in places],
        vehicles=movers,
        city=block_city(),
        camera={"range": 150.0, "half_aperture_deg": 40.0},
        tracks=tracks,
        decisions=decisions,
        sightings=sightings,
        messages=messages,
        receptions=receptions,
        condition=condition,
    )


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_every_second_has_one_cause_and_it_is_the_oracles(seed):
    record = some_record(seed)
    result = unwatched(record)
    keys = [[Cause(code).key for code in row] for row in result.cause.tolist()]
    assert keys == unseen_oracle.causes(record)
    assert result.totals.sum(axis=1).tolist() == [8.0] * 3
    near = follow(record).tracked[1:]
    assert np.array_equal(result.cause == Cause.WATCHED, near & visible_decisions(record)[1:])


def test_chance_brings_every_cause():
    found = {code for seed in range(40) for code in unwatched(some_record(seed)).cause.ravel()}
    assert found == set(Cause)


def test_the_metrics_hold_seconds_of_each_cause_that_add_up_to_the_duration():
    record = some_record(3)
    metrics = compute_metrics(record)
    assert json.dumps(metrics, allow_nan=False)
    for target in metrics["targets"]:
        assert list(target["unwatched"]) == [cause.key for cause in Cause][1:]
        assert target["watched"] + sum(target["unwatched"].values()) == metrics["duration"]
    team = metrics["team"]
    for cause in team["unwatched"]:
        assert team["unwatched"][cause] == sum(t["unwatched"][cause] for t in metrics["targets"])
    assert team["watched"] == sum(target["watched"] for target in metrics["targets"])


def test_nothing_flown_nobody_there_and_strange_numbers():
    start = compute_metrics(make_record(seconds=0, aircraft=[ABOVE], vehicles=[HERE]))
    assert start["targets"][0]["watched"] == sum(start["team"]["unwatched"].values()) == 0.0
    empty = unwatched(make_record(seconds=2, aircraft=[], vehicles=[]))
    assert empty.totals.shape == (0, 9)
    nobody = unwatched(make_record(seconds=2, aircraft=[], vehicles=[HERE]))
    assert nobody.totals[0, Cause.NOBODY_ASSIGNED] == 2.0
    stranger = {
        "tracks": [track(1.0, 7, "0-0", 500.0, 500.0)],
        "decisions": [decision(1.0, -2, "0-0")],
        "sightings": [sighting(1.0, 0, reporter=9), sighting(1.0, 5)],
        "messages": [message(1.0, 8, 0, "report")],
        "receptions": [],
    }
    record = make_record(seconds=2, aircraft=[ABOVE], vehicles=[HERE], **stranger)
    assert unwatched(record).totals[0, Cause.NOBODY_ASSIGNED] == 2.0


def test_a_camera_that_no_scenario_can_have_is_refused():
    record = make_record(seconds=1, aircraft=[ABOVE], vehicles=[HERE], camera={"range": -1.0})
    with pytest.raises(RecordError, match=r"scenario\.camera"):
        unwatched(record)
