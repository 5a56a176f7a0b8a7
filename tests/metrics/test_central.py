"""The team's fusion without a centre against the same tracker that hears everything."""

import numpy as np
import pytest

import staniel
from staniel.metrics import central_fusion, compute_metrics, gospa_steps


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """Missions by carrot with a perfect, a poor and no radio."""
    folder = tmp_path_factory.mktemp("central")
    kinds = {
        "perfect": {"radio.sigma": 1e9},
        "poor": {"radio.loss": 0.8},
        "none": {"radio.range": 0.0},
    }
    return {
        name: [
            staniel.fly(
                staniel.load_scenario(
                    "downtown", seed=seed, minutes=3.0, **{"guidance.pursuit": "carrot"}, **radio
                ),
                out=folder / f"{name}-{seed}",
            ).record
            for seed in range(2)
        ]
        for name, radio in kinds.items()
    }


def mean_gospa(records):
    return np.mean([gospa_steps(record)[60:, 0].mean() for record in records])


def test_a_centre_hears_every_sighting_and_loses_little(records):
    for runs in records.values():
        central = [central_fusion(record) for record in runs]
        assert {agent for record in central for agent in record.tracks["agent"].tolist()} == {-1}
        assert mean_gospa(central) < mean_gospa(runs) + 0.5


def test_the_team_is_nearly_as_good_as_a_centre_where_its_radio_is(records):
    central = [central_fusion(record) for record in records["perfect"]]
    assert mean_gospa(records["perfect"]) < mean_gospa(central) + 1.5


def test_without_a_radio_a_centre_is_clearly_better(records):
    central = [central_fusion(record) for record in records["none"]]
    assert mean_gospa(central) < mean_gospa(records["none"]) - 1.0


def test_all_metrics_read_it_and_what_was_flown_stays(records):
    record = records["poor"][0]
    central = central_fusion(record)
    assert central.aircraft is record.aircraft
    assert compute_metrics(central)["team"]["gospa_mean"] > 0.0
    again = central_fusion(record)
    assert central.tracks.tobytes() == again.tracks.tobytes()
