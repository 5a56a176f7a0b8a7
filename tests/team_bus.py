"""Agents that stand still, on a bus that loses messages; targets that all of them track."""

import math

import numpy as np

from staniel.cooperation import Allocation, CooperationConfig, Price, Task
from staniel.datatypes.belief import Pose, TrackId
from staniel.kernels.dubins import shortest_length

RADIUS = 33.0


class Bus:
    """Agents at fixed poses; every message reaches every other one with probability 1 - loss."""

    def __init__(self, poses, targets, *, loss=0.0, seed=0, seers=None, names=None, config=None):
        self.config = config or CooperationConfig()
        self.poses = [Pose(x, y, 80.0, heading, 0.0, 15.0) for x, y, heading in poses]
        self.sides = [Allocation(i, self.config, step=1.0) for i in range(len(poses))]
        self.targets, self.loss, self.rng = (
            dict(enumerate(targets)),
            loss,
            np.random.default_rng(seed),
        )
        self.seers = seers or {k: set(range(len(poses))) for k in self.targets}
        # Each agent's own name for each target, which renames change.
        self.names = {
            (agent, k): (names or {}).get((agent, k), TrackId(0.0, agent, k))
            for agent in range(len(poses))
            for k in self.targets
        }
        self.inboxes = [[] for _ in poses]
        self.dead, self.log, self.time = set(), [], 0.0
        self.health, self.alone = {}, set()
        self.trackers = {}  # of each target; not told: all
        self.overdue = 0.0  # share of the streets
        self.offsets = {}  # of an agent's instants within the second

    def cost(self, agent, target):
        pose, (x, y) = self.poses[agent], self.targets[target]
        return shortest_length(pose.x, pose.y, pose.heading, x, y, 0.0, RADIUS)

    def prices(self, agent):
        pose = self.poses[agent]

        def of(goals):
            return [
                Price(shortest_length(pose.x, pose.y, pose.heading, *g.position, g.course, RADIUS))
                for g in goals
            ]

        return of

    def tick(self):
        self.time += 1.0
        said = []
        for agent, side in enumerate(self.sides):
            if agent in self.dead:
                continue
            tasks = [
                Task(
                    self.names[agent, k],
                    place,
                    0.0,
                    self.cost(agent, k),
                    agent in self.seers[k],
                    last_seen=self.time if self.seers[k] else 0.0,
                )
                for k, place in self.targets.items()
                if agent in self.trackers.get(k, range(len(self.sides)))
            ]
            out = side.step(
                self.time + self.offsets.get(agent, 0.0),
                self.poses[agent],
                tasks,
                self.inboxes[agent],
                self.prices(agent),
                health=self.health.get(agent, "healthy"),
                alone=agent in self.alone,
                overdue=self.overdue,
            )
            for old, new in side.renames:
                key = next(k for k, name in self.names.items() if k[0] == agent and name == old)
                self.names[key] = new
            role = "patrol" if side.patrolling else "search" if side.holding is None else "pursue"
            said += [*out, side.heartbeat(role, (0.0, 0.0))]
        self.log += said
        self.inboxes = [
            [m for m in said if m.sender != agent and not self.loses(m, agent)]
            for agent in range(len(self.sides))
        ]

    def loses(self, message, receiver):
        """Whether a message does not reach a receiver."""
        return self.rng.random() < self.loss

    def run(self, ticks):
        for _ in range(ticks):
            self.tick()
        return self

    def holders(self, target):
        place = self.targets[target]
        return [
            agent
            for agent, side in enumerate(self.sides)
            if agent not in self.dead
            and side.holding is not None
            and math.dist(side.holding.position, place) < 1.0
        ]

    def said(self, kind):
        return [m for m in self.log if isinstance(m, kind)]
