"""One mind by itself: percepts and messages in by hand, commands and messages out."""

import math

import numpy as np
import pytest

from staniel.agent import Agent, Briefing
from staniel.city import City
from staniel.cooperation import CooperationConfig
from staniel.datatypes.belief import Percept, Pose, Sighting, TrackId
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.equipment import Airframe, Camera
from staniel.datatypes.message import Announce, Award, Heartbeat, Looked, Release, Report
from staniel.guidance import GuidanceConfig
from staniel.tracking import TrackingConfig

GUIDANCE = GuidanceConfig()
CHASING = GuidanceConfig(pursuit="carrot")
SIGMA = np.eye(2) * 1.5**2


def agent_of(number=0, guidance=GUIDANCE, cooperation=CooperationConfig()):  # noqa: B008 - frozen
    briefing = Briefing(
        chart=City.open((600.0, 600.0)),
        clock=Clock(),
        airframe=Airframe(),
        camera=Camera(),
        tracking=TrackingConfig(),
        cooperation=cooperation,
        guidance=guidance,
    )
    return Agent(number, briefing, np.random.default_rng(3))


def place(k):
    """A vehicle that drives east at 2 m/s."""
    return 300.0 + 2.0 * k, 320.0


def see(k, reporter=0):
    return Sighting(float(k), place(k), SIGMA, reporter=reporter)


def percept(k, *sightings, pose=None):
    return Percept(float(k), pose or Pose(150.0, 300.0, 80.0, 0.0, 0.0, 15.0), sightings)


def said(outbox, kind):
    return [message for message in outbox if isinstance(message, kind)]


def found(agent):
    """An agent that found a vehicle by itself and was awarded it by its own auction."""
    log = []
    for k in range(12):
        command, outbox = agent.step(percept(k, see(k)), [])
        log += outbox
    assert agent.belief.role == "pursue"
    return agent, log, command


@pytest.fixture
def holder():
    return found(agent_of())


def test_a_lone_finder_announces_awards_itself_and_holds(holder):
    agent, log, _ = holder
    (announced, *_) = said(log, Announce)
    (award,) = said(log, Award)
    assert announced.time == 2.0  # the third consistent detection
    assert award.winner == agent.id == 0
    assert award.time == announced.time + CooperationConfig().bid_wait
    assert said(log, Heartbeat)[-1].target == award.target == agent.belief.target
    assert len(said(log, Heartbeat)) == len(said(log, Report)) == 12


def test_the_default_looks_ahead_and_says_what_it_flies(holder):
    agent, log, command = holder
    assert agent.belief.role == "pursue"
    assert isinstance(command, FlyBanks)
    assert command.look == pytest.approx(place(11.75), abs=3.0)
    assert said(log, Heartbeat)[-1].command == command


def test_a_policy_is_told_where_the_gimbal_looked_until_now(holder):
    agent, _, command = holder
    told, policy = [], agent._pursue
    agent._pursue = lambda pursuit: told.append(pursuit.look) or policy(pursuit)
    after, _ = agent.step(percept(12, see(12)), [])
    agent.step(percept(13, see(13)), [])
    assert told == [command.look, after.look]


def test_the_carrot_flies_to_the_prediction_three_steps_ahead():
    agent, _, command = found(agent_of(guidance=CHASING))
    (track,) = agent.belief.tracks
    assert isinstance(command, FlyLine)
    assert command.end == pytest.approx(tuple(track.position + 3.0 * track.velocity))
    assert command.end == pytest.approx(place(11 + 3), abs=5.0)


def test_the_carrot_circles_when_close():
    agent, _, _ = found(agent_of(guidance=CHASING))
    above = Pose(place(12)[0] - 30.0, place(12)[1], 80.0, 0.0, 0.0, 15.0)
    command, _ = agent.step(percept(12, see(12), pose=above), [])
    assert isinstance(command, FlyOrbit)
    assert command.radius == GUIDANCE.loiter_radius


def test_a_lost_target_is_released_its_last_place_circled_and_then_left(holder):
    agent, _, _ = holder
    released, roles = None, {}
    for k in range(12, 80):
        command, outbox = agent.step(percept(k), [])
        roles[k] = agent.belief.role
        for release in said(outbox, Release):
            released = k
            assert release.lost
        if roles[k] == "recover":
            assert isinstance(command, FlyOrbit)
            # Where it last was by the belief: not further than it can have driven unseen.
            assert math.dist(command.center, place(11)) < 2.5 * 17
    unseen = TrackingConfig().unseen_limit
    assert released is not None
    assert released - 11 <= unseen + 1
    assert roles[released] == "recover"
    assert agent.belief.target is None
    searching = [k for k, role in roles.items() if role == "search"]
    assert searching[0] - released == pytest.approx(GUIDANCE.recover_time, abs=2.0)
    assert agent.belief.tracks == []


def test_a_search_stays_where_it_saw_something_once():
    agent = agent_of()
    command, _ = agent.step(percept(1), [])
    assert isinstance(command, FlyLine)
    for k in range(2, 30):
        sightings = [see(2)] if k == 2 else []
        command, _ = agent.step(percept(k, *sightings), [])
        assert agent.belief.role == "search"
        stays = k < 2 + GUIDANCE.glimpse_time
        if stays:
            assert math.dist(agent.belief.goal, place(2)) < 10.0
        assert isinstance(command, FlyOrbit) == stays
    flies_on = agent_of(guidance=GUIDANCE.model_copy(update={"glimpse_time": 0.0}))
    command, _ = flies_on.step(percept(2, see(2)), [])
    assert isinstance(command, FlyLine)


def test_what_a_track_explains_is_no_glimpse():
    """Another aircraft holds it: this one searches on."""
    agent = agent_of(1)
    for k in range(1, 14):
        beat = Heartbeat(
            0, k, k - 1.0, pose=Pose(0.0, 0.0, 80.0, 0.0, 0.0, 15.0), role="pursue", goal=(0, 0),
            target=TrackId(0.0, 0, 1), target_position=place(k - 1), cost=0.0,
        )  # fmt: skip
        command, _ = agent.step(percept(k, see(k)), [beat])
    assert len(agent.belief.tracks) == 1
    assert (agent.belief.role, agent.belief.target) == ("search", None)
    assert isinstance(command, FlyLine)


def test_what_others_saw_becomes_a_track_of_ones_own():
    agent = agent_of(1)
    for k in range(1, 8):
        # Said in tick k - 1, heard in tick k.
        report = Report(0, k, k - 1.0, sightings=(see(k - 1, reporter=0),))
        _, outbox = agent.step(percept(k), [report])
        assert not said(outbox, Report)
    (track,) = agent.belief.tracks
    assert math.dist(track.position, place(7)) < 5.0
    # It did not see it itself: the auction is the finder's to open.
    assert agent.belief.role == "search"


def test_a_searching_agent_flies_a_leg_to_its_goal():
    agent = agent_of()
    command, outbox = agent.step(percept(0), [])
    assert isinstance(command, FlyLine)
    (heartbeat,) = said(outbox, Heartbeat)
    assert heartbeat.role == "search"
    assert heartbeat.goal == command.end == agent.belief.goal


def test_what_was_looked_at_is_said_every_so_often_and_heeded():
    teller, hearer = agent_of(0), agent_of(1)
    words = []
    for k in range(11):
        _, outbox = teller.step(percept(k), [])
        words += said(outbox, Looked)
    assert [word.time for word in words] == [0.0, 5.0, 10.0]
    far = Pose(10.0, 10.0, 80.0, 0.0, 0.0, 15.0)
    hearer.step(percept(11, pose=far), [words[-1]])
    news = hearer._searcher._map.ages
    assert news[15, 7] == 10.0  # below the teller
    assert hearer.dropped["malformed"] == 0


def test_a_word_that_is_none_is_dropped_and_counted():
    agent = agent_of()
    agent.step(percept(0), [Looked(1, 1, 0.0, cells=b"nonsense")])
    assert agent.dropped["malformed"] == 1


def test_a_team_that_is_not_to_share_is_silent():
    agent = agent_of(cooperation=CooperationConfig(share_every=0.0))
    assert not said(agent.step(percept(0), [])[1], Looked)
