"""A small world for avoidance alone: agents that want to go somewhere, walls, lidars, a radio."""

import math

import numpy as np

from staniel.city import City
from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.belief import Percept, Pose
from staniel.datatypes.clock import Clock
from staniel.datatypes.equipment import Airframe, Lidar
from staniel.datatypes.lidar import LidarScan
from staniel.datatypes.message import Heartbeat
from staniel.guidance import GuidanceConfig
from staniel.guidance.avoidance import avoidance_for
from staniel.kernels.flight import fly
from staniel.kernels.lidar import sweep
from staniel.world.lidar import build_facades

CLOCK, RANGE = Clock(), 140.0


class Flown:
    """Aircraft on constant commands, each behind its own avoidance.

    After `run`: `path` (10 a second, n, 6), `guards` and `flown`, one row a second.
    """

    def __init__(
        self,
        poses,
        commands,
        *,
        city=None,
        chart=None,
        aperture=180.0,
        regions=(),
        heard=lambda tick, sender, receiver: True,
        wind=(0.0, 0.0),
        airframe=None,
        **config,
    ):
        self.city = city or City.open((1000.0, 1000.0))
        self.airframe = airframe or Airframe()
        lidar = Lidar(mount="scanner", range=RANGE, aperture_deg=aperture)
        settings = GuidanceConfig(**({"avoidance": "predictive"} | config))
        blank = City.open(self.city.size)
        self.minds = [
            avoidance_for(i, self.airframe, CLOCK, chart or blank, lidar, settings)
            for i in range(len(poses))
        ]
        self.state = np.array(poses, dtype=np.float64)
        self.climbs = np.zeros(len(poses))
        self.commands, self.regions, self.heard, self.wind = commands, regions, heard, wind
        half = int(0.5 * aperture)
        self.angles = np.radians(np.arange(-half, half + 1.0))
        self.facades = build_facades(self.city)
        self.said = []
        self.tick = 0
        self.path, self.guards, self.flown = [self.state.copy()], [], []

    def scan(self, i):
        fan = np.column_stack((np.cos(self.angles), np.sin(self.angles)))
        ranges = sweep(
            self.facades,
            self.city.walls,
            np.ascontiguousarray(self.state[None, i : i + 1]),
            fan,
            math.radians(1.0),
            RANGE,
            0.1,
            np.uint64(7 + i),
            self.tick,
        )
        return LidarScan(float(self.tick), Pose(*self.state[i]), self.angles, ranges[0, 0], 0.1)

    def run(self, seconds):
        n = len(self.state)
        row = limits([self.airframe] * n)
        for _ in range(seconds):
            flown, guards, said = [], [], []
            for i, mind in enumerate(self.minds):
                pose, time = Pose(*self.state[i].tolist()), float(self.tick)
                inbox = [
                    word
                    for word in self.said
                    if word.sender != i and self.heard(self.tick, word.sender, i)
                ]
                percept = Percept(time, pose, (), self.scan(i))
                command, guard = mind.step(percept, inbox, self.regions, self.commands[i])
                flown.append(command)
                guards.append(guard)
                said.append(
                    Heartbeat(
                        i,
                        self.tick,
                        time,
                        pose,
                        "search",
                        (0.0, 0.0),
                        None,
                        None,
                        0.0,
                        command=command,
                    )
                )
            air = np.empty((CLOCK.substeps, n, 2))
            air[:] = self.wind
            path, self.climbs = fly(
                self.state, self.climbs, encode(flown), row, air,
                CLOCK.dynamics_step, CLOCK.substeps,
            )  # fmt: skip
            self.state = path[-1].copy()
            self.path.extend(path)
            self.said = said
            self.guards.append(guards)
            self.flown.append(flown)
            self.tick += 1
        return self

    @property
    def places(self):
        """(t, n, 3) ten times a second."""
        return np.array(self.path)[:, :, :3]

    @property
    def nearest(self):
        """Least distance of any two, ever."""
        places, n = self.places, len(self.state)
        gaps = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
        gaps[:, np.arange(n), np.arange(n)] = np.inf
        return gaps.min()

    @property
    def strikes(self):
        """How many pieces of the paths meet the inside of a building."""
        places = self.places
        ends = places[:-1].reshape(-1, 3), places[1:].reshape(-1, 3)
        return int((~self.city.visible_pairs(*ends)).sum())
