"""Where lost targets may be: who asks learns it, and changes nothing by asking."""

import numpy as np

from staniel.datatypes.belief import Sighting
from staniel.tracking import Tracker, TrackingConfig

SIGMA = 1.5**2 * np.eye(2)
REMEMBER = 60.0
# Lost targets are predicted in strides of 2 s; this is not a whole number of steps.
STEP = 0.75


def follow(tracker, ask, hidden=range(20, 70), steps=90):
    """Two targets that drive east at 2 m/s and hide; estimates and what was answered, by step."""
    random = np.random.default_rng(5)
    estimates, answers = [], []
    for k in range(steps):
        time = STEP * k
        places = [np.array([2.0 * time, 80.0 * n]) for n in range(2)]
        seen = (
            []
            if k in hidden
            else [Sighting(time, p + random.normal(0, 1.5, 2), SIGMA) for p in places]
        )
        estimates.append(tracker.step(time, seen))
        answers.append(tracker.lost_particles() if ask(k) else None)
    return estimates, answers


def new_tracker():
    return Tracker(TrackingConfig(particles=200, remember=REMEMBER), rng=3)


def test_asking_changes_nothing():
    asked, silent = new_tracker(), new_tracker()
    told, _ = follow(asked, lambda k: k % 3 != 0)
    plain, _ = follow(silent, lambda k: False)
    assert any(not tracks for tracks in plain)  # both were lost
    assert [len(tracks) for tracks in plain][-1] == 2
    for one, other in zip(told, plain, strict=True):
        assert [track.id for track in one] == [track.id for track in other]
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a.position, b.position)
            np.testing.assert_array_equal(a.covariance, b.covariance)
    for track in asked.estimates:
        np.testing.assert_array_equal(asked.particles(track.id), silent.particles(track.id))


def test_clouds_go_on_until_their_target_is_found_or_forgotten():
    tracker = new_tracker()
    estimates, answers = follow(tracker, lambda k: True)
    assert answers[0] == {}
    gone = next(k for k, answer in enumerate(answers) if len(answer) == 2)
    assert set(answers[gone]) == {track.id for track in estimates[19]}
    for k in range(gone, 70):
        for name, (places, weights) in answers[k].items():
            track = next(track for track in estimates[19] if track.id == name)
            assert abs(weights.sum() - 1.0) < 1e-5
            # Some of the cloud goes on as the target does; the others stop and turn.
            true = (2.0 * STEP * k, track.position[1])
            assert np.linalg.norm(places - true, axis=1).min() < 12.0
    assert answers[-1] == {}
    forgotten, answers = follow(new_tracker(), lambda k: True, range(20, 400), 200)
    assert answers[100]
    assert answers[-1] == {}
    assert not forgotten[-1]


def test_what_is_handed_out_is_a_copy():
    tracker = new_tracker()
    follow(tracker, lambda k: False, range(20, 70), 60)
    (places, weights), *_ = tracker.lost_particles().values()
    places += 1000.0
    weights *= 0.0
    again = next(iter(tracker.lost_particles().values()))
    assert not np.array_equal(places, again[0])
    assert again[1].sum() > 0.99


def test_a_tracker_that_never_stepped_lost_nothing():
    assert new_tracker().lost_particles() == {}
