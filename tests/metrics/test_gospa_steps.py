"""GOSPA step by step: of a real flight, against the function of two sets of points."""

import numpy as np
import pytest

import staniel
from staniel.metrics import gospa, gospa_steps, team_picture


def test_each_step_is_the_distance_of_its_own_sets(tmp_path):
    run = staniel.fly(staniel.load_scenario("downtown", minutes=1.5), seed=3, out=tmp_path / "run")
    record = run.record
    steps = gospa_steps(record)
    assert steps.shape == (len(record.times), 4)
    for k, time in enumerate(record.times):
        now = record.tracks[record.tracks["time"] == time]
        picture = now[team_picture(now)]
        places = np.column_stack([picture["x"], picture["y"]])
        expected = gospa(record.vehicles[k, :, :2], places)
        assert steps[k] == pytest.approx(
            (expected.distance, expected.localisation, expected.missed, expected.false)
        )
    assert run.metrics["team"]["gospa_mean"] == pytest.approx(steps[:, 0].mean(), abs=1e-6)
    assert steps[0, 2] > steps[-1, 2]
