"""Packets: what comes out is what went in, and whatever else is in one is refused."""

import math
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from any_message import JUNK, KINDS, messages, names, spoiled, tries
from staniel.datatypes.belief import Sighting, TrackId
from staniel.datatypes.malformed import Fault, fault_of, faults_of
from staniel.datatypes.message import Announce, AssistanceEnd, Looked, Message, Report
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.wire import LARGEST, TAG, decode, encode, wire_size
from staniel.errors import StanielError, WireError

KEY, OTHER = b"sixteen bytes or", b"more of them, other ones"
EXACT = {"time", "seen", "heard", "floor"}
WORD = AssistanceEnd(3, 17, 5.0, target=TrackId(2.5, 3, 1))


def assert_close(sent, come, field=""):
    """The same but for what the page of the wire says of rounding."""
    assert isinstance(come, type(sent)) or isinstance(sent, int), field
    if isinstance(sent, (TrackId, RiskRegion)) or field in EXACT:
        assert sent == come, field
    elif is_dataclass(sent):
        for part in (part for part in fields(sent) if part.init):
            assert_close(getattr(sent, part.name), getattr(come, part.name), part.name)
    elif isinstance(sent, np.ndarray):
        # The correlation gives way where rounding would make the covariance impossible.
        scale = (
            np.abs(sent) if sent.ndim == 1 else np.sqrt(np.outer(sent.diagonal(), sent.diagonal()))
        )
        assert (np.abs(sent - come) <= 4e-7 * scale + 1e-37).all(), field
    elif isinstance(sent, tuple):
        assert len(sent) == len(come), field
        for a, b in zip(sent, come, strict=True):
            assert_close(a, b, field)
    elif isinstance(sent, (int, float)):
        near = 5.01e-5 if field == "banks" else 6e-8 * abs(sent) + 1e-37
        assert sent == come or abs(sent - come) <= near, field
    else:
        assert sent == come, field


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_round_trip(kind):
    @tries(0.004, least=15)
    @given(messages([kind]), st.sampled_from([None, KEY]))
    def holds(message, key):
        packet = encode(message, key)
        assert len(packet) == wire_size(message) + (0 if key is None else TAG)
        come = decode(packet, key)
        assert_close(message, come)
        assert decode(encode(come)) == come  # what was rounded once is not rounded again

    holds()


def test_the_kinds_keep_their_codes():
    """A packet of an older version means the same today."""
    codes = "Heartbeat Report Warn Looked Announce Bid Award Acknowledge Revoke Handover Release"
    codes += " AssistanceRequest AssistanceOffer AssistanceEnd Bundle Beacon"
    assert {kind.__name__ for kind in KINDS} == set(codes.split())
    assert encode(WORD) == bytes.fromhex(
        "a00e 0300 11000000 0000000000001440 0000000000000440 0300 01000000"
    )
    assert codes.split().index("AssistanceEnd") + 1 == 0x0E


# -- fuzz ------------------------------------------------------------------------------------------


def refused(error):
    assert error.reason in ("malformed", "oversized", "forged")
    assert str(error)


def refused_or_sound(packet, key=None):
    """Nothing else may come of a packet; what comes of it is well-formed and can be sent again."""
    try:
        message = decode(packet, key)
    except WireError as error:
        return refused(error)
    assert fault_of(message) is None
    assert len(encode(message)) == wire_size(message) <= LARGEST
    return message


@tries(0.05)
@given(st.binary(max_size=400), st.integers(0xA0, 0xA1), st.integers(0, 17))
def test_random_bytes(data, form, kind):
    refused_or_sound(data)
    refused_or_sound(bytes([form, kind]) + data)
    assert refused_or_sound(bytes([form, kind]) + data, KEY) is None


def damaged(packet, rng):
    """A packet with some of it changed, cut off, added or moved."""
    packet = bytearray(packet)
    for _ in range(rng.randint(1, 4)):
        at, bits = rng.randrange(len(packet) + 1), rng.randrange(1, 256)
        match rng.choice(["flip", "flip", "set", "cut", "add", "move"]):
            case "flip" if at < len(packet):
                packet[at] ^= 1 << bits % 8
            case "set" if at < len(packet):
                packet[at] = rng.choice([0, 1, 127, 128, 255, bits])
            case "cut":
                del packet[at:]
            case "add":
                packet += bytes([bits]) * (1 + at % 40)
            case "move":
                packet = packet[at:] + packet[:at]
    return bytes(packet)


@tries(0.02)
@given(messages(), st.sampled_from([None, None, KEY]), st.randoms(use_true_random=True))
def test_damaged_packets(message, key, rng):
    whole = encode(message, key)
    for _ in range(40):
        packet = damaged(whole, rng)
        come = refused_or_sound(packet, key)
        if key is not None and packet != whole:
            assert come is None, packet.hex()


@tries(0.01)
@given(messages(), st.data())
def test_no_part_of_a_packet_is_a_packet(message, data):
    packet = encode(message)
    cut = data.draw(st.integers(0, len(packet) - 1))
    for part in (packet[:cut], packet + packet[: cut + 1], packet + b"\0"):
        with pytest.raises(WireError):
            decode(part)


@tries(0.01)
@given(messages(), st.randoms(use_true_random=True))
def test_spoiled_objects_are_named_or_sound(message, rng):
    """Each field in turn holds what it, or any field, may not."""
    for field in [field.name for field in fields(message)]:
        for junk in (math.nan, object(), [math.nan], "nothing"):
            assert fault_of(replace(message, **{field: junk})) is not None, (field, junk)
        for junk in rng.sample(JUNK, 3):
            named_or_sound(replace(message, **{field: junk}))


def named_or_sound(message):
    fault = fault_of(message)
    if fault is None:
        assert_close(message, decode(encode(message)))
        return
    assert fault.words
    with pytest.raises(WireError) as refused:
        encode(message)
    assert refused.value.reason == fault.reason


# -- authentication --------------------------------------------------------------------------------


def test_only_who_has_the_key_speaks():
    signed = encode(WORD, KEY)
    assert len(signed) == len(encode(WORD)) + TAG
    assert decode(signed, KEY) == WORD
    for packet, key in [(signed, OTHER), (encode(WORD), KEY), (signed, None), (signed[:-1], KEY)]:
        with pytest.raises(WireError) as refused:
            decode(packet, key)
        assert refused.value.reason == "forged"
    # Who knows a signed packet cannot put another sender into it.
    for bit in range(8 * len(signed)):
        packet = bytearray(signed)
        packet[bit // 8] ^= 1 << bit % 8
        with pytest.raises(WireError):
            decode(packet, KEY)


@pytest.mark.parametrize("key", [b"", b"short", b"x" * 65])
def test_a_key_has_a_length(key):
    for call in (lambda: encode(WORD, key), lambda: decode(encode(WORD), key)):
        with pytest.raises(StanielError, match="expected 16 to 64"):
            call()


# -- bounds ----------------------------------------------------------------------------------------


def test_the_largest_message():
    most = Looked(0, 1, 0.0, cells=bytes(LARGEST - 18))
    assert len(encode(most)) == LARGEST == wire_size(most)
    assert decode(encode(most, KEY), KEY) == most
    more = Looked(0, 1, 0.0, cells=bytes(LARGEST - 17))
    with pytest.raises(WireError, match="takes 32,769 bytes: expected at most 32,768") as refused:
        encode(more)
    assert refused.value.reason == "oversized"
    assert fault_of(more) == Fault("oversized", "takes 32,769 bytes: expected at most 32,768")
    with pytest.raises(WireError) as refused:
        decode(bytes(10**7))
    assert refused.value.reason == "oversized"


def test_a_count_that_the_packet_has_no_room_for():
    """A report of 65,535 sightings in 19 bytes."""
    head = encode(Report(0, 1, 0.0, sightings=()))[:16]
    with pytest.raises(WireError, match="too early"):
        decode(head + b"\xff\xff\0")


@pytest.mark.parametrize("packet", [None, 10**9, "text", [1, 2], 3.5, object()])
def test_what_is_no_packet(packet):
    with pytest.raises(WireError):
        decode(packet)


@pytest.mark.parametrize("view", [bytearray, memoryview])
def test_any_bytes(view):
    assert decode(view(encode(WORD))) == WORD


# -- what is wrong in words ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sender": -1}, "sender = -1: expected a whole number from 0 to 65534"),
        ({"sender": True}, "sender = True"),
        ({"sequence": 2**32}, "sequence = 4294967296"),
        ({"time": math.nan}, "time = nan"),
        ({"target": None}, "target = None: expected the name of a track"),
        ({"position": (math.inf, 0.0)}, "position = .* expected 2 numbers within ±1e"),
        ({"position": [0.0, 0.0]}, "position = "),
        ({"course": "north"}, "course = 'north'"),
        ({"cost": -math.inf}, "cost = -inf: expected up to ±1.1e.12, or infinity"),
        ({"speed": -1.0}, "speed = -1.0: expected a number from 0"),
    ],
)
def test_the_words_name_the_field(change, words):
    sound = {"target": WORD.target, "position": (0.0, 0.0), "course": 0.0, "cost": 1.0}
    head = {"sender": 0, "sequence": 1, "time": 2.0}
    assert fault_of(Announce(**head, **sound)) is None
    with pytest.raises(AssertionError, match=f"^{words}"):
        raise AssertionError(fault_of(Announce(**{**head, **sound, **change})).words)


def test_costs_may_be_negative_or_infinite():
    for cost in (-80.0, math.inf, 0):
        assert fault_of(Announce(0, 1, 2.0, WORD.target, (0.0, 0.0), 0.0, cost)) is None


def test_lengths_belong_together():
    seen = Sighting(0.0, [0.0, 0.0], np.eye(2))
    assert fault_of(Report(0, 1, 2.0, sightings=(seen,), names=(None,))) is None
    fault = fault_of(Report(0, 1, 2.0, sightings=(seen,), names=(None, None)))
    assert fault.words == "names has 2 entries: expected 1"


def test_nobody_sees_the_future():
    seen = Sighting(3.0, [0.0, 0.0], np.eye(2))
    assert "sighting time = 3.0" in fault_of(Report(0, 1, 2.0, sightings=(seen,))).words


def test_a_message_of_no_kind():
    assert fault_of(Message(0, 1, 2.0)).words == "of no known kind: Message"
    for thing in (None, 3, "word", *JUNK):
        assert fault_of(thing).reason == "malformed"


@tries(0.003)
@given(st.lists(messages() | spoiled(), max_size=6))
def test_many_are_judged_as_each_is(box):
    assert faults_of(box) == [fault_of(message) for message in box]
    assert faults_of(box + box) == faults_of(box) * 2


@tries(0.003)
@given(names)
def test_names_are_exact(name):
    assert decode(encode(AssistanceEnd(0, 1, 0.0, target=name))).target == name
