"""Wind: what it does to flight, how the autopilot holds its course in it, and Dryden's gusts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from staniel.angles import wrap
from staniel.city import City
from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import GRAVITY, Airframe
from staniel.errors import ScenarioError
from staniel.kernels.flight import fly
from staniel.kernels.gusts import blow
from staniel.world import Traffic, Wind, World
from staniel.world.wind import dryden, mean_wind

LIMITS = limits([Airframe()])


def flown(command, state, seconds, wind, dt=0.1):
    steps = round(seconds / dt)
    air = np.empty((steps, 1, 2))
    air[:] = wind
    start = np.array([state], dtype=float)
    return fly(start, np.zeros(1), encode([command]), LIMITS, air, dt, steps)[0][:, 0]


def world_of(count=3, **wind):
    return World(
        City.open((600.0, 600.0)),
        Airframe(),
        count,
        Traffic(count=0),
        Clock(),
        np.random.SeedSequence(3),
        wind=Wind(**wind),
    )


def test_velocity_over_ground_is_that_through_the_air_plus_the_wind():
    """A turn in wind is the turn in calm air, carried along; and an ODE solver agrees."""
    command, wind, bank = FlyBanks((0.4,), 1.0, 15.0, 80.0), np.array([4.0, -3.0]), 0.4
    calm = flown(command, [0, 0, 80, 0.3, bank, 15], 10.0, (0.0, 0.0))
    windy = flown(command, [0, 0, 80, 0.3, bank, 15], 10.0, wind)
    times = 0.1 * np.arange(1, 101)
    np.testing.assert_allclose(windy[:, :2] - calm[:, :2], times[:, None] * wind, atol=1e-9)
    np.testing.assert_array_equal(windy[:, 2:], calm[:, 2:])
    rate = GRAVITY / 15.0 * math.tan(bank)
    exact = solve_ivp(
        lambda t, _: [
            15.0 * math.cos(0.3 + rate * t) + wind[0],
            15.0 * math.sin(0.3 + rate * t) + wind[1],
        ],
        (0.0, 10.0),
        [0.0, 0.0],
        rtol=1e-10,
        atol=1e-10,
    )
    np.testing.assert_allclose(windy[-1, :2], exact.y[:, -1], atol=1e-4)


@settings(max_examples=60, deadline=None)
@given(
    speed=st.floats(0.0, 7.5),
    origin=st.floats(-math.pi, math.pi),
    x=st.floats(-100, 100),
    y=st.floats(-100, 100),
    heading=st.floats(-math.pi, math.pi),
)
def test_line_is_joined_and_kept_in_wind_up_to_half_the_airspeed(speed, origin, x, y, heading):
    wind = speed * np.array([math.cos(origin), math.sin(origin)])
    path = flown(
        FlyLine((0.0, 0.0), (1000.0, 0.0), 15.0, 80.0), [x, y, 80, heading, 0, 15], 75, wind
    )
    assert np.abs(path[-100:, 1]).max() < 0.1
    # The crab angle of the wind triangle; airspeed stays airspeed.
    crab = math.asin(-wind[1] / 15.0)
    assert abs(wrap(path[-1, 3] - crab)) < 0.01
    assert path[-1, 5] == pytest.approx(15.0)
    way = (path[-1, 0] - path[-101, 0]) / 10.0
    assert way == pytest.approx(15.0 * math.cos(crab) + wind[0], abs=0.01)


@settings(max_examples=40, deadline=None)
@given(
    speed=st.floats(0.0, 7.5),
    origin=st.floats(-math.pi, math.pi),
    radius=st.floats(80.0, 150.0),
    turn=st.sampled_from([1, -1]),
    x=st.floats(-200, 200),
    y=st.floats(-200, 200),
)
def test_orbit_is_joined_and_kept_in_wind_up_to_half_the_airspeed(
    speed, origin, radius, turn, x, y
):
    """The least radius downwind is (V + W)²/(g tan 35°) = 74 m: below it nobody could."""
    wind = speed * np.array([math.cos(origin), math.sin(origin)])
    command = FlyOrbit((0.0, 0.0), radius, turn, 15.0, 80.0)
    path = flown(command, [x, y, 80, 0.0, 0, 15], 140.0, wind)
    last = path[-500:]
    assert np.abs(np.hypot(last[:, 0], last[:, 1]) - radius).max() < 1.0
    angles = np.unwrap(np.arctan2(last[:, 1], last[:, 0]))
    assert np.sign(angles[-1] - angles[0]) == turn


@pytest.mark.parametrize("speed", [14.9, 20.0, 49.0])
def test_a_wind_that_stops_the_aircraft_is_survived(speed):
    for command in (
        FlyLine((0.0, 0.0), (100.0, 0.0), 15.0, 80.0),
        FlyOrbit((0.0, 0.0), 45.0, 1, 15.0, 80.0),
    ):
        path = flown(command, [0, 0, 80, 0, 0, 15], 60.0, (-speed, 0.0))
        assert np.isfinite(path).all()
        assert np.abs(path[:, 4]).max() <= Airframe().max_bank + 1e-12


@pytest.mark.parametrize(
    ("origin", "velocity"),
    [(0, (0, -5)), (90, (-5, 0)), (180, (0, 5)), (270, (5, 0)), (-90, (5, 0))],
)
def test_wind_is_named_by_where_it_comes_from(origin, velocity):
    np.testing.assert_allclose(mean_wind(Wind(speed=5.0, from_deg=origin)), velocity, atol=1e-12)


def test_dryden_at_the_end_of_its_heights_is_isotropic_turbulence():
    """At 1000 ft the low-altitude forms meet L = 1000 ft and sigma = 0.1 W20 (MIL-F-8785C)."""
    sigma, length = dryden(1000 * 0.3048, 10.0)
    assert sigma == pytest.approx(1.0, rel=1e-3)
    assert length == pytest.approx(304.8, rel=1e-3)
    assert dryden(1e4, 10.0) == dryden(304.8, 10.0)
    assert dryden(0.0, 10.0) == pytest.approx(dryden(3.048, 10.0))


def test_gusts_have_their_intensity_length_and_normal_distribution():
    n, steps, dt, sigma, length, speed = 400, 400, 0.5, 1.3, 60.0, 15.0
    one, mean = np.ones(n), np.array([2.0, -1.0])
    start = blow(
        np.zeros((n, 2)) + mean, mean, one, sigma * one, length * one, np.uint64(7), 0, 1e12, 1
    )[0]
    path = blow(start, mean, speed * one, sigma * one, length * one, np.uint64(7), 1, dt, steps)
    gusts = path - mean
    assert (start - mean).std() == pytest.approx(sigma, rel=0.06)
    assert gusts.std() == pytest.approx(sigma, rel=0.03)
    assert np.abs(gusts.mean()) < 0.05
    for lag in (1, 4, 8):
        correlation = (gusts[lag:] * gusts[:-lag]).mean() / sigma**2
        assert correlation == pytest.approx(math.exp(-speed * dt * lag / length), abs=0.04)
    assert abs((gusts[:, :, 0] * gusts[:, :, 1]).mean()) / sigma**2 < 0.03
    assert abs((gusts[:, :-1] * gusts[:, 1:]).mean()) / sigma**2 < 0.03
    assert (gusts**4).mean() / gusts.var() ** 2 == pytest.approx(3.0, abs=0.15)


def test_calm_air_is_calm_and_a_steady_wind_is_the_same_for_all():
    assert not world_of().start().wind.any()
    truth = world_of(speed=5.0, from_deg=270.0).start()
    np.testing.assert_allclose(truth.wind, [[5.0, 0.0]] * 3, atol=1e-12)


def test_gusts_are_repeatable_and_another_aircraft_changes_nobodys():
    command = FlyLine((0.0, 0.0), (600.0, 600.0), 15.0, 80.0)

    def winds(count):
        world = world_of(count, speed=6.0, gusts=True)
        truth = world.start()
        found = [truth.wind]
        for _ in range(20):
            truth = world.advance(truth, [command] * count)
            found.append(truth.wind)
        return np.array(found)

    three, again, four = winds(3), winds(3), winds(4)
    np.testing.assert_array_equal(three, again)
    np.testing.assert_array_equal(three[0], four[0][:3])
    assert np.abs(np.diff(three, axis=0)).max() > 0.01
    assert not np.allclose(three[:, 0], three[:, 1])
    # With the same airspeed the gusts of three are those of the first three of four.
    np.testing.assert_array_equal(three, four[:, :3])


def test_a_wind_as_fast_as_the_aircraft_is_refused():
    with pytest.raises(ScenarioError, match=r"wind.speed = 15 m/s: expected below aircraft.speed"):
        world_of(speed=15.0)
