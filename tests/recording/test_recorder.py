"""The recorder against the frames that went in, mcap's own reader, kills and full disks."""

import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_run
from mcap.reader import make_reader

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyBanks
from staniel.datatypes.message import COST_TERMS, Award, Bid, Heartbeat, Report
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.threats import Carrier, Threats
from staniel.errors import OutputError
from staniel.recording import Recorder, read_record
from staniel.recording.encode import FineSteps
from staniel.recording.schemas import (
    MOST_OFFERS,
    ONCE_TOPICS,
    OPTIONAL_TOPICS,
    SCHEMAS,
    TICK_TOPICS,
)

TICKS = 40


@pytest.fixture(scope="module")
def city():
    return City.generate(size=(300.0, 300.0), seed=3)


@pytest.fixture(scope="module")
def frames(city):
    return list(synthetic_run.frames(city, TICKS))


def record(path, city, frames, complete=True, **how):
    with Recorder(
        path,
        scenario=synthetic_run.scenario(),
        version=synthetic_run.VERSION,
        city=city,
        clock=synthetic_run.CLOCK,
        **how,
    ) as recorder:
        for frame in frames:
            recorder.write(frame)
        recorder.finish(complete)
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory, city, frames):
    return record(tmp_path_factory.mktemp("run") / "mission.mcap", city, frames)


def test_poses_come_back_within_the_rounding(path, frames):
    back = read_record(path)
    assert back.complete
    assert back.version == synthetic_run.VERSION
    assert back.scenario == synthetic_run.scenario()
    assert back.times.tolist() == [frame.truth.time for frame in frames]
    steps = np.array([0.0005, 0.0005, 0.0005, 0.00005, 0.00005, 0.0005]) + 1e-9
    aircraft = np.stack([frame.truth.aircraft for frame in frames])
    vehicles = np.stack([frame.truth.vehicles for frame in frames])
    assert (np.abs(back.aircraft - aircraft) <= steps).all()
    assert (np.abs(back.vehicles - vehicles) <= steps[[0, 1, 3, 5]]).all()
    fine = np.concatenate([frame.truth.aircraft_path[1::2] for frame in frames])
    assert (np.abs(back.fine_aircraft - fine) <= steps).all()
    fine = np.concatenate([frame.truth.vehicle_path[1::2] for frame in frames])
    assert (np.abs(back.fine_vehicles - fine) <= steps[[0, 1, 3, 5]]).all()
    assert np.allclose(back.fine_times, 0.2 * np.arange(1, 5 * TICKS + 1), atol=1e-9)


def test_the_city_comes_back(path, city):
    back = read_record(path).city
    assert back.size == city.size
    assert back.to_dict() == city.to_dict()


def test_sightings_and_tracks_come_back(path, frames):
    back = read_record(path)
    seen = [
        (s.time, agent, *s.position, s.covariance[0, 0], s.covariance[0, 1], s.covariance[1, 1], o)
        for frame in frames
        for agent, (percept, causes) in enumerate(zip(frame.percepts, frame.origins, strict=True))
        for s, o in zip(percept.sightings, causes, strict=True)
    ]
    assert len(seen) > 20
    assert np.allclose(np.array(back.sightings.tolist()), np.array(seen), rtol=1e-5, atol=0.0006)
    held = [
        (agent, track) for f in frames for agent, b in enumerate(f.beliefs) for track in b.tracks
    ]
    assert len(held) > 100
    assert back.tracks["agent"].tolist() == [agent for agent, _ in held]
    assert back.tracks["id"].tolist() == [str(track.id) for _, track in held]
    assert back.tracks["last_seen"].tolist() == [track.last_seen for _, track in held]
    places = np.array([(*track.position, *track.velocity) for _, track in held])
    written = np.stack([back.tracks[name] for name in ("x", "y", "vx", "vy")], axis=1)
    assert (np.abs(written - places) <= 0.000501).all()


def test_messages_come_back(path, frames):
    back = read_record(path).messages
    sent = [delivery for frame in frames for delivery in frame.deliveries]
    assert len(back) == len(sent)
    kinds = set()
    for row, delivery in zip(back, sent, strict=True):
        message = delivery.message
        kinds.add(message.kind)
        assert (row["time"], row["sender"], row["sequence"], row["kind"]) == (
            message.time,
            message.sender,
            message.sequence,
            message.kind,
        )
        assert (row["receivers"], row["heard"]) == (delivery.receivers, len(delivery.heard_by))
        if isinstance(message, Award):
            assert (row["target"], row["winner"]) == (str(message.target), message.winner)
            assert row["cost"] == message.cost
            assert [row["x"], row["y"]] == pytest.approx(message.position, abs=0.0006)
        elif isinstance(message, Heartbeat):
            # Its cost is infinite in these frames: not a number that JSON can say.
            assert math.isnan(row["cost"])
            assert row["winner"] == -1
            assert row["x"] == pytest.approx(message.pose.x, abs=0.0006)
        elif isinstance(message, Report):
            assert row["target"] == ""
            assert math.isnan(row["x"])
    assert kinds == {"heartbeat", "report", "announce", "bid", "award", "revoke", "release"}


def test_the_bids_of_awards_come_back(path, frames):
    sent = [delivery.message for frame in frames for delivery in frame.deliveries]
    wanted = []
    for award in sent:
        if isinstance(award, Award):
            said = award.time, award.sender, award.sequence, str(award.target)
            for bidder, cost, terms in award.bids or ((award.winner, award.cost, ()),):
                cost = cost if math.isfinite(cost) else math.nan
                told = [*terms, *[math.nan] * (len(COST_TERMS) - len(terms))]
                wanted.append((*said, bidder, cost, bidder == award.winner, *told))
    back = read_record(path).awards
    assert len(wanted) >= 20
    assert np.array_equal(
        np.array(wanted, dtype=back.dtype).view(f"V{back.itemsize}"), back.view(f"V{back.itemsize}")
    )
    assert back["won"].sum() == sum(isinstance(message, Award) for message in sent)


def test_a_bid_is_written_with_all_its_targets(path, frames):
    sent = [delivery.message for frame in frames for delivery in frame.deliveries]
    bids = [message for message in sent if isinstance(message, Bid)]
    with path.open("rb") as stream:
        found = [
            item["offers"]
            for _, _, message in make_reader(stream).iter_messages("/staniel/messages")
            for item in json.loads(message.data)["messages"]
            if item["kind"] == "bid"
        ]
    assert max(map(len, found)) > 1
    for offers, bid in zip(found, bids, strict=True):
        assert [offer["target"] for offer in offers] == [str(target) for target in bid.targets]
        assert [offer["auctioneer"] for offer in offers] == list(bid.auctioneers)
        assert [offer["cost"] for offer in offers] == [130.25, *[None] * (len(offers) - 1)]
        assert offers[0]["terms"] == dict(zip(COST_TERMS, synthetic_run.TERMS, strict=True))
        assert all(offer["terms"] == {} for offer in offers[1:])


def test_no_more_bids_are_recorded_than_the_schema_allows(tmp_path, city, frames):
    (k,) = [k for k, frame in enumerate(frames) if frame.truth.tick == 20]
    deliveries = [
        replace(d, message=replace(d.message, bids=d.message.bids[:1] * 1000, winner=2))
        for d in frames[k].deliveries
        if isinstance(d.message, Award)
    ]
    many = [replace(frames[k], deliveries=deliveries[:1])]
    back = read_record(record(tmp_path / "many.mcap", city, many)).awards
    assert len(back) == MOST_OFFERS + 1  # The winner's own is always there.
    assert back["bidder"].tolist() == [*[0] * MOST_OFFERS, 2]
    assert back["won"].nonzero()[0].tolist() == [MOST_OFFERS]


def test_commands_and_decisions_come_back(path, frames):
    back = read_record(path)
    commands = [command for frame in frames for command in frame.commands]
    assert len(back.commands) == len(commands)
    names = {"FlyLine": "line", "FlyOrbit": "orbit", "FlyBanks": "banks"}
    for row, command in zip(back.commands, commands, strict=True):
        kind = row["kind"]
        assert kind == names[type(command).__name__]
        assert (row["speed"], row["altitude"]) == (command.speed, command.altitude)
        if kind == "line":
            assert [row["ax"], row["ay"]] == pytest.approx(command.start, abs=0.0006)
            assert [row["bx"], row["by"]] == pytest.approx(command.end, abs=0.0006)
        elif kind == "orbit":
            assert [row["ax"], row["ay"]] == pytest.approx(command.center, abs=0.0006)
            assert (row["radius"], row["turn"]) == (command.radius, command.turn)
        else:
            look = (math.nan, math.nan) if command.look is None else command.look
            assert [row["ax"], row["ay"]] == pytest.approx(look, abs=0.0006, nan_ok=True)
            assert all(math.isnan(row[name]) for name in ("bx", "by", "radius"))
    banks = [command for command in commands if isinstance(command, FlyBanks)]
    assert {command.look is None for command in banks} == {False, True}
    beliefs = [belief for frame in frames for belief in frame.beliefs]
    assert back.decisions["role"].tolist() == [belief.role for belief in beliefs]
    targets = ["" if belief.target is None else str(belief.target) for belief in beliefs]
    assert back.decisions["target"].tolist() == targets


def test_the_same_run_writes_the_same_bytes(path, tmp_path, city):
    again = list(synthetic_run.frames(city, TICKS))
    assert record(tmp_path / "again.mcap", city, again).read_bytes() == path.read_bytes()


@pytest.mark.parametrize(("n_aircraft", "n_vehicles"), [(1, 0), (2, 1)])
def test_few_machines_come_back(tmp_path, n_aircraft, n_vehicles):
    city = City.open((100.0, 50.0))
    few = list(synthetic_run.frames(city, 3, aircraft=n_aircraft, vehicles=n_vehicles))
    back = read_record(record(tmp_path / "few.mcap", city, few))
    assert back.aircraft.shape == (3, n_aircraft, 6)
    assert back.vehicles.shape == (3, n_vehicles, 4)
    assert back.fine_vehicles.shape == (15, n_vehicles, 4)


@pytest.mark.parametrize(
    ("decision", "dynamics", "stride"),
    [(1.0, 0.1, 2), (1.0, 0.05, 4), (1.0, 0.125, 1), (0.3, 0.1, 1), (0.6, 0.1, 2), (1.0, 0.2, 1)],
)
def test_fine_steps_are_even_and_end_with_the_tick(decision, dynamics, stride):
    clock = Clock(decision_step=decision, dynamics_step=dynamics)
    fine = FineSteps(clock)
    assert fine.stride == stride
    path = np.arange(clock.substeps, dtype=float).reshape(-1, 1, 1)
    taken = fine.of(path).ravel()
    assert taken[-1] == clock.substeps - 1
    ends = fine.times(decision, len(taken))
    assert np.allclose(ends, (taken + 1) * dynamics)
    assert fine.of(path[:1]).shape == (1, 1, 1)
    assert fine.times(0.0, 1) == [0.0]


def test_mcap_itself_reads_the_file_with_its_summary(path):
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 3 + 7 * TICKS
        assert summary.statistics.message_start_time == 0
        assert summary.statistics.message_end_time == TICKS * 1_000_000_000
        assert len(summary.chunk_indexes) == TICKS + 1
        assert {channel.topic for channel in summary.channels.values()} == set(SCHEMAS)
        last = [m for _, c, m in reader.iter_messages("/staniel/truth")]
        assert [message.log_time for message in last] == [
            (k + 1) * 1_000_000_000 for k in range(TICKS)
        ]


def conforms(value, schema, where="message"):
    """Check a value against the part of JSON Schema that the schemas use."""
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    python = {
        "object": dict,
        "array": list,
        "string": str,
        "boolean": bool,
        "null": type(None),
        "integer": int,
        "number": (int, float),
    }
    assert any(
        isinstance(value, python[kind]) and (kind == "boolean" or not isinstance(value, bool))
        for kind in kinds
    ), f"{where}: {value!r} is not {kinds}"
    if isinstance(value, dict):
        properties = schema.get("properties", {})
        assert set(schema.get("required", ())) <= set(value), where
        if properties:
            assert set(value) <= set(properties), where
        for key, item in value.items():
            if key in properties:
                conforms(item, properties[key], f"{where}.{key}")
    elif isinstance(value, list):
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", math.inf), where
        for item in value:
            conforms(item, schema["items"], f"{where}[]")
    elif isinstance(value, int | float):
        assert math.isfinite(value), where
        assert value >= schema.get("minimum", -math.inf), where


def test_every_message_is_what_its_schema_says(path):
    checked = set()
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            conforms(json.loads(message.data), json.loads(schema.data), channel.topic)
            checked.add(channel.topic)
    assert checked == set(SCHEMAS) - set(OPTIONAL_TOPICS)


def test_threats_are_written_as_their_schema_says_and_only_when_there_are_any(
    tmp_path, city, frames
):
    region = RiskRegion(kind="no-fly", center=(0.0, 0.0), radius=9.0, briefed=False)
    carrier = Carrier(2.0, [1.23456, -2.0], [[4.0, 1.0], [1.0, 9.0]], 60.0, 0.5, reporter=1)
    percepts = list(frames[1].percepts)
    percepts[1] = replace(percepts[1], threats=Threats((region,), (carrier,)))
    noticed = [(), (5, 2), (), ()]
    file = record(
        tmp_path / "threats.mcap",
        city,
        [frames[0], replace(frames[1], percepts=percepts, noticed=noticed), frames[2]],
    )
    with file.open("rb") as stream:
        ((schema, _, message),) = make_reader(stream).iter_messages("/staniel/threats")
    conforms(json.loads(message.data), json.loads(schema.data))
    assert message.sequence == frames[1].truth.tick
    first, second = read_record(file).threats.tolist()
    assert first[:4] == (frames[1].truth.time, 1, "region", 5)
    assert np.isnan(first[4:]).all()
    assert second == (2.0, 1, "carrier", 2, 1.235, -2.0, 4.0, 1.0, 9.0)


def test_the_scene_shows_each_machine_where_it_is(path, frames):
    with path.open("rb") as stream:
        texts = [m.data for _, _, m in make_reader(stream).iter_messages("/scene/team")]
    entities = {entity["id"]: entity for entity in json.loads(texts[-1])["entities"]}
    truth = frames[-1].truth
    for arrow, (x, y, z, heading, _, _) in zip(
        entities["aircraft"]["arrows"], truth.aircraft, strict=True
    ):
        place, turn = arrow["pose"]["position"], arrow["pose"]["orientation"]
        assert [place["x"], place["y"], place["z"]] == pytest.approx([x, y, z], abs=0.01)
        forward = (1 - 2 * turn["z"] ** 2, 2 * turn["z"] * turn["w"])
        assert forward == pytest.approx((math.cos(heading), math.sin(heading)), abs=1e-3)
    for wing, (*_, heading, bank, _) in zip(
        entities["aircraft"]["cubes"], truth.aircraft, strict=True
    ):
        q = wing["pose"]["orientation"]
        # The left wing tip, y of the body, goes down in a left bank.
        left_z = 2 * (q["y"] * q["z"] + q["w"] * q["x"])
        assert left_z == pytest.approx(-math.sin(bank), abs=1e-3)
        left_x = 2 * (q["x"] * q["y"] - q["w"] * q["z"])
        assert left_x == pytest.approx(-math.sin(heading) * math.cos(bank), abs=1e-3)
    assert len(entities["vehicles"]["cubes"]) == len(truth.vehicles)
    assert len(entities["tracks"]["spheres"]) == len(
        {t.id for b in frames[-1].beliefs for t in b.tracks}
    )


def test_the_scene_has_every_building_closed_from_above(path, city):
    with path.open("rb") as stream:
        ((_, _, message),) = make_reader(stream).iter_messages("/scene/city")
    (triangles,) = json.loads(message.data)["entities"][0]["triangles"]
    points = np.array([(p["x"], p["y"], p["z"]) for p in triangles["points"]])
    assert len(triangles["colors"]) == len(points)
    a, b, c = points[np.array(triangles["indices"]).reshape(-1, 3).T]
    normals = np.cross(b - a, c - a) / 2
    areas = np.linalg.norm(normals, axis=1)
    roofs = np.abs(normals[:, 2]) > 0.999 * areas
    built = sum(outline.area for outline in city.outlines)
    assert areas[roofs].sum() == pytest.approx(built, rel=1e-4)
    walls = sum(o.length * h for o, h in zip(city.outlines, city.heights, strict=True))
    assert areas[~roofs].sum() == pytest.approx(walls, rel=1e-4)


def test_a_lean_record_says_the_same_but_for_the_scenes(path, tmp_path, city):
    many = list(synthetic_run.frames(city, 130))  # more than two chunks
    whole, lean = (
        record(tmp_path / f"{name}.mcap", city, many, lean=name == "lean")
        for name in ("whole", "lean")
    )
    a, b = read_record(whole), read_record(lean)
    assert a.complete
    assert b.complete
    for name, value in vars(a).items():
        if isinstance(value, np.ndarray):
            assert value.tobytes() == getattr(b, name).tobytes()
    with lean.open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert set(ONCE_TOPICS + TICK_TOPICS) <= topics <= set(SCHEMAS) - {"/scene/city", "/scene/team"}


def test_an_existing_file_is_refused(path, city):
    with pytest.raises(OutputError, match=r"mission\.mcap: cannot be written"):
        record(path, city, [])


def test_a_run_that_is_left_early_is_not_complete(tmp_path, city, frames):
    file = tmp_path / "early.mcap"

    def fly():
        with Recorder(
            file, scenario={}, version="1", city=city, clock=synthetic_run.CLOCK
        ) as recorder:
            for frame in frames[:5]:
                recorder.write(frame)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fly()
    back = read_record(file)
    assert len(back.times) == 5
    assert not back.complete


def test_an_interrupt_in_the_middle_of_a_tick_keeps_the_ticks_before(
    tmp_path, city, frames, monkeypatch
):
    file = tmp_path / "torn.mcap"
    recorder = Recorder(file, scenario={}, version="1", city=city, clock=synthetic_run.CLOCK)
    for frame in frames[:3]:
        recorder.write(frame)
    size = file.stat().st_size
    whole_add, calls = recorder._add, []

    def torn_add(*arguments):
        calls.append(arguments)
        if len(calls) == 4:
            raise KeyboardInterrupt
        whole_add(*arguments)

    monkeypatch.setattr(recorder, "_add", torn_add)
    with pytest.raises(KeyboardInterrupt):
        recorder.write(frames[3])
    recorder.finish(complete=False)
    assert file.stat().st_size == size
    assert len(read_record(file).times) == 3


def test_a_closed_recorder_refuses_ticks(tmp_path, city, frames):
    recorder = Recorder(
        tmp_path / "a.mcap", scenario={}, version="1", city=city, clock=synthetic_run.CLOCK
    )
    recorder.finish(complete=True)
    recorder.finish(complete=True)
    with pytest.raises(OutputError, match="closed"):
        recorder.write(frames[0])


WRITE_FOR_EVER = """
import sys
sys.path.insert(0, sys.argv[1])
import synthetic_run
from staniel.recording import Recorder
city = synthetic_run.open_city()
frames = list(synthetic_run.frames(city, 30))
recorder = Recorder(sys.argv[2], scenario={}, version="1", city=city, clock=synthetic_run.CLOCK)
for frame in frames:
    recorder.write(frame)
    print(frame.truth.tick, flush=True)
import time
time.sleep(60)
"""

FILL_THE_DISK = """
import resource, signal, sys
sys.path.insert(0, sys.argv[1])
import synthetic_run
from staniel.errors import OutputError
from staniel.recording import Recorder
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
city = synthetic_run.open_city()
try:
    with Recorder(sys.argv[2], scenario={}, version="1", city=city, clock=synthetic_run.CLOCK) as r:
        for frame in synthetic_run.frames(city, 200):
            r.write(frame)
            written = frame.truth.tick
except OutputError as error:
    r.finish(True)
    r.finish(False)
    print(written, error)
"""


NO_ROOM_AT_ALL = FILL_THE_DISK.replace("200_000", "2_000").replace(
    "    r.finish(True)\n    r.finish(False)\n    print(written, error)", "    print(error)"
)


def run_script(script, file):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", script, str(Path(__file__).parent), str(file)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)


def test_a_kill_keeps_every_tick_that_was_written(tmp_path):
    file = tmp_path / "killed.mcap"
    with run_script(WRITE_FOR_EVER, file) as process:
        for line in process.stdout:
            if int(line) == 20:
                process.send_signal(signal.SIGKILL)
                break
        process.wait()
    back = read_record(file)
    assert len(back.times) >= 20
    assert not back.complete


def test_a_full_disk_keeps_every_whole_tick(tmp_path):
    file = tmp_path / "full.mcap"
    with run_script(FILL_THE_DISK, file) as process:
        said = process.stdout.read()
    assert process.returncode == 0
    written, message = said.split(maxsplit=1)
    assert f"{file}: cannot be written (" in message
    assert f"{written} whole ticks are kept" in message
    back = read_record(file)
    assert len(back.times) == int(written) > 5
    assert not back.complete


def test_a_disk_that_is_full_from_the_beginning_is_left_as_it_was(tmp_path):
    file = tmp_path / "none.mcap"
    with run_script(NO_ROOM_AT_ALL, file) as process:
        said = process.stdout.read()
    assert process.returncode == 0
    assert f"{file}: cannot be written (" in said
    assert not file.exists()
