"""A scenario becomes a mission that is ready to fly, and every stage gets a stream of its own."""

import math
from dataclasses import replace

import numpy as np

from staniel.agent import Agent, Briefing
from staniel.city import City
from staniel.cooperation import CooperationConfig
from staniel.errors import ScenarioError
from staniel.ground import Ground, GroundBriefing
from staniel.mission import Mission, Station
from staniel.scenario.model import Scenario
from staniel.world import Lidars, MixedCameras, Radio, ThreatSensors, World

__all__ = ["assemble", "kernels_of"]

_ROUNDING = 1e-9  # of a tick
_STALE = 60.0  # beyond what the radio delays, a message is too old to be heeded [s]
_MAST = 10.0  # height of a ground station's antenna [m]


def assemble(scenario: Scenario, city: City) -> Mission:
    """World, cameras, radio and agents of one mission.

    Randomness: the scenario's seed spawns one `numpy.random.SeedSequence` a stage, and the agents'
    one spawns one an agent, so that another aircraft changes nobody's draws.

    Parameters
    ----------
    scenario : Scenario
    city : City
        The true one. Agents get a copy of it as their chart, or an empty one where
        ``scenario.chart`` is ``"blank"``.

    Returns
    -------
    Mission

    Raises
    ------
    ScenarioError
        An aircraft or a vehicle has no place in this city, or sightings would come too late.
    """
    seeds = np.random.SeedSequence(scenario.seed).spawn(7)
    (
        world_seed, camera_seed, radio_seed, agent_seed, lidar_seed, threat_seed, station_seed,
    ) = seeds  # fmt: skip
    team, clock = scenario.aircraft, scenario.clock
    cameras, airframes = scenario.cameras, scenario.airframes
    slowest = max(camera.delay for camera in cameras)
    if slowest > scenario.tracking.late_limit:
        raise ScenarioError(
            f"camera.delay = {slowest:g} s: expected at most "
            f"tracking.late_limit = {scenario.tracking.late_limit:g} s, or no sighting is used"
        )
    chart = City.open(city.size) if scenario.chart == "blank" else replace(city)
    briefing = Briefing(
        chart=chart,
        clock=clock,
        airframe=team,
        camera=scenario.camera,
        tracking=scenario.tracking,
        cooperation=_patient(scenario),
        guidance=scenario.guidance,
        risk=scenario.risk.briefed,
        carried=scenario.risk.carried.briefing,
        lidar=scenario.lidar,
        team=range(team.count + 1),
        patience=_STALE + scenario.radio.latency + 5.0 * scenario.radio.jitter,
        centre=team.count if scenario.cooperation.mode == "centralised" else None,
    )
    world = World(
        city,
        team,
        team.count,
        scenario.vehicles,
        clock,
        world_seed,
        wind=scenario.wind,
        faults=scenario.faults,
        launch=scenario.launch,
        airframes=airframes,
        following=scenario.guidance.following,
        approach=scenario.guidance.approach,
        low=sees_buildings(scenario),
    )
    lidar, risk = scenario.lidar, scenario.risk
    return Mission(
        world=world,
        cameras=MixedCameras(city, cameras, team.altitude, camera_seed, clock),
        radio=Radio(
            scenario.radio,
            radio_seed.generate_state(1, np.uint64)[0],
            city,
            clock.decision_step,
        ),
        agents=[
            Agent(
                number,
                replace(briefing, airframe=airframes[number], camera=cameras[number]),
                np.random.default_rng(seed),
            )
            for number, seed in enumerate(agent_seed.spawn(team.count))
        ],
        start=world.start(),
        ticks=round(scenario.minutes * 60.0 / clock.decision_step),
        lidars=None if lidar.mount == "none" else Lidars(city, lidar, lidar_seed),
        threat_sensors=ThreatSensors(city, risk, threat_seed) if risk.sensor.range else None,
        station=_station(scenario, briefing, station_seed),
    )


def _station(
    scenario: Scenario, briefing: Briefing, seed: np.random.SeedSequence
) -> Station | None:
    """The ground node, where the mode has one."""
    config = briefing.cooperation
    if config.mode != "centralised":
        return None
    told = GroundBriefing(briefing.chart, briefing.airframe, briefing.tracking, config)
    ground = Ground(scenario.aircraft.count, told, np.random.default_rng(seed))
    silent = scenario.faults.station
    return Station(
        ground, (*(config.station or (0.0, 0.0)), _MAST), math.inf if silent is None else silent
    )


def sees_buildings(scenario: Scenario) -> bool:
    """Whether the team avoids buildings, and can see them: then it may fly below the roofs."""
    seen = scenario.chart == "known" or scenario.lidar.mount != "none"
    return scenario.guidance.avoidance != "none" and seen


def _patient(scenario: Scenario) -> CooperationConfig:
    """Cooperation with `bid_wait` longer by what the radio takes for an announcement and a bid.

    Beyond the one tick each that they take at least.
    """
    hop = math.ceil(scenario.radio.latency / scenario.clock.decision_step - _ROUNDING)
    wait = scenario.cooperation.bid_wait + 2 * max(hop - 1, 0)
    return scenario.cooperation.model_copy(update={"bid_wait": wait})


def kernels_of(scenario: Scenario) -> list[str]:
    """Kernel modules that this scenario calls beside those that every mission does."""
    dangerous = bool(scenario.risk.regions or scenario.risk.carried.radius)
    uses = {
        "auction": scenario.cooperation.mode != "none",
        "gusts": scenario.wind.gusts,
        "occupancy": scenario.guidance.avoidance == "predictive",
        "avoidance": scenario.guidance.avoidance == "predictive",
        "lidar": scenario.lidar.mount != "none",
        "risk": dangerous,
        "threats": dangerous,
        "roads": scenario.vehicles.kind == "roads",
        "replay": scenario.vehicles.kind == "replay",
    }
    searched = scenario.guidance.pursuit == "lookahead"
    pursuit = (
        ["forecast", "lookahead", "lookout", "moves", "outlook", "sightlines"] if searched else []
    )
    return [*(name for name, used in uses.items() if used), *pursuit]
