"""Plans: flown exactly, clear of walls by shapely, short, refused or answered in bounds."""

import heapq
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from staniel.city import City
from staniel.datatypes.command import FlyOrbit
from staniel.datatypes.risk import RiskRegion
from staniel.errors import PlanningError
from staniel.guidance.dangers import Dangers
from staniel.guidance.planning import Obstacles, Problem, plan, planner, planner_names
from staniel.kernels.cells import SAGITTA, advanced
from staniel.kernels.dubins import shortest_length
from staniel.kernels.shots import TURNS, shot

SHARED = Path(__file__).resolve().parents[2] / "../shared/data"
CLEARANCE = 4.0


def open_air(side=400.0, **settings):
    return Obstacles.open((side, side), altitude=50.0, clearance=CLEARANCE, **settings)


def euler(found, steps=40_000):
    """The end of a plan by small straight steps: nothing of the plan's own geometry."""
    x, y, course = found.start
    for bend, length in found.pieces.tolist():
        n = max(int(steps * length / found.length), 1)
        courses = course + bend * length * (np.arange(n) + 0.5) / n
        x, y = x + np.cos(courses).sum() * length / n, y + np.sin(courses).sum() * length / n
        course += bend * length
    return x, y, course


def check(found, problem, walls=()):
    """Everything that holds for any plan of any planner."""
    x, y, course = euler(found)
    assert math.hypot(x - problem.goal[0], y - problem.goal[1]) <= problem.tolerance + 0.01
    if len(problem.goal) == 3:
        assert abs(math.remainder(course - problem.goal[2], math.tau)) < 1e-6
    assert found.start == problem.start
    assert (np.abs(found.pieces[:, 0]) <= 1.0 / problem.turn_radius * (1.0 + 1e-12)).all()
    assert (found.pieces[:, 1] > 0.0).all()
    if len(walls):
        line = shapely.LineString(found.poses(0.5)[:, :2])
        assert shapely.distance(line, np.array(walls, dtype=object)).min() > (
            problem.obstacles.clearance - SAGITTA - 0.01
        )


def tall(city, altitude, clearance=CLEARANCE):
    return [o for o, h in zip(city.outlines, city.heights, strict=True) if h > altitude - clearance]


def random_problem(obstacles, radius, rng, **settings):
    free = obstacles.middles[~obstacles.blocked]
    (ax, ay), (bx, by) = free[rng.integers(len(free), size=2)]
    a, b = rng.uniform(-math.pi, math.pi, 2)
    return Problem((ax, ay, a), (bx, by, b), radius, obstacles, **settings)


def test_in_free_air_the_plan_is_the_dubins_path():
    rng = np.random.default_rng(0)
    for _ in range(20):
        problem = random_problem(open_air(2000.0), 30.0, rng)
        found = plan(problem)
        if found and min(found.poses(5.0)[:, :2].min(), 1996 - found.poses(5.0)[:, :2].max()) > 70:
            best = shortest_length(*problem.start, *problem.goal, 30.0)
            assert found.length == pytest.approx(best, abs=1e-6)
            check(found, problem)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 10_000), st.sampled_from([12.0, 20.0, 33.0]), st.booleans())
def test_in_random_cities_plans_keep_their_clearance(seed, radius, place):
    city = City.generate(size=(300.0, 300.0), density=0.25, heights=(10.0, 40.0), seed=seed % 50)
    altitude = 25.0
    obstacles = Obstacles.from_city(city, altitude=altitude, clearance=CLEARANCE, margin=60.0)
    rng = np.random.default_rng(seed)
    problem = random_problem(obstacles, radius, rng, limit=30_000)
    if place:
        problem = Problem(problem.start, problem.goal[:2], radius, obstacles, tolerance=3.0)
    found = plan(problem)
    if found:
        check(found, problem, tall(city, altitude))
        bounds = found.poses(1.0)[:, :2]
        assert bounds.min() >= -60.0 - SAGITTA
        assert bounds.max() <= 360.0 + SAGITTA
        assert found.length == pytest.approx(found.cost)
        # Nothing that turns so is shorter in free air.
        if not place:
            assert found.length >= shortest_length(*problem.start, *problem.goal, radius) - 1e-6


def slalom():
    """Three walls with gaps at alternating ends: the shortest way without turning is known."""
    walls = [
        shapely.box(100.0, 0.0, 104.0, 280.0),
        shapely.box(200.0, 120.0, 204.0, 400.0),
        shapely.box(300.0, 0.0, 304.0, 280.0),
    ]
    return open_air().with_shapes(walls, 1), walls


def test_a_slalom_is_hardly_longer_than_a_taut_string():
    obstacles, walls = slalom()
    problem = Problem((20.0, 200.0, 0.0), (380.0, 200.0), 15.0, obstacles)
    found = plan(problem)
    check(found, problem, walls)
    # A string around the corners of the blocked cells, which no path can be shorter than.
    grown = [shapely.box(*shapely.bounds(w) + np.array([-4, -4, 4, 4])) for w in walls]
    corners = [(96, 284), (108, 284), (196, 116), (208, 116), (296, 284), (308, 284)]
    string = shapely.LineString([(20, 200), *corners, (380, 200)])
    assert not any(string.crosses(g.buffer(-0.1)) for g in grown)
    assert string.length <= found.length <= 1.06 * string.length


def test_a_wider_turn_is_longer_and_too_wide_a_turn_has_no_path():
    obstacles, _ = slalom()
    lengths = []
    for radius in (10.0, 25.0, 40.0):
        found = plan(Problem((20.0, 200.0, 0.0), (380.0, 200.0), radius, obstacles))
        lengths.append(found.length)
    assert lengths == sorted(lengths)
    corridor = open_air(100.0)
    assert not plan(Problem((30.0, 50.0, 0.0), (30.0, 50.0, math.pi), 60.0, corridor))


def ringed(gap=0.0):
    ring = shapely.Point(200, 200).buffer(60) - shapely.Point(200, 200).buffer(50)
    return open_air().with_shapes([ring - shapely.box(200, 200 - gap, 400, 200 + gap)], 1)


@pytest.mark.parametrize("goal", [(200.0, 200.0), (200.0, 200.0, 1.0)])
def test_an_enclosed_goal_has_no_path_at_once(goal):
    for start, end in (((20.0, 20.0, 0.0), goal), ((200.0, 200.0, 0.0), (20.0, 20.0))):
        found = plan(Problem(start, end, 15.0, ringed()))
        assert not found
        assert found.reason == "closed"
        assert found.work < 5_000


def test_a_goal_that_no_turn_reaches_is_given_up_within_the_bound():
    # Open to flies, but a circle of 60 m does not fit into the ring, nor does its gap lead there.
    obstacles = ringed(gap=12.0)
    ways = plan(Problem((20.0, 20.0, 0.0), (200.0, 200.0, math.pi / 2), 60.0, obstacles))
    assert not ways
    assert ways.work <= 300_000
    few = plan(Problem((20.0, 20.0, 0.0), (200.0, 200.0, math.pi / 2), 60.0, obstacles, limit=500))
    assert (few.reason, few.work) == ("limit", 500)
    assert plan(Problem((20.0, 20.0, 0.0), (200.0, 200.0), 15.0, obstacles))


def test_risk_is_flown_around_when_it_is_worth_it():
    obstacles = open_air()
    threat = RiskRegion(kind="threat", center=(200.0, 200.0), radius=80.0, rate=0.3)
    risk = obstacles.exposure_rates(Dangers((threat,)))
    asked = {"turn_radius": 20.0, "obstacles": obstacles, "risk": risk}
    exposures, lengths = [], []
    for weight in (0.0, 30.0, 3000.0):
        found = plan(Problem((20.0, 200.0, 0.0), (380.0, 200.0), risk_weight=weight, **asked))
        exposures.append(found.exposure)
        lengths.append(found.length)
        assert found.cost == pytest.approx(found.length + weight * found.exposure, rel=1e-5)
        inside = (
            shapely.Point(200, 200)
            .buffer(80)
            .intersection(shapely.LineString(found.poses(0.5)[:, :2]))
        )
        assert found.exposure == pytest.approx(0.3 * inside.length / 15.0, abs=0.3 * 8.0 / 15.0)
    assert exposures[0] == pytest.approx(0.3 * 160.0 / 15.0, rel=0.05)
    assert exposures[0] > exposures[2]
    assert exposures[2] < 0.1
    assert lengths[0] < lengths[2] < 1.4 * lengths[0]


def test_no_fly_regions_block_at_their_heights_only():
    ban = RiskRegion(kind="no-fly", center=(200.0, 200.0), radius=60.0, ceiling=80.0)
    wedge = RiskRegion(kind="no-fly", polygon=((300, 0), (400, 0), (400, 90)), floor=60.0)
    obstacles = open_air().with_regions([ban, wedge])
    assert obstacles.what_blocks(390.0, 20.0) is None
    assert obstacles.what_blocks(259.0, 200.0) == "a no-fly region"
    middles = obstacles.middles[obstacles.blocked]
    apart = np.hypot(*(middles - 200.0).T)
    assert apart.max() <= 60.0 + CLEARANCE + 2.0 * math.sqrt(2.0)
    problem = Problem((20.0, 200.0, 0.0), (380.0, 200.0), 20.0, obstacles)
    found = plan(problem)
    check(found, problem, [shapely.Point(200, 200).buffer(60.0, quad_segs=64)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"goal": (200.0, 200.0)}, r"goal = \(200, 200\).*is in a building"),
        ({"start": (200.0, 200.0, 0.0)}, r"start = \(200, 200\).*is in a building"),
        ({"goal": (50.0, 350.0, 0.0)}, r"goal = .*is in a no-fly region"),
        ({"goal": (500.0, 0.0)}, "the edge of the area"),
        ({"goal": (math.nan, 0.0)}, "goal = .nan, 0.0.*expected finite"),
        ({"start": (0.0, 0.0)}, "start = .*expected finite numbers .x, y, course."),
        ({"start": (0.0, 0.0, math.inf)}, "start = .*expected finite"),
        ({"turn_radius": 0.0}, "turn_radius = 0.0: expected a number greater than 0"),
        ({"turn_radius": math.nan}, "turn_radius = nan"),
        ({"tolerance": -1.0}, "tolerance = -1.0: expected a number at least 0"),
        ({"tolerance": 1.0, "goal": (9.0, 9.0, 0.0)}, "tolerance = 1: expected 0"),
        ({"speed": 0.0}, "speed = 0.0"),
        ({"risk_weight": math.inf}, "risk_weight = inf"),
        ({"limit": 0}, "limit = 0: expected at least 1"),
        ({"risk": np.zeros((2, 2))}, "risk has shape"),
        ({"risk": np.full((100, 100), -1.0)}, "risk has shape"),
    ],
)
def test_bad_input_is_refused_at_the_door(change, words):
    obstacles = open_air().with_shapes([shapely.box(150, 150, 250, 250)], 1)
    ban = RiskRegion(kind="no-fly", center=(50.0, 350.0), radius=20.0)
    asked = {
        "start": (20.0, 20.0, 0.0),
        "goal": (380.0, 20.0),
        "turn_radius": 20.0,
        "obstacles": obstacles.with_regions([ban]),
    }
    assert plan(Problem(**asked))
    with pytest.raises(PlanningError, match=words):
        Problem(**{**asked, **change})


@pytest.mark.parametrize(
    "change",
    [{"cell": 0.0}, {"cell": math.nan}, {"clearance": 0.0}, {"margin": -1.0}, {"cell": 0.01}],
)
def test_bad_grids_are_refused(change):
    with pytest.raises(PlanningError, match=f"{next(iter(change))} = "):
        Obstacles.open((400.0, 400.0), **{"altitude": 9.0, "clearance": 1.0, **change})


def test_planners_are_found_by_name():
    with pytest.raises(PlanningError, match="planner = 'swarm': expected one of astar"):
        plan(Problem((9.0, 9.0, 0.0), (99.0, 9.0), 5.0, open_air()), "swarm")
    assert "astar" in planner_names()
    with pytest.raises(ValueError, match="registered already"):
        planner("astar")(lambda problem, rng: None)


def test_commands_fly_the_plan():
    found = plan(Problem((20.0, 200.0, 0.0), (380.0, 200.0), 15.0, slalom()[0]))
    told = found.commands(15.0, 50.0)
    assert sum(seconds for _, seconds in told) == pytest.approx(found.length / 15.0)
    way = 0.0
    for command, seconds in told:
        x, y, _ = found.at(np.array([way + 0.5 * seconds * 15.0]))[0]
        if isinstance(command, FlyOrbit):
            apart = math.hypot(x - command.center[0], y - command.center[1])
            assert apart == pytest.approx(command.radius) == pytest.approx(15.0)
        else:
            line = shapely.LineString([command.start, command.end])
            assert line.distance(shapely.Point(x, y)) < 1e-6
        way += seconds * 15.0


REAL = ["Boston_0_512.map", "Milan_0_512.map", "helsinki_centre_buildings.geojson"]


def real(name):
    path = SHARED / ("maps" if name.endswith(".map") else "footprints") / name
    if not path.exists():
        pytest.skip(f"shared data absent: {name}")
    if name.endswith(".map"):
        return City.from_grid(path, cell=2.0, heights=(10.0, 40.0), seed=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return City.from_geojson(path, heights=(10.0, 40.0), size=(1000.0, 1000.0))


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize(("share", "radius"), [(0.0, 15.0), (0.5, 33.0)])
def test_real_cities_are_flown_through(name, share, radius):
    city = real(name)
    altitude = share * city.tallest
    obstacles = Obstacles.from_city(city, altitude=altitude, clearance=CLEARANCE)
    rng = np.random.default_rng(1)
    answers = [(p, plan(p)) for p in (random_problem(obstacles, radius, rng) for _ in range(20))]
    walls = tall(city, altitude)
    for problem, found in answers:
        assert found.work <= 400_000
        if found:
            check(found, problem, walls)
    assert sum(bool(found) for _, found in answers) >= 5
    again = plan(answers[0][0])
    assert bool(again) == bool(answers[0][1])
    if again:
        assert again.pieces.tobytes() == answers[0][1].pieces.tobytes()


def reference(problem, courses=16, step=4.0, fine=1.5):
    """A slow search without a heuristic, on finer cells, its walls polygons: the least length.

    From every pose it reaches it tries the Dubins path to the goal.
    """
    grid, radius = problem.obstacles, problem.turn_radius
    rows, columns = np.nonzero(grid.blocked)
    x, y = grid.west + grid.cell * columns, grid.south + grid.cell * rows
    walls = shapely.union_all(shapely.box(x, y, x + grid.cell, y + grid.cell))
    shapely.prepare(walls)
    area = shapely.box(*(np.array([0, 0, *grid.state.shape[::-1]]) * grid.cell))
    shapely.prepare(area)

    def free(points):
        line = shapely.LineString(points)
        return area.contains(line) and not walls.intersects(line)

    def arc(x, y, course, bend, length):
        ways = np.linspace(0.0, length, 12)
        return np.array([advanced(x, y, course, bend, s)[:2] for s in ways])

    turn = 2.0 * math.pi / courses
    queue, done, best = [(0.0, 0, problem.start, 0)], set(), math.inf
    number = 1
    while queue:
        spent, _, pose, k = heapq.heappop(queue)
        key = (int(pose[0] / fine), int(pose[1] / fine), k)
        if key in done or spent >= best:
            continue
        done.add(key)
        length, word, *parts = shot(*pose, *problem.goal, radius)
        if spent + length < best:
            at, points = pose, []
            for side, part in zip(TURNS[word], parts, strict=True):
                points.append(arc(*at, side / radius, part * radius))
                at = advanced(*at, side / radius, part * radius)
            if free(np.concatenate(points)):
                best = spent + length
        for side in (-1, 0, 1):
            bend, length = side / radius, radius * turn if side else step
            if free(arc(*pose, bend, length)):
                after = advanced(*pose, bend, length)
                heapq.heappush(queue, (spent + length, number, after, (k + side) % courses))
                number += 1
    return best


@pytest.mark.parametrize("seed", [1, 2])
def test_hardly_longer_than_an_exhaustive_search_finds(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(12.0, 68.0, (3, 2))
    houses = [shapely.box(x, y, x + 9.0, y + 14.0) for x, y in corners]
    air = Obstacles.open((80.0, 80.0), altitude=9.0, clearance=1.0)
    problem = random_problem(air.with_shapes(houses, 1), 8.0, rng)
    exact, found = reference(problem), plan(problem)
    assert bool(found) == math.isfinite(exact)
    if found:
        assert found.length <= 1.05 * exact
