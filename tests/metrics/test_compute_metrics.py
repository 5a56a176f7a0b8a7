"""Every figure by hand, on records made by hand."""

import dataclasses
import json
import math

import numpy as np
import pytest
import shapely
from handmade import (
    block_city,
    decision,
    drive,
    fly_east,
    hover,
    make_record,
    message,
    parked,
    sighting,
    track,
)

from staniel.city import City
from staniel.metrics import compute_metrics, team_picture
from staniel.record import THREAT_DTYPE


def compute(**parts):
    """Metrics of a record; whatever they are, JSON takes them, and the same twice."""
    record = make_record(**parts)
    metrics = compute_metrics(record)
    text = json.dumps(metrics, allow_nan=False)
    assert json.dumps(compute_metrics(record), allow_nan=False) == text
    return metrics


def watched(tracks, *, vehicles=None, seconds=4, **parts):
    """One aircraft over one parked vehicle that is seen from the start."""
    vehicles = vehicles or [parked(500.0, 500.0)]
    return compute(
        seconds=seconds,
        aircraft=[hover(500.0, 500.0)],
        vehicles=vehicles,
        sightings=[sighting(0.0, k) for k in range(len(vehicles))],
        tracks=tracks,
        **parts,
    )


def test_found_when_a_track_is_near_and_tracked_from_the_first_detection_on():
    metrics = compute(
        seconds=9,
        aircraft=[hover(500.0, 500.0), hover(400.0, 500.0)],
        vehicles=[parked(500.0, 500.0)],
        sightings=[sighting(2.0, -1), sighting(4.0, 0, reporter=1), sighting(3.0, 0)],
        tracks=[
            track(1.0, 0, "0-0", 500.0, 509.0),  # near by luck, before the vehicle was ever seen
            track(4.0, 0, "0-0", 500.0, 510.5),  # too far
            track(5.0, 0, "0-0", 500.0, 512.0, last_seen=5.0),
            track(5.0, 1, "0-0", 500.0, 510.0),  # another agent's copy, just within 10 m
            track(6.0, 1, "0-0", 500.0, 503.0),
            track(8.0, 0, "1-0", 501.0, 500.0),
        ],
    )
    target = metrics["targets"][0]
    assert target["first_detection"] == 3.0
    assert target["found_at"] == 5.0
    assert target["tracked_fraction"] == pytest.approx(3 / 7, abs=1e-6)  # 5, 6, 8 of 3 to 9
    # At 5 s the team's own picture is 12 m off; what was before the first detection is left out.
    assert target["position_rmse"] == pytest.approx(math.sqrt((3**2 + 1**2) / 2), abs=1e-6)
    assert target["identity_switches"] == 1  # 0-0 and, after a pause, 1-0
    assert metrics["team"]["tracked_fraction"] == target["tracked_fraction"]


def test_never_found_is_none_and_counts_as_nothing_in_the_team():
    metrics = compute(
        seconds=5,
        aircraft=[hover(500.0, 500.0)],
        vehicles=[parked(500.0, 500.0), parked(900.0, 900.0)],
        sightings=[sighting(0.0, 0)],
        tracks=[track(t, 0, "0-0", 500.0, 500.0) for t in (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)],
    )
    found, missed = metrics["targets"]
    assert found["tracked_fraction"] == found["visible_fraction"] == 1.0
    assert missed.pop("id") == 1
    assert missed.pop("identity_switches") == 0
    assert missed.pop("watched") == 0.0
    assert missed.pop("unwatched")["nobody_assigned"] == 5.0
    assert set(missed.values()) == {None}
    assert metrics["team"]["visible_fraction"] == metrics["team"]["tracked_fraction"] == 0.5
    assert metrics["team"]["gospa_mean"] == pytest.approx(math.sqrt(200.0), abs=1e-6)


def test_errors_of_the_nearest_estimate_of_the_team_picture():
    metrics = watched(
        [
            track(0.0, 0, "0-0", 503.0, 504.0, vx=0.0, vy=3.0),
            track(0.0, 0, "0-1", 508.0, 500.0, vx=9.0, vy=9.0),
            track(1.0, 0, "0-0", 502.0, 501.0, vx=-1.0, vy=0.0),
            track(2.0, 0, "0-0", 540.0, 500.0),
        ],
        vehicles=[drive(500.0, 500.0, speed=2.0)],
        seconds=2,
    )
    target = metrics["targets"][0]
    assert target["position_rmse"] == pytest.approx(math.sqrt((5**2 + 1**2) / 2), abs=1e-6)
    assert target["speed_rmse"] == pytest.approx(math.sqrt((1**2 + 1**2) / 2), abs=1e-6)
    turned = math.sqrt(((math.pi / 2) ** 2 + math.pi**2) / 2)
    assert target["course_rmse"] == pytest.approx(turned, abs=1e-6)


def test_course_error_takes_the_short_way_round_and_needs_a_moving_vehicle():
    heading, off = math.radians(175.0), math.radians(-175.0)
    moving = watched(
        [track(0.0, 0, "0-0", 500.0, 500.0, vx=2 * math.cos(off), vy=2 * math.sin(off))],
        vehicles=[drive(500.0, 500.0, heading=heading)],
    )["targets"][0]
    assert moving["course_rmse"] == pytest.approx(math.radians(10.0), abs=1e-6)
    backwards = watched(
        [track(0.0, 0, "0-0", 500.0, 500.0, vx=-2.0)], vehicles=[drive(500.0, 500.0, speed=-2.0)]
    )["targets"][0]
    assert backwards["course_rmse"] == backwards["speed_rmse"] == 0.0
    standing = watched([track(0.0, 0, "0-0", 500.0, 500.0, vx=1.0)])["targets"][0]
    assert standing["course_rmse"] is None
    assert standing["speed_rmse"] == 1.0


def test_identity_is_kept_while_near_even_when_another_track_is_nearer():
    metrics = watched(
        [
            track(0.0, 0, "0-0", 504.0, 500.0),
            track(1.0, 0, "0-0", 509.0, 500.0),
            track(1.0, 0, "0-9", 500.0, 500.0),
            track(2.0, 0, "0-0", 511.0, 500.0),  # gone too far: now the other one
            track(2.0, 0, "0-9", 500.0, 500.0),
            track(3.0, 0, "0-0", 500.0, 500.0),  # back, but 0-9 is still near
            track(3.0, 0, "0-9", 508.0, 500.0),
        ]
    )
    assert metrics["targets"][0]["identity_switches"] == 1
    assert metrics["team"]["identity_switches"] == 1
    assert metrics["team"]["tracks_started"] == 2


def test_identities_of_two_vehicles_exchanged():
    west, east = parked(480.0, 500.0), parked(520.0, 500.0)
    swapped = [
        track(t, 0, name, x, 500.0)
        for t, a, b in ((0.0, 480.0, 520.0), (1.0, 480.0, 520.0), (2.0, 520.0, 480.0))
        for name, x in (("0-0", a), ("0-1", b))
    ]
    metrics = watched(swapped, vehicles=[west, east], seconds=2)
    assert [t["identity_switches"] for t in metrics["targets"]] == [1, 1]


def test_matching_gives_as_many_vehicles_a_track_as_possible():
    # Both vehicles are near 0-0, only the first is near 0-1. Nearest first would leave one without.
    close = [parked(500.0, 500.0), parked(508.0, 500.0)]
    tracks = [
        row
        for t in (0.0, 1.0)
        for row in (track(t, 0, "0-0", 501.0, 500.0), track(t, 0, "0-1", 492.0, 500.0))
    ]
    tracks += [track(2.0, 0, "0-7", 508.0, 500.0), track(2.0, 0, "0-1", 492.0, 500.0)]
    metrics = watched(tracks, vehicles=close, seconds=2)
    assert [t["identity_switches"] for t in metrics["targets"]] == [0, 1]


def test_identity_scores_of_the_team_picture_over_all_instants():
    metrics = watched(
        [
            # 0 s: nothing yet. The staler copy of a name, far off, is not in the picture.
            track(1.0, 0, "0-0", 503.0, 504.0, last_seen=1.0),
            track(1.0, 1, "0-0", 600.0, 600.0),
            track(2.0, 0, "0-0", 500.0, 520.0),  # out of the gate: missed, and one false
            track(3.0, 0, "0-0", 501.0, 500.0),
            track(4.0, 1, "1-5", 500.0, 503.0),  # another name
        ]
    )
    team = metrics["team"]
    assert (team["identity_switches"], team["fragmentations"]) == (1, 1)
    assert (team["misses"], team["false_positives"]) == (2, 1)
    assert team["mota"] == pytest.approx(1 - 4 / 5)
    assert team["motp"] == pytest.approx((5 + 1 + 3) / 3)
    assert (team["idp"], team["idr"], team["idf1"]) == pytest.approx(
        (2 / 4, 2 / 5, 4 / 9), abs=1e-6
    )


def test_nees_while_visible_and_since_the_first_detection():
    def rows(time, x, xx, yy, xy=0.0):
        return {**track(time, 0, "0-0", x, 500.0), "cxx": xx, "cyy": yy, "cxy": xy}

    metrics = compute(
        seconds=6,
        # East of 500 m + 80 m tan 60° it no longer sees the vehicle.
        aircraft=[lambda t: (hover(500.0, 500.0) if t < 5.0 else hover(900.0, 500.0))(t)],
        vehicles=[parked(500.0, 500.0), parked(700.0, 700.0)],
        sightings=[sighting(1.0, 0)],
        tracks=[
            rows(0.0, 509.0, 1.0, 1.0),  # before the first detection
            rows(1.0, 503.0, 2.25, 9.0),  # 4
            rows(2.0, 502.0, 2.0, 2.0, 1.0),  # 4·2/3
            rows(3.0, 502.0, 1.0, 1.0, 1.0),  # not positive definite
            rows(4.0, 511.0, 1.0, 1.0),  # not near
            rows(5.0, 509.0, 1.0, 1.0),  # not visible
        ],
    )
    seen, unseen = metrics["targets"]
    assert seen["position_nees"] == pytest.approx((4 + 8 / 3) / 2 / 2, abs=1e-6)
    assert unseen["position_nees"] is None
    assert metrics["team"]["position_nees"] == seen["position_nees"]


def test_team_picture_takes_the_freshest_then_the_lowest_agent():
    record = make_record(
        seconds=1,
        aircraft=[hover(0.0, 0.0)],
        vehicles=[],
        tracks=[
            track(0.0, 2, "b", 1.0, 0.0, last_seen=5.0),
            track(0.0, 0, "a", 2.0, 0.0, last_seen=3.0),
            track(0.0, 1, "b", 3.0, 0.0, last_seen=5.0),
            track(0.0, 0, "b", 4.0, 0.0, last_seen=4.0),
            track(1.0, 0, "b", 5.0, 0.0, last_seen=1.0),
        ],
    )
    assert team_picture(record.tracks).tolist() == [2, 1, 4]


def test_gospa_means_over_all_steps_from_the_start():
    # 0 s: nothing known; 1 s: 5 m off; 2 s: 5 m off and one false one far away.
    metrics = watched(
        [
            track(1.0, 0, "0-0", 503.0, 504.0),
            track(2.0, 0, "0-0", 503.0, 504.0, last_seen=2.0),
            track(2.0, 1, "0-0", 500.0, 500.0, last_seen=1.0),  # staler: not in the picture
            track(2.0, 0, "0-1", 800.0, 800.0),
        ],
        seconds=2,
    )
    team = metrics["team"]
    steps = [math.sqrt(200.0), 5.0, 15.0]
    assert team["gospa_mean"] == pytest.approx(sum(steps) / 3, abs=1e-6)
    assert team["gospa_localisation"] == pytest.approx(50.0 / 3, abs=1e-6)
    assert team["gospa_missed"] == team["gospa_false"] == pytest.approx(200.0 / 3, abs=1e-6)
    ospa = [20.0, 5.0, math.sqrt((25.0 + 400.0) / 2)]
    assert team["ospa_mean"] == pytest.approx(sum(ospa) / 3, abs=1e-6)
    assert (team["tracks_started"], team["false_tracks"]) == (2, 1)


def test_a_track_that_was_near_once_in_any_hands_is_not_false():
    metrics = watched(
        [
            track(0.0, 0, "0-0", 600.0, 600.0, last_seen=9.0),
            track(0.0, 1, "0-0", 500.0, 509.0, last_seen=1.0),
            track(1.0, 0, "0-1", 500.0, 510.5),
        ]
    )
    assert (metrics["team"]["tracks_started"], metrics["team"]["false_tracks"]) == (2, 1)


def test_handovers():
    def said(rows):
        decisions = [decision(t, agent, name) for t, agent, name in rows]
        empty = {"seconds": 1, "aircraft": [hover(0.0, 0.0)], "vehicles": []}
        return compute(**empty, decisions=decisions)["team"]["handovers"]

    assert said([]) == 0
    kept = [(0.0, 0, "x"), (0.0, 1, ""), (1.0, 0, "x"), (1.0, 1, "")]
    assert said(kept) == 0
    passed_on = [*kept, (2.0, 0, ""), (2.0, 1, "x")]
    assert said(passed_on) == 1
    assert said([*passed_on, (3.0, 0, "x"), (3.0, 1, "")]) == 2
    # Both claim it for a tick: the holder stays, until it lets go.
    both = [*kept, (2.0, 0, "x"), (2.0, 1, "x")]
    assert said(both) == 0
    assert said([*both, (3.0, 0, "x"), (3.0, 1, "")]) == 0
    assert said([*both, (3.0, 0, ""), (3.0, 1, "x")]) == 1
    # Both take it at once: it is the first one's.
    at_once = [(0.0, 0, "x"), (0.0, 1, "x")]
    assert said([*at_once, (1.0, 0, ""), (1.0, 1, "x")]) == 1
    assert said([*at_once, (1.0, 0, "x"), (1.0, 1, "")]) == 0
    # Nobody holds it for a tick while the award is on its way.
    assert said([*kept, (2.0, 0, ""), (2.0, 1, ""), (3.0, 0, ""), (3.0, 1, "x")]) == 1
    # Taken over from an aircraft that is no more.
    assert said([*kept, (2.0, 1, "x")]) == 0
    # Two targets cross over.
    crossed = [(0.0, 0, "x"), (0.0, 1, "y"), (1.0, 0, "y"), (1.0, 1, "x")]
    assert said(crossed) == 2


def test_messages_and_auctions():
    metrics = compute(
        seconds=1,
        aircraft=[hover(0.0, 0.0)],
        vehicles=[],
        messages=[
            message(0.0, 0, 1, "heartbeat", receivers=3, heard=2),
            message(0.0, 1, 1, "announce", target="0-0", receivers=3, heard=0),
            message(1.0, 1, 2, "award", target="0-0", receivers=3, heard=3),
            message(1.0, 1, 2, "award", target="0-0", receivers=2, heard=1),
            message(1.0, 1, 3, "award", target="0-0", receivers=3, heard=3),
            message(1.0, 2, 2, "award", target="0-0", receivers=3, heard=3),
        ],
    )
    team = metrics["team"]
    assert team["auctions"] == 2  # what is said again counts once
    assert team["messages_sent"] == 6
    assert team["messages_delivered"] == 12
    assert team["messages_possible"] == 17


def test_distance_separation_and_exposure():
    metrics = compute(
        seconds=10,
        aircraft=[fly_east(400.0, 500.0), fly_east(420.0, 500.0, z=95.0, speed=10.0)],
        vehicles=[parked(500.0, 500.0)],
    )
    first, second = metrics["aircraft"]
    assert (first["id"], second["id"]) == (0, 1)
    assert first["distance"] == pytest.approx(150.0)
    assert second["distance"] == pytest.approx(100.0)
    # They pass at 4 s, 15 m apart in height.
    assert first["min_separation"] == second["min_separation"] == pytest.approx(15.0)
    # 80 m up, within 100 m of the vehicle: 60 m either side, that is 40 m to 160 m flown.
    inside = sum(40.0 < 15.0 * 0.2 * k < 160.0 for k in range(51))
    assert first["exposure"] == pytest.approx(0.2 * inside, abs=1e-6)
    assert inside == 37


def test_a_climb_counts_as_distance():
    metrics = compute(
        seconds=10, aircraft=[lambda t: (10 + 4 * t, 10.0, 50 + 3 * t, 0.0, 0.0, 5.0)], vehicles=[]
    )
    assert metrics["aircraft"][0]["distance"] == pytest.approx(50.0)


def test_building_strikes_are_counted_once_each_and_not_over_the_roof():
    city = City.from_outlines(
        [shapely.box(450, 480, 460, 520), shapely.box(500, 480, 501, 520)],
        [40.0, 40.0],
        (1000.0, 1000.0),
    )
    # 1 m thin: flown through between two samples, 3 m apart, of which neither is inside.
    metrics = compute(
        seconds=10,
        aircraft=[
            fly_east(400.5, 500.0, z=30.0),
            fly_east(400.5, 500.0, z=45.0),
            fly_east(400.5, 530.0, z=30.0),
            hover(455.0, 500.0, z=20.0),
        ],
        vehicles=[],
        city=city,
    )
    assert [a["building_strikes"] for a in metrics["aircraft"]] == [2, 0, 0, 1]


def test_unbriefed_regions_are_noticed_first_by_anybody():
    ban = {"kind": "no-fly", "center": [0.0, 0.0], "radius": 9.0}
    hidden = {**ban, "briefed": False}
    threats = np.zeros(4, dtype=THREAT_DTYPE)
    threats["time"] = (2.0, 3.0, 3.0, 4.0)
    threats["agent"] = (1, 0, 1, 0)
    threats["kind"] = ("carrier", "region", "region", "region")
    threats["origin"] = (3, 1, 1, 1)  # a vehicle 3 is not the region 3
    record = make_record(seconds=4, aircraft=[hover(0, 0), hover(9, 9)], vehicles=[])
    assert compute_metrics(record)["team"]["risk_noticed"] == []
    record = dataclasses.replace(
        record,
        scenario={**record.scenario, "risk": {"regions": [ban, hidden, ban, hidden]}},
        threats=threats,
    )
    assert compute_metrics(record)["team"]["risk_noticed"] == [
        {"region": 1, "time": 3.0},
        {"region": 3, "time": None},
    ]


def test_empty_runs():
    nothing = compute(seconds=0, aircraft=[hover(500.0, 500.0)], vehicles=[])
    assert nothing["duration"] == 0.0
    assert nothing["targets"] == []
    assert nothing["aircraft"] == [
        {
            "id": 0,
            "distance": 0.0,
            "exposure": 0.0,
            "min_separation": None,
            "building_strikes": 0,
            "risk_exposure": 0.0,
            "no_fly_seconds": 0.0,
            "no_fly_violations": 0,
            "heard_share": None,
        }
    ]
    assert nothing["team"]["gospa_mean"] == nothing["team"]["ospa_mean"] == 0.0
    assert nothing["team"]["mota"] is nothing["team"]["position_nees"] is None
    assert nothing["team"]["visible_fraction"] is None
    one_tick = compute(
        seconds=0,
        aircraft=[hover(500.0, 500.0), hover(520.0, 500.0)],
        vehicles=[parked(500.0, 500.0)],
        sightings=[sighting(0.0, 0)],
        city=block_city(),
    )
    assert one_tick["targets"][0]["visible_fraction"] in (0.0, 1.0)
    assert one_tick["aircraft"][0]["min_separation"] == 20.0


def test_a_record_cut_before_its_first_tick():
    full = make_record(seconds=2, aircraft=[hover(1.0, 1.0)] * 2, vehicles=[parked(5.0, 5.0)])
    names = ("times", "aircraft", "vehicles", "fine_times", "fine_aircraft", "fine_vehicles")
    cut = dataclasses.replace(full, complete=False, **{n: getattr(full, n)[:0] for n in names})
    metrics = compute_metrics(cut)
    json.dumps(metrics, allow_nan=False)
    assert metrics["complete"] is False
    assert metrics["team"]["gospa_mean"] is metrics["team"]["ospa_mean"] is None
    assert metrics["aircraft"][0]["min_separation"] is None


def test_what_the_run_was():
    metrics = compute(seconds=3, aircraft=[hover(1.0, 1.0)], vehicles=[], complete=False)
    assert metrics["scenario"] == "by-hand"
    assert metrics["seed"] == 7
    assert metrics["version"] == "0.0.0"
    assert metrics["duration"] == 3.0
    assert metrics["complete"] is False


def test_the_record_is_left_as_it_was():
    record = make_record(
        seconds=3,
        aircraft=[hover(500.0, 500.0)],
        vehicles=[parked(500.0, 500.0)],
        tracks=[track(1.0, 0, "0-0", 500.0, 500.0)],
    )
    arrays = {
        field.name: value.copy()
        for field in dataclasses.fields(record)
        if isinstance(value := getattr(record, field.name), np.ndarray)
    }
    for name in arrays:
        getattr(record, name).setflags(write=False)
    compute_metrics(record)
    for name, before in arrays.items():
        assert getattr(record, name).tobytes() == before.tobytes()
