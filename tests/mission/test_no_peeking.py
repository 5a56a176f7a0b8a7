"""The team thinks with the truth poisoned: any read of it while an agent steps raises."""

import numpy as np
import pytest

from staniel.agent import Agent
from staniel.city import City
from staniel.datatypes.truth import Truth
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble


class PeekingError(AssertionError):
    """The truth was read by somebody who must not see it."""


@pytest.fixture
def poisoned(monkeypatch):
    """While an agent steps, `Truth` objects and the world's own city raise at any read."""
    state = {"thinking": False, "true_city": None, "reads": 0}
    plain_truth, plain_city, step = Truth.__getattribute__, City.__getattribute__, Agent.step

    def read_truth(self, name):
        if state["thinking"]:
            raise PeekingError(f"Truth.{name}")
        state["reads"] += 1
        return plain_truth(self, name)

    def read_city(self, name):
        if state["thinking"] and self is state["true_city"]:
            raise PeekingError(f"City.{name} of the world")
        return plain_city(self, name)

    def think(self, percept, inbox):
        state["thinking"] = True
        try:
            return step(self, percept, inbox)
        finally:
            state["thinking"] = False

    monkeypatch.setattr(Truth, "__getattribute__", read_truth)
    monkeypatch.setattr(City, "__getattribute__", read_city)
    monkeypatch.setattr(Agent, "step", think)
    return state


def test_agents_never_read_the_truth(poisoned):
    scenario = load_scenario("downtown", minutes=3.0, seed=1)
    city = build_city(scenario.city, scenario.seed)
    poisoned["true_city"] = city
    mission = assemble(scenario, city)
    frames = list(mission.frames())
    assert poisoned["reads"] > 0
    assert any(belief.role == "pursue" for belief in frames[-1].beliefs)


def test_the_poison_works(poisoned):
    scenario = load_scenario("downtown", minutes=0.1)
    city = build_city(scenario.city, scenario.seed)
    poisoned["true_city"] = city
    mission = assemble(scenario, city)
    truth = mission.world.start()

    class Peeker:
        belief = mission.agents[0].belief

        def step(self, percept, inbox):
            return truth.vehicles

    poisoned["thinking"] = True
    with pytest.raises(PeekingError, match=r"Truth\.vehicles"):
        Peeker().step(None, [])
    with pytest.raises(PeekingError, match="of the world"):
        city.visible([[0.0, 0.0, 1.0]], [[1.0, 1.0, 1.0]])
    poisoned["thinking"] = False


def test_percepts_share_no_memory_with_the_truth():
    scenario = load_scenario("downtown", minutes=1.0)
    mission = assemble(scenario, build_city(scenario.city, scenario.seed))
    for frame in mission.frames():
        arrays = [
            array
            for percept in frame.percepts
            for sighting in percept.sightings
            for array in (sighting.position, sighting.covariance)
        ]
        truth = frame.truth
        for array in arrays:
            for own in (truth.aircraft, truth.vehicles, truth.aircraft_path, truth.vehicle_path):
                assert not np.shares_memory(array, own)
