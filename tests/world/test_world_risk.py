"""Exposure: against chords, shapely's lengths and dense sampling; refusals; a mission's record."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import staniel
from staniel.datatypes.risk import CarriedThreat, RiskConfig, RiskRegion
from staniel.errors import ScenarioError
from staniel.recording import read_record
from staniel.scenario import build_city, dump_scenario, load_scenario
from staniel.scenario.assemble import assemble
from staniel.world import Hazards

STILL = np.zeros((2, 0, 4))


def line(*points):
    """Path of one aircraft through points, one each second."""
    path = np.zeros((len(points), 1, 6))
    path[:, 0, :3] = points
    return path


def threat(**shape):
    return RiskRegion(kind="threat", rate=1.0, **shape)


def exposure(path, *regions, carried=None, vehicles=None, step=1.0):
    config = RiskConfig(regions=regions, carried=carried or CarriedThreat())
    still = np.zeros((len(path), 0, 4)) if vehicles is None else vehicles
    return Hazards(config).exposure(path, still, step)


@pytest.mark.parametrize("miss", [0.0, 12.5, 29.9, 30.0, 31.0])
def test_a_disc_takes_the_time_of_its_chord(miss):
    speed, radius = 15.0, 30.0
    path = line(*[(-100.0 + speed * k, miss, 80.0) for k in range(20)])
    chord = 2.0 * math.sqrt(max(radius**2 - miss**2, 0.0)) / speed
    seen = exposure(path, threat(center=(0.0, 0.0), radius=radius))
    assert seen.risk[0] == pytest.approx(chord, abs=1e-9)
    twice = RiskRegion(kind="threat", rate=2.5, center=(0.0, 0.0), radius=radius)
    assert exposure(path, twice).risk[0] == pytest.approx(2.5 * chord, abs=1e-9)


coordinate = st.floats(-50.0, 50.0).map(lambda v: round(v, 2))


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.floats(0.2, 1.0), min_size=3, max_size=12),
    st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=6),
    st.booleans(),
)
def test_a_polygon_takes_shapelys_length(spokes, points, reverse):
    """Star-shaped, hardly ever convex, either way round."""
    turns = np.linspace(0.0, 2.0 * math.pi, len(spokes), endpoint=False)
    corners = [
        (40.0 * r * math.cos(a), 40.0 * r * math.sin(a)) for r, a in zip(spokes, turns, strict=True)
    ]
    region = threat(polygon=tuple(corners[::-1] if reverse else corners))
    shape = shapely.Polygon(corners)
    path = line(*[(*point, 80.0) for point in points])
    wanted = 0.0
    for a, b in pairwise(points):
        whole = shapely.LineString([a, b])
        if a == b:
            wanted += float(shape.contains(shapely.Point(a)))
        else:
            wanted += shape.intersection(whole).length / whole.length
    assert exposure(path, region).risk[0] == pytest.approx(wanted, abs=1e-6)


def test_corners_and_edges_hit_exactly():
    square = threat(polygon=((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)))
    diagonal = line((-10.0, -10.0, 80.0), (20.0, 20.0, 80.0))
    assert exposure(diagonal, square).risk[0] == pytest.approx(1.0 / 3.0)
    through_corner = line((-10.0, 10.0, 80.0), (10.0, -10.0, 80.0))
    assert exposure(through_corner, square).risk[0] == pytest.approx(0.0, abs=1e-12)
    standing = line((5.0, 5.0, 80.0), (5.0, 5.0, 80.0), (5.0, 5.0, 80.0))
    assert exposure(standing, square).risk[0] == 2.0


def test_floor_and_ceiling_clip_a_climb():
    disc = threat(center=(0.0, 0.0), radius=100.0, floor=50.0, ceiling=80.0)
    climb = line((0.0, 0.0, 40.0), (0.0, 0.0, 100.0))
    assert exposure(climb, disc).risk[0] == pytest.approx(0.5)
    below = line((-50.0, 0.0, 40.0), (50.0, 0.0, 40.0))
    assert exposure(below, disc).risk[0] == 0.0
    square = threat(polygon=((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)), floor=50.0)
    # Above the floor for the second half, inside the outline for the first 59 %.
    slanted = line((0.0, 0.0, 40.0), (9.0 / 0.59, 0.0, 60.0))
    assert exposure(slanted, square).risk[0] == pytest.approx(0.09)


def test_no_fly_counts_seconds_and_entries():
    ban = RiskRegion(kind="no-fly", polygon=((0.0, 0.0), (30.0, 0.0), (30.0, 30.0), (0.0, 30.0)))
    weave = line(*[(15.0, y, 80.0) for y in (-10, 10, 10, -10, -20, 40)])
    seen = exposure(weave, ban)
    assert seen.violations[0] == 2
    assert seen.no_fly[0] == pytest.approx(0.5 + 1.0 + 0.5 + 0.5)
    assert seen.risk[0] == 0.0


def test_what_is_not_in_the_air_is_not_exposed():
    path = line(*[(float(k), 0.0, 80.0) for k in range(7)])
    path[2] = path[4] = np.nan
    ban = RiskRegion(kind="no-fly", center=(0.0, 0.0), radius=50.0)
    seen = exposure(
        path, ban, carried=CarriedThreat(radius=90, rate=1), vehicles=np.zeros((7, 1, 4))
    )
    assert (seen.no_fly[0], seen.violations[0]) == (2.0, 2)
    assert seen.risk[0] == 2.0


def test_aircraft_and_regions_count_each_for_itself():
    path = np.concatenate((line((0, 0, 80), (9, 0, 80)), line((0, 50, 80), (9, 50, 80))), axis=1)
    here = threat(center=(0.0, 0.0), radius=20.0)
    there = RiskRegion(kind="threat", rate=3.0, center=(0.0, 50.0), radius=20.0)
    assert exposure(path, here, there).risk.tolist() == pytest.approx([1.0, 3.0])
    assert exposure(path).risk.tolist() == [0.0, 0.0]
    # A path of one instant takes no time.
    assert exposure(path[:1], here).risk.tolist() == [0.0, 0.0]


def test_a_threat_that_drives():
    """Slant range to a moving vehicle, against dense sampling and against Pythagoras."""
    rng = np.random.default_rng(5)
    path = np.zeros((8, 2, 6))
    path[:, :, :3] = np.cumsum(rng.normal(0.0, 15.0, (8, 2, 3)), axis=0)
    path[:, :, 2] += 60.0
    vehicles = np.zeros((8, 3, 4))
    vehicles[:, :, :2] = np.cumsum(rng.normal(0.0, 8.0, (8, 3, 2)), axis=0)
    for who in (None, (1,), (2, 0)):
        carried = CarriedThreat(radius=80.0, rate=0.5, vehicles=who)
        seen = exposure(path, carried=carried, vehicles=vehicles, step=0.2).risk
        share = np.linspace(0.0, 1.0, 4001)[:-1] + 0.5 / 4000
        for i in range(2):
            total = 0.0
            for k in range(7):
                own = path[k, i, :3] + share[:, None] * (path[k + 1, i, :3] - path[k, i, :3])
                for j in range(3) if who is None else who:
                    a, b = vehicles[k, j, :2], vehicles[k + 1, j, :2]
                    gap = own.copy()
                    gap[:, :2] -= a + share[:, None] * (b - a)
                    total += 0.2 * (np.linalg.norm(gap, axis=1) <= 80.0).mean()
            assert seen[i] == pytest.approx(0.5 * total, abs=5e-3)
    still = np.zeros((31, 1, 4))
    overhead = line(*[(-225.0 + 15.0 * k, 0.0, 80.0) for k in range(31)])
    chord = 2.0 * math.sqrt(100.0**2 - 80.0**2) / 15.0
    carried = CarriedThreat(radius=100.0, rate=2.0)
    seen = exposure(overhead, carried=carried, vehicles=still).risk[0]
    assert seen == pytest.approx(2.0 * chord)


REGIONS = [
    {"kind": "threat", "center": [300.0, 300.0], "radius": 120.0, "rate": 0.5},
    {
        "kind": "no-fly", "polygon": [[0, 0], [250, 0], [250, 250], [0, 250]], "ceiling": 200.0,
        "briefed": False,
    },
]  # fmt: skip


@pytest.fixture(scope="module")
def dangerous():
    return load_scenario(
        "village",
        **{"minutes": 1.0, "risk.regions": REGIONS, "risk.carried": {"radius": 120, "rate": 0.1}},
    )


def test_a_missions_metrics_are_those_of_its_substeps(dangerous, tmp_path):
    run = staniel.fly(dangerous, out=tmp_path / "run")
    hazards = Hazards(dangerous.risk)
    mission = assemble(dangerous, build_city(dangerous.city, dangerous.seed))
    risk, no_fly, before = 0.0, 0.0, None
    for frame in mission.frames():
        truth = frame.truth
        if before is not None:
            path = np.concatenate((before.aircraft[None], truth.aircraft_path))
            drive = np.concatenate((before.vehicles[None], truth.vehicle_path))
            part = hazards.exposure(path, drive, dangerous.clock.dynamics_step)
            risk, no_fly = risk + part.risk, no_fly + part.no_fly
        before = truth
    table = run.metrics["aircraft"]
    assert [a["risk_exposure"] for a in table] == pytest.approx(risk.tolist(), abs=0.05)
    assert [a["no_fly_seconds"] for a in table] == pytest.approx(no_fly.tolist(), abs=0.1)
    assert max(risk) > 1.0
    assert all((a["no_fly_violations"] > 0) == (a["no_fly_seconds"] > 0) for a in table)
    assert read_record(tmp_path / "run").scenario["risk"]["regions"][0]["rate"] == 0.5


def test_agents_are_briefed_of_what_is_briefed_and_never_of_what_is_carried(dangerous):
    mission = assemble(dangerous, build_city(dangerous.city, dangerous.seed))
    for agent in mission.agents:
        assert agent._briefing.risk == (dangerous.risk.regions[0],)


def test_risk_changes_nobodys_flight(dangerous):
    """But that of a policy which heeds it, as the look-ahead does."""

    def paths(scenario):
        guidance = scenario.guidance.model_copy(update={"pursuit": "carrot"})
        scenario = scenario.model_copy(update={"guidance": guidance})
        mission = assemble(scenario, build_city(scenario.city, scenario.seed))
        return np.array([frame.truth.aircraft for frame in mission.frames()])

    plain = load_scenario("village", minutes=1.0)
    assert np.array_equal(paths(dangerous), paths(plain))


def test_a_dangerous_scenario_is_written_and_read_back(dangerous, tmp_path):
    file = tmp_path / "dangerous.toml"
    file.write_text(dump_scenario(dangerous, "1.0"), encoding="utf-8")
    assert load_scenario(file) == dangerous


DISC = {"kind": "threat", "center": [0.0, 0.0], "radius": 9.0, "rate": 1.0}


@pytest.mark.parametrize(
    ("region", "text"),
    [
        ({**DISC, "rate": -1.0}, "risk.regions[0].rate = -1.0: expected at least 0"),
        ({**DISC, "radius": 0.0}, "risk.regions[0].radius = 0.0: expected greater than 0"),
        ({**DISC, "radius": math.nan}, "risk.regions[0].radius"),
        ({**DISC, "kind": "nofly"}, "'threat' or 'no-fly'"),
        ({**DISC, "kind": "no-fly"}, "only a threat has one"),
        ({"kind": "threat", "center": [0.0, 0.0], "radius": 9.0}, "a threat needs one"),
        ({"kind": "no-fly"}, "expected one of the two shapes"),
        ({"kind": "no-fly", "center": [0.0, 0.0]}, "a disc has both"),
        ({**DISC, "polygon": [[0, 0], [1, 0], [0, 1]]}, "expected one of the two shapes"),
        ({**DISC, "floor": 10.0, "ceiling": 10.0}, "ceiling = 10 must be higher"),
        ({**DISC, "colour": "red"}, "unknown key"),
        (
            {"kind": "no-fly", "polygon": [[0, 0], [1, 0]]},
            "polygon has 2 corners: expected 3 to 10,000",
        ),
        (
            {"kind": "no-fly", "polygon": [[0, 0], [9, 9], [9, 0], [0, 9]]},
            "not a simple outline with an area (Self-intersection",
        ),
        ({"kind": "no-fly", "polygon": [[0, 0], [5, 5], [9, 9]]}, "not a simple outline"),
        ({"kind": "no-fly", "polygon": [[0, 0], [9, 0], [0, 1e9]]}, "expected at most 1e+06"),
        ({"kind": "no-fly", "polygon": [[0, 0], [9, "a"], [0, 9]]}, "expected a number"),
    ],
)
def test_bad_regions_are_refused_by_name(region, text):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("village", **{"risk.regions": [region]})
    assert text in str(caught.value)


def test_too_many_regions_corners_and_unknown_carriers_are_refused():
    with pytest.raises(ScenarioError, match="regions has 1,001 tables: expected at most 1,000"):
        load_scenario("village", **{"risk.regions": [DISC] * 1001})
    ring = [[math.cos(k / 500.0) * 90, math.sin(k / 500.0) * 90] for k in range(3001)]
    ban = {"kind": "no-fly", "polygon": ring}
    with pytest.raises(ScenarioError, match="12,004 corners together: expected at most 10,000"):
        load_scenario("village", **{"risk.regions": [ban] * 4})
    with pytest.raises(ScenarioError, match=r"risk\.carried\.vehicles names vehicle 99"):
        load_scenario("village", **{"risk.carried.vehicles": [99]})
    with pytest.raises(ScenarioError, match="vehicles names one twice"):
        load_scenario("village", **{"risk.carried.vehicles": [0, 0]})
