"""Height along a path: against solved geometry and against transfer functions."""

import math

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.command import FlyLine
from staniel.datatypes.equipment import Airframe
from staniel.guidance.longitudinal import altitude_command, altitude_zone, line_altitude
from staniel.kernels.flight import fly

numbers = st.floats(-300.0, 300.0)


@given(x=numbers, y=numbers, along=st.floats(-math.pi, math.pi), slope=st.floats(-3.0, 3.0))
def test_height_is_where_the_line_is_abeam(x, y, along, slope):
    """The line's point whose horizontal distance from the aircraft is least, by solving for it."""
    start = np.array([20.0, -10.0, 90.0])
    q = 2.0 * np.array([math.cos(along), math.sin(along), slope])
    ((way,), *_) = np.linalg.lstsq(q[:2, None], np.array([x, y]) - start[:2], rcond=None)
    assert line_altitude([[x, y]], start, q)[0] == pytest.approx(start[2] + way * q[2], abs=1e-6)


@pytest.mark.parametrize("direction", [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, math.nan, 0.0]])
def test_a_line_straight_up_has_no_height(direction):
    with pytest.raises(ValueError, match=r"direction = .*expected"):
        line_altitude([[0.0, 0.0]], [0.0, 0.0, 80.0], direction)


def heights(airframe, wanted, climb, *, lead):
    """Heights flown when the hold is asked anew every 0.1 s."""
    state, climbs, flown = np.array([[0.0, 0.0, wanted[0], 0.0, 0.0, 15.0]]), np.zeros(1), []
    for height in wanted:
        asked = altitude_command(height, climb, airframe) if lead else height
        row = encode([FlyLine((0.0, 0.0), (1.0, 0.0), 15.0, asked)])
        path, climbs = fly(state, climbs, row, limits([airframe]), np.zeros((1, 1, 2)), 0.1, 1)
        state = path[-1].copy()
        flown.append(state[0, 2])
    return np.array(flown)


@pytest.mark.parametrize(("b", "b1"), [(0.25, 1.0), (0.4, 0.7)])
def test_a_ramp_is_followed_without_standing_error(b, b1):
    """Eq. 5.13, 5.15, 5.16 (corrected): the response is (b' s + b)/(s² + b' s + b)."""
    airframe = Airframe(altitude_gain=b, climb_gain=b1, max_climb=50.0)
    times = 0.1 * np.arange(600)
    wanted = 80.0 + 1.2 * times
    with_rate = heights(airframe, wanted, 1.2, lead=True)
    _, response, _ = scipy.signal.lsim(([b1, b], [1.0, b1, b]), 1.2 * times, times)
    np.testing.assert_allclose(with_rate[:-1], 80.0 + response[1:], atol=0.08)
    assert with_rate[-1] - wanted[-1] == pytest.approx(0.06, abs=0.07)  # half a step of 0.1 s
    without = heights(airframe, wanted, 1.2, lead=False)
    assert wanted[-1] - without[-1] == pytest.approx(1.2 * b1 / b, abs=0.15)


def test_the_zones_are_where_the_kernel_climbs_at_its_limit():
    airframe = Airframe()
    for command in (60.0, 67.0, 69.0, 91.0, 93.0, 120.0):
        row = encode([FlyLine((0.0, 0.0), (1.0, 0.0), 15.0, command)])
        # At the greatest climb rate already: it stays there in the zone and slows down outside.
        limit = math.copysign(airframe.max_climb, command - 80.0)
        start = np.array([[0.0, 0.0, 80.0, 0.0, 0.0, 15.0]])
        air = np.zeros((1, 1, 2))
        _, climb = fly(start, np.array([limit]), row, limits([airframe]), air, 0.001, 1)
        zone = altitude_zone(80.0, command, airframe)
        assert (zone == "hold") == (abs(climb[0]) < airframe.max_climb - 1e-9)
        assert zone != ("descend" if command > 80.0 else "climb")
