"""Following lines and orbits: against closed forms, Lyapunov's argument and an ODE solver."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import staniel
from staniel.angles import wrap, wrap_array
from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.command import FlyLine, FlyOrbit
from staniel.datatypes.equipment import GRAVITY, Airframe
from staniel.errors import ScenarioError
from staniel.guidance import (
    GuidanceConfig,
    carrot_line,
    carrot_loiter,
    follower_named,
    follower_names,
    heading_for_course,
    line_course,
    orbit_course,
)
from staniel.kernels import following
from staniel.kernels.flight import fly
from staniel.scenario import build_city
from staniel.scenario.assemble import assemble

AIRFRAME = Airframe()
V = AIRFRAME.speed
WINDS = [
    (speed * math.cos(angle), speed * math.sin(angle))
    for speed in (2.5, 7.5)
    for angle in np.arange(8) * math.pi / 4.0
] + [(0.0, 0.0)]

numbers = st.floats(-500.0, 500.0)
angles = st.floats(-math.pi, math.pi)
turns = st.sampled_from([1, -1])
names = st.sampled_from(["carrot", "vector-field"])


def rotated(points, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points) @ np.array([[c, s], [-s, c]])


def same_angle(a, b, atol=1e-9):
    np.testing.assert_allclose(np.exp(1j * np.asarray(a)), np.exp(1j * np.asarray(b)), atol=atol)


# The laws.


@settings(max_examples=60, deadline=None)
@given(across=numbers, along=numbers, gain=st.floats(0.005, 0.5), approach=st.floats(0.1, 1.57))
def test_the_field_of_a_line_is_that_of_the_source(across, along, gain, approach):
    """Eq. 5.20 for a line to the east, where left of it is north."""
    found = line_course([[along, across]], [-7.0, 0.0], [3.0, 0.0], gain=gain, approach=approach)
    expected = -approach * (2.0 / math.pi) * math.atan(gain * across)
    assert found[0] == pytest.approx(expected, abs=1e-12)


@settings(max_examples=60, deadline=None)
@given(x=numbers, y=numbers, turn=turns, gain=st.floats(0.2, 8.0), radius=st.floats(20.0, 300.0))
def test_the_field_of_an_orbit_is_that_of_the_source(x, y, turn, gain, radius):
    """Eq. 5.25 with 5.30: inward speed and way round, from the course by scalar products."""
    d = math.hypot(x, y)
    if d < 1e-3:
        return
    (course,) = orbit_course([[x, y]], [0.0, 0.0], radius=radius, turn=turn, gain=gain)
    slope = gain * (d - radius) / radius
    out = (x * math.cos(course) + y * math.sin(course)) / d
    around = (x * math.sin(course) - y * math.cos(course)) / d
    assert out == pytest.approx(-slope / math.hypot(1.0, slope), abs=1e-9)
    assert around == pytest.approx(turn / math.hypot(1.0, slope), abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(x=numbers, y=numbers, along=angles, gain=st.floats(0.005, 0.5))
def test_the_carrot_of_a_line_is_the_field_that_approaches_at_a_right_angle(x, y, along, gain):
    direction = [math.cos(along), math.sin(along)]
    chased = carrot_line([[x, y]], [5.0, -3.0], direction, gain=gain)
    field = line_course([[x, y]], [5.0, -3.0], direction, gain=gain, approach=0.5 * math.pi)
    same_angle(chased, field)
    foot = np.dot([x - 5.0, y + 3.0], direction)
    carrot = np.array([5.0, -3.0]) + (foot + 1.0 / gain) * np.array(direction)
    same_angle(chased[0], math.atan2(carrot[1] - y, carrot[0] - x))


@settings(max_examples=60, deadline=None)
@given(x=numbers, y=numbers, turn=turns, gain=st.floats(0.3, 8.0), radius=st.floats(20.0, 300.0))
def test_the_carrot_of_a_loiter_is_a_place_on_the_circle(x, y, turn, gain, radius):
    """Alg. 5.3 (corrected) in complex numbers, less half the look-ahead angle."""
    if math.hypot(x, y) < 1e-3:
        return
    lookahead = 2.0 * math.atan(0.5 / gain)
    place = complex(x, y)
    carrot = radius * place / abs(place) * np.exp(1j * turn * lookahead)
    if abs(carrot - place) < 1e-3:
        return
    off = 0.5 * lookahead * min(1.0, radius / abs(place))
    expected = np.angle((carrot - place) * np.exp(-1j * turn * off))
    found = carrot_loiter([[x + 9.0, y - 4.0]], [9.0, -4.0], radius=radius, turn=turn, gain=gain)
    same_angle(found[0], expected, atol=1e-7)


@settings(max_examples=60, deadline=None)
@given(name=names, x=numbers, y=numbers, by=st.floats(-10.0, 10.0), turn=turns)
def test_courses_turn_with_the_picture_and_are_wrapped(name, x, y, by, turn):
    """No direction is special: not north, not the seam at ±180 degrees."""
    law = follower_named(name)
    places = [[x, y], [y, x], [-x, y]]
    line = law.line(places, [10.0, 20.0], [2.0, 1.0], gain=0.03)
    orbit = law.orbit(places, [10.0, 20.0], radius=80.0, turn=turn, gain=2.0)
    turned = rotated([[10.0, 20.0], [2.0, 1.0], *places], by)
    line_there = law.line(turned[2:], turned[0], turned[1], gain=0.03)
    orbit_there = law.orbit(turned[2:], turned[0], radius=80.0, turn=turn, gain=2.0)
    same_angle(line_there, line + by, atol=1e-6)
    same_angle(orbit_there, orbit + by, atol=1e-6)
    for courses in (line, orbit, line_there, orbit_there):
        assert (courses > -math.pi).all()
        assert (courses <= math.pi).all()


def test_across_the_seam_the_course_does_not_jump():
    """It goes on around an orbit and beside a line to the west, but for 2 pi (5.21, 5.33)."""
    angle = np.linspace(-math.pi, math.pi, 2001)
    ring = 90.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    beside = np.column_stack([np.zeros(2001), np.linspace(-50.0, 50.0, 2001)])
    for name in follower_names():
        law = follower_named(name)
        around = law.orbit(ring, [0.0, 0.0], radius=80.0, turn=1, gain=2.0)
        west = law.line(beside, [0.0, 0.0], [-1.0, 0.0], gain=0.05)
        for courses in (around, west):
            assert np.abs(wrap_array(np.diff(courses))).max() < 0.01
        assert np.ptp(around) > 6.2


def test_the_center_of_an_orbit_has_a_course():
    for place in ([0.0, 0.0], [-0.0, -0.0]):
        found = orbit_course([place], [0.0, -0.0], radius=50.0, turn=1, gain=1.0)
        assert found[0] == pytest.approx(math.pi / 4.0)


# Lyapunov's argument.


def made_good(course, wind):
    """Velocity over ground of an aircraft that holds a course."""
    triangle = heading_for_course(course, V, wind)
    return float(triangle.ground_speed) * np.array([math.cos(course), math.sin(course)])


@pytest.mark.parametrize("wind", WINDS)
@pytest.mark.parametrize("name", ["carrot", "vector-field"])
def test_cross_track_error_falls_as_lyapunov_says(name, wind):
    """W = e²/2 falls all the way, at the rate of eq. 5.19, whatever the wind."""
    law = follower_named(name).line
    line = {"start": [0.0, 0.0], "direction": [-2.0, 1.0], "gain": 0.05}
    left = np.array([-1.0, -2.0]) / math.sqrt(5.0)
    along = math.atan2(1.0, -2.0)

    def velocity(_time, place):
        return made_good(law([place], **line)[0], wind)

    for away in (160.0, -90.0, 3.0):
        flown = solve_ivp(velocity, (0.0, 60.0), away * left, rtol=1e-9, atol=1e-9, max_step=0.5)
        error = flown.y.T @ left
        fall = np.diff(0.5 * error**2)
        assert (fall[np.abs(error[1:]) > 1e-6] < 0.0).all()
        for place, e in zip(flown.y.T[::20], error[::20], strict=True):
            rate = made_good(law([place], **line)[0], wind)
            angle = math.pi / 2.0 if name == "carrot" else math.radians(60.0)
            expected = -np.linalg.norm(rate) * math.sin(angle * 2.0 / math.pi * math.atan(0.05 * e))
            assert rate @ left == pytest.approx(expected, abs=1e-9)
        assert abs(error[-1]) < 0.05
        assert math.cos(math.atan2(*velocity(0.0, flown.y[:, -1])[::-1]) - along) > 0.9999


@pytest.mark.parametrize("wind", WINDS)
@pytest.mark.parametrize("name", ["carrot", "vector-field"])
def test_orbit_error_falls_as_lyapunov_says(name, wind):
    """W = (d - r)²/2 falls all the way from inside and outside; for the field as in eq. 5.31."""
    law = follower_named(name).orbit
    radius, gain = 80.0, 2.0
    for turn, start in ((1, [300.0, 40.0]), (-1, [-5.0, 9.0])):

        def velocity(_time, place, turn=turn):
            course = law([place], [0.0, 0.0], radius=radius, turn=turn, gain=gain)[0]
            return made_good(course, wind)

        flown = solve_ivp(velocity, (0.0, 90.0), start, rtol=1e-9, atol=1e-9, max_step=0.5)
        error = np.hypot(*flown.y) - radius
        fall = np.diff(0.5 * error**2)
        assert (fall[np.abs(error[1:]) > 1e-5] < 0.0).all()
        assert abs(error[-1]) < 0.05
        angle = np.unwrap(np.arctan2(flown.y[1], flown.y[0]))
        assert np.sign(angle[-1] - angle[-5]) == turn
        if name == "vector-field":
            for place, e in zip(flown.y.T[::20], error[::20], strict=True):
                rate = velocity(0.0, place)
                out = rate @ place / np.linalg.norm(place)
                expected = -np.linalg.norm(rate) * math.sin(math.atan(gain * e / radius))
                assert out == pytest.approx(expected, abs=1e-9)


def test_a_plain_carrot_on_a_circle_would_end_inside_it():
    """What the half look-ahead angle that `carrot_loiter` takes off is for."""
    radius, ahead = 80.0, 0.6

    def plain(_time, place):
        x, y = place
        angle = math.atan2(y, x) + ahead
        to = np.array([radius * math.cos(angle) - x, radius * math.sin(angle) - y])
        return V * to / np.linalg.norm(to)

    flown = solve_ivp(plain, (0.0, 120.0), [120.0, 0.0], rtol=1e-9, atol=1e-9)
    assert np.hypot(*flown.y[:, -1]) == pytest.approx(radius * math.cos(ahead), abs=0.01)


# The real flight kernel.


def flown(command, state, seconds, wind, name, dt=0.1, approach=60.0):
    steps = round(seconds / dt)
    air = np.empty((steps, 1, 2))
    air[:] = wind
    rows = limits([AIRFRAME], name, math.radians(approach))
    return fly(
        np.array([state], dtype=float), np.zeros(1), encode([command]), rows, air, dt, steps
    )[0][:, 0]


def oracle(course_at, start, wind, seconds, gain=AIRFRAME.course_gain):
    """A coordinated turn that steers k times the course error and the field's own rate.

    The rate is a difference along the way flown, the field's look-ahead being held.
    """
    limit = AIRFRAME.max_bank

    def rates(_time, s):
        x, y, heading, bank = s
        v = np.array([V * math.cos(heading) + wind[0], V * math.sin(heading) + wind[1]])
        course, ahead = math.atan2(v[1], v[0]), 2.0 * np.linalg.norm(v) / gain
        places = np.array([[x, y], [x, y] + 1e-4 * v, [x, y] - 1e-4 * v])
        now, later, sooner = course_at(places, ahead)
        wanted = gain * wrap(now - course) + wrap(later - sooner) / 2e-4
        geared = wanted * np.linalg.norm(v) / (V * math.cos(heading - course))
        bank_wanted = np.clip(math.atan(V * geared / GRAVITY), -limit, limit)
        roll = np.clip(AIRFRAME.roll_gain * (bank_wanted - bank), -math.pi / 3.0, math.pi / 3.0)
        return [*v, GRAVITY / V * math.tan(bank), roll]

    start = [start[0], start[1], start[3], start[4]]
    last = solve_ivp(rates, (0.0, seconds), start, rtol=1e-8, atol=1e-8, max_step=0.02).y[:, -1]
    last[2] = wrap(last[2])
    return last


@pytest.mark.parametrize("wind", [(0.0, 0.0), (5.0, -4.0)])
def test_the_autopilot_flies_the_fields_own_rate(wind):
    """Thesis eq. 5.6 (corrected) against an ODE solver; the orbit is joined from outside."""
    approach = math.radians(50.0)

    def along_line(places, ahead):
        gain = 0.5 * math.pi / (approach * ahead)
        return line_course(places, [0.0, 0.0], [-1.0, 0.2], gain=gain, approach=approach)

    def around(places, ahead):
        return orbit_course(places, [0.0, -50.0], radius=70.0, turn=-1, gain=70.0 / ahead)

    for command, law, heading in (
        (FlyLine((0.0, 0.0), (-1.0, 0.2), V, 80.0), along_line, -2.8),
        (FlyOrbit((0.0, -50.0), 70.0, -1, V, 80.0), around, 0.3),
    ):
        start = [30.0, 45.0, 80.0, heading, 0.0, V]
        path = flown(command, start, 8.0, wind, "vector-field", dt=0.005, approach=50.0)
        expected = oracle(law, start, wind, 8.0)
        np.testing.assert_allclose(path[-1, [0, 1, 3, 4]], expected, atol=0.02)


@settings(max_examples=60, deadline=None)
@given(speed=st.floats(0.0, 7.5), to=angles, x=numbers, y=st.floats(-150, 150), heading=angles)
def test_the_field_of_a_line_converges_in_wind_up_to_half_the_airspeed(speed, to, x, y, heading):
    """Once the course keeps within 2° of the field, the error falls where that asks for more."""
    wind = np.array([speed * math.cos(to), speed * math.sin(to)])
    command = FlyLine((0.0, 0.0), (1.0, 0.0), V, 80.0)
    path = flown(command, [x, y, 80.0, heading, 0.0, V], 75.0, wind, "vector-field")
    assert np.abs(path[-100:, 1]).max() < 0.05
    velocity = V * np.column_stack([np.cos(path[:, 3]), np.sin(path[:, 3])]) + wind
    course = np.arctan2(velocity[:, 1], velocity[:, 0])
    ahead = 2.0 * np.hypot(*velocity.T) / AIRFRAME.course_gain
    gains = 1.5 / ahead
    field = -math.radians(120.0) / math.pi * np.arctan(gains * path[:, 1])
    off = np.abs(wrap_array(course - field)) > math.radians(2.0)
    joined = len(off) - int(np.argmax(off[::-1])) if off.any() else 0
    assert joined < 300
    error = np.abs(path[joined:, 1])
    outside = error[1:] > math.tan(math.radians(3.0)) / gains[joined + 1 :]
    assert (np.diff(error)[outside] < 0.0).all()


@settings(max_examples=60, deadline=None)
@given(
    speed=st.floats(0.0, 7.5),
    to=angles,
    x=st.floats(-250, 250),
    y=st.floats(-250, 250),
    heading=angles,
    turn=turns,
    radius=st.floats(80.0, 150.0),
)
def test_the_field_of_an_orbit_converges_in_wind_up_to_half_the_airspeed(
    speed, to, x, y, heading, turn, radius
):
    """The least radius downwind is (V + W)²/(g tan 35°) = 74 m."""
    wind = (speed * math.cos(to), speed * math.sin(to))
    command = FlyOrbit((0.0, 0.0), radius, turn, V, 80.0)
    last = flown(command, [x, y, 80.0, heading, 0.0, V], 140.0, wind, "vector-field")[-500:]
    assert np.abs(np.hypot(last[:, 0], last[:, 1]) - radius).max() < 0.6
    around = np.unwrap(np.arctan2(last[:, 1], last[:, 0]))
    assert np.sign(around[-1] - around[0]) == turn


def test_a_line_without_direction_is_survived_by_the_field():
    path = flown(
        FlyLine((9.0, 9.0), (9.0, 9.0), V, 80.0), [0, 0, 80, 0, 0, V], 30.0, 0.0, "vector-field"
    )
    assert np.isfinite(path).all()
    assert np.hypot(*(path[-1, :2] - 9.0)) < 100.0


# Wind triangle.


@settings(max_examples=60, deadline=None)
@given(course=angles, airspeed=st.floats(5.0, 40.0), speed=st.floats(0.0, 0.99), to=angles)
def test_below_the_airspeed_every_course_is_held(course, airspeed, speed, to):
    wind = airspeed * speed * np.array([math.cos(to), math.sin(to)])
    found = heading_for_course(course, airspeed, wind)
    through = airspeed * np.array([math.cos(found.heading), math.sin(found.heading)])
    over = found.ground_speed * np.array([math.cos(course), math.sin(course)])
    np.testing.assert_allclose(through + wind, over, atol=1e-9)
    assert found.held
    assert found.ground_speed > 0.0


@settings(max_examples=60, deadline=None)
@given(course=angles, ratio=st.floats(1.05, 5.0), to=angles)
def test_above_the_airspeed_the_nearest_course_is_flown(course, ratio, to):
    """Against a search over all headings."""
    wind = ratio * 15.0 * np.array([math.cos(to), math.sin(to)])
    headings = np.linspace(-math.pi, math.pi, 20_001)
    over = 15.0 * np.column_stack([np.cos(headings), np.sin(headings)]) + wind
    nearest = np.abs(wrap_array(np.arctan2(over[:, 1], over[:, 0]) - course)).min()
    heading, ground_speed, held = heading_for_course([course], 15.0, wind)
    own = 15.0 * np.array([math.cos(heading[0]), math.sin(heading[0])]) + wind
    off = abs(wrap(math.atan2(own[1], own[0]) - course))
    assert off <= nearest + 1e-6
    assert np.hypot(*own) == pytest.approx(ground_speed[0])
    assert bool(held[0]) == (off < 1e-6)


def test_a_wind_that_just_stops_the_aircraft():
    against = heading_for_course([math.pi, 0.0], 15.0, [15.0, 0.0])
    np.testing.assert_array_equal(against.held, [False, True])
    np.testing.assert_allclose(against.ground_speed, [0.0, 30.0], atol=1e-9)


# Doors, and the choice by name.


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": [[0.0, math.nan]]}, r"position\[0\] = \[0.0, nan\]: expected finite"),
        ({"position": [0.0, 0.0]}, r"position has shape \(2,\): expected \(n, 2\)"),
        ({"center": [math.inf, 0.0]}, "center = .*expected finite"),
        ({"center": [0.0, 0.0, 0.0]}, r"center has shape \(3,\)"),
        ({"radius": 0.0}, "radius = 0.0: expected a finite number greater than 0"),
        ({"radius": -5.0}, "radius = -5.0"),
        ({"radius": math.nan}, "radius = nan"),
        ({"turn": 0}, r"turn = 0: expected \+1 or -1"),
        ({"gain": 0.0}, "gain = 0.0"),
        ({"gain": math.inf}, "gain = inf"),
    ],
)
def test_orbits_that_make_no_sense_are_refused(change, message):
    fine = {"position": [[1.0, 2.0]], "center": [0.0, 0.0], "radius": 50.0, "turn": 1, "gain": 2.0}
    for law in (orbit_course, carrot_loiter):
        law(**fine)
        with pytest.raises(ValueError, match=message):
            law(**(fine | change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": [[math.inf, 0.0]]}, "position.*expected finite"),
        ({"direction": [0.0, 0.0]}, "direction.*with a direction"),
        ({"direction": [math.nan, 0.0]}, "direction.*expected finite"),
        ({"start": [0.0]}, "start has shape"),
        ({"gain": -1.0}, "gain = -1.0"),
    ],
)
def test_lines_that_make_no_sense_are_refused(change, message):
    fine = {"position": [[1.0, 2.0]], "start": [0.0, 0.0], "direction": [1.0, 0.0], "gain": 0.1}
    for law in (line_course, carrot_line):
        law(**fine)
        with pytest.raises(ValueError, match=message):
            law(**(fine | change))


@pytest.mark.parametrize("approach", [0.0, -1.0, 1.6, math.nan])
def test_an_approach_beyond_a_right_angle_is_refused(approach):
    with pytest.raises(ValueError, match="approach = "):
        line_course([[0.0, 0.0]], [0.0, 0.0], [1.0, 0.0], gain=0.1, approach=approach)


@pytest.mark.parametrize(
    "bad", [(math.nan, 15.0, [0, 0]), (0.0, 0.0, [0, 0]), (0.0, 15.0, [math.nan, 0])]
)
def test_a_wind_triangle_of_nonsense_is_refused(bad):
    with pytest.raises(ValueError, match="expected"):
        heading_for_course(*bad)


def test_names_mean_the_same_everywhere():
    assert follower_names() == sorted(following.FOLLOWERS)
    assert set(get_args(GuidanceConfig.model_fields["following"].annotation)) == set(
        follower_names()
    )
    with pytest.raises(ValueError, match=r"'rails': expected one of carrot, vector-field"):
        follower_named("rails")


def test_the_scenario_chooses_what_is_flown():
    def paths(**guidance):
        scenario = staniel.load_scenario("village", minutes=1.0, guidance=guidance)
        city = build_city(scenario.city, scenario.seed)
        return np.concatenate(
            [frame.truth.aircraft_path for frame in assemble(scenario, city).frames()]
        )

    default, carrot = paths(), paths(following="carrot")
    field, steeper = (
        paths(following="vector-field"),
        paths(following="vector-field", approach_deg=85.0),
    )
    np.testing.assert_array_equal(default, carrot)
    assert np.abs(field - carrot).max() > 1.0
    assert np.abs(field - steeper).max() > 0.1
    with pytest.raises(ScenarioError, match=r"guidance\.following"):
        paths(following="rails")
