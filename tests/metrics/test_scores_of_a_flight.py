"""Scores of a real flight, against the functions of sets of points."""

import numpy as np
import pytest

import staniel
from staniel.metrics import (
    gospa,
    gospa_steps,
    identity_scores,
    nees,
    ospa,
    ospa_steps,
    team_picture,
)
from staniel.metrics.following import follow


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    scenario = staniel.load_scenario("downtown", minutes=1.5)
    return staniel.fly(scenario, seed=3, out=tmp_path_factory.mktemp("flight") / "run")


def pictures(record):
    """Tracks of the team picture, instant by instant."""
    for time in record.times:
        now = record.tracks[record.tracks["time"] == time]
        yield now[team_picture(now)]


def places_of(picture):
    return np.column_stack([picture["x"], picture["y"]])


def test_each_step_is_the_distance_of_its_own_sets(run):
    record = run.record
    steps, others = gospa_steps(record), ospa_steps(record)
    assert steps.shape == (len(record.times), 4)
    assert others.shape == (len(record.times),)
    for k, picture in enumerate(pictures(record)):
        places = places_of(picture)
        expected = gospa(record.vehicles[k, :, :2], places)
        assert steps[k] == pytest.approx(
            (expected.distance, expected.localisation, expected.missed, expected.false)
        )
        assert others[k] == pytest.approx(ospa(record.vehicles[k, :, :2], places).distance)
    assert run.metrics["team"]["gospa_mean"] == pytest.approx(steps[:, 0].mean(), abs=1e-6)
    assert run.metrics["team"]["ospa_mean"] == pytest.approx(others.mean(), abs=1e-6)
    assert steps[0, 2] > steps[-1, 2]


def test_identity_scores_are_of_the_team_picture(run):
    record = run.record
    truth = [(range(len(row)), row[:, :2]) for row in record.vehicles]
    tracks = [(picture["id"].tolist(), places_of(picture)) for picture in pictures(record)]
    scores = identity_scores(truth, tracks)
    team = run.metrics["team"]
    assert team["identity_switches"] == scores.switches
    for name in ("fragmentations", "misses", "false_positives"):
        assert team[name] == getattr(scores, name)
    for name in ("mota", "motp", "idp", "idr", "idf1"):
        assert team[name] == pytest.approx(getattr(scores, name), abs=1e-6)


def test_nees_of_a_flight_is_that_of_the_nearest_track(run):
    record, following = run.record, follow(run.record)
    for k, picture in enumerate(pictures(record)):
        for vehicle, place in enumerate(record.vehicles[k, :, :2]):
            if np.isnan(following.position_nees[k, vehicle]):
                continue
            errors = places_of(picture) - place
            nearest = np.argmin((errors**2).sum(axis=1))
            row = picture[nearest]
            P = [[row["cxx"], row["cxy"]], [row["cxy"], row["cyy"]]]
            assert following.position_nees[k, vehicle] == pytest.approx(nees(errors[nearest], P))
    assert (np.isnan(following.position_nees) == np.isnan(following.position_error)).all()
