"""What of the sightings is taken in, in which order, as which looks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.datatypes.belief import Sighting
from staniel.errors import StanielError
from staniel.tracking.intake import Intake

sightings = st.lists(
    st.builds(
        lambda time, x, y, reporter: Sighting(time, [x, y], np.eye(2), reporter=reporter),
        st.sampled_from([7.0, 8.5, 9.0, 10.0]),
        st.sampled_from([-3.0, 0.0, 2.0]),
        st.sampled_from([0.0, 1.0]),
        st.integers(0, 2),
    ),
    max_size=12,
)


@given(sightings, sightings)
@settings(max_examples=150, deadline=None)
def test_order_looks_and_copies(first, second):
    intake, heard = Intake(2.0), set()
    for now, box in ((10.0, first), (10.5, second)):
        batch = intake.read(now, box)
        intake.accept(batch, now)
        due = {s.row for s in box if s.time >= now - 2.0} - heard
        heard |= due
        rows = sorted(due)
        np.testing.assert_allclose(batch.values, np.reshape(rows, (-1, 7))[:, :6], atol=2e-6)
        numbers = {}
        looks = [numbers.setdefault((row[0], row[6]), len(numbers)) for row in rows]
        assert batch.looks.tolist() == looks
        assert batch.keys == [(row[6], row[0], row[1], row[2]) for row in rows]


def test_a_copy_is_forgotten_once_it_is_too_late_to_count():
    intake, seen = Intake(2.0), Sighting(0.0, [1.0, 2.0], np.eye(2))
    for k in range(6):
        intake.accept(intake.read(float(k), [seen]), float(k))
    assert not intake._heard
    assert not intake._accepted


@pytest.mark.parametrize(
    ("time", "place", "variance", "word"),
    [
        (10.1, [0.0, 0.0], 1.0, r"sightings\[1\].time = 10.1: expected 10"),
        (10.0, [2e9, 0.0], 1.0, r"sightings\[1\] at \(2e\+09, 0\)"),
        (10.0, [0.0, -2e9], 1.0, r"sightings\[1\] at \(0, -2e\+09\)"),
        (10.0, [0.0, 0.0], 1e12, r"variances 1e\+12 and 1e\+12"),
    ],
)
def test_what_cannot_be_used_is_named(time, place, variance, word):
    good = Sighting(10.0, [5.0, 5.0], np.eye(2))
    with pytest.raises(StanielError, match=word):
        Intake(2.0).read(10.0, [good, Sighting(time, place, variance * np.eye(2))])
