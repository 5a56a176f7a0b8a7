"""Why unseen, on missions that were flown: the slow oracle, and what each trouble brings about."""

from dataclasses import replace

import numpy as np
import pytest
import unseen_oracle

import staniel
from staniel.city import City
from staniel.metrics import Cause, unwatched
from staniel.scenario import load_scenario

LOST = {"schedule": [{"aircraft": k, "kind": "lost", "time": 90.0 + k} for k in range(3)]}
SCENARIOS = {
    "default": {},
    "aircraft lost": {"faults": LOST},
    "radio dead": {"radio": {"range": 0.0}},
    # By the carrot, which lets buildings stand between it and what it follows, in a city where
    # the vehicles are soon found; of three minutes by look-ahead more is gone before they are.
    "dense": {
        "seed": 2,
        "guidance": {"pursuit": "carrot"},
        "city": {"density": 0.55, "heights": [30.0, 50.0]},
        "camera": {"mount": "nadir", "half_aperture_deg": 75.0},
    },
    "often missed": {
        "guidance": {"pursuit": "carrot"},
        "camera": {"detection_probability": 0.3},
    },
    "never missed": {"camera": {"detection_probability": 1.0}},
}


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    out = tmp_path_factory.mktemp("unseen")
    return {
        name: staniel.fly(load_scenario("downtown", minutes=3.0, **changes), out=out / name).record
        for name, changes in SCENARIOS.items()
    }


def seconds(record):
    """Vehicle-seconds by cause."""
    return dict(zip(Cause, unwatched(record).totals.sum(axis=0).tolist(), strict=True))


def agrees(record):
    keys = [[Cause(code).key for code in row] for row in unwatched(record).cause.tolist()]
    return keys == unseen_oracle.causes(record)


def forgetful(record):
    """The same flight, but no agent holds a track from the second minute on."""
    return replace(record, tracks=record.tracks[record.tracks["time"] < 120.0])


@pytest.mark.parametrize("name", SCENARIOS)
def test_equals_the_oracle_second_by_second(records, name):
    record = records[name]
    assert agrees(record)
    assert agrees(forgetful(record))
    assert unwatched(record).totals.sum(axis=1).tolist() == [180.0] * 4


def test_losing_aircraft_shows_as_aircraft_lost_and_nothing_else_does(records):
    for name, record in records.items():
        assert (seconds(record)[Cause.AIRCRAFT_LOST] > 30.0) == (name == "aircraft lost")
    before = unwatched(records["aircraft lost"])
    assert (before.cause[before.times < 90.0] != Cause.AIRCRAFT_LOST).all()


def test_a_dense_city_hides_most_of_all_and_an_open_one_nothing(records):
    spent = seconds(records["dense"])
    del spent[Cause.WATCHED]
    assert max(spent, key=spent.__getitem__) is Cause.BUILDING
    # Wider than its range, and never banked: the camera has no edge of a footprint to be outside.
    assert spent[Cause.OUTSIDE_FOOTPRINT] == 0.0
    for record in records.values():
        assert seconds(record)[Cause.BUILDING] > 0.0
        bare = replace(record, city=City.open(record.city.size))
        assert seconds(bare)[Cause.BUILDING] == 0.0


def test_missed_detections_come_of_missing(records):
    often, never = seconds(records["often missed"]), seconds(records["never missed"])
    assert often[Cause.MISSED_DETECTION] > 5.0
    assert never[Cause.MISSED_DETECTION] == 0.0
    # Without a single sighting, what was a lost track or message is a missed detection, too.
    record = forgetful(records["never missed"])
    blind = seconds(replace(record, sightings=record.sightings[:0]))
    kept = seconds(record)
    unheard = (Cause.MISSED_DETECTION, Cause.MESSAGE_LOST, Cause.TRACK_LOST)
    assert blind[Cause.MISSED_DETECTION] == sum(kept[cause] for cause in unheard) > 0.0


def test_messages_are_lost_where_nobody_hears(records):
    silent = forgetful(records["radio dead"])
    assert seconds(silent)[Cause.MESSAGE_LOST] > 0.0
    # The same flight with every report heard by all, and with nobody knowing who heard what.
    rows = np.flatnonzero(silent.messages["kind"] == "report")
    everyone = np.stack([np.repeat(rows, 4), np.tile(np.arange(4), len(rows))], axis=1)
    for receptions in (everyone.astype(np.int32), None):
        heard = seconds(replace(silent, receptions=receptions))
        lost = (Cause.MESSAGE_LOST, Cause.TRACK_LOST)
        assert heard[Cause.MESSAGE_LOST] == 0.0
        assert heard[Cause.TRACK_LOST] == sum(seconds(silent)[cause] for cause in lost)


def test_a_record_of_half_seconds_counts_half_seconds(tmp_path):
    half = {"decision_step": 0.5, "dynamics_step": 0.1}
    record = staniel.fly(load_scenario("village", clock=half), out=tmp_path / "run").record
    assert agrees(record)
    assert unwatched(record).seconds.tolist() == [0.5] * 120
    assert unwatched(record).totals.sum() == pytest.approx(60.0)
