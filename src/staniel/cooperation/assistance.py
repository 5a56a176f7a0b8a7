"""Explicit cooperation: a holder asks, free agents offer, it takes the best (thesis 7.2.1.1).

request → offer → the holder's heartbeat names its helpers, which is a lease like an award: it ends
when a heartbeat says otherwise, by an end from either side, or by silence.
"""

import math
from collections.abc import Iterable

from staniel.cooperation.config import CooperationConfig
from staniel.cooperation.table import Holding
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import (
    AssistanceEnd,
    AssistanceOffer,
    AssistanceRequest,
    Heartbeat,
    Message,
    Point,
)

__all__ = ["Assistance"]

Words = list[AssistanceRequest | AssistanceOffer | AssistanceEnd]


class Assistance:
    """One agent's part in it, as the one who asks or as the one who helps.

    Parameters
    ----------
    agent : int
        Its id.
    config : CooperationConfig
    step : float [s]
        The decision step.

    Attributes
    ----------
    target : TrackId or None
        Whose holder it helps.
    position : (float, float) [m]
        Where that target was last said to be.
    holder_pose : Pose or None
        Where its holder was then.
    helpers : tuple of int
        Who helps it with what it holds itself.
    """

    def __init__(self, agent: int, config: CooperationConfig, *, step: float) -> None:
        self.target: TrackId | None = None
        self.position: Point = (0.0, 0.0)
        self.holder_pose: Pose | None = None
        self.helpers: tuple[int, ...] = ()
        self._agent, self._config = agent, config
        self._again = 2.0 * config.bid_wait * step
        self._heard: dict[int, Heartbeat] = {}
        self._offers: dict[int, tuple[float, float]] = {}  # by agent: cost, when heard
        self._taken: dict[int, float] = {}  # helpers, and since when
        self._asked = self._needed = -math.inf
        self._holds: TrackId | None = None
        self._out: list[tuple[type[Message], dict[str, object]]] = []

    def step(
        self,
        time: float,
        pose: Pose,
        holding: Holding | None,
        need: str | None,
        able: bool,
        inbox: Iterable[Message],
    ) -> list[tuple[type[Message], dict[str, object]]]:
        """Hear, ask, offer, join or leave.

        Parameters
        ----------
        time : float [s]
        pose : Pose
            The agent's own.
        holding : Holding or None
            What it holds itself.
        need : str or None
            Why it wants help with that, see `AssistanceRequest`; None where it does not.
        able : bool
            Whether it is free and fit to help.
        inbox : iterable of Message
            What arrived since the last call.

        Returns
        -------
        list of (type, dict)
            Messages to say: kind and content.
        """
        self._out = []
        lease = self._config.lease
        ended: set[int] = set()
        requests: dict[int, AssistanceRequest] = {}
        for message in inbox:
            match message:
                case Heartbeat(sender=sender):
                    known = self._heard.get(sender)
                    if known is None or known.sequence < message.sequence:
                        self._heard[sender] = message
                case AssistanceRequest(sender=sender):
                    requests[sender] = message
                case AssistanceOffer(holder=self._agent, sender=sender, cost=cost):
                    self._offers[sender] = cost, time
                case AssistanceEnd(sender=sender):
                    ended.add(sender)
        self._heard = {k: v for k, v in self._heard.items() if time - v.time <= lease}
        self._ask(time, holding, need, ended)
        self._help(pose, able, requests, ended)
        return self._out

    def partners(self, target: TrackId) -> list[Heartbeat]:
        """Last heartbeat of each other agent that holds the target or helps with it, by id."""
        said = sorted(self._heard.items())
        return [beat for _, beat in said if target in (beat.target, beat.helps)]

    # -- the holder ------------------------------------------------------------------------------

    def _ask(self, time: float, holding: Holding | None, need: str | None, ended: set[int]) -> None:
        """Ask while help is wanted and lacking; take the best that offer; end it in good time."""
        config = self._config
        target = None if holding is None else holding.id
        if target is None or target != self._holds:
            self._end(target is None)
        self._holds = target
        self._offers = {k: v for k, v in self._offers.items() if time - v[1] <= self._again}
        wanted = config.helpers if need is not None and config.assistance != "none" else 0
        if wanted:
            self._needed = time
        if holding is None or (self._taken and time - self._needed > config.lease):
            self._end(True)
        else:
            # Who said since he was taken that he does something else has left.
            self._taken = {
                k: since
                for k, since in self._taken.items()
                if k not in ended
                and k in self._heard
                and (self._heard[k].helps == target or time - since <= self._again)
            }
            free = sorted((cost, -k) for k, (cost, _) in self._offers.items() if k not in ended)
            for _, negative in free:
                if len(self._taken) < wanted and -negative not in self._taken:
                    self._taken[-negative] = time
            if len(self._taken) < wanted and time - self._asked >= self._again:
                self._asked = time
                self._say(AssistanceRequest, target=target, position=holding.position, reason=need)
        self.helpers = tuple(sorted(self._taken))

    def _end(self, say: bool) -> None:
        if self._taken and say:
            self._say(AssistanceEnd, target=self._holds)
        self._taken, self._offers, self._asked = {}, {}, -math.inf

    # -- the helper ------------------------------------------------------------------------------

    def _help(
        self, pose: Pose, able: bool, requests: dict[int, AssistanceRequest], ended: set[int]
    ) -> None:
        """Offer what is asked for; join the nearest holder that takes it; leave when it is over."""
        if not able:
            if self.target is not None:
                self._say(AssistanceEnd, target=self.target)
            self.target = self.holder_pose = None
            return
        takers = {
            k: beat
            for k, beat in self._heard.items()
            if self._agent in beat.helpers and beat.target is not None and k not in ended
        }
        stay = [k for k, beat in takers.items() if beat.target == self.target]
        chosen = min(stay or takers, key=lambda k: (_way(pose, takers[k]), k), default=None)
        if chosen is None:
            self.target = self.holder_pose = None
        else:
            beat = takers[chosen]
            self.target, self.holder_pose = beat.target, beat.pose
            self.position = beat.target_position or self.position
        if self.target is None:
            for sender, request in sorted(requests.items()):
                cost = math.dist(request.position, (pose.x, pose.y))
                self._say(AssistanceOffer, target=request.target, holder=sender, cost=cost)

    def _say(self, kind: type[Message], **content: object) -> None:
        self._out.append((kind, content))


def _way(pose: Pose, holder: Heartbeat) -> float:
    x, y = holder.target_position or (math.inf, math.inf)
    return math.hypot(x - pose.x, y - pose.y)
