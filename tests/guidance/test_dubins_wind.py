"""Paths in wind, flown over ground step by step, against still air and a search over all times."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.errors import StanielError
from staniel.guidance import Word, shortest, shortest_in_wind

SIDES = {"L": 1.0, "S": 0.0, "R": -1.0}
place = st.floats(-200.0, 200.0)
course = st.floats(-math.pi, math.pi)


def flown(path, start, airspeed, wind, radius, steps=4000):
    """Runge-Kutta over ground: airspeed along the nose and the wind, nose turning by the word."""
    x, y, heading = start
    for letter, way in zip(Word(path.air.word[0]).name, path.air.segments[0], strict=True):
        dt = way / airspeed / steps
        rate = SIDES[letter] * airspeed / radius
        h = heading + rate * dt * np.arange(steps)[:, None] + rate * dt * np.array([0.0, 0.5, 1.0])
        weights = np.array([1.0, 4.0, 1.0]) / 6.0
        x += dt * np.sum((airspeed * np.cos(h) + wind[0]) @ weights)
        y += dt * np.sum((airspeed * np.sin(h) + wind[1]) @ weights)
        heading += rate * dt * steps
    return x, y, heading


@settings(max_examples=60, deadline=None)
@given(place, place, course, course, st.floats(0.0, 0.9), course)
def test_the_path_ends_at_its_goal_over_ground(x, y, c0, c1, share, direction):
    start, goal = (0.0, 0.0, c0), (x, y, c1)
    wind = (15.0 * share * math.cos(direction), 15.0 * share * math.sin(direction))
    path = shortest_in_wind(start, goal, 15.0, wind, 30.0)
    end = flown(path, start, 15.0, wind, 30.0)
    assert math.dist(end[:2], goal[:2]) < 1e-6
    assert abs(math.remainder(end[2] - c1, math.tau)) < 1e-9
    assert path.air.length[0] == pytest.approx(15.0 * path.time, rel=1e-8, abs=1e-6)
    last = path.sample([path.time, 2.0 * path.time])
    assert np.abs(last[:, :2] - goal[:2]).max() < 1e-6
    if path.earliest:  # At no earlier instant is the drifted goal within reach.
        times = np.random.default_rng(0).uniform(0.0, path.time, 2000)
        goals = np.column_stack([x - wind[0] * times, y - wind[1] * times, np.full(2000, c1)])
        reach = shortest(start, goals, 30.0).length - 15.0 * times
        assert (reach >= -1e-6 * 15.0 * path.time).all()


def test_without_wind_it_is_the_shortest_path():
    rng = np.random.default_rng(1)
    for _ in range(20):
        start, goal = rng.uniform(-100.0, 100.0, (2, 3)) * (1.0, 1.0, 0.03)
        still = shortest(start, goal, 20.0)
        path = shortest_in_wind(start, goal, 12.0, (0.0, 0.0), 20.0)
        assert path.earliest
        assert path.time == pytest.approx(still.length[0] / 12.0, rel=1e-12)
        assert path.air.word[0] == still.word[0]


def test_there_and_back_takes_the_wind_triangle():
    there = shortest_in_wind((0, 0, 0), (3000, 0, 0), 15.0, (6.0, 0.0), 30.0)
    back = shortest_in_wind((3000, 0, math.pi), (0, 0, math.pi), 15.0, (6.0, 0.0), 30.0)
    assert there.time == pytest.approx(3000.0 / 21.0, rel=1e-9)
    assert back.time == pytest.approx(3000.0 / 9.0, rel=1e-9)
    across = shortest_in_wind((0, 0, 0), (0, 90_000, 0), 15.0, (9.0, 0.0), 30.0)
    assert across.time == pytest.approx(90_000.0 / 12.0, rel=0.01)


def test_arriving_early_costs_a_way_of_the_right_length():
    """The wind brings the goal to the nose: the shortest paths jump past the time there is."""
    rng, kinds = np.random.default_rng(2), set()
    for _ in range(200):
        start, goal = rng.uniform(-40.0, 40.0, (2, 3)) * (1.0, 1.0, 0.08)
        angle = rng.uniform(-math.pi, math.pi)
        wind = (13.0 * math.cos(angle), 13.0 * math.sin(angle))
        path = shortest_in_wind(start, goal, 15.0, wind, 30.0)
        kinds.add(path.earliest)
        end = flown(path, start, 15.0, wind, 30.0, steps=500)
        assert math.dist(end[:2], goal[:2]) < 1e-5
    assert kinds == {True, False}


def test_samples_move_with_airspeed_through_the_air():
    wind = (4.0, -3.0)
    path = shortest_in_wind((0, 0, 1.0), (100, 50, -2.0), 15.0, wind, 30.0)
    times = np.linspace(0.0, path.time, 2001)
    poses = path.sample(times)
    through = np.diff(poses[:, :2], axis=0) / np.diff(times)[:, None] - wind
    assert np.allclose(np.hypot(*through.T), 15.0, rtol=1e-5)


def test_bad_input_is_refused():
    good = {"start": (0, 0, 0), "goal": (1, 1, 1), "airspeed": 15.0, "wind": (1.0, 0.0)}
    for bad, message in (
        ({"airspeed": 0.0}, "airspeed = 0.0"),
        ({"wind": (9.0, 12.0)}, "together below the airspeed"),
        ({"wind": (math.nan, 0.0)}, "wind = "),
        ({"wind": (1.0, 0.0, 0.0)}, "wind = "),
        ({"start": (0, 0)}, "start: expected finite x, y, heading"),
        ({"goal": (0, math.inf, 0)}, "goal: expected finite"),
        ({"radius": -1.0}, "radius = -1.0"),
    ):
        with pytest.raises(StanielError, match=message):
            shortest_in_wind(**{"radius": 30.0, **good, **bad})
    path = shortest_in_wind(**good, radius=30.0)
    for times in (3.0, [-1.0], [math.nan]):
        with pytest.raises(StanielError, match="times: expected"):
            path.sample(times)
