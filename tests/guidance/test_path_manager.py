"""The path manager: when it switches, and that random missions are flown as they were drawn."""

import math

import numpy as np
import pytest
import shapely
from flown_paths import AIRFRAME, fly_paths, random_routes, winds_from_all_sides

from amounts import amount
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyLine, FlyOrbit
from staniel.guidance import PathState, dubins_path, follow, waypoint_path
from staniel.guidance.paths import Arc, Straight

MISSIONS = amount(40, full=100)
CORNER = [[0.0, 0.0], [200.0, 0.0], [200.0, 200.0]]
OVER = waypoint_path(CORNER, AIRFRAME)


def leg_at(path, x, y, state=None, **how):
    return follow(path, Pose(x, y, 80.0, 0.0, 0.0, 15.0), state or PathState(), lead=0.0, **how)[
        1
    ].leg


# When it switches.


@pytest.mark.parametrize("x", [150.0, 190.0, 199.0, 201.0, 210.0])
@pytest.mark.parametrize("y", [-20.0, 0.0, 20.0])
def test_a_corner_is_passed_in_the_bisecting_half_plane(x, y):
    """Of a right angle to the left: x + y > 200, from one turn radius before the waypoint."""
    expected = int(x - 200.0 + y >= 0.0 and x >= 200.0 - AIRFRAME.min_turn_radius)
    assert leg_at(OVER, x, y) == expected


@pytest.mark.parametrize(("x", "y"), [(171.0, 0.0), (169.0, 0.0), (195.0, -29.0), (205.0, -30.0)])
def test_a_ball_is_entered_before_the_half_plane(x, y):
    expected = int(math.hypot(x - 200.0, y) <= 30.0)
    assert leg_at(OVER, x, y, ball=30.0) == expected
    assert leg_at(OVER, x, y) == 0


def test_a_ball_that_is_missed_does_not_hold_the_aircraft():
    assert leg_at(OVER, 230.0, -20.0, ball=5.0) == 1


@pytest.mark.parametrize("turn_deg", [170.0, 179.99, 180.0, -180.0, -175.0])
def test_beside_a_leg_to_a_sharp_corner_the_waypoint_is_not_reached(turn_deg):
    turn = math.radians(turn_deg)
    back = [300.0 + 300.0 * math.cos(turn), 300.0 * math.sin(turn)]
    path = waypoint_path([[0.0, 0.0], [300.0, 0.0], back], AIRFRAME)
    for aside in (-40.0, -1.0, 1.0, 40.0):
        assert leg_at(path, 100.0, aside) == 0
    assert leg_at(path, 301.0, 0.5 * math.copysign(1.0, turn)) == 1


def test_legs_in_line_are_switched_at_the_waypoint():
    path = waypoint_path([[0.0, 0.0], [100.0, 0.0], [200.0, 0.0]], AIRFRAME, radius=50.0)
    assert len(path.legs) == 2
    assert (leg_at(path, 99.0, 5.0), leg_at(path, 101.0, 5.0)) == (0, 1)


def test_a_fillet_is_entered_and_left_where_it_touches():
    path = waypoint_path(CORNER, AIRFRAME, radius=50.0)
    assert (leg_at(path, 149.0, 2.0), leg_at(path, 151.0, 2.0)) == (0, 1)
    pose = Pose(151.0, 0.0, 80.0, 0.0, 0.0, 15.0)
    command, state = follow(path, pose, lead=0.0)
    assert isinstance(command, FlyOrbit)
    np.testing.assert_allclose(command.center, [150.0, 50.0])
    assert (command.radius, command.turn) == (50.0, 1)
    assert leg_at(path, 199.0, 49.0, state) == 1
    assert leg_at(path, 199.0, 51.0, state) == 2


def test_more_than_half_a_circle_is_turned_to_its_end():
    """Where the plain half-plane of its end holds the aircraft already at its beginning."""
    path = dubins_path([[0.0, 0.0, 0.0], [-10.0, 20.0, 0.0]], AIRFRAME, radius=50.0)
    (longest,) = (i for i, leg in enumerate(path.legs) if leg.length > 50.0 * math.pi)
    assert isinstance(path.legs[longest], Arc)
    state, order = PathState(), []
    for x, y, _ in path.places(5.0):
        _, state = follow(path, Pose(x, y, 80.0, 0.0, 0.0, 15.0), state, lead=0.0)
        order.append(state.leg)
    assert order == sorted(order)
    legs = np.bincount(order, minlength=len(path.legs))
    assert legs[longest] * 5.0 == pytest.approx(path.legs[longest].length, abs=15.0)


def test_the_lead_counts_in_steps_as_they_were_flown():
    path = waypoint_path(CORNER, AIRFRAME, radius=50.0)
    pose = Pose(130.0, 0.0, 80.0, 0.0, 0.0, 15.0)
    for x, lead, leg in ((141.0, 1.0, 1), (139.0, 1.0, 0), (139.0, 1.5, 1), (149.0, 0.0, 0)):
        _, state = follow(path, pose, lead=lead)
        _, state = follow(path, pose._replace(x=x), state, lead=lead)
        assert state.leg == leg


def test_the_end_is_circled():
    command, state = follow(OVER, Pose(200.0, 201.0, 80.0, 1.57, 0.0, 15.0), PathState(leg=1))
    assert state.leg == 2
    assert isinstance(command, FlyOrbit)
    assert command.center == (200.0, 200.0)
    assert command.radius > AIRFRAME.min_turn_radius
    again, _ = follow(OVER, Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), state)
    assert again == command


def test_it_is_a_pure_function():
    pose = Pose(150.0, 3.0, 80.0, 0.0, 0.0, 15.0)
    before = PathState(last=(140.0, 3.0))
    assert follow(OVER, pose, before) == follow(OVER, pose, before)
    assert before == PathState(last=(140.0, 3.0))
    assert follow(OVER, pose)[0] == FlyLine((0.0, 0.0), (200.0, 0.0), 15.0, 80.0)


@pytest.mark.parametrize(
    ("pose", "state", "how", "message"),
    [
        (Pose(math.nan, 0.0, 80.0, 0.0, 0.0, 15.0), PathState(), {}, "pose = .*finite"),
        (Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), PathState(), {"ball": 0.0}, "ball = 0.0"),
        (Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), PathState(), {"lead": -1.0}, "lead = -1.0"),
        (
            Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0),
            PathState(leg=3),
            {},
            "state.leg = 3: expected 0 to 2",
        ),
    ],
)
def test_nonsense_is_refused(pose, state, how, message):
    with pytest.raises(ValueError, match=message):
        follow(OVER, pose, state, **how)


# Random missions in the real kernel.


def along(path, way):
    """Of a flown way: greatest distance from the path before its end, and its own length."""
    line = shapely.LineString(path.places(2.0)[:, :2]).simplify(0.02)
    places = shapely.points(way[::3, :2])
    inside = shapely.line_locate_point(line, places) < line.length - 1e-6
    off = shapely.distance(places, line)
    return off[inside].max(), np.hypot(*np.diff(way[:, :2], axis=0).T).sum()


@pytest.mark.parametrize(
    ("wind", "radius", "following"),
    [
        (0.0, 50.0, "carrot"),
        (0.0, 50.0, "vector-field"),
        (7.5, 90.0, "carrot"),
        (7.5, 90.0, "vector-field"),
    ],
)
def test_random_missions_with_fillets_are_flown_as_drawn(wind, radius, following):
    """Without wind within 2 m, in half the airspeed within 8; at most 1 % longer than drawn."""
    routes = random_routes(7, MISSIONS)
    paths = [waypoint_path(route, AIRFRAME, radius=radius) for route in routes]
    ways, _ = fly_paths(paths, winds_from_all_sides(MISSIONS, wind), following=following)
    within = 2.0 if wind == 0.0 else 8.0
    for path, route, way in zip(paths, routes, ways, strict=True):
        off, length = along(path, way)
        assert off < within
        assert -0.002 * path.length < length - path.length < 0.01 * path.length
        # Corners are cut by no more than their fillet, and the last waypoint is reached.
        flown = shapely.LineString(way[:, :2])
        line = shapely.LineString(path.places(2.0)[:, :2])
        for place in map(shapely.Point, route):
            assert place.distance(flown) < place.distance(line) + within
        assert flown.distance(shapely.Point(route[-1])) < 3.0


@pytest.mark.parametrize("wind", [0.0, 7.5])
def test_random_missions_pass_over_every_waypoint(wind):
    routes = random_routes(8, MISSIONS, sharpest=math.pi)
    paths = [waypoint_path(route, AIRFRAME) for route in routes]
    ways, log = fly_paths(paths, winds_from_all_sides(MISSIONS, wind))
    for route, way in zip(routes, ways, strict=True):
        flown = shapely.LineString(way[:, :2])
        assert max(flown.distance(shapely.Point(place)) for place in route) < 1.0
    for i in range(MISSIONS):
        legs = [states[i].leg for states in log]
        assert legs == sorted(legs)
        assert set(legs) == set(range(len(paths[i].legs) + 1))


def test_a_ball_is_reached_by_every_mission():
    routes = random_routes(9, 30)
    paths = [waypoint_path(route, AIRFRAME) for route in routes]
    ways, _ = fly_paths(paths, np.zeros((30, 2)), ball=40.0)
    exact, _ = fly_paths(paths, np.zeros((30, 2)))
    for route, way, over in zip(routes, ways, exact, strict=True):
        flown = shapely.LineString(way[:, :2])
        assert max(flown.distance(shapely.Point(place)) for place in route) <= 40.0
        assert len(way) < len(over)


@pytest.mark.parametrize(("wind", "radius"), [(0.0, 45.0), (5.0, 85.0)])
def test_dubins_missions_meet_their_poses(wind, radius):
    routes = random_routes(10, 60, corners=3, legs=(150.0, 400.0))
    headings = np.random.default_rng(1).uniform(-math.pi, math.pi, routes.shape[:2])
    paths = [
        dubins_path(np.column_stack(rows), AIRFRAME, radius=radius)
        for rows in zip(routes, headings, strict=True)
    ]
    ways, _ = fly_paths(paths, winds_from_all_sides(60, wind))
    offs = []
    for path, route, way in zip(paths, routes, ways, strict=True):
        off, length = along(path, way)
        offs.append(off)
        assert off < 25.0
        assert abs(length - path.length) < 0.03 * path.length + 15.0
        flown = shapely.LineString(way[:, :2])
        assert flown.distance(shapely.Point(route[-1])) < 12.0
    assert np.median(offs) < 6.0


def test_short_legs_are_flown_in_the_answer_that_was_chosen():
    """Fillets shrunk to fit, then flown over; a reversal; each mission still comes to its end."""
    route = [[0, 0], [300, 0], [300, 75], [0, 75], [0, 110], [300, 110], [100, 110], [100, 400]]
    path = waypoint_path(route, AIRFRAME, radius=60.0)
    radii = [leg.radius for leg in path.legs if not isinstance(leg, Straight)]
    assert min(radii) < 60.0
    over = [leg for leg in path.legs[:-1] if isinstance(leg, Straight) and leg.waypoint]
    assert len(over) == len(route) - 2 - len(radii)
    assert over
    ((way,), _) = fly_paths([path], np.zeros((1, 2)))
    flown = shapely.LineString(way[:, :2])
    assert flown.distance(shapely.Point(route[-1])) < 1.0
    for leg in over:
        assert flown.distance(shapely.Point(leg.end)) < 5.0


def test_heights_are_flown():
    rng = np.random.default_rng(5)
    routes = random_routes(11, 40, sharpest=0.5)  # they do not cross themselves
    paths = []
    for route in routes:
        climbs = rng.uniform(-1.2, 1.2, len(route) - 1) / 15.0
        up = 200.0 + np.concatenate(
            [[0.0], np.cumsum(climbs * np.hypot(*np.diff(route, axis=0).T))]
        )
        paths.append(waypoint_path(np.column_stack([route, up]), AIRFRAME, radius=50.0))
    ways, _ = fly_paths(paths, np.zeros((40, 2)))
    for path, way in zip(paths, ways, strict=True):
        line = shapely.LineString(path.places(2.0)[:, :2])
        station = shapely.line_locate_point(line, shapely.points(way[::5, :2]))
        error = way[::5, 2] - np.array([path.height(s) for s in station])
        assert np.abs(error[12:]).max() < 3.0
        assert np.median(np.abs(error)) < 0.6
