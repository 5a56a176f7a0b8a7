"""Occupancy against shapely, ways against the flight kernel, bans against buffers."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.datatypes.autopilot import decode, encode, limits
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.risk import RiskRegion, region_arrays
from staniel.kernels.avoidance import Bans, Others, Rules, choose, ways
from staniel.kernels.flight import ORBIT, fly
from staniel.kernels.lidar import sweep
from staniel.kernels.occupancy import Tops, Window, forget, mark, tops
from staniel.kernels.threats import is_near
from staniel.world.lidar import build_facades

CELL, N = 3.0, 100
LIMITS = limits([Airframe()])
RULES = Rules(0.1, 10, 2, 8.0, 7.0)
OPEN = Tops(
    np.full((N, N), -np.inf, np.float32), np.full((N, N), -np.inf, np.float32), -150.0, -150.0, CELL
)
NOBODY = Others(np.zeros((0, 80, 3)), np.zeros((0, 80, 2)), 0.25)
NO_BANS = Bans(region_arrays(()), np.zeros(0, dtype=np.bool_), 5.0)

numbers = st.floats(-1.0, 1.0)
commands = st.one_of(
    st.builds(
        lambda a, b, v, z: FlyLine((50 * a, 50 * b), (200 * b, 200 * v), 15.0 + 4 * v, 50 + 9 * z),
        numbers, numbers, numbers, numbers,
    ),
    st.builds(
        lambda a, b, r, z: FlyOrbit((80 * a, 80 * b), 60 + 25 * r, 1 if a > 0 else -1, 15, 50 + z),
        numbers, numbers, numbers, numbers,
    ),
    st.builds(lambda a, z: FlyBanks((0.6 * a, 0.3), 2.0, 13.0, 50 + 9 * z), numbers, numbers),
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(commands, numbers, numbers, numbers)
def test_ways_are_flown_with_the_autopilots_own_dynamics(command, heading, bank, climb):
    """The same way as `fly`'s, however often it is looked at."""
    state = np.array([0.0, 0.0, 50.0, 3.0 * heading, 0.6 * bank, 15.0])
    row, wind = encode([command]), np.array([1.5, -2.0])
    ends, clear, banned = ways(
        state, 2.0 * climb, row, LIMITS[0], wind, OPEN, NOBODY, NO_BANS, RULES
    )
    finer = fly(
        state[None], np.array([2.0 * climb]), row, LIMITS, np.tile(wind, (80, 1, 1)), 0.1, 80
    )
    assert clear[0] == RULES.foresight
    assert banned[0] == 0.0
    assert np.allclose(ends[0], finer[0][-1, 0, :2], atol=1e-9)


def test_a_verified_choice_can_be_flown_to_its_end():
    """Its command for a step and its escape for a minute: `fly` meets no closed cell on the way."""
    closed = OPEN.closed.copy()
    closed[70:, :] = np.inf  # a wall to the east, from x = 60 on
    closed[:, :30] = np.inf  # and one to the south, up to y = -60
    around = Tops(closed, closed, *OPEN[2:])
    east = encode([FlyLine((0.0, 0.0), (300.0, 0.0), 15.0, 50.0)])
    north = encode([FlyLine((0.0, 0.0), (0.0, 300.0), 15.0, 50.0)])
    rows = np.concatenate([east, north])
    for x in np.arange(-60.0, 20.0, 5.0):
        state = np.array([x, 0.0, 50.0, 0.0, 0.0, 15.0])
        choice = choose(
            state,
            0.0,
            rows,
            np.arange(2),
            15.0,
            LIMITS[0],
            np.zeros(2),
            around,
            NOBODY,
            NO_BANS,
            RULES,
        )
        if choice.harm.any():
            continue
        path, climbs = fly(
            state[None], np.zeros(1), rows[choice.row][None], LIMITS, np.zeros((10, 1, 2)), 0.1, 10
        )
        rest, _ = fly(
            path[-1], climbs, choice.escape[None], LIMITS, np.zeros((600, 1, 2)), 0.1, 600
        )
        way = np.concatenate([path, rest])[:, 0]
        assert choice.escape[0] == ORBIT
        assert way[:, 0].max() < 60.0
        assert way[:, 1].min() > -60.0
        assert np.array_equal(choice.there, path[-1, 0])
        assert choice.climb == climbs[0]


def test_from_too_near_a_wall_nothing_is_verified():
    closed = OPEN.closed.copy()
    closed[55:, :] = np.inf  # from x = 15 on, across the whole window
    around = Tops(closed, closed, *OPEN[2:])
    east = encode([FlyLine((0.0, 0.0), (300.0, 0.0), 15.0, 50.0)])
    state = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 15.0])
    common = (LIMITS[0], np.zeros(2), around, NOBODY, NO_BANS, RULES)
    choice = choose(state, 0.0, east, np.arange(1), 15.0, *common)
    assert choice.harm[0] > 0.0
    ends, clear, _ = ways(state, 0.0, east, *common)
    assert 0.9 <= clear[0] <= 1.1  # a second to x = 15
    assert ends[0, 0] == pytest.approx(15.0, abs=1.0)


# -- what is known of buildings ------------------------------------------------------------------


def scanned(city, x, y, z, heading=0.0, aperture=360, chart=None):
    half = aperture // 2
    angles = np.radians(np.arange(-half, half + 1.0))
    fan = np.column_stack((np.cos(angles), np.sin(angles)))
    pose = np.array([[[x, y, z, heading]]])
    ranges = sweep(
        build_facades(city), city.walls, pose, fan, math.radians(1.0), 140.0, 0.1, np.uint64(3), 0
    )[0, 0]
    window = Window(*(np.full((N, N), v, np.float32) for v in (np.inf, -np.inf, -np.inf)))
    corner = np.array([math.floor(x / CELL) - N // 2, math.floor(y / CELL) - N // 2])
    held = chart or City.open(city.size)
    forget(window, corner - 10 * N, corner, CELL, held.walls, np.asarray(held.heights, float), 2.0)
    origins = np.tile([x, y], (len(angles), 1))
    mark(window, corner, CELL, z, origins, heading + angles, ranges, 140.0, 0.1)
    return window, corner


def opened(air, z):
    """Middles of the cells that can be entered at z."""
    i, j = np.nonzero(z >= air.closed)
    return np.column_stack((air.west + (i + 0.5) * CELL, air.south + (j + 0.5) * CELL))


@pytest.mark.parametrize("seed", range(4))
def test_what_the_lidar_opens_is_in_the_open_and_apart_from_every_wall(seed):
    city = City.generate(size=(500.0, 500.0), seed=seed)
    z = 0.6 * city.tallest
    tall = [o for o, h in zip(city.outlines, city.heights, strict=True) if h > z]
    rng = np.random.default_rng(seed)
    places = rng.uniform(100.0, 400.0, (60, 2))
    free = [p for p in places if min(o.distance(shapely.Point(p)) for o in tall) > 12.0][:8]
    for x, y in free:
        window, corner = scanned(city, x, y, z)
        points = opened(tops(window, corner, CELL, 6.0, np.inf, True), z)
        assert len(points) > 20
        apart = shapely.distance(shapely.union_all(tall), shapely.points(points))
        assert apart.min() > 3.0  # the clearance, less the cells' own size


def test_open_ground_is_open_as_far_as_the_lidar_reaches_and_no_farther():
    window, corner = scanned(City.open((500.0, 500.0)), 250.0, 250.0, 30.0)
    points = opened(tops(window, corner, CELL, 6.0, np.inf, True), 30.0)
    away = np.linalg.norm(points - 250.0, axis=1)
    assert away.max() < 140.0
    assert len(points) * CELL**2 == pytest.approx(math.pi * 130.0**2, rel=0.08)


def test_half_a_fan_opens_half_and_what_is_above_counts_for_above_only():
    window, corner = scanned(City.open((500.0, 500.0)), 250.0, 250.0, 30.0, aperture=180)
    air = tops(window, corner, CELL, 6.0, np.inf, True)
    assert opened(air, 30.0)[:, 0].min() > 235.0
    assert len(opened(air, 45.0)) == len(opened(air, 30.0))
    assert len(opened(air, 25.0)) < 60  # only where it is itself
    assert len(opened(tops(window, corner, CELL, 6.0, 20.0, True), 25.0)) == N * N


def test_a_wall_seen_from_above_is_flown_over_where_it_was_seen_to_end():
    city = City.from_outlines([shapely.box(300.0, 200.0, 320.0, 300.0)], [40.0], (500.0, 500.0))
    window, corner = scanned(city, 250.0, 250.0, 30.0)
    assert not len(_near(opened(tops(window, corner, CELL, 6.0, np.inf, True), 45.0)))
    origins = np.tile([250.0, 250.0], (361, 1))
    angles = np.radians(np.arange(-180.0, 181.0))
    mark(window, corner, CELL, 42.0, origins, angles, np.full(361, np.inf), 140.0, 0.1)
    air = tops(window, corner, CELL, 6.0, np.inf, True)
    assert len(_near(opened(air, 42.0)))
    assert not len(_near(opened(air, 35.0)))


def _near(points):
    """Those around the wall's face."""
    return points[(abs(points[:, 0] - 300.0) < 3.0) & (abs(points[:, 1] - 250.0) < 20.0)]


def test_the_window_forgets_what_it_leaves_and_keeps_the_rest():
    window, corner = scanned(City.open((500.0, 500.0)), 250.0, 250.0, 30.0)
    before = window.passed.copy()
    blank = City.open((500.0, 500.0))
    forget(window, corner, corner + np.array((20, 0)), CELL, blank.walls, np.zeros(0), 2.0)
    columns = np.arange(corner[0], corner[0] + N + 20)
    kept, left = columns[20:N] % N, columns[N:] % N
    assert np.array_equal(window.passed[kept], before[kept])
    assert np.isinf(window.passed[left]).all()


def test_the_chart_closes_its_buildings_up_to_their_roofs():
    city = City.generate(size=(300.0, 300.0), seed=5)
    chart = City.open((300.0, 300.0))
    window, corner = scanned(chart, 150.0, 150.0, 90.0, chart=city)
    air = tops(window, corner, CELL, 6.0, city.tallest + 2.0, False)
    for z in (12.0, 25.0, 35.0):
        points = shapely.points(opened(air, z))
        tall = [o for o, h in zip(city.outlines, city.heights, strict=True) if h > z]
        assert shapely.distance(shapely.union_all(tall), points).min() > 3.0


# -- bans ----------------------------------------------------------------------------------------

SHAPES = [
    RiskRegion(kind="no-fly", center=(10.0, -20.0), radius=40.0, floor=10.0, ceiling=90.0),
    RiskRegion(
        kind="no-fly", polygon=((0, 0), (90, 10), (60, 40), (90, 80), (-10, 70)), ceiling=50.0
    ),
]


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("outside", [False, True])
def test_bans_and_fences_are_buffers(number, outside):
    region, margin = SHAPES[number], 7.0
    shape = (
        shapely.Polygon(region.polygon)
        if region.polygon is not None
        else shapely.Point(region.center).buffer(region.radius, 200)
    )
    grown = shape.buffer(-margin if outside else margin, 200)
    low, high = (region.floor, region.ceiling)
    low, high = (low + margin, high - margin) if outside else (low - margin, high + margin)
    rng = np.random.default_rng(number)
    regions = region_arrays([region])
    for x, y, z in rng.uniform((-90, -90, -20), (140, 140, 120), (1500, 3)):
        if abs(grown.exterior.distance(shapely.Point(x, y))) < 0.05:
            continue
        held = grown.contains(shapely.Point(x, y)) and low <= z <= high
        assert is_near(regions, 0, x, y, z, margin, outside) == (held != outside)


@given(commands)
def test_commands_come_back_from_their_rows(command):
    assert encode([decode(encode([command])[0])]).tolist() == encode([command]).tolist()
