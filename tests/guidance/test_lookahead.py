"""The policies orbit and lookahead, and the loiter where no flight is safe, from outside."""

import dataclasses
import math

import numpy as np
import pytest
import shapely
from scipy.optimize import minimize_scalar

from staniel.city import City
from staniel.datatypes.belief import Pose, TrackEstimate, TrackId
from staniel.datatypes.command import FlyBanks, FlyOrbit
from staniel.datatypes.equipment import Airframe, Camera
from staniel.guidance import (
    GuidanceConfig,
    NoFeasibleFlightError,
    Partner,
    Pursuit,
    best_radius,
    lookahead,
    orbit,
    safe_loiter,
)
from staniel.kernels.flight import MAX_BANKS
from staniel.kernels.lookout import roll_out
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble

OPEN = City.open((600.0, 600.0))


def pursuit(pose, target=(300.0, 300.0), chart=OPEN, time=10.0, last_seen=10.0, **others):
    track = TrackEstimate(
        TrackId(0.0, 0, 1), time, np.array(target), np.zeros(2), np.eye(2), 1.0, last_seen
    )
    rng = np.random.default_rng(3)
    particles = np.concatenate(
        (target + rng.normal(0.0, 2.0, (300, 2)), np.zeros((300, 2))), axis=1
    )
    usual = {
        "airframe": Airframe(altitude=pose[2]),
        "camera": Camera(),
        "memory": {},
        "config": GuidanceConfig(),
    }
    return Pursuit(
        time=time,
        pose=Pose(*pose),
        track=track,
        waypoint=np.array(target),
        cloud=lambda: (particles, np.full(300, 1.0 / 300.0)),
        chart=chart,
        **(usual | others),
    )


@pytest.mark.parametrize("altitude", [45.0, 50.0, 80.0, 200.0])
@pytest.mark.parametrize("speed", [12.0, 15.0, 20.0])
def test_the_best_orbit_is_where_the_center_is_nearest_to_the_cameras_axis(altitude, speed):
    airframe = Airframe(speed=speed, altitude=altitude)

    def off_axis(radius):
        return math.atan(radius / altitude) + math.atan(speed**2 / (9.80665 * radius))

    low = airframe.min_turn_radius
    least = minimize_scalar(off_axis, bounds=(low, 2000.0), method="bounded")
    assert off_axis(best_radius(airframe)) == pytest.approx(least.fun, abs=1e-6)


def test_orbit_circles_the_predicted_place_with_the_scenarios_radius_or_the_best():
    begin = (250.0, 300.0, 80.0, 0.0, 0.0, 15.0)
    assert orbit(pursuit(begin, (300.0, 310.0))) == FlyOrbit(
        (300.0, 310.0), best_radius(Airframe()), 1, 15.0, 80.0
    )
    config = GuidanceConfig(orbit_radius=61.0)
    assert orbit(pursuit(begin, (300.0, 290.0), config=config)).radius == 61.0
    assert orbit(pursuit(begin, (300.0, 290.0), config=config)).turn == -1


def seconds_of_sight(policy, begin, seconds=60, target=(300.0, 300.0)):
    """Of a target that stands in the open, by cone and range alone."""
    pose, seen, memory = np.array(begin), 0, {}
    for second in range(seconds):
        now = pursuit(
            tuple(pose), target, time=float(second), last_seen=float(second), memory=memory
        )
        command = policy(now)
        assert isinstance(command, FlyBanks)
        way = roll_out(pose, np.array(command.banks), 1.0, 0.0, 10, 0.1, 3.0, math.radians(60.0))
        pose = way[-1]
        for x, y, z, heading, bank, _ in way[1:]:
            axis = math.sin(bank) * np.array([math.sin(heading), -math.cos(heading), 0.0])
            axis[2] = -math.cos(bank)
            ray = np.array([target[0] - x, target[1] - y, 1.0 - z])
            seen += ray @ axis >= math.cos(math.radians(60.0)) * np.linalg.norm(ray)
    return 0.1 * seen


@pytest.mark.parametrize("height", [36.0, 50.0])
def test_a_standing_target_in_the_open_is_seen_longer_than_from_any_orbit(height):
    """From 36 m no orbit sees its center at all (77 degrees off the axis at best)."""
    assert math.atan(32.8 / height) + math.atan(15.0**2 / (9.80665 * 32.8)) > math.radians(60.0)
    begin = (270.0, 300.0, height, 0.0, 0.0, 15.0)
    assert seconds_of_sight(lookahead, begin) > 30.0


def test_the_same_pursuit_gives_the_same_command_and_the_rest_of_a_plan_is_kept():
    begin = (220.0, 280.0, 60.0, 1.0, 0.2, 15.0)
    first, second = lookahead(pursuit(begin)), lookahead(pursuit(begin))
    assert first == second
    assert len(first.banks) == min(GuidanceConfig().lookahead.horizon, MAX_BANKS)
    assert all(abs(bank) <= Airframe().max_bank + 1e-12 for bank in first.banks)


def test_a_gimbal_is_led_to_where_the_target_will_be():
    drive = np.concatenate(
        (np.full((300, 2), 300.0), np.tile(np.array([[4.0, 0.0]]), (300, 1))), axis=1
    )
    begin = (250.0, 300.0, 50.0, 0.0, 0.0, 15.0)
    cloud = (drive, np.full(300, 1.0 / 300.0))
    look = lookahead(dataclasses.replace(pursuit(begin), cloud=lambda: cloud)).look
    # The mean of the coming second's two instants, 0.5 and 1 s ahead.
    assert look == pytest.approx((303.0, 300.0))


def test_a_partners_look_in_vain_by_a_gimbal_counts_where_it_looked():
    """What it saw to be empty is where no flight goes to look."""
    camera = Camera(mount="gimbal", half_aperture_deg=15.0, gimbal_limit_deg=70.0)
    begin = (300.0, 300.0, 60.0, 0.0, 0.0, 15.0)

    def next_look(partner):
        now = pursuit(begin, (300.0, 300.0), time=11.0, camera=camera, partners=(partner,))
        west = np.tile(np.array([[260.0, 300.0, 0.0, 0.0]]), (150, 1))
        east = west + np.array([80.0, 0.0, 0.0, 0.0])
        cloud = np.concatenate((west, east))
        both = lambda: (cloud, np.full(300, 1.0 / 300.0))  # noqa: E731
        return lookahead(dataclasses.replace(now, cloud=both)).look[0]

    # It says where it looks with its plan; one that does not has seen nothing for certain.
    plan = FlyBanks((0.0,), 1.0, 15.0, 60.0, look=(260.0, 300.0))
    partner = Partner(11.0, Pose(300.0, 310.0, 60.0, 0.0, 0.0, 15.0), plan)
    assert next_look(partner) > 325.0
    silent = dataclasses.replace(partner, plan=None)
    assert next_look(silent) == pytest.approx(300.0, abs=6.0)


def test_a_partner_that_has_the_target_in_sight_makes_room_for_another_flight():
    begin = (270.0, 300.0, 50.0, 0.0, 0.0, 15.0)
    plan = FlyBanks((0.0,), 1.0, 15.0, 50.0)  # it sees the target for the first seconds only
    partner = Partner(9.0, Pose(255.0, 300.0, 50.0, 0.0, 0.0, 15.0), plan)
    alone, paired = lookahead(pursuit(begin)), lookahead(pursuit(begin, partners=(partner,)))
    assert alone != paired
    old = Partner(1.0, partner.pose, plan)
    silent = Partner(9.0, partner.pose, None)
    assert lookahead(pursuit(begin, partners=(old,))) == alone
    assert lookahead(pursuit(begin, partners=(silent,))) == alone


def test_no_flight_between_walls_is_said_and_the_loiter_climbs_above_all_roofs():
    ring = shapely.box(100.0, 100.0, 500.0, 500.0) - shapely.box(260.0, 280.0, 330.0, 320.0)
    chart = City.from_outlines([ring], [70.0], (600.0, 600.0))
    inside = pursuit((290.0, 300.0, 50.0, 0.0, 0.0, 15.0), chart=chart)
    with pytest.raises(NoFeasibleFlightError, match="no flight"):
        lookahead(inside)
    wall = City.from_outlines([shapely.box(290.0, 310.0, 400.0, 360.0)], [70.0], (600.0, 600.0))
    circle = safe_loiter(inside.pose, inside.airframe, wall)
    assert circle.altitude == 75.0
    assert circle.turn == -1
    assert circle.radius == inside.airframe.min_turn_radius


def flown(minutes=3.0, **changes):
    scenario = load_scenario(
        "downtown",
        minutes=minutes,
        city={"density": 0.6, "block": (45.0, 95.0)},
        vehicles={"count": 1},
        aircraft={"count": 2, "altitude": 80.0},
        tracking={"particles": 300},
        **changes,
    )
    return list(assemble(scenario, build_city(scenario.city, scenario.seed)).frames())


def seen_share(frames):
    """Ticks with a sighting of the vehicle, of those since the first."""
    seen = [any(0 in origins for origins in frame.origins) for frame in frames]
    return np.mean(seen[seen.index(True) :])


@pytest.mark.slow
def test_a_pair_that_looks_ahead_sees_more_than_a_pair_that_chases():
    """On the same six cities, in pairs: a tenth of the time more at least, two sigma below."""
    shares = np.array(
        [
            [
                seen_share(
                    flown(
                        6.0,
                        seed=seed,
                        cooperation={"assistance": "always", "helpers": 1},
                        guidance={"pursuit": name},
                    )
                )
                for name in ("carrot", "lookahead")
            ]
            for seed in (1, 2, 3, 6, 7, 9)
        ]
    )
    more = shares[:, 1] - shares[:, 0]
    assert more.mean() - 2.0 * more.std(ddof=1) / math.sqrt(len(more)) > 0.1
    chase, look = shares.mean(axis=0)
    assert 1.0 - look < 0.65 * (1.0 - chase)


def test_a_gimbal_sees_what_it_pursues_far_longer_than_a_camera_fixed_to_the_body():
    """With the same aperture, of the time that anybody pursues."""
    for seed in (3, 6, 9):
        shares = []
        for camera in ({"mount": "body"}, {"mount": "gimbal", "gimbal_limit_deg": 60.0}):
            camera = {"half_aperture_deg": 45.0, **camera}
            frames = flown(4.0, seed=seed, camera=camera, guidance={"pursuit": "lookahead"})
            pursued = [f for f in frames if any(b.role == "pursue" for b in f.beliefs)]
            assert len(pursued) > 60
            shares.append(np.mean([any(0 in o for o in frame.origins) for frame in pursued]))
        assert shares[1] > shares[0] + 0.25


def test_a_helper_joins_by_message_and_two_runs_are_the_same():
    changes = {
        "cooperation": {"assistance": "always", "helpers": 1},
        "guidance": {"pursuit": "lookahead"},
    }
    first, second = (flown(minutes=2.0, seed=1, **changes) for _ in range(2))
    assert [frame.commands for frame in first] == [frame.commands for frame in second]
    together = [{belief.role for belief in frame.beliefs} == {"pursue", "help"} for frame in first]
    assert any(together)
    beats = [
        delivery.message
        for frame in first
        for delivery in frame.deliveries
        if delivery.message.kind == "heartbeat"
    ]
    assert any(beat.helps is not None and beat.command is not None for beat in beats)
    assert any(beat.target is not None and beat.command is not None for beat in beats)
    alone = flown(minutes=2.0, seed=1, guidance={"pursuit": "lookahead"})
    assert not any(belief.role == "help" for frame in alone for belief in frame.beliefs)
