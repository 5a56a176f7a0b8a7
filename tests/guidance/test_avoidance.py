"""Avoidance by itself: walls that the lidar sees, other aircraft, bans; flown, then measured."""

import math

import numpy as np
import pytest
import shapely
from flown import Flown

from staniel.city import City
from staniel.datatypes.belief import Pose
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe
from staniel.datatypes.risk import RiskRegion
from staniel.guidance import GuidanceConfig

Z = 30.0
SIZE = (1000.0, 1000.0)


def east(x=100.0, y=500.0, z=Z, heading=0.0, speed=15.0):
    return (x, y, z, heading, 0.0, speed)


def line(start, end, speed=15.0, z=Z):
    return FlyLine(start, end, speed, z)


def town(*boxes, roof=60.0):
    return City.from_outlines([shapely.box(*box) for box in boxes], [roof] * len(boxes), SIZE)


WALL = town((400.0, 350.0, 430.0, 650.0))
HOUSE = town((400.0, 470.0, 440.0, 530.0))
CORNER = town((400.0, 300.0, 420.0, 560.0), (200.0, 540.0, 400.0, 560.0))
DEAD_END = town(
    (300.0, 420.0, 500.0, 440.0), (300.0, 560.0, 500.0, 580.0), (480.0, 440.0, 500.0, 560.0)
)
CANYON = town((200.0, 420.0, 800.0, 440.0), (200.0, 560.0, 800.0, 580.0))
TIGHT = town((300.0, 470.0, 900.0, 485.0), (300.0, 515.0, 900.0, 530.0))


@pytest.mark.parametrize("aperture", [180.0, 360.0])
@pytest.mark.parametrize("city", [WALL, HOUSE, CORNER, DEAD_END, TIGHT], ids=range(5))
def test_no_wall_is_flown_into_that_the_lidar_alone_sees(city, aperture):
    run = Flown([east()], [line((100.0, 500.0), (900.0, 500.0))], city=city, aperture=aperture)
    run.run(90)
    assert run.strikes == 0
    way = run.places[:, 0]
    high = np.asarray(city.heights).max()
    points = shapely.points(way[way[:, 2] < high, :2])
    apart = min(shapely.distance(outline, points).min() for outline in city.outlines)
    assert apart > 2.0  # the clearance of 6 m, less half a cell and what a step leaves open
    assert any("avoid" in guards for guards in run.guards)
    # Half a fan leaves it blind behind at first; later a wall may come up in half a cell.
    assert sum("loiter" in guards for guards in run.guards[1:]) <= 1


def test_a_house_in_the_way_is_passed_and_the_goal_reached():
    run = Flown([east()], [line((100.0, 500.0), (900.0, 500.0))], city=HOUSE).run(60)
    assert run.places[:, 0, 0].max() > 850.0
    assert abs(run.places[-1, 0, 1] - 500.0) < 15.0
    assert run.guards[-1] == [""]


def test_a_clear_canyon_is_flown_as_commanded():
    command = line((100.0, 500.0), (900.0, 500.0))
    run = Flown([east(y=498.0)], [command], city=CANYON, aperture=360.0).run(50)
    assert {guard for guards in run.guards for guard in guards} == {""}
    assert all(flown[0] is command for flown in run.flown)
    assert run.places[-1, 0, 0] > 800.0


def test_roofs_of_the_chart_are_known_before_the_lidar_sees_them():
    city = town((400.0, 350.0, 430.0, 650.0), roof=32.0)
    wanted = [line((100.0, 500.0), (900.0, 500.0), z=33.0)]
    run = Flown([east(z=33.0)], wanted, city=city, chart=city).run(60)
    assert run.strikes == 0  # the lidar looks over the roof, a metre above: only the chart knows
    over = shapely.contains_xy(shapely.box(400.0, 350.0, 430.0, 650.0), run.places[:, 0, :2])
    assert run.places[over, 0, 2].min(initial=99.0) > 33.5
    assert any("avoid" in guards for guards in run.guards)


def test_nothing_is_seen_below_the_lidar_so_nobody_descends_there():
    run = Flown([east(z=90.0)], [line((100.0, 500.0), (900.0, 500.0))], city=WALL).run(45)
    assert run.strikes == 0
    assert run.places[:, 0, 2].min() > 60.0


@pytest.mark.parametrize("wind", [(0.0, 5.0), (-5.0, 0.0), (5.0, 0.0)])
def test_wind_is_found_out_and_reckoned_with(wind):
    run = Flown([east()], [line((100.0, 500.0), (900.0, 500.0))], city=WALL, wind=wind).run(60)
    assert run.strikes == 0


# -- other aircraft ------------------------------------------------------------------------------

HEAD_ON = (
    [east(100.0), east(700.0, heading=math.pi)],
    [
        line((100.0, 500.0), (900.0, 500.0)),
        line((700.0, 500.0), (0.0, 500.0)),
    ],
)
OVERTAKING = (
    [east(300.0, speed=11.0), east(200.0, speed=20.0)],
    [
        line((300.0, 500.0), (900.0, 500.0), speed=11.0),
        line((200.0, 500.0), (900.0, 500.0), speed=20.0),
    ],
)
CROSSING = (
    [east(100.0), east(400.0, 200.0, heading=math.pi / 2)],
    [
        line((100.0, 500.0), (900.0, 500.0)),
        line((400.0, 200.0), (400.0, 900.0)),
    ],
)
SAME_PLACE = (
    [east(100.0), east(700.0, heading=math.pi)],
    [
        FlyOrbit((400.0, 500.0), 45.0, 1, 15.0, Z),
        FlyOrbit((400.0, 500.0), 45.0, -1, 15.0, Z),
    ],
)
PAIRS = {
    "head-on": HEAD_ON, "overtaking": OVERTAKING, "crossing": CROSSING, "same place": SAME_PLACE,
}  # fmt: skip


def lossy(seed, loss):
    def heard(tick, sender, receiver):
        return np.random.default_rng([seed, tick, sender, receiver]).random() >= loss

    return heard


def test_without_avoidance_they_would_collide():
    for name, (poses, commands) in PAIRS.items():
        run = Flown(poses, commands, separation=0.01)
        for mind in run.minds:
            mind.step = lambda percept, heard, regions, command: (command, "")
        assert run.run(60).nearest < 10.0, name


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("loss", [0.0, 0.5])
def test_pairs_keep_apart(pair, seed, loss):
    poses, commands = PAIRS[pair]
    run = Flown(poses, commands, heard=lossy(seed, loss)).run(60)
    assert run.nearest >= 10.0


def test_a_crossing_pair_goes_on_to_its_goals():
    run = Flown(*CROSSING).run(60)
    assert run.places[:, 0, 0].max() > 800.0
    assert run.places[:, 1, 1].max() > 800.0


def test_who_has_the_higher_number_gives_way():
    run = Flown(*CROSSING).run(40)
    commands = CROSSING[1]
    changed = [[flown[i] is not commands[i] for flown in run.flown].count(True) for i in (0, 1)]
    assert changed[0] < changed[1]


def test_layers_separate_a_pair_that_never_hears_of_one_another():
    poses, commands = HEAD_ON
    layered = [commands[0], FlyLine(commands[1].start, commands[1].end, 15.0, Z + 15.0)]
    apart = [poses[0], (*poses[1][:2], Z + 15.0, *poses[1][3:])]
    assert Flown(apart, layered, heard=lambda *_: False).run(60).nearest >= 10.0
    # ... and together they do not, which is why the default of a silent team is layers:
    assert Flown(poses, commands, heard=lambda *_: False).run(60).nearest < 10.0


# -- bans ----------------------------------------------------------------------------------------

DISC = RiskRegion(kind="no-fly", center=(400.0, 500.0), radius=80.0)
BOX = RiskRegion(
    kind="no-fly", polygon=((350.0, 420.0), (450.0, 420.0), (450.0, 580.0), (350.0, 580.0))
)


def shape_of(region):
    if region.polygon is not None:
        return shapely.Polygon(region.polygon)
    return shapely.Point(region.center).buffer(region.radius, 90)


@pytest.mark.parametrize("region", [DISC, BOX])
def test_a_ban_is_flown_round(region):
    run = Flown([east()], [line((100.0, 500.0), (900.0, 500.0))], regions=(region,)).run(70)
    points = shapely.points(run.places[:, 0, :2])
    assert shapely.distance(shape_of(region), points).min() > 1.0
    assert run.places[:, 0, 0].max() > 800.0


@pytest.mark.parametrize("offset", [(-70.0, 0.0), (-40.0, 30.0), (0.0, 0.0), (40.0, 0.0)])
def test_who_is_caught_inside_leaves_by_nearly_the_quickest_way_and_stays_out(offset):
    x, y = DISC.center[0] + offset[0], DISC.center[1] + offset[1]
    run = Flown([east(x, y)], [FlyOrbit(DISC.center, 45.0, 1, 15.0, Z)], regions=(DISC,)).run(60)
    inside = shapely.contains_xy(shape_of(DISC), run.places[:, 0, :2])
    assert inside[0]
    left = int(np.argmin(inside))
    assert not inside[left:].any()
    assert 0.1 * left <= 1.35 * _quickest(x, y) + 1.0


def _quickest(x, y):
    """Seconds to leave the disc by holding one bank for some time and then flying straight on."""
    airframe, best = Airframe(), math.inf
    for bank in np.radians([-35.0, 35.0]):
        for turning in np.arange(0.0, 10.0, 0.25):
            px, py, heading = x, y, 0.0
            for k in range(400):
                rate = 9.80665 / airframe.speed * math.tan(bank) if 0.05 * k < turning else 0.0
                heading += 0.05 * rate
                px += 0.05 * airframe.speed * math.cos(heading)
                py += 0.05 * airframe.speed * math.sin(heading)
                if math.dist((px, py), DISC.center) > DISC.radius:
                    best = min(best, 0.05 * (k + 1))
                    break
    return best


def test_soft_threats_are_not_bans():
    threat = RiskRegion(kind="threat", center=(400.0, 500.0), radius=80.0, rate=1.0)
    wanted = [line((100.0, 500.0), (900.0, 500.0))]
    run = Flown([east()], wanted, regions=(threat,), aperture=360.0).run(30)
    assert {guard for guards in run.guards for guard in guards} == {""}


def test_the_fence_is_not_left():
    fence = ((50.0, 300.0), (600.0, 300.0), (600.0, 700.0), (50.0, 700.0))
    run = Flown([east()], [line((100.0, 500.0), (900.0, 500.0))], fence=fence).run(120)
    points = shapely.points(run.places[:, 0, :2])
    assert shapely.contains_properly(shapely.Polygon(fence), points).all()


def test_walls_come_before_bans():
    """A wall ahead, and bans on both sides: it enters one rather than strike."""
    bans = tuple(
        RiskRegion(kind="no-fly", polygon=((200.0, y0), (420.0, y0), (420.0, y1), (200.0, y1)))
        for y0, y1 in ((0.0, 480.0), (520.0, 1000.0))
    )
    run = Flown([east(330.0)], [line((100.0, 500.0), (900.0, 500.0))], city=WALL, regions=bans)
    run.run(40)
    assert run.strikes == 0


# -- when nothing is safe ------------------------------------------------------------------------


def test_it_says_so_when_nothing_is_safe():
    court = City.from_outlines(
        [shapely.box(460.0, 460.0, 540.0, 540.0) - shapely.box(485.0, 485.0, 515.0, 515.0)],
        [60.0],
        SIZE,
    )
    run = Flown([east(500.0)], [line((500.0, 500.0), (900.0, 500.0))], city=court, aperture=360.0)
    run.run(1)
    assert run.guards == [["loiter"]]
    assert run.flown[0][0] is not run.commands[0]


def test_an_unsafe_command_of_any_kind_is_replaced():
    into = FlyOrbit((415.0, 500.0), 45.0, 1, 15.0, Z)  # round the wall's middle
    run = Flown([east(200.0)], [into], city=WALL).run(60)
    assert run.strikes == 0


def test_where_a_gimbal_looks_steers_nothing_and_stays_with_other_banks():
    def run(look):
        wanted = FlyBanks((0.0,), 1.0, 15.0, Z, look)
        return Flown([east(300.0), east(600.0, heading=math.pi)], [wanted] * 2).run(25)

    aside, ahead = run((300.0, 900.0)), run((450.0, 500.0))
    assert np.array_equal(aside.path, ahead.path)
    replaced = [
        command
        for commands, guards in zip(aside.flown, aside.guards, strict=True)
        for command, guard in zip(commands, guards, strict=True)
        if guard
    ]
    banks = [command for command in replaced if isinstance(command, FlyBanks)]
    assert len(replaced) > len(banks) > 0
    assert {command.look for command in banks} == {(300.0, 900.0)}


@pytest.mark.parametrize(
    ("fence", "word"),
    [(((0, 0), (1, 1)), "fence"), (((0, 0), (1, 1), (1, 0), (0, 1)), "fence")],
)
def test_a_fence_that_is_no_outline_is_refused(fence, word):
    with pytest.raises(ValueError, match=word):
        GuidanceConfig(fence=fence)


def test_decisions_are_a_function_of_what_was_perceived():
    first, second = (Flown(*CROSSING, heard=lossy(1, 0.5)).run(40) for _ in range(2))
    assert np.array_equal(first.path, second.path)
    assert Pose(*first.state[0]) == Pose(*second.state[0])
