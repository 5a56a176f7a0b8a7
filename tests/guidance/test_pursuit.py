import math

import numpy as np
import pytest

from staniel.city import City
from staniel.datatypes.belief import Pose, TrackEstimate, TrackId
from staniel.datatypes.command import FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe, Camera
from staniel.guidance import (
    GuidanceConfig,
    Pursuit,
    carrot,
    loiter,
    pursuit_names,
    pursuit_policy,
    pursuit_policy_named,
)

CONFIG = GuidanceConfig()


def pursuit(pose, waypoint):
    track = TrackEstimate(
        TrackId(0.0, 0, 1), 0.0, np.zeros(2), np.zeros(2), np.eye(2), existence=1.0, last_seen=0.0
    )
    return Pursuit(
        time=0.0,
        pose=pose,
        track=track,
        waypoint=np.array(waypoint, dtype=float),
        cloud=lambda: (np.zeros((1, 4)), np.ones(1)),
        airframe=Airframe(),
        camera=Camera(),
        chart=City.open((100.0, 100.0)),
        config=CONFIG,
    )


def test_carrot_chases_a_far_target_along_a_line_and_circles_a_near_one():
    pose = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0)
    far = carrot(pursuit(pose, (300.0, 40.0)))
    assert far == FlyLine((0.0, 0.0), (300.0, 40.0), 15.0, 80.0)
    near = carrot(pursuit(pose, (30.0, 40.0)))
    assert near == FlyOrbit((30.0, 40.0), CONFIG.loiter_radius, +1, 15.0, 80.0)


@pytest.mark.parametrize("heading", np.linspace(-3.0, 3.0, 7))
def test_a_loiter_turns_towards_its_center_and_keeps_turning_that_way(heading):
    config, airframe = GuidanceConfig(loiter_radius=50.0), Airframe()
    pose = Pose(0.0, 0.0, 80.0, heading, 0.0, 15.0)
    for side in (+1, -1):
        center = (-side * 50.0 * math.sin(heading), side * 50.0 * math.cos(heading))
        turn = loiter(pose, center, airframe, config).turn
        assert turn == side
        # A step further round the same circle the sense is the same.
        angle = heading + side * 0.3
        next_pose = pose._replace(
            x=center[0] + side * 50.0 * math.sin(angle),
            y=center[1] - side * 50.0 * math.cos(angle),
            heading=angle,
        )
        assert loiter(next_pose, center, airframe, config).turn == side


def test_a_loiter_is_never_tighter_than_the_aircraft_can_turn():
    pose, airframe = Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), Airframe()
    orbit = loiter(pose, (0.0, 50.0), airframe, GuidanceConfig(loiter_radius=10.0))
    assert orbit.radius == pytest.approx(15.0**2 / (9.80665 * math.tan(math.radians(35.0))))


def test_policies_are_found_by_name_and_strangers_refused():
    assert "carrot" in pursuit_names()
    assert pursuit_policy_named("carrot") is carrot
    with pytest.raises(ValueError, match=r"'telepathy': expected one of .*carrot"):
        pursuit_policy_named("telepathy")
    with pytest.raises(ValueError, match="registered already"):
        pursuit_policy("carrot")(lambda pursuit: None)
    assert pursuit_policy("carrot")(carrot) is carrot
