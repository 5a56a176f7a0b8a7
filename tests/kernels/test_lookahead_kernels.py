"""The look-ahead's kernels against the flight dynamics, slow oracles and brute force."""

import itertools
import math

import numpy as np
import pytest
import shapely
from scipy.spatial.transform import Rotation

from staniel.city import City
from staniel.datatypes.equipment import Camera
from staniel.kernels.flight import BANKS, COMMAND_WIDTH, fly
from staniel.kernels.footprint import BODY
from staniel.kernels.forecast import discredit, forecast
from staniel.kernels.lookahead import plan
from staniel.kernels.lookout import Eye, no_regions, roll_out, shade, watch
from staniel.kernels.moves import entry_of, nearest, new_moves
from staniel.kernels.outlook import (
    REACH,
    RING,
    RINGS,
    SIZE,
    Outlook,
    free_shares,
    new_outlook,
    outlook,
)
from staniel.kernels.risk import Regions
from staniel.kernels.scene import Search
from staniel.kernels.sightlines import AIR, GROUND, SLOTS, new_sightlines, sees, slot_of
from staniel.kernels.walls import inside_points, line_of_sight

ROLL_GAIN, ROLL_RATE, SPEED = 3.0, math.radians(60.0), 15.0
LIMIT = math.radians(35.0)
EYE = Eye(BODY, math.radians(60.0), 250.0)
OPEN = City.open((600.0, 600.0))


def flown(start, banks, dt=0.1):
    """Poses every 0.5 s of the autopilot's own flight, one second a bank."""
    limits = np.array([[11.0, 20.0, 1.5, 3.0, 0.7, ROLL_RATE, ROLL_GAIN, 1.2, 1.0, 1.0, 0.25]])
    command = np.zeros((1, COMMAND_WIDTH))
    command[0, :3] = BANKS, SPEED, start[2]
    command[0, 3:5] = 1.0, len(banks)
    command[0, 5 : 5 + len(banks)] = banks
    steps = round(len(banks) / dt)
    path, _ = fly(
        start[None].copy(), np.zeros(1), command, limits, np.zeros((steps, 1, 2)), dt, steps
    )
    return np.concatenate((start[None], path[round(0.5 / dt) - 1 :: round(0.5 / dt), 0]))


def axis_of(heading, bank):
    """Camera axis by rotation matrices, thesis eq. 4.2 (corrected)."""
    c, s = math.cos(heading), math.sin(heading)
    yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    c, s = math.cos(-bank), math.sin(-bank)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return yaw @ roll @ np.array([0.0, 0.0, -1.0])


def hidden(city, eye, point):
    """Whether a building stands between, by its outline and the height of the line over it."""
    line = shapely.LineString([eye[:2], point[:2]])
    for outline, roof in zip(city.outlines, city.heights, strict=True):
        part = line.intersection(outline)
        if part.is_empty or part.length < 1e-9:
            continue
        shares = [
            line.project(shapely.Point(p)) / line.length for p in shapely.get_coordinates(part)
        ]
        if min(eye[2] + t * (point[2] - eye[2]) for t in shares) < roof:
            return True
    return False


def in_view(pose, point, half_aperture=EYE.half_aperture, reach=EYE.reach, axis=None):
    way = np.asarray(point) - pose[:3]
    distance = np.linalg.norm(way)
    axis = axis_of(pose[3], pose[4]) if axis is None else axis
    return distance <= reach and math.acos(min(1.0, way @ axis / distance)) <= half_aperture


def gimbal_axis(pose, point, limit):
    """Towards a point on the ground, or turned towards it by the limit from body-down."""
    down = axis_of(pose[3], pose[4])
    wish = np.array([*point, 0.0]) - pose[:3]
    wish /= np.linalg.norm(wish)
    if math.acos(np.clip(wish @ down, -1.0, 1.0)) <= limit:
        return wish
    normal = np.cross(down, wish)
    return Rotation.from_rotvec(normal / np.linalg.norm(normal) * limit).apply(down)


def gimbal(half_aperture_deg=25.0, limit_deg=40.0):
    camera = Camera(mount="gimbal", gimbal_limit_deg=limit_deg)
    return Eye(camera.mounting, math.radians(half_aperture_deg), EYE.reach)


NO_HOPE = Outlook(np.zeros((SIZE, SIZE, 5)), LIMIT, 1.0, 0.0)
"""After its end a flight is worth nothing."""


def search(banks=(-LIMIT, 0.0, LIMIT), eye=EYE, **changes):
    moves = new_moves(np.array(banks), 8, SPEED, ROLL_GAIN, ROLL_RATE, 0.5, 2, eye.mount)
    usual = Search(moves, 3, 2, 0.5, 200, 0.9, 0.0, 0, NO_HOPE)
    return usual._replace(**changes)


def outlook_of(height=60.0, reach=EYE.reach, discount=0.9, free=None):
    eye, shares = EYE._replace(reach=reach), np.ones(RINGS) if free is None else free
    banks = LIMIT * np.linspace(-1.0, 1.0, 5)
    return new_outlook(
        eye, shares, height - 1.0, SPEED, banks, ROLL_GAIN, ROLL_RATE, 0.5, 2, discount
    )


def slots_of(memory, places):
    return np.array([slot_of(memory, x, y) for x, y in places])


@pytest.mark.parametrize("seed", range(5))
def test_a_roll_out_is_what_the_autopilot_flies(seed):
    rng = np.random.default_rng(seed)
    banks = rng.uniform(-LIMIT, LIMIT, 12)
    start = np.array([10.0, 20.0, 80.0, rng.uniform(-3, 3), rng.uniform(-0.5, 0.5), SPEED])
    ours = roll_out(start, banks, 1.0, 0.0, 24, 0.5, ROLL_GAIN, ROLL_RATE)
    theirs = flown(start, banks)
    np.testing.assert_allclose(ours[:, :2], theirs[:, :2], atol=0.3)
    turned = np.angle(np.exp(1j * (ours[:, 3] - theirs[:, 3])))
    np.testing.assert_allclose(turned, 0.0, atol=0.005)
    np.testing.assert_allclose(ours[:, 4], theirs[:, 4], atol=1e-9)


def test_a_roll_out_of_an_old_plan_goes_on_from_where_its_flyer_is_now():
    start, banks = np.array([0.0, 0.0, 80.0, 0.0, 0.0, SPEED]), np.array([0.5, -0.5, 0.2])
    whole = roll_out(start, banks, 1.0, 0.0, 10, 0.5, ROLL_GAIN, ROLL_RATE)
    later = roll_out(start, banks, 1.0, 2.0, 6, 0.5, ROLL_GAIN, ROLL_RATE)
    np.testing.assert_allclose(later, whole[4:])


def test_what_a_pose_sees_is_what_rotation_matrices_and_shapely_say():
    city = City.generate(size=(200.0, 200.0), density=0.5, block=(40.0, 60.0), seed=3)
    memory, rng = new_sightlines(60.0, 1.0), np.random.default_rng(1)
    both = set()
    for _ in range(300):
        place = rng.uniform(20.0, 180.0, 2)
        memory.owners[:] = -1
        # From the middle of an air cell the memory is exact.
        x, y = place + (rng.integers(-12, 12, 2) + 0.5) * AIR
        heading, bank = rng.uniform(-math.pi, math.pi), rng.uniform(-LIMIT, LIMIT)
        point = (*place, 1.0)
        pose = np.array([x, y, 60.0, heading, bank])
        buried = any(shapely.contains_xy(o, *place) for o in city.outlines)
        expected = in_view(pose, point) and not buried and not hidden(city, pose[:3], point)
        seen = watch(
            memory, city.walls, EYE, slots_of(memory, [place]), place[None], np.array([0.7]),
            x, y, tuple(axis_of(heading, bank)),
        )  # fmt: skip
        assert seen == pytest.approx(0.7 * expected)
        both.add(expected)
    assert both == {True, False}


def test_cells_that_share_a_slot_evict_each_other_and_never_answer_for_each_other():
    wall = City.from_outlines([shapely.box(95.0, 0.0, 105.0, 600.0)], [300.0], (600.0, 600.0))
    memory = new_sightlines(50.0, 1.0)
    near, far = (90.0, 50.0), (90.0 + SLOTS * GROUND, 50.0)
    slots = set()
    for place, free in ((near, False), (far, True), (near, False)):
        slot = slot_of(memory, *place)
        slots.add(slot)
        assert sees(memory, wall.walls, slot, place[0] + 20.0, 50.0) == free
    assert len(slots) == 1


def test_sight_from_beyond_the_remembered_air_is_looked_up_exactly():
    city, memory = City.generate(seed=2), new_sightlines(45.0, 1.0)
    rng = np.random.default_rng(0)
    for _ in range(200):
        place = rng.uniform(0.0, 600.0, 2)
        slot = slot_of(memory, *place)
        x, y = memory.places[slot] + 160.0 * rng.choice([-1.0, 1.0], 2)
        exact = line_of_sight(city.walls, *memory.places[slot], 1.0, x, y, 45.0)
        assert sees(memory, city.walls, slot, x, y) == exact


def test_a_forecast_goes_straight_in_the_open_and_never_enters_a_building():
    cloud = np.array([[100.0, 100.0, 2.0, 0.0], [300.0, 300.0, -1.0, 1.0], [50.0, 50.0, 0.0, 0.0]])
    places = forecast(OPEN.walls, cloud, 10, 0.5)
    times = 0.5 * np.arange(11)[:, None, None]
    np.testing.assert_allclose(places, cloud[None, :, :2] + times * cloud[None, :, 2:], atol=1e-9)

    city, rng = City.generate(density=0.6, block=(45.0, 95.0), seed=5), np.random.default_rng(0)
    spots = rng.uniform(10.0, 590.0, (2000, 2))
    spots = spots[~inside_points(city.walls, spots)][:300]
    angles = rng.uniform(-math.pi, math.pi, len(spots))
    velocities = 2.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    cloud = np.concatenate((spots, velocities), axis=1)
    places = forecast(city.walls, cloud, 24, 0.5)
    assert not inside_points(city.walls, np.ascontiguousarray(places.reshape(-1, 2))).any()
    # They keep moving: a straight line would have taken many of them into walls.
    moved = np.linalg.norm(places[-1] - places[0], axis=1)
    straight = inside_points(city.walls, np.ascontiguousarray(spots + 12.0 * velocities))
    assert straight.mean() > 0.3
    assert np.median(moved[straight]) > 5.0


def test_looks_in_vain_take_weight_from_what_they_would_have_shown():
    rng, n = np.random.default_rng(4), 200
    cloud = np.concatenate((rng.uniform(0.0, 300.0, (n, 2)), rng.normal(0.0, 1.0, (n, 2))), axis=1)
    weights = np.full(n, 1.0 / n)
    looks = np.array(
        [
            [7.0, 100.0, 100.0, 60.0, 0.3, 0.4, 70.0, 160.0],
            [9.0, 180.0, 90.0, 60.0, 1.0, -0.2, 180.0, 120.0],
        ]
    )
    for eye in (EYE, gimbal(40.0, 50.0)):
        expected, left = weights.copy(), weights.copy()
        for look in looks:
            swings = eye is not EYE
            axis = gimbal_axis(look[1:], look[6:], math.radians(50.0)) if swings else None
            for i in range(n):
                place = cloud[i, :2] - (10.0 - look[0]) * cloud[i, 2:]
                seen = in_view(look[1:], (*place, 1.0), eye.half_aperture, axis=axis)
                expected[i] *= 0.1 if seen else 1.0
        discredit(OPEN.walls, cloud, left, 10.0, looks, eye.mount, 1.0, *eye[1:], 0.1)
        np.testing.assert_allclose(left, expected / expected.sum(), rtol=1e-9)
        assert len(np.unique(np.round(left / left.max(), 6))) == 3


def test_a_search_finds_what_trying_every_sequence_finds():
    rng = np.random.default_rng(7)
    for _ in range(6):
        start = np.array([300.0, 300.0, 50.0, rng.uniform(-3, 3), rng.uniform(-0.5, 0.5), SPEED])
        places = np.tile(rng.uniform(200.0, 400.0, (1, 5, 2)), (7, 1, 1))
        weights = np.tile(rng.uniform(0.1, 0.3, (1, 5)), (7, 1))

        def worth(banks, start=start, places=places, weights=weights):
            total = 0.0
            for t, pose in enumerate(flown(start, banks)[1:], start=1):
                seen = [in_view(pose, (*p, 1.0)) for p in places[t]]
                total += 0.9 ** (0.5 * t) * 0.5 * (weights[t] @ seen)
            return total

        best = max(worth(banks) for banks in itertools.product((-LIMIT, 0.0, LIMIT), repeat=3))
        banks, value = plan(
            OPEN.walls, new_sightlines(50.0, 1.0), EYE, search(), *no_regions(), start, places,
            weights, np.zeros(3),
        )  # fmt: skip
        assert value == pytest.approx(worth(banks), abs=0.05)
        assert value >= best - 0.05
        polished = plan(
            OPEN.walls, new_sightlines(50.0, 1.0), EYE, search(polish=3), *no_regions(), start,
            places, weights, np.zeros(3),
        )[1]  # fmt: skip
        assert polished >= value


@pytest.mark.parametrize("limit", [20.0, 60.0])
def test_a_gimbal_is_scored_by_its_own_axis(limit):
    """It looks at the mean of the places at each instant, within its swing."""
    rng, eye = np.random.default_rng(11), gimbal(25.0, limit)
    far, near = 0, 0
    for _ in range(6):
        start = np.array([300.0, 300.0, 50.0, rng.uniform(-3, 3), rng.uniform(-0.5, 0.5), SPEED])
        cluster = rng.uniform(240.0, 360.0, 2) + rng.uniform(-30.0, 30.0, (5, 2))
        places = cluster + 3.0 * np.arange(7)[:, None, None]
        weights = np.tile(rng.uniform(0.1, 0.3, (1, 5)), (7, 1))

        def worth(banks, start=start, places=places, weights=weights):
            total = 0.0
            for t, pose in enumerate(flown(start, banks)[1:], start=1):
                axis = gimbal_axis(pose, places[t].mean(axis=0), math.radians(limit))
                seen = [in_view(pose, (*p, 1.0), eye.half_aperture, axis=axis) for p in places[t]]
                total += 0.9 ** (0.5 * t) * 0.5 * (weights[t] @ seen)
            return total

        best = max(worth(banks) for banks in itertools.product((-LIMIT, 0.0, LIMIT), repeat=3))
        for polish in (0, 2):
            banks, value = plan(
                OPEN.walls, new_sightlines(50.0, 1.0), eye,
                search(eye=eye, polish=polish), *no_regions(), start, places, weights, np.zeros(3),
            )  # fmt: skip
            assert value == pytest.approx(worth(banks), abs=0.06)
            assert value >= best - 0.06
        far, near = far + (best > 0.0), near + (best < 2.0)
    assert far > 0
    assert near > 0


def test_the_outlook_of_a_gimbal_ends_where_its_swing_and_cone_do():
    """Level and far away, what it may hope for is what its limit lets it see."""
    narrow, wide = (
        new_outlook(
            gimbal(25.0, limit), np.ones(RINGS), 50.0, SPEED, LIMIT * np.linspace(-1.0, 1.0, 5),
            ROLL_GAIN, ROLL_RATE, 0.5, 2, 0.9,
        )
        for limit in (20.0, 60.0)
    )  # fmt: skip
    # Seen for ever: the sum of 0.9^t over half seconds. It keeps a target in a cone of 85 degrees.
    always = 0.5 / (0.9**-0.5 - 1.0)
    assert outlook(wide, 0.0, 0.0, 0.0) == pytest.approx(always, rel=0.01)
    assert outlook(narrow, 0.0, 0.0, 0.0) < 0.8 * always
    assert (wide.values >= narrow.values - 1e-9).all()


def crossing(regions, rates, city=OPEN, start=(100.0, 300.0, 30.0, 0.0, 0.0, SPEED), holds=8):
    """The way of a plan towards a target so far east that straight ahead is best."""
    places = np.full((2 * holds + 1, 1, 2), (450.0, 300.0))
    weights = np.ones(places.shape[:2])
    begin = np.array(start)
    sought = search(holds=holds, beyond=outlook_of(start[2]))
    banks, _ = plan(
        city.walls, new_sightlines(start[2], 1.0), EYE, sought, regions, rates,
        begin, places, weights, np.zeros(holds),
    )  # fmt: skip
    if not banks.size:
        return None
    return shapely.LineString(
        roll_out(begin, banks, 1.0, 0.0, 2 * holds, 0.5, 3.0, ROLL_RATE)[:, :2]
    )


def test_no_fly_regions_and_buildings_are_flown_around_and_threats_where_it_pays():
    disc = shapely.Point(175.0, 300.0).buffer(25.0)
    assert crossing(*no_regions()).intersects(disc)
    box = np.array([[150.0, 200.0, 275.0, 325.0, 0.0, np.inf]])
    region = Regions(box, np.array([[175.0, 300.0, 25.0]]), np.array([0, 0]), np.zeros((0, 2)))
    for rate in (np.inf, 10.0):
        way = crossing(region, np.array([rate]))
        # Looked at every half a second, 7.5 m: a corner of the disc may be cut.
        assert way.intersection(disc.buffer(-2.0)).length == 0.0
    assert crossing(region, np.array([1e-6])).intersects(disc)
    tower = shapely.box(160.0, 285.0, 190.0, 315.0)
    city = City.from_outlines([tower], [100.0], (600.0, 600.0))
    assert not crossing(*no_regions(), city=city).intersects(tower.buffer(3.0))


def test_no_plan_where_every_flight_ends_in_a_building():
    ring = shapely.box(50.0, 250.0, 150.0, 350.0) - shapely.box(90.0, 290.0, 110.0, 310.0)
    city = City.from_outlines([ring], [100.0], (600.0, 600.0))
    assert crossing(*no_regions(), city=city) is None


def test_what_a_partner_sees_counts_for_little():
    poses = roll_out(
        np.array([0.0, 0.0, 50.0, 0.0, 0.0, SPEED]), np.zeros(1), 1.0, 0.0, 12, 0.5, 3.0, 1.0
    )
    places = np.tile(np.array([[[90.0, 0.0], [90.0, 200.0]]]), (13, 1, 1))
    weights = np.full((13, 2), 0.5)
    shade(OPEN.walls, EYE, poses, places, weights, 1.0, 0.9)
    for t, pose in enumerate(poses):
        for j in range(2):
            seen = in_view(pose, (*places[t, j], 1.0))
            assert weights[t, j] == pytest.approx(0.05 if seen else 0.5)
    assert 0.05 < weights[:, 0].mean() < 0.5
    assert (weights[:, 1] == 0.5).all()
    eye, weights = gimbal(20.0, 30.0), np.full((13, 2), 0.5)
    places = np.tile(np.array([[[90.0, 0.0], [70.0, 20.0]]]), (13, 1, 1))
    shade(OPEN.walls, eye, poses, places, weights, 1.0, 0.9)
    for t, pose in enumerate(poses):
        axis = gimbal_axis(pose, places[t].mean(axis=0), math.radians(30.0))
        for j in range(2):
            seen = in_view(pose, (*places[t, j], 1.0), eye.half_aperture, axis=axis)
            assert weights[t, j] == pytest.approx(0.05 if seen else 0.5)
    assert set(np.round(weights.ravel(), 9)) == {0.05, 0.5}


@pytest.mark.parametrize("seed", range(3))
def test_the_table_of_moves_is_what_a_roll_out_flies(seed):
    rng = np.random.default_rng(seed)
    moves = new_moves(
        LIMIT * np.linspace(-1.0, 1.0, 5), 4, SPEED, ROLL_GAIN, ROLL_RATE, 0.5, 2, BODY
    )
    for _ in range(50):
        bank, k = rng.uniform(-LIMIT, LIMIT), rng.integers(17)
        assert nearest(moves, moves.banks).tolist() == list(range(17))
        start = np.array([0.0, 0.0, 60.0, 0.0, bank, SPEED])
        poses = roll_out(start, moves.banks[k : k + 1], 1.0, 0.0, 2, 0.5, ROLL_GAIN, ROLL_RATE)
        entry, share = entry_of(moves, bank)
        ends = (1.0 - share) * moves.ends[entry, k] + share * moves.ends[entry + 1, k]
        np.testing.assert_allclose(ends[:, :2], poses[1:, :2], atol=0.01)
        np.testing.assert_allclose(ends[:, [2, 5]], poses[1:, 3:5], atol=0.003)
        for end, pose in zip(ends, poses[1:], strict=True):
            axis = (moves.forward, end[6], end[7])
            np.testing.assert_allclose(axis, axis_of(0.0, pose[4]), atol=0.003)
            np.testing.assert_allclose(end[3:5], (np.cos(pose[3]), np.sin(pose[3])), atol=0.003)


def test_an_outlook_is_what_flying_by_it_brings_and_nobody_does_better():
    """Over flat ground: greedy flights on the table earn it, random and fixed ones less."""
    rng, discount = np.random.default_rng(3), 0.9
    table = outlook_of(discount=discount)
    banks = LIMIT * np.linspace(-1.0, 1.0, 5)

    def after(pose, bank):
        return roll_out(pose, np.array([bank]), 1.0, 0.0, 2, 0.5, ROLL_GAIN, ROLL_RATE)[1:]

    def gain(poses):
        seen = [in_view(pose, (0.0, 0.0, 1.0)) for pose in poses]
        return 0.5 * (discount**0.5 * seen[0] + discount * seen[1])

    def hope(pose):
        c, s = math.cos(pose[3]), math.sin(pose[3])
        return outlook(table, -c * pose[0] - s * pose[1], s * pose[0] - c * pose[1], pose[4])

    def earned(pose, choose):
        total = 0.0
        for k in range(60):
            poses = after(pose, choose(pose, k))
            total, pose = total + discount**k * gain(poses), poses[-1]
        return total

    def greedy(pose, _):
        flights = [(after(pose, bank), bank) for bank in banks]
        return max(flights, key=lambda f: gain(f[0]) + discount * hope(f[0][-1]))[1]

    promised, kept = [], []
    for _ in range(12):
        start = np.array([*rng.uniform(-150.0, 150.0, 2), 60.0, rng.uniform(-3, 3), 0.0, SPEED])
        promised.append(hope(start))
        kept.append(earned(start, greedy))
        for _ in range(4):
            hold = rng.choice(banks, 20)
            assert earned(start, lambda pose, k, hold=hold: hold[k // 3]) < promised[-1] + 0.3
        assert earned(start, lambda pose, k: 0.0) < promised[-1] + 0.3
    # The table is linear between 10 m: what it promises it keeps to a few hundredths.
    assert np.mean(kept) == pytest.approx(np.mean(promised), rel=0.05)
    np.testing.assert_allclose(kept, promised, atol=1.0)


def test_an_outlook_falls_where_the_target_is_far_and_by_the_lines_that_are_not_free():
    table = outlook_of()
    worths = [outlook(table, -ahead, 0.0, 0.0) for ahead in (60.0, 150.0, 250.0, 400.0)]
    assert worths == sorted(worths, reverse=True)
    assert worths[-1] > 0.0
    fading = outlook(table, -400.0, 0.0, 0.0) / outlook(table, -300.0, 0.0, 0.0)
    assert fading == pytest.approx(0.9 ** (100.0 / SPEED), rel=1e-9)
    half = outlook_of(free=np.full(RINGS, 0.5))
    np.testing.assert_allclose(half.values, 0.5 * table.values, atol=1e-12)
    mirrored = table.values[:, ::-1, ::-1]
    np.testing.assert_allclose(mirrored, table.values, atol=1e-5)  # as far as it has converged
    assert REACH == (SIZE - 1) / 2 * 10.0


def test_the_share_of_free_lines_is_what_shapely_finds():
    assert (free_shares(OPEN.walls, 600.0, 600.0, 60.0, 1.0) == 1.0).all()
    city, rng = City.generate(size=(300.0, 300.0), seed=4), np.random.default_rng(0)
    ours = free_shares(city.walls, *city.size, 60.0, 1.0)
    assert ours[0] == 1.0
    places = rng.uniform(0.0, 300.0, (900, 2))
    streets = places[~inside_points(city.walls, places)][:400]
    for ring in (3, 10):
        angles = rng.uniform(0.0, 2.0 * math.pi, len(streets))
        air = streets + RING * ring * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        free = [
            not hidden(city, np.array([*a, 60.0]), (*p, 1.0))
            for a, p in zip(air, streets, strict=True)
        ]
        assert np.mean(free) == pytest.approx(ours[ring], abs=0.08)  # 3 sigma of 400 lines
