"""The world as a whole: how it begins, that it is pure, and what it refuses."""

import math

import numpy as np
import pytest
import shapely

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.errors import CityError, ScenarioError
from staniel.world import Traffic, World

ORBIT = FlyOrbit((150.0, 150.0), 45.0, 1, 15.0, 80.0)


@pytest.fixture(scope="module")
def city():
    return City.generate(size=(300.0, 300.0), seed=1)


def world_of(city, aircraft=4, seed=0, clock=None, airframe=None, **traffic):
    return World(
        city,
        airframe or Airframe(),
        aircraft,
        Traffic(**traffic),
        clock or Clock(),
        np.random.SeedSequence(seed),
    )


def assert_same(a, b):
    assert (a.tick, a.time) == (b.tick, b.time)
    for name in ("aircraft", "vehicles", "traffic", "aircraft_path", "vehicle_path"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()


def test_aircraft_start_on_the_perimeter_heading_for_the_centre():
    truth = world_of(City.open((600.0, 400.0)), aircraft=4).start()
    x, y, z, heading, bank, speed = truth.aircraft.T
    gap = np.minimum.reduce([x, y, 600.0 - x, 400.0 - y])
    np.testing.assert_allclose(gap, 30.0)
    np.testing.assert_allclose(truth.aircraft[0, :2], [30.0, 30.0])
    np.testing.assert_allclose(heading, np.arctan2(200.0 - y, 300.0 - x))
    assert (z == 80.0).all()
    assert (bank == 0.0).all()
    assert (speed == 15.0).all()
    assert truth.tick == 0
    np.testing.assert_array_equal(truth.aircraft_path[-1], truth.aircraft)


@pytest.mark.parametrize("count", [1, 3, 7, 100])
def test_aircraft_are_spread_evenly(count):
    aircraft = world_of(City.open((600.0, 600.0)), aircraft=count).start().aircraft
    assert aircraft.shape == (count, 6)
    line = shapely.box(30, 30, 570, 570).exterior
    ways = np.sort([line.project(shapely.Point(a[:2])) for a in aircraft])
    gaps = np.diff([*ways, ways[0] + line.length])
    np.testing.assert_allclose(gaps, line.length / count, atol=1e-6)


def test_one_tick_is_one_decision_step(city):
    clock = Clock(decision_step=0.6, dynamics_step=0.2)
    world = world_of(city, clock=clock)
    truth = world.advance(world.advance(world.start(), [ORBIT] * 4), [ORBIT] * 4)
    assert truth.tick == 2
    assert truth.time == pytest.approx(1.2)
    assert truth.aircraft_path.shape == (3, 4, 6)
    assert truth.vehicle_path.shape == (3, 4, 4)
    np.testing.assert_array_equal(truth.aircraft_path[-1], truth.aircraft)
    np.testing.assert_array_equal(truth.vehicle_path[-1], truth.vehicles)


def test_advancing_is_pure_and_repeatable(city):
    world = world_of(city)
    start = world.start()
    before = [a.copy() for a in (start.aircraft, start.vehicles, start.traffic)]
    once = world.advance(start, [ORBIT] * 4)
    world.advance(once, [ORBIT] * 4)
    assert_same(once, world.advance(start, [ORBIT] * 4))
    for kept, array in zip(before, (start.aircraft, start.vehicles, start.traffic), strict=True):
        np.testing.assert_array_equal(kept, array)
    other = world_of(city)
    assert_same(once, other.advance(other.start(), [ORBIT] * 4))


def test_another_seed_is_another_traffic(city):
    assert not np.array_equal(
        world_of(city, seed=0).start().vehicles, world_of(city, seed=1).start().vehicles
    )


def test_another_aircraft_changes_no_vehicle(city):
    few, many = world_of(city, aircraft=2), world_of(city, aircraft=5)
    a, b = few.start(), many.start()
    for _ in range(20):
        a, b = few.advance(a, [ORBIT] * 2), many.advance(b, [ORBIT] * 5)
    np.testing.assert_array_equal(a.vehicles, b.vehicles)


def test_another_vehicle_moves_none_of_those_placed_before_it(city):
    four, five = world_of(city).start(), world_of(city, count=5).start()
    np.testing.assert_array_equal(four.vehicles, five.vehicles[:4])


def test_an_empty_city_is_legal(city):
    world = world_of(city, count=0)
    assert world.advance(world.start(), [ORBIT] * 4).vehicles.shape == (0, 4)


def test_aircraft_below_the_tallest_roof_are_refused(city):
    low = Airframe(altitude=city.tallest)
    with pytest.raises(ScenarioError, match=r"altitude = .* m: expected above the tallest roof"):
        world_of(city, airframe=low)
    world_of(city, airframe=Airframe(altitude=math.nextafter(city.tallest, math.inf)))


def test_a_city_without_free_space_is_refused():
    full = City.from_outlines([shapely.box(0, 0, 50, 50)], [10.0], (50.0, 50.0))
    with pytest.raises(CityError, match="no free space"):
        world_of(full, count=0).start()


def test_a_team_without_aircraft_and_missing_commands_are_refused(city):
    with pytest.raises(ScenarioError, match="aircraft count = 0"):
        world_of(city, aircraft=0)
    world = world_of(city)
    with pytest.raises(ValueError, match="3 commands for 4 aircraft"):
        world.advance(world.start(), [ORBIT] * 3)
