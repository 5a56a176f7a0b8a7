"""One aircraft's mind: tracking, then cooperation, then guidance.

It has three doors and no others: a percept and an inbox come in, a command and an outbox go out.
What flies knows only what it saw, what it was told, and what it was ordered.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.cooperation import (
    Allocation,
    Assistance,
    CooperationConfig,
    CostModel,
    Gate,
    Goal,
    Holding,
    Searcher,
    Situation,
    Task,
    priority_at,
)
from staniel.datatypes.belief import Belief, Percept, Pose, TrackEstimate, TrackId
from staniel.datatypes.clock import Clock
from staniel.datatypes.command import Command, FlyBanks, FlyLine, look_point
from staniel.datatypes.equipment import Airframe, Camera, Lidar
from staniel.datatypes.message import Heartbeat, Message, Point, Report, Warn
from staniel.datatypes.risk import CarriedThreat, RiskRegion
from staniel.guidance import (
    GuidanceConfig,
    KnownDangers,
    NoFeasibleFlightError,
    Partner,
    Pursuit,
    avoidance_for,
    loiter,
    predicted_visibility,
    pursuit_policy_named,
    safe_loiter,
)
from staniel.tracking import CameraView, Coverage, Picture, TrackingConfig

__all__ = ["Agent", "Briefing"]

_FORESEEN = 16
"""Particles by which the agent foresees what it will see."""

_FORESIGHT_TICKS = 5.0
"""Over which that is averaged."""

_LONGEST_WAY = 120.0
"""A target is given up when the agent has not come near its place by then [s]."""


@dataclass(frozen=True, slots=True)
class Briefing:
    """What every agent of a team is told before the start.

    Of dangers it is told of `risk`, some regions, and of `carried`: that vehicles carry a threat of
    this radius and rate, but not which ones do.
    """

    chart: City
    clock: Clock
    airframe: Airframe
    camera: Camera
    tracking: TrackingConfig
    cooperation: CooperationConfig
    guidance: GuidanceConfig
    risk: tuple[RiskRegion, ...] = ()
    carried: CarriedThreat | None = None
    lidar: Lidar = Lidar()  # noqa: RUF009 - frozen
    team: range | None = None
    """Ids of all that may speak on the radio; None: anybody."""
    patience: float = 60.0
    """What was said longer ago is not heeded [s]."""
    centre: int | None = None
    """Id of the ground station that shares targets out, where one does."""


class Agent:
    """The mind of one aircraft.

    Parameters
    ----------
    id : int
        The aircraft's number in the team.
    briefing : Briefing
    rng : numpy.random.Generator
        Its own.

    Attributes
    ----------
    belief : Belief
        What it holds true and does, as of the last step.
    dangers : KnownDangers
        What it was told and noticed of threats and no-fly regions.
    """

    def __init__(self, id: int, briefing: Briefing, rng: np.random.Generator) -> None:
        airframe, clock = briefing.airframe, briefing.clock
        self.id, self._briefing = id, briefing
        self._gate = Gate(
            id, team=briefing.team, patience=briefing.patience, step=clock.decision_step
        )
        self._picture = Picture(briefing.tracking, rng, id, briefing.chart)
        self._tracker = self._picture.tracker
        self._allocation = Allocation(
            id,
            briefing.cooperation,
            step=clock.decision_step,
            centre=briefing.centre,
        )
        self._assistance = Assistance(id, briefing.cooperation, step=clock.decision_step)
        self._costs = CostModel(
            briefing.cooperation.cost,
            airframe,
            briefing.camera,
            briefing.chart,
            briefing.cooperation.areas,
        )
        self._visibility = 1.0
        self._arrived: float | None = None
        self._searcher = Searcher(
            id,
            briefing.chart,
            airframe,
            briefing.camera,
            briefing.cooperation,
            glimpse_time=briefing.guidance.glimpse_time,
        )
        self._pursue = pursuit_policy_named(briefing.guidance.pursuit)
        self._lookahead = briefing.guidance.prediction_steps * clock.decision_step
        self.dangers = KnownDangers(
            briefing.risk, briefing.carried, speed=briefing.tracking.max_speed
        )
        self._memory: dict[str, Any] = {}
        self._avoidance = avoidance_for(
            id, airframe, clock, briefing.chart, briefing.lidar, briefing.guidance
        )
        self._last_place: tuple[Point, float] | None = None
        self._seen_holding = -math.inf
        self._look: Point = (math.nan, math.nan)
        self.belief = Belief((), "search", None, (0.0, 0.0))

    def step(self, percept: Percept, inbox: Sequence[Message]) -> tuple[Command, list[Message]]:
        """Perceive, hear, decide, act: once every decision step.

        Parameters
        ----------
        percept : Percept
            What the aircraft perceives now.
        inbox : sequence of Message
            What arrived since the last step.

        Returns
        -------
        command : Command
            For the autopilot, until the next step.
        outbox : list of Message
            To be broadcast; heard in the next step at the earliest.
        """
        time, pose = percept.time, percept.pose
        inbox = self._gate.admit(time, inbox)
        warned = [message.threats for message in inbox if isinstance(message, Warn)]
        news = self.dangers.step(time, percept.threats, warned)
        tracks = self._track(percept, inbox)
        outbox = self._allocate(percept, tracks, inbox)
        command, role, goal = self._fly(percept, inbox, outbox)
        self._foresee(pose, command)
        command, guard = self._avoid(percept, inbox, command)
        self._look = look_point(command)
        if percept.sightings:
            outbox.append(
                Report(
                    self.id,
                    self._allocation.next_sequence(),
                    time,
                    sightings=percept.sightings,
                    names=tuple(self._tracker.owner_of(seen) for seen in percept.sightings),
                )
            )
        if news:
            outbox.append(Warn(self.id, self._allocation.next_sequence(), time, threats=news))
        outbox += self._searcher.tell(time, self._allocation.next_sequence)
        # Partners and those who avoid one another want to know what is flown.
        planned = role in ("pursue", "help") and isinstance(command, FlyBanks)
        told = command if planned or self._avoidance is not None else None
        outbox.append(
            self._allocation.heartbeat(
                role, goal, self._assistance.target, told, self._assistance.helpers
            )
        )
        held = self._allocation.holding
        target = None if held is None else held.id
        self.belief = Belief(self._tracker.estimates, role, target, goal, guard)
        return command, outbox

    @property
    def dropped(self) -> dict[str, int]:
        """How many messages it did not heed, by reason: see `staniel.cooperation.gate`."""
        counts = dict(self._gate.dropped)
        counts["malformed"] += self._searcher.refused
        return counts

    def _avoid(
        self, percept: Percept, inbox: Sequence[Message], command: Command
    ) -> tuple[Command, str]:
        """What was decided, or what is safe in its place."""
        if self._avoidance is None:
            return command, ""
        heartbeats = [message for message in inbox if isinstance(message, Heartbeat)]
        return self._avoidance.step(percept, heartbeats, self.dangers.regions, command)

    def _track(self, percept: Percept, inbox: Sequence[Message]) -> list[TrackEstimate]:
        """Own sightings and those of the others, fused in one tracker."""
        return self._picture.step(
            percept.time,
            percept.sightings,
            inbox,
            self._coverage(percept),
            self._allocation.held,
        )

    def _coverage(self, percept: Percept) -> list[Coverage] | None:
        """What the own camera has just looked at; not known of one whose pictures come late."""
        camera, pose, aim = self._briefing.camera, percept.pose, self._look
        if not percept.health.camera:
            return []
        if camera.delay > 0.0:
            return None
        view = CameraView.of(self._briefing.chart, camera, pose, aim)
        return [Coverage(pose, view, self._briefing.tracking.detection_probability)]

    def _allocate(
        self, percept: Percept, tracks: list[TrackEstimate], inbox: Sequence[Message]
    ) -> list[Message]:
        """Auctions and help: what the tracks cost, what the others said, who watches what."""
        time, pose, config = percept.time, percept.pose, self._briefing.cooperation
        health, allocation = percept.health, self._allocation
        fit = "blind" if not health.camera else "weak" if health.energy < config.weak_below else ""
        alone = config.mode == "none" or not health.radio
        dangers = self.dangers.at(time, tracks)
        situation = Situation(pose, health.energy, health.camera, dangers.rate if dangers else None)

        outbox = allocation.step(
            time,
            pose,
            self._tasks(percept, tracks, situation),
            inbox,
            lambda goals: self._costs.prices(situation, goals),
            health=fit or "healthy",
            alone=alone,
            overdue=self._searcher.overdue(time),
        )
        for old, new in allocation.renames:
            self._tracker.rename(old, new)
        able = not (allocation.holding or allocation.patrolling or fit or alone)
        need = None if alone else self._need_of_help()
        said = self._assistance.step(time, pose, allocation.holding, need, able, inbox)
        outbox += [
            kind(self.id, allocation.next_sequence(), time, **content) for kind, content in said
        ]
        return outbox

    def _need_of_help(self) -> str | None:
        """Why the agent wants another beside it, if it does (thesis section 7.2.1.1)."""
        config = self._briefing.cooperation
        if config.assistance == "always":
            return "value"
        held = self._allocation.holding
        if held is not None and priority_at(config.areas, held.position) > 1.0:
            return "value"
        if self.belief.guard:
            return "avoidance"
        return "visibility" if self._visibility < config.ask_below else None

    def _foresee(self, pose: Pose, command: Command) -> None:
        """Keep the mean of late of what the agent expects to see of what it holds."""
        briefing, held = self._briefing, self._allocation.holding
        track = None if held is None else self._track_named(held.id)
        if track is None or briefing.cooperation.assistance == "none":
            self._visibility = 1.0
            return
        cloud = self._tracker.particles(track.id)
        share = predicted_visibility(
            pose,
            command,
            cloud[:: max(len(cloud) // _FORESEEN, 1)],
            briefing.airframe,
            briefing.camera,
            briefing.chart,
            self._look,
        )
        self._visibility += (share - self._visibility) / _FORESIGHT_TICKS

    def _tasks(
        self, percept: Percept, tracks: list[TrackEstimate], situation: Situation
    ) -> list[Task]:
        if not tracks:
            return []
        places = [(*track.position.tolist(),) for track in tracks]
        goals = [
            Goal(place, track.course, track.speed)
            for place, track in zip(places, tracks, strict=True)
        ]
        own = [tuple(sighting.position.tolist()) for sighting in percept.sightings]
        # Sightings may be older than the percept that hands them out.
        looked = min((sighting.time for sighting in percept.sightings), default=math.inf)
        near = self._briefing.cooperation.same_target
        return [
            Task(
                track.id,
                place,
                goal.course,
                price.cost,
                track.last_seen >= looked and any(math.dist(place, z) < near for z in own),
                price.terms,
                (*track.velocity.tolist(),),
                track.last_seen,
            )
            for track, place, goal, price in zip(
                tracks, places, goals, self._costs.prices(situation, goals), strict=True
            )
        ]

    def _fly(
        self, percept: Percept, inbox: Sequence[Message], outbox: list[Message]
    ) -> tuple[Command, str, Point]:
        """Pursue the held target; else help; else loiter where one was; else search."""
        time, pose = percept.time, percept.pose
        self._searcher.look_around(percept, self._look, inbox)
        held = self._allocation.holding
        if held is not None:
            track = self._track_named(held.id)
            if track is not None:
                self._seen_holding = time
                self._last_place = (held.position, time)
                self._searcher.forget_goal()
                return *self._chase(time, pose, track, "pursue"), held.position
            self._give_up_in_time(time, pose, held, outbox)
        if self._allocation.patrolling:
            self._last_place = None
        if self._assistance.target is not None:
            return self._help(time, pose, self._assistance.target)
        if self._last_place is not None:
            place, since = self._last_place
            if time - since <= self._briefing.guidance.recover_time:
                self._searcher.forget_goal()
                return self._circle(pose, place), "recover", place
            self._last_place = None
        if not percept.health.camera:
            place = (pose.x, pose.y) if self.belief.role != "standby" else self.belief.goal
            return self._circle(pose, place), "standby", place
        role = "patrol" if self._allocation.patrolling else "search"
        second = self._second_look(percept)
        if second is not None and role == "search":
            self._searcher.forget_goal()
            return self._circle(pose, second), role, second
        start, goal = self._searcher.leg(time, pose, self._lost_clouds)
        airframe = self._briefing.airframe
        return FlyLine(start, goal, airframe.speed, airframe.altitude), role, goal

    def _give_up_in_time(
        self, time: float, pose: Pose, held: Holding, outbox: list[Message]
    ) -> None:
        """Let go of a target without a track that was not found for long where it was last."""
        patience = self._briefing.guidance.recover_time
        since = max(self._seen_holding, held.since)
        if self._arrived is None or self._arrived < since:
            near = 3.0 * self._briefing.airframe.min_turn_radius
            if math.dist(held.position, (pose.x, pose.y)) < near:
                self._arrived = time
            elif time - since < _LONGEST_WAY:
                since = time
        if self._arrived is not None:
            since = max(since, self._arrived)
        if self._tracker_lost(held.id) or time - since > patience:
            outbox.append(self._allocation.give_up())
        self._last_place = (held.position, since)

    def _second_look(self, percept: Percept) -> Point | None:
        """Where the own camera saw something a moment ago that no track has explained since."""
        strange = [s for s in percept.sightings if self._tracker.owner_of(s) is None]
        return self._searcher.second_look(
            percept.time,
            [(*sighting.position.tolist(),) for sighting in strange],
            [(*track.position.tolist(),) for track in self._tracker.estimates],
        )

    def _circle(self, pose: Pose, place: Point) -> Command:
        return loiter(pose, place, self._briefing.airframe, self._briefing.guidance)

    def _lost_clouds(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Where the lost targets may be that nobody is known to hold."""
        held = self._allocation.held
        lost = self._tracker.lost_particles()
        return [cloud for name, cloud in lost.items() if name not in held]

    def _help(self, time: float, pose: Pose, target: TrackId) -> tuple[Command, str, Point]:
        """Plan with the holder where the policy can; else circle midway to it (thesis 7.2.1.1)."""
        self._last_place = None
        self._searcher.forget_goal()
        place, track = self._assistance.position, self._track_named(target)
        if track is not None and self._briefing.guidance.pursuit == "lookahead":
            return *self._chase(time, pose, track, "help"), place
        holder = self._assistance.holder_pose
        if holder is not None:
            place = ((place[0] + holder.x) / 2.0, (place[1] + holder.y) / 2.0)
        return self._circle(pose, place), "help", place

    def _chase(
        self, time: float, pose: Pose, track: TrackEstimate, role: str
    ) -> tuple[Command, str]:
        """What the policy commands, or a loiter that is safe, and then the role says so."""
        try:
            return self._pursue(self._pursuit(time, pose, track)), role
        except NoFeasibleFlightError:
            return safe_loiter(pose, self._briefing.airframe, self._briefing.chart), "loiter"

    def _pursuit(self, time: float, pose: Pose, track: TrackEstimate) -> Pursuit:
        briefing = self._briefing
        return Pursuit(
            time=time,
            pose=pose,
            track=track,
            waypoint=track.ahead(self._lookahead),
            cloud=lambda: (self._tracker.particles(track.id), self._tracker.weights(track.id)),
            airframe=briefing.airframe,
            camera=briefing.camera,
            chart=briefing.chart,
            config=briefing.guidance,
            dangers=self.dangers.at(time, self._tracker.estimates),
            partners=tuple(
                Partner(
                    beat.time,
                    beat.pose,
                    beat.command if isinstance(beat.command, FlyBanks) else None,
                )
                for beat in self._assistance.partners(track.id)
            ),
            look=self._look,
            memory=self._memory,
        )

    def _track_named(self, name: TrackId) -> TrackEstimate | None:
        return next((track for track in self._tracker.estimates if track.id == name), None)

    def _tracker_lost(self, name: TrackId) -> bool:
        return any(track.id == name for track in self._tracker.lost)
