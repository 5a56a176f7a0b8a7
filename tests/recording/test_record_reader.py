"""The reader on files that were cut, damaged or made by somebody else."""

import json
import random

import numpy as np
import pytest
import synthetic_run
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from staniel.city import City
from staniel.datatypes.message import COST_TERMS
from staniel.errors import RecordError
from staniel.recording import Recorder, read_record

TICKS = 12


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("reader")


class Whole:
    """A finished record's bytes, and where in them each tick ends."""

    def __init__(self, content, ends):
        self.content, self.ends = content, ends


@pytest.fixture(scope="module")
def whole(folder):
    city = City.generate(size=(150.0, 150.0), seed=1)
    file = folder / "mission.mcap"
    ends = []
    with Recorder(
        file,
        scenario=synthetic_run.scenario(),
        version="1",
        city=city,
        clock=synthetic_run.CLOCK,
    ) as recorder:
        for frame in synthetic_run.frames(city, TICKS):
            recorder.write(frame)
            ends.append(file.stat().st_size)
        recorder.finish(complete=True)
    return Whole(file.read_bytes(), ends)


def read_or_refuse(file):
    """The record and an empty text, or None and the reader's refusal."""
    try:
        return read_record(file), ""
    except RecordError as error:
        return None, str(error)


def test_a_run_folder_is_read_like_its_file(folder, whole):
    assert (
        len(read_record(folder).times) == len(read_record(folder / "mission.mcap").times) == TICKS
    )


@settings(max_examples=100, deadline=None)
@given(place=st.integers(0, 10**9))
def test_a_file_cut_at_any_byte_keeps_its_whole_ticks(folder, whole, place):
    content, ends = whole.content, whole.ends
    size = place % (len(content) + 1)
    file = folder / "cut.mcap"
    file.write_bytes(content[:size])
    # A tick is there when its last message is; the indexes that follow may be missing.
    surely = sum(end <= size for end in ends)
    back, refusal = read_or_refuse(file)
    if back is None:
        assert str(file) in refusal
        assert surely == 0
    else:
        assert surely <= len(back.times) <= surely + 1
        uncut = read_record(folder / "mission.mcap")
        assert np.array_equal(back.aircraft, uncut.aircraft[: len(back.times)])
        assert np.array_equal(back.fine_times, uncut.fine_times[: 5 * len(back.times)])
        assert size > ends[-1] or not back.complete


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), changes=st.integers(1, 20))
def test_a_damaged_file_is_read_or_refused_never_a_traceback(folder, whole, seed, changes):
    content = bytearray(whole.content)
    chance = random.Random(seed)
    for _ in range(changes):
        content[chance.randrange(8, len(content))] = chance.randrange(256)
    file = folder / "damaged.mcap"
    file.write_bytes(content)
    back, refusal = read_or_refuse(file)
    assert str(file) in refusal if back is None else np.isfinite(back.aircraft).all()


@settings(max_examples=30, deadline=None)
@given(content=st.binary(max_size=400))
def test_anything_after_the_magic_is_refused(folder, content):
    file = folder / "noise.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + content)
    with pytest.raises(RecordError, match=r"noise\.mcap"):
        read_record(file)


def test_what_is_no_record_is_refused(tmp_path):
    with pytest.raises(RecordError, match=r"missing\.mcap: cannot be read"):
        read_record(tmp_path / "missing.mcap")
    with pytest.raises(RecordError, match=r"mission\.mcap: cannot be read"):
        read_record(tmp_path)
    text = tmp_path / "text.mcap"
    text.write_text("not an MCAP file at all")
    with pytest.raises(RecordError, match="not an MCAP file"):
        read_record(text)


def forge(path, changes, ticks=2):
    """Write a record with mcap's own writer, messages changed as `changes` says, by topic."""
    once = {
        "/staniel/scenario": {"format": 1, "version": "1", "scenario": {}, "clock": {}},
        "/staniel/city": {"size": [100, 100], "buildings": []},
    }
    fine = {"times": [0.5, 1.0], "aircraft": [[[0, 0, 80, 0, 0, 15]]] * 2, "vehicles": [[]] * 2}
    aircraft = [{"id": 0, "x": 0, "y": 0, "z": 80, "heading": 0, "bank": 0, "speed": 15}]
    each = {
        "/staniel/truth": {"time": 1.0, "aircraft": aircraft, "vehicles": [], "fine": fine},
        **{
            f"/staniel/{kind}": {"time": 1.0, kind: []}
            for kind in ("sightings", "tracks", "messages", "commands", "decisions")
        },
    }
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        channels = {topic: writer.register_channel(topic, "json", 0) for topic in {**once, **each}}
        for tick in range(1, ticks + 1):
            for topic, value in {**(once if tick == 1 else {}), **each}.items():
                value = json.loads(json.dumps(value))
                if "time" in value:
                    value["time"] = float(tick)
                if topic == "/staniel/truth":
                    value["fine"]["times"] = [tick - 0.5, float(tick)]
                value = changes[topic](value, tick) if topic in changes else value
                text = value if isinstance(value, bytes) else json.dumps(value).encode()
                writer.add_message(channels[topic], tick, text, tick, sequence=tick)
        writer.finish()
    return path


def test_a_forged_record_that_keeps_the_rules_is_read(tmp_path):
    back = read_record(forge(tmp_path / "good.mcap", {}))
    assert back.times.tolist() == [1.0, 2.0]
    assert back.vehicles.shape == (2, 0, 4)
    assert not back.complete


def setting(*keys, to):
    """Change one value inside a message, in its second tick or in the only one."""

    def change(value, tick):
        place = value
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = to
        return value

    return change


TRACK = {
    **dict.fromkeys(("time", "x", "y", "vx", "vy", "cxx", "cxy", "cyy", "last_seen"), 1.0),
    "agent": 0,
    "id": "0-1",
    "existence": 1.0,
}


AWARD = {
    **{"time": 1.0, "sender": 0, "sequence": 5, "kind": "award", "target": "0-1", "winner": 2},
    **{"cost": 80.0, "x": 1.0, "y": 2.0, "receivers": 2, "heard_by": [1]},
}
BID = {"bidder": 1, "cost": 90.5, "terms": {"distance": 90.0, "energy": 0.5}}


def awarding(**changes):
    """An award in the second tick, as an older record has it but for the changes."""
    return setting("messages", to=[{**AWARD, **changes}])


def bidding(**changes):
    return awarding(bids=[{**BID, **changes}])


def test_an_award_without_bids_tells_of_its_winner_alone(tmp_path):
    old = read_record(forge(tmp_path / "old.mcap", {"/staniel/messages": awarding()}))
    assert len(old.awards) == 2  # One a tick.
    row = old.awards[0]
    assert row.tolist()[:7] == (1.0, 0, 5, "0-1", 2, 80.0, True)
    assert all(np.isnan(row[name]) for name in COST_TERMS)


def test_terms_of_other_versions_do_no_harm(tmp_path):
    change = bidding(terms={"distance": 90.5, "noise": 3.0})
    row = read_record(forge(tmp_path / "new.mcap", {"/staniel/messages": change})).awards[0]
    assert (row["bidder"], row["won"], row["distance"]) == (1, False, 90.5)
    assert np.isnan(row["energy"])


@pytest.mark.parametrize(
    "change",
    [
        awarding(bids=None),
        awarding(bids={"bidder": 1}),
        awarding(bids="many"),
        awarding(bids=[3]),
        awarding(bids=[{}]),
        awarding(bids=[BID] * 101),
        bidding(bidder="a"),
        bidding(bidder=2**40),
        bidding(bidder=None),
        bidding(bidder=[1]),
        bidding(cost="cheap"),
        bidding(cost=1e13),
        bidding(cost=10**400),
        bidding(terms=None),
        bidding(terms=[90.0]),
        bidding(terms={"distance": "far"}),
        bidding(terms={"distance": {}}),
        bidding(terms={"energy": -1e12}),
        awarding(sequence=2**70, bids=[BID]),
        awarding(target=7, bids=[BID]),
    ],
)
def test_bids_that_break_the_rules_are_refused(tmp_path, change):
    file = forge(tmp_path / "bad.mcap", {"/staniel/messages": change})
    with pytest.raises(RecordError, match=r"bad\.mcap: /staniel/messages"):
        read_record(file)


@pytest.mark.parametrize(
    ("topic", "change", "expected"),
    [
        ("/staniel/scenario", setting("format", to=99), "format is 99"),
        ("/staniel/scenario", setting("version", to=None), "expected a version"),
        ("/staniel/scenario", lambda *_: b"{", "not JSON"),
        ("/staniel/scenario", lambda *_: b"[" * 100_000, "not JSON"),
        ("/staniel/scenario", lambda *_: b"[1]", "expected a JSON object"),
        ("/staniel/city", setting("size", to=[0, -1]), "city"),
        ("/staniel/city", setting("buildings", to=7), "city"),
        ("/staniel/truth", setting("time", to="noon"), "truth"),
        ("/staniel/truth", setting("time", to=5.0), "do not increase"),
        ("/staniel/truth", setting("aircraft", 0, "x", to=None), "not finite"),
        ("/staniel/truth", lambda *_: b'{"time": NaN}', "not JSON"),
        ("/staniel/truth", setting("aircraft", 0, "x", to=10**400), "truth"),
        ("/staniel/truth", setting("aircraft", to=[]), "truth"),
        ("/staniel/truth", setting("aircraft", to=5), "truth"),
        ("/staniel/truth", setting("fine", "times", to=[0.5]), "truth"),
        ("/staniel/truth", setting("fine", "aircraft", to=[[[0, 0]]]), "truth"),
        ("/staniel/truth", lambda value, _: {"time": value["time"]}, "lacks 'aircraft'"),
        ("/staniel/tracks", setting("tracks", to=[{**TRACK, "id": "x" * 17}]), "16 characters"),
        ("/staniel/tracks", setting("tracks", to=[{**TRACK, "id": 3}]), "16 characters"),
        ("/staniel/tracks", setting("tracks", to=[{**TRACK, "agent": 2**40}]), "tracks"),
        ("/staniel/tracks", setting("tracks", to=[{**TRACK, "cxx": None}]), "cxx|tracks"),
        ("/staniel/tracks", setting("tracks", to=[{}]), "lacks"),
        ("/staniel/tracks", setting("tracks", to={"a": 1}), "tracks"),
        ("/staniel/tracks", lambda *_: b'{"time":1,"tracks":[{"id":1e999}]}', "tracks"),
        (
            "/staniel/decisions",
            setting("decisions", to=[{"agent": 0, "role": "search", "target": None, "goal": [1]}]),
            "decisions",
        ),
    ],
)
def test_a_forged_record_that_breaks_them_is_refused(tmp_path, topic, change, expected):
    file = forge(tmp_path / "bad.mcap", {topic: change})
    with pytest.raises(RecordError, match=expected) as caught:
        read_record(file)
    assert str(file) in str(caught.value)


def test_infinity_hidden_in_a_number_is_refused(tmp_path):
    text = json.dumps({"time": 1.0, "tracks": [TRACK]}).replace('"x": 1.0', '"x": 1e999')
    file = forge(tmp_path / "inf.mcap", {"/staniel/tracks": lambda *_: text.encode()})
    with pytest.raises(RecordError, match="x has a number that is not finite"):
        read_record(file)


def test_compressed_chunks_are_refused_with_a_word(tmp_path):
    file = tmp_path / "packed.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4)
        writer.start()
        channel = writer.register_channel("/staniel/city", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(RecordError, match="compressed"):
        read_record(file)


def test_a_file_beyond_the_limit_is_refused_unread(tmp_path, monkeypatch):
    file = tmp_path / "big.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    monkeypatch.setattr("staniel.recording.reader.MAX_FILE_SIZE", 100)
    with pytest.raises(RecordError, match="108 bytes, expected at most 100"):
        read_record(file)
