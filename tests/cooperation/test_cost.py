"""Each term of a cost against what it says it is."""

import math

import numpy as np
import pytest
import shapely

from staniel.city import City
from staniel.cooperation import Area, CostConfig, CostModel, Goal, Situation
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import COST_TERMS
from staniel.kernels.dubins import shortest_length

POSE = Pose(0.0, 0.0, 80.0, 0.3, 0.0, 15.0)
GOAL = Goal((300.0, 100.0), 1.0, 4.0)
AIRFRAME, OPEN = Airframe(), City.open((600.0, 600.0))


def term(name, *, goal=GOAL, situation=None, chart=OPEN, camera=None, areas=(), **weights):
    model = CostModel(CostConfig(**weights), AIRFRAME, camera or Camera(), chart, areas)
    (price,) = model.prices(situation or Situation(POSE), [goal])
    assert price.cost == pytest.approx(math.fsum(price.terms), abs=1e-9)
    return price.terms[COST_TERMS.index(name)]


def test_the_distance_alone_by_default():
    (price,) = CostModel(CostConfig(), AIRFRAME, Camera(), OPEN).prices(Situation(POSE), [GOAL])
    way = shortest_length(0.0, 0.0, 0.3, 300.0, 100.0, 1.0, AIRFRAME.min_turn_radius)
    assert price == (pytest.approx(way, abs=1e-9), ())
    assert CostModel(CostConfig(), AIRFRAME, Camera(), OPEN).prices(Situation(POSE), []) == []


def test_energy_speed_and_priority_are_linear():
    assert term("energy", situation=Situation(POSE, 0.25), energy=400.0) == 300.0
    assert term("speed", speed=100.0) == pytest.approx(100.0 * 4.0 / 20.0)
    areas = [Area(center=(300.0, 100.0), radius=50.0, priority=3.0)]
    assert term("priority", priority=100.0, areas=areas) == -200.0
    far = Goal((300.0, 200.0), 0.0)
    assert term("priority", goal=far, priority=100.0, areas=areas) == 0.0


def test_exposure_is_the_rate_integrated_along_the_way():
    def rate(places):
        return np.where(np.hypot(*(places[:, :2] - [150.0, 50.0]).T) < 60.0, 0.02, 0.0)

    found = term("exposure", situation=Situation(POSE, rate=rate), exposure=1000.0)
    seconds = 120.0 / AIRFRAME.speed  # the straight way leads through the disc's middle
    assert found == pytest.approx(1000.0 * 0.02 * seconds, rel=0.2)
    assert term("exposure", exposure=1000.0) == 0.0


def test_visibility_is_the_share_of_a_ring_with_a_free_line():
    wall = [(310.0, 0.0), (330.0, 0.0), (330.0, 200.0), (310.0, 200.0)]
    chart = City.from_outlines([shapely.Polygon(wall)], [60.0], size=(600.0, 600.0))
    found = term("visibility", chart=chart, visibility=1.0)
    outline, height, eye = shapely.Polygon(wall), 60.0, AIRFRAME.altitude
    radius, hidden = 2.0 * AIRFRAME.min_turn_radius, 0
    for k in range(12):
        angle = k * math.pi / 6.0
        end = np.array([300.0 + radius * math.cos(angle), 100.0 + radius * math.sin(angle)])
        share = (height - 1.0) / (eye - 1.0)  # of the way from the target up to the roof's height
        start = np.array([300.0, 100.0])
        below = shapely.LineString([start, start + share * (end - start)])
        hidden += below.crosses(outline)
    assert 0 < hidden < 12
    assert found == pytest.approx(hidden / 12)


@pytest.mark.parametrize(
    ("camera", "sees", "expected"),
    [
        (Camera(), True, 0.9),
        (Camera(), False, 0.0),
        (Camera(max_height=50.0), True, 0.0),
        (Camera(detection_falloff=2.0), True, 0.9 * (1.0 - (79.0 / 250.0) ** 2)),
    ],
)
def test_the_sensor_term_is_what_the_camera_misses(camera, sees, expected):
    found = term("sensor", camera=camera, situation=Situation(POSE, sees=sees), sensor=10.0)
    assert found == pytest.approx(10.0 * (1.0 - expected))
