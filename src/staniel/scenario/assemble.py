"""A scenario becomes a mission that is ready to fly, and every stage gets a stream of its own."""

from dataclasses import replace

import numpy as np

from staniel.agent import Agent, Briefing
from staniel.city import City
from staniel.mission import Mission
from staniel.scenario.model import Scenario
from staniel.world import Cameras, Radio, World

__all__ = ["assemble"]


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
        An aircraft or a vehicle has no place in this city.
    """
    world_seed, camera_seed, radio_seed, agent_seed = np.random.SeedSequence(scenario.seed).spawn(4)
    team, clock = scenario.aircraft, scenario.clock
    chart = City.open(city.size) if scenario.chart == "blank" else replace(city)
    briefing = Briefing(
        chart=chart,
        clock=clock,
        airframe=team,
        camera=scenario.camera,
        tracking=scenario.tracking,
        cooperation=scenario.cooperation,
        guidance=scenario.guidance,
    )
    world = World(city, team, team.count, scenario.vehicles, clock, world_seed)
    return Mission(
        world=world,
        cameras=Cameras(city, scenario.camera, team.altitude, camera_seed),
        radio=Radio(scenario.radio, radio_seed.generate_state(1, np.uint64)[0]),
        agents=[
            Agent(number, briefing, np.random.default_rng(seed))
            for number, seed in enumerate(agent_seed.spawn(team.count))
        ],
        start=world.start(),
        ticks=round(scenario.minutes * 60.0 / clock.decision_step),
    )
