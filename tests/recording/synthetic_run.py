"""A made-up run, frame by frame: shaped like a mission's, flown by nobody."""

import math

import numpy as np

from staniel.city import City
from staniel.datatypes.belief import Belief, Percept, Pose, Sighting, TrackEstimate, TrackId
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.message import (
    Announce,
    Award,
    Bid,
    Delivery,
    Heartbeat,
    Offer,
    Release,
    Report,
    Revoke,
)
from staniel.datatypes.truth import Truth
from staniel.record import Frame

CLOCK = Clock()
VERSION = "0.0.test"
TERMS = (90.0, 4.0, 0.5, 12.25, 0.0, 3.125, -5.0, -2.0)


def scenario(minutes=1.0, seed=7):
    return {
        "name": "made-up",
        "seed": seed,
        "minutes": minutes,
        "camera": {"half_aperture_deg": 60.0, "range": 250.0},
    }


def frames(city, ticks, *, aircraft=4, vehicles=4, tracks=4, seed=7, clock=CLOCK):
    """Frames of `ticks` decision steps; each aircraft believes in `tracks` targets."""
    rng = np.random.default_rng(seed)
    team = _Team(city, aircraft, rng)
    traffic = _Traffic(city, vehicles, rng)
    for tick in range(1, ticks + 1):
        time = tick * clock.decision_step
        aircraft_path = np.array([team.step(clock.dynamics_step) for _ in range(clock.substeps)])
        vehicle_path = np.array([traffic.step(clock.dynamics_step) for _ in range(clock.substeps)])
        truth = Truth(
            tick=tick,
            time=time,
            aircraft=aircraft_path[-1],
            vehicles=vehicle_path[-1],
            traffic=np.zeros((vehicles, 2)),
            aircraft_path=aircraft_path,
            vehicle_path=vehicle_path,
        )
        yield _frame(truth, tracks, rng)


class _Team:
    """Aircraft on orbits whose radius breathes."""

    def __init__(self, city, n, rng):
        self.low, self.high = np.zeros(2), np.array(city.size)
        self.state = np.zeros((n, 6))
        self.state[:, :2] = rng.uniform(0.2, 0.8, (n, 2)) * self.high
        self.state[:, 2] = 80.0 + 5.0 * np.arange(n)
        self.state[:, 3] = rng.uniform(-math.pi, math.pi, n)
        self.state[:, 5] = 15.0
        self.clock = 0.0

    def step(self, dt):
        self.clock += dt
        state = self.state.copy()
        n = np.arange(len(state))
        outward = self.high / 2 - state[:, :2]
        home = np.arctan2(outward[:, 1], outward[:, 0])
        far = np.hypot(*outward.T) > 0.4 * self.high.min()
        error = (home - state[:, 3] + math.pi) % (2 * math.pi) - math.pi
        wish = np.where(far, np.clip(error, -0.6, 0.6), 0.5 * np.sin(self.clock / (9 + 4 * n) + n))
        state[:, 4] += np.clip(wish - state[:, 4], -0.1, 0.1)
        state[:, 3] += dt * 9.81 / 15.0 * np.tan(state[:, 4])
        state[:, 3] = (state[:, 3] + math.pi) % (2 * math.pi) - math.pi
        state[:, 0] += dt * 15.0 * np.cos(state[:, 3])
        state[:, 1] += dt * 15.0 * np.sin(state[:, 3])
        self.state = state
        return state


class _Traffic:
    """Vehicles that drive straight and turn away where a building or the edge is in front."""

    def __init__(self, city, n, rng):
        self.city, self.rng = city, rng
        places = []
        while len(places) < n:
            place = rng.uniform(0.1, 0.9, 2) * city.size
            if not city.inside([place])[0]:
                places.append(place)
        self.state = np.zeros((n, 4))
        self.state[:, :2] = np.reshape(places, (n, 2))
        self.state[:, 2] = rng.integers(0, 4, n) * math.pi / 2
        self.state[:, 3] = 2.0

    def step(self, dt):
        state = self.state.copy()
        for _ in range(8):
            feel = state[:, :2] + 4.0 * np.stack([np.cos(state[:, 2]), np.sin(state[:, 2])], axis=1)
            blocked = self.city.inside(feel) | (
                (feel < 2) | (feel > np.array(self.city.size) - 2)
            ).any(1)
            turn = self.rng.choice([0.5, -0.5, 1.0], len(state)) * math.pi
            state[:, 2] = np.where(blocked, state[:, 2] + turn, state[:, 2])
        state[:, 2] = (state[:, 2] + math.pi) % (2 * math.pi) - math.pi
        state[:, 0] += np.where(blocked, 0.0, dt * state[:, 3] * np.cos(state[:, 2]))
        state[:, 1] += np.where(blocked, 0.0, dt * state[:, 3] * np.sin(state[:, 2]))
        self.state = state
        return state


def _frame(truth, tracks, rng):
    percepts, origins, beliefs, commands, deliveries = [], [], [], [], []
    others = len(truth.aircraft) - 1
    for agent, pose in enumerate(truth.aircraft):
        own = Pose(*pose.tolist())
        sightings, causes = _sightings(truth, agent, own, rng)
        percepts.append(Percept(truth.time, own, sightings))
        origins.append(causes)
        belief = _belief(truth, agent, tracks, rng)
        beliefs.append(belief)
        commands.append(_command(agent, truth.tick, belief.goal))
        for message in _messages(truth, agent, own, belief, sightings):
            heard = tuple(n for n in range(others + 1) if n != agent and rng.random() < 0.9)
            deliveries.append(Delivery(message, others, heard))
    return Frame(truth, percepts, origins, deliveries, commands, beliefs)


def _sightings(truth, agent, own, rng):
    sightings, causes = [], []
    for vehicle, (x, y, _, _) in enumerate(truth.vehicles.tolist()):
        if math.hypot(x - own.x, y - own.y) < 120.0 and rng.random() < 0.7:
            place = rng.normal([x, y], 1.5)
            covariance = [[2.25, 0.3], [0.3, 3.1]]
            sightings.append(Sighting(truth.time, place, covariance, reporter=agent, pose=own))
            causes.append(vehicle)
    if rng.random() < 0.05:
        place = rng.normal([own.x, own.y], 40.0)
        sightings.append(Sighting(truth.time, place, 2.25 * np.eye(2), reporter=agent, pose=own))
        causes.append(-1)
    return tuple(sightings), tuple(causes)


def _belief(truth, agent, tracks, rng):
    estimates = []
    for vehicle, (x, y, heading, speed) in enumerate(truth.vehicles[:tracks].tolist()):
        if truth.tick < 10 + 7 * vehicle:
            continue
        spread = 4.0 + 3.0 * math.sin(truth.tick / 9 + vehicle) + 4.0 * (vehicle % 2)
        estimates.append(
            TrackEstimate(
                id=TrackId(10.0 + 7 * vehicle, vehicle % 4, vehicle),
                time=truth.time,
                position=rng.normal([x, y], 1.0),
                velocity=speed * np.array([math.cos(heading), math.sin(heading)]),
                covariance=np.array([[spread**2, 2.0], [2.0, 0.6 * spread**2]]),
                existence=0.9,
                last_seen=max(0.0, truth.time - truth.tick % 4),
            )
        )
    target = estimates[agent % len(estimates)] if estimates else None
    goal = tuple(target.position.tolist()) if target else (100.0, 100.0)
    return Belief(estimates, "pursue" if target else "search", target.id if target else None, goal)


def _command(agent, tick, goal):
    if tick % 7 == 0:
        look = goal if tick % 2 else None
        return FlyBanks((0.1, -0.2, 0.0), 1.5, 15.0, 80.0, look)
    if (tick + agent) % 2:
        return FlyOrbit(goal, 40.0, -1 if agent % 2 else 1, 15.0, 80.0)
    return FlyLine((goal[0] - 50.0, goal[1]), goal, 15.0, 80.0)


def _messages(truth, agent, own, belief, sightings):
    time, number = truth.time, 10 * truth.tick
    target = belief.target
    place = belief.goal if target else None
    yield Heartbeat(agent, number, time, own, belief.role, belief.goal, target, place, math.inf)
    if sightings:
        yield Report(agent, number + 1, time, sightings)
    if target is not None and truth.tick % 20 == agent:
        other = (agent + 1) % len(truth.aircraft)
        yield Announce(agent, number + 2, time, target, place, 0.5, 120.0)
        yield Bid(agent, number + 3, time, *_bid(belief, other))
        unable = Offer((agent + 2) % len(truth.aircraft), math.inf)
        bids = (Offer(agent, 101.0 + agent, TERMS), Offer(other, 99.5, TERMS[:2]), unable)
        yield Award(agent, number + 4, time, target, place, other, 99.5, bids)
        yield Award(agent, number + 7, time, target, place, other, 99.5)
        yield Revoke(agent, number + 5, time, target, other, target, place, 88.0)
        yield Release(agent, number + 6, time, target, place, True)


def _bid(belief, auctioneer):
    """One bid for all targets, the agent's own first, of which only the first cost is told."""
    others = [track.id for track in belief.tracks if track.id != belief.target]
    targets = (belief.target, *others)
    costs = (130.25, *[math.inf] * len(others))
    return targets, (auctioneer,) * len(targets), costs, (TERMS, *[()] * len(others))


def open_city():
    return City.open((600.0, 600.0))
