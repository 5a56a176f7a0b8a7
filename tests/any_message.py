"""Any sound message of any kind, and what may be wrong with one: for hypothesis.

``STANIEL_FUZZ=100000 pytest tests/datatypes tests/cooperation/test_gate.py`` tries as many.
"""

import math
import os
from dataclasses import fields, replace

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from staniel.datatypes import message as words
from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.message import Claim, Message, Offer, Unheld
from staniel.datatypes.parts import HEALTHS, NOBODY, REASONS, ROLES
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.threats import Carrier, Threats

FUZZ = int(os.environ.get("STANIEL_FUZZ", "1500"))
KINDS = [kind for kind in vars(words).values() if isinstance(kind, type)]
KINDS = [kind for kind in KINDS if issubclass(kind, Message) and kind is not Message]


def tries(share, least=20):
    """So large a share of all the cases."""
    return settings(
        max_examples=max(least, round(share * FUZZ)),
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


numbers = st.floats(-1e6, 1e6)
positive = st.floats(1e-3, 1e6)
costs = st.one_of(st.floats(-1e9, 1e9), st.just(math.inf))
instants = st.floats(0.0, 1e5)
agents = st.integers(0, 65_534)
whom = st.integers(NOBODY, 65_534)
points = st.tuples(numbers, numbers)
poses = st.builds(Pose, *[numbers] * 6)
names = st.builds(TrackId, st.floats(-1e9, 1e9), agents, st.integers(0, 2**32 - 1))
terms = st.lists(costs, max_size=8).map(tuple)
commands = st.one_of(
    st.builds(FlyLine, points, points, numbers, numbers),
    st.builds(FlyOrbit, points, positive, st.sampled_from([1, -1]), numbers, numbers),
    st.builds(
        FlyBanks,
        st.lists(st.floats(-math.pi, math.pi), min_size=1, max_size=16).map(tuple),
        positive,
        numbers,
        numbers,
        st.none() | points,
    ),
)


@st.composite
def covariances(draw):
    """From round to as flat as a constructor takes."""
    x, y = (draw(st.floats(1e-4, 5e4)) for _ in range(2))
    xy = draw(st.sampled_from([0.0, 0.3, -0.99, 1.0 - 1e-9, -1.0 + 1e-12])) * x * y
    return [[x * x, xy], [xy, y * y]]


@st.composite
def sightings(draw, now):
    """Taken by then."""
    return Sighting(
        now - draw(st.floats(0.0, 50.0)),
        draw(points),
        draw(covariances()),
        reporter=draw(whom),
        pose=draw(st.none() | poses),
        pose_deviation=draw(st.just(0.0) | st.floats(0.0, 1e5)),
    )


@st.composite
def regions(draw):
    """Discs and many-cornered ones."""
    kind, low = draw(st.sampled_from(["threat", "no-fly"])), draw(st.floats(-1e5, 1e5))
    shape = {"center": draw(points), "radius": draw(positive)}
    if draw(st.booleans()):
        x, y = draw(st.floats(-1e5, 1e5)), draw(st.floats(-1e5, 1e5))
        angles = 2.0 * np.pi * np.arange(draw(st.integers(3, 40))) / 40
        size = draw(st.floats(1.0, 1e4))
        shape = {"polygon": [(x + size * np.cos(a), y + size * np.sin(a)) for a in angles]}
    return RiskRegion(
        kind=kind,
        rate=draw(st.floats(0.0, 1e6)) if kind == "threat" else None,
        floor=low,
        ceiling=draw(st.none() | st.floats(low + 1.0, 2e5)),
        briefed=draw(st.booleans()),
        **shape,
    )


@st.composite
def carriers(draw, now):
    """Noticed by then."""
    time, place, spread = now - draw(st.floats(0.0, 50.0)), draw(points), draw(covariances())
    radius, rate, reporter = draw(positive), draw(st.floats(0.0, 1e6)), draw(whom)
    return Carrier(time, place, spread, radius, rate, reporter=reporter)


def some(of, most=4):
    """A few of them, in a tuple."""
    return st.lists(of, max_size=most).map(tuple)


def _content(draw, kind, now, target):
    """What each kind says beside its head."""
    place, cost, whose = draw(points), draw(costs), draw(agents)
    match kind.__name__:
        case "Heartbeat":
            then = st.floats(0.0, 100.0).map(lambda late: now - late)
            return {
                "pose": draw(poses), "role": draw(st.sampled_from(ROLES)), "goal": place,
                "target": draw(st.none() | target), "target_position": draw(st.none() | points),
                "cost": cost, "helps": draw(st.none() | target),
                "command": draw(st.none() | commands),
                "target_velocity": draw(st.just((0.0, 0.0)) | points),
                "helpers": draw(some(agents)), "health": draw(st.sampled_from(HEALTHS)),
                "unheld": draw(some(st.builds(Unheld, target, points, numbers, then))),
            }  # fmt: skip
        case "Report":
            seen = draw(some(sightings(now)))
            named = st.tuples(*[st.none() | target] * len(seen))
            return {"sightings": seen, "names": draw(st.just(()) | named)}
        case "Warn":
            return {"threats": Threats(draw(some(regions(), 2)), draw(some(carriers(now), 2)))}
        case "Looked":
            return {"cells": draw(st.binary(max_size=300))}
        case "Announce":
            speed = draw(st.floats(0.0, 1e6))
            return {"target": draw(target), "position": place, "course": draw(numbers),
                    "cost": cost, "speed": speed}  # fmt: skip
        case "Bid":
            rows = draw(some(st.tuples(target, agents, costs, terms)))
            columns = tuple(zip(*rows, strict=True)) or ((), (), (), ())
            bid = dict(zip(("targets", "auctioneers", "costs", "terms"), columns, strict=True))
            return bid if draw(st.booleans()) else {**bid, "terms": ()}
        case "Award":
            bids = draw(some(st.builds(Offer, agents, costs, terms)))
            return {"target": draw(target), "position": place, "winner": whose, "cost": cost,
                    "bids": bids}  # fmt: skip
        case "Acknowledge":
            return {"target": draw(target), "auctioneer": whose}
        case "Revoke" | "Handover":
            return {"target": draw(target), "auctioneer": whose, "held_as": draw(target),
                    "position": place, "cost": cost}  # fmt: skip
        case "Release":
            seen = draw(st.just(-math.inf) | st.floats(0.0, 100.0).map(lambda late: now - late))
            return {"target": draw(target), "position": place, "lost": draw(st.booleans()),
                    "seen": seen}  # fmt: skip
        case "AssistanceRequest":
            reason = draw(st.sampled_from(REASONS))
            return {"target": draw(target), "position": place, "reason": reason}
        case "AssistanceOffer":
            return {"target": draw(target), "holder": whose, "cost": cost}
        case "AssistanceEnd":
            return {"target": draw(target)}
        case "Beacon":
            return {}
        case "Bundle":
            news = st.tuples(agents, st.floats(0.0, 100.0).map(lambda late: now - late))
            claim = st.builds(Claim, target, whom, costs)
            return {"claims": draw(some(claim)), "heard": draw(some(news))}
    raise AssertionError(kind)


@st.composite
def messages(draw, kinds=KINDS, times=instants, senders=agents, targets=names):
    """A sound message."""
    kind, time = draw(st.sampled_from(kinds)), draw(times)
    sequence = draw(st.integers(0, 2**32 - 1))
    return kind(draw(senders), sequence, time, **_content(draw, kind, time, targets))


JUNK = (
    math.nan, math.inf, -math.inf, 1e300, -1, 2**40, None, True, "search", "", b"", b"x" * 9, (),
    (math.nan,), (math.nan, math.nan), (1.0, "2"), (1e9, 0.0), [], [0.0, 0.0], {}, object(),
    np.array([1.0, 2.0]), np.float64("nan"), TrackId(math.nan, 0, 0), TrackId(0.0, -1, 0),
    TrackId(0.0, 0, 2**32), TrackId("0", 0, 0), Pose(0.0, 0.0, math.nan, 0.0, 0.0, 0.0),
    Pose(0.0, 0.0, 1e7, 0.0, 0.0, 0.0), FlyBanks((), 1.0, 15.0, 80.0),
    FlyBanks((0.1,) * 17, 1.0, 15.0, 80.0), FlyLine((0.0, 0.0), (math.nan, 0.0), 15.0, 80.0),
    FlyOrbit((0.0, 0.0), -1.0, 1, 15.0, 80.0), FlyOrbit((0.0, 0.0), 9.0, 7, 15.0, 80.0),
    (TrackId(0.0, 0, 1),) * 3, (Offer(-1, 0.0),), (Offer(1, math.nan),), (Claim(None, 0, 0.0),),
    (Sighting(1e9, [0.0, 0.0], np.eye(2)),), (Sighting(0.0, [0.0, 1e8], np.eye(2)),),
    (Sighting(0.0, [0.0, 0.0], 1e-20 * np.eye(2)),), (Sighting(0.0, [0.0, 0.0], 1e20 * np.eye(2)),),
    Threats((), (Carrier(1e9, [0.0, 0.0], np.eye(2), 9.0, 1.0),)), Threats(("region",)),
)  # fmt: skip
"""What no field, or hardly one, may hold."""


@st.composite
def spoiled(draw, sound=None):
    """A message one of whose fields holds something else, right by chance if at all."""
    message = draw(messages() if sound is None else sound)
    field = draw(st.sampled_from([field.name for field in fields(message)]))
    return replace(message, **{field: draw(st.sampled_from(JUNK))})
