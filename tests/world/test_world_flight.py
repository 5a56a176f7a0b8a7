"""Flight against the closed forms of a steady turn, an ODE solver, and the limits it promises."""

import math

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from staniel.angles import wrap
from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import GRAVITY, Airframe, turn_radius
from staniel.kernels.flight import MAX_BANKS, fly

AIRFRAME = Airframe()
LIMITS = limits([AIRFRAME])[0]


def flown(command, state, seconds, dt=0.1, airframe=AIRFRAME, wind=(0.0, 0.0)):
    start, steps = np.array([state], dtype=float), round(seconds / dt)
    air = np.empty((steps, 1, 2))
    air[:] = wind
    return fly(start, np.zeros(1), encode([command]), limits([airframe]), air, dt, steps)[0][:, 0]


@pytest.mark.parametrize("bank_deg", [30.0, -20.0, 35.0])
def test_steady_turn_has_the_textbook_radius_and_period(bank_deg):
    bank = math.radians(bank_deg)
    period = 2.0 * math.pi * 15.0 / (GRAVITY * math.tan(abs(bank)))
    dt = period / 200.0
    path = flown(FlyBanks((bank,), 1.0, 15.0, 80.0), [0, 0, 80, 0.3, bank, 15], period, dt)
    middle = path[:, :2].mean(axis=0)
    radius = np.hypot(*(path[:, :2] - middle).T)
    np.testing.assert_allclose(radius, turn_radius(15.0, bank), rtol=1e-6)
    np.testing.assert_allclose(path[-1], [0, 0, 80, 0.3, bank, 15], atol=1e-5)
    first_turn = wrap(path[0, 3] - 0.3)
    assert first_turn == pytest.approx(math.copysign(2.0 * math.pi / 200.0, bank), rel=1e-12)


def test_roll_speed_and_way_agree_with_an_ode_solver():
    """A roll that is rate-limited first and exponential after, while the speed changes."""
    wanted, speed = math.radians(30.0), 18.0

    def rates(_time, s):
        roll = np.clip(3.0 * (wanted - s[3]), -LIMITS[5], LIMITS[5])
        push = np.clip(speed - s[4], -1.5, 1.5)
        return [
            s[4] * math.cos(s[2]),
            s[4] * math.sin(s[2]),
            GRAVITY / s[4] * math.tan(s[3]),
            roll,
            push,
        ]

    exact = solve_ivp(
        rates, (0, 1.5), [0, 0, 1.0, -0.5, 15.0], rtol=1e-10, atol=1e-10, max_step=0.01
    )
    path = flown(FlyBanks((wanted,), 1.0, speed, 80.0), [0, 0, 80, 1.0, -0.5, 15], 1.5)
    np.testing.assert_allclose(path[-1, [0, 1, 3, 4, 5]], exact.y[:, -1], atol=2e-4)
    assert path[-1, 4] == pytest.approx(exact.y[3, -1], abs=1e-8)


def test_order_of_integration_is_at_least_second():
    """Halving the step divides the error of a rolling turn by at least four."""
    command = FlyBanks((0.5,), 1.0, 15.0, 80.0)
    state = [0, 0, 80, 0, 0.2, 15]
    exact = flown(command, state, 2.0, dt=0.001)[-1]
    errors = [np.abs(flown(command, state, 2.0, dt)[-1, :2] - exact[:2]).max() for dt in (0.2, 0.1)]
    assert errors[1] < errors[0] / 4.0 + 1e-9
    assert errors[1] < 1e-4


@settings(max_examples=100, deadline=None)
@given(
    kind=st.sampled_from(["line", "orbit", "banks"]),
    numbers=st.lists(st.floats(-500, 500), min_size=4, max_size=4),
    radius=st.floats(1.0, 300.0),
    turn=st.sampled_from([1, -1]),
    banks=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=MAX_BANKS),
    speed=st.floats(0.0, 100.0),
    altitude=st.floats(0.0, 300.0),
    heading=st.floats(-math.pi, math.pi),
    bank=st.floats(-0.6, 0.6),
    start_speed=st.floats(11.0, 20.0),
)
def test_limits_always_hold(
    kind, numbers, radius, turn, banks, speed, altitude, heading, bank, start_speed
):
    command = {
        "line": FlyLine(tuple(numbers[:2]), tuple(numbers[2:]), speed, altitude),
        "orbit": FlyOrbit(tuple(numbers[:2]), radius, turn, speed, altitude),
        "banks": FlyBanks(tuple(banks), 0.3, speed, altitude),
    }[kind]
    start = [10.0, -20.0, 80.0, heading, bank, start_speed]
    path = np.vstack([start, flown(command, start, 6.0)])
    assert np.isfinite(path).all()
    assert (np.abs(path[:, 4]) <= AIRFRAME.max_bank + 1e-12).all()
    assert (np.abs(np.diff(path[:, 4])) <= LIMITS[5] * 0.1 + 1e-12).all()
    assert (path[:, 5] >= 11.0 - 1e-12).all()
    assert (path[:, 5] <= 20.0 + 1e-12).all()
    assert (np.abs(np.diff(path[:, 5])) <= 0.15 + 1e-12).all()
    assert (np.abs(np.diff(path[:, 2])) <= 0.3 + 1e-12).all()
    assert (path[1:, 3] > -math.pi).all()
    assert (path[1:, 3] <= math.pi).all()
    way = np.hypot(np.diff(path[:, 0]), np.diff(path[:, 1]))
    assert (way <= np.maximum(path[1:, 5], path[:-1, 5]) * 0.1 + 1e-9).all()


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(-200, 200),
    y=st.floats(-200, 200),
    heading=st.floats(-math.pi, math.pi),
    along=st.floats(-math.pi, math.pi),
)
def test_line_is_joined_and_kept(x, y, heading, along):
    end = (1000.0 * math.cos(along), 1000.0 * math.sin(along))
    path = flown(FlyLine((0.0, 0.0), end, 15.0, 80.0), [x, y, 80, heading, 0, 15], 60.0)
    across = path[-100:, 1] * math.cos(along) - path[-100:, 0] * math.sin(along)
    assert np.abs(across).max() < 0.1
    assert abs(wrap(path[-1, 3] - along)) < 0.01


def test_line_is_joined_without_overshoot():
    path = flown(FlyLine((0.0, 0.0), (100.0, 0.0), 15.0, 80.0), [0, 60, 80, 0, 0, 15], 40.0)
    assert path[:, 1].min() > -0.05
    assert np.abs(path[120:, 1]).max() < 2.0  # within 2 m after 12 s


@settings(max_examples=60, deadline=None)
@given(
    radius=st.floats(36.0, 150.0),
    turn=st.sampled_from([1, -1]),
    x=st.floats(-250, 250),
    y=st.floats(-250, 250),
    heading=st.floats(-math.pi, math.pi),
)
def test_orbit_is_joined_and_kept(radius, turn, x, y, heading):
    command = FlyOrbit((0.0, 0.0), radius, turn, 15.0, 80.0)
    path = flown(command, [x, y, 80, heading, 0, 15], 75.0)
    last = path[-150:]
    assert np.abs(np.hypot(last[:, 0], last[:, 1]) - radius).max() < 0.5
    cross = last[:, 0] * np.sin(last[:, 3]) - last[:, 1] * np.cos(last[:, 3])
    assert (np.sign(cross) == turn).all()


def test_the_loiter_settles_on_its_radius_with_the_steady_bank():
    path = flown(FlyOrbit((0.0, 0.0), 45.0, 1, 15.0, 80.0), [200, 0, 80, math.pi, 0, 15], 60.0)
    error = np.hypot(path[:, 0], path[:, 1]) - 45.0
    assert np.abs(error[160:]).max() < 2.0
    assert np.abs(error[-100:]).max() < 0.05
    assert math.degrees(path[-1, 4]) == pytest.approx(27.0, abs=0.1)


def test_a_bank_sequence_is_flown_in_time_and_its_last_bank_is_held():
    path = flown(FlyBanks((0.3, -0.3, 0.0), 2.0, 15.0, 80.0), [0, 0, 80, 0, 0, 15], 9.0)
    assert path[19, 4] == pytest.approx(0.3, abs=0.01)
    assert path[39, 4] == pytest.approx(-0.3, abs=0.01)
    assert path[-1, 4] == pytest.approx(0.0, abs=1e-3)


def test_speed_follows_its_first_order_step_response():
    airframe = Airframe(max_acceleration=50.0, speed_gain=0.7)
    path = flown(FlyBanks((0.0,), 1.0, 18.0, 80.0), [0, 0, 80, 0, 0, 15], 6.0, airframe=airframe)
    times = 0.1 * np.arange(61)
    _, step = scipy.signal.step(([0.7], [1.0, 0.7]), T=times)
    np.testing.assert_allclose(path[:, 5], 15.0 + 3.0 * step[1:], atol=1e-9)


@pytest.mark.parametrize("damping", [0.4, 1.0, 2.0])
def test_altitude_follows_its_second_order_step_response(damping):
    """Thesis eq. 5.12 (corrected): h/h_c = (b' s + b)/(s² + b' s + b), but for h'_c = 0."""
    b = 0.36
    b1 = 2.0 * damping * math.sqrt(b)
    airframe = Airframe(max_climb=1e3, altitude_gain=b, climb_gain=b1)
    path = flown(FlyBanks((0.0,), 1.0, 15.0, 90.0), [0, 0, 80, 0, 0, 15], 20.0, airframe=airframe)
    _, step = scipy.signal.step(([b], [1.0, b1, b]), T=0.1 * np.arange(201))
    np.testing.assert_allclose(path[:, 2], 80.0 + 10.0 * step[1:], atol=1e-4)


def test_altitude_is_reached_at_the_climb_limit_without_overshoot():
    path = flown(FlyLine((0.0, 0.0), (1.0, 0.0), 15.0, 140.0), [0, 0, 80, 0, 0, 15], 60.0)
    climb = np.diff(path[:, 2]) / 0.1
    assert climb.max() == pytest.approx(3.0, abs=1e-3)
    np.testing.assert_allclose(climb[80:120], 3.0, atol=1e-3)
    assert path[:, 2].max() <= 140.0
    assert path[-1, 2] == pytest.approx(140.0, abs=1e-3)


def test_aircraft_do_not_depend_on_one_another():
    states = np.array([[0.0, 0, 80, 0, 0, 15], [50, 10, 80, 2, 0.1, 14]])
    commands = encode(
        [FlyOrbit((9.0, 9.0), 45.0, 1, 15, 80), FlyLine((0.0, 0.0), (9.0, 9.0), 15, 80)]
    )
    air, rows = np.ones((10, 2, 2)), limits([AIRFRAME] * 2)
    both, _ = fly(states, np.zeros(2), commands, rows, air, 0.1, 10)
    alone, _ = fly(
        states[:1].copy(), np.zeros(1), commands[:1].copy(), rows[:1], air[:, :1].copy(), 0.1, 10
    )
    np.testing.assert_array_equal(both[:, :1], alone)


def test_a_line_without_direction_is_survived():
    path = flown(FlyLine((50.0, 50.0), (50.0, 50.0), 15.0, 80.0), [0, 0, 80, 0, 0, 15], 30.0)
    assert np.isfinite(path).all()
    assert np.hypot(path[-1, 0] - 50.0, path[-1, 1] - 50.0) < 100.0


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (FlyBanks((0.1,) * 17, 1.0, 15.0, 80.0), "17 entries: expected 1 to 16"),
        (FlyBanks((), 1.0, 15.0, 80.0), "0 entries"),
        (FlyBanks((0.1,), 0.0, 15.0, 80.0), "hold = 0.0"),
        (FlyOrbit((0.0, 0.0), 0.0, 1, 15.0, 80.0), "radius = 0.0"),
        (FlyLine((0.0, math.nan), (1.0, 0.0), 15.0, 80.0), "aircraft 0 .* finite"),
        (FlyBanks((0.1,), 1.0, 15.0, 80.0, (math.inf, 0.0)), "aircraft 0 .* finite"),
    ],
)
def test_commands_that_cannot_be_flown_are_refused(command, message):
    with pytest.raises(ValueError, match=message):
        encode([command])
