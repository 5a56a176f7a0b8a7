"""Who helps whom: free agents join the holder of a target, by heartbeats that may be lost.

A free agent that hears of a held target which still lacks helpers joins the nearest such. Its
heartbeats say so. Where more have joined than the scenario wants, those with the greatest ids leave
as soon as they hear of it. Who holds a target of its own helps nobody.
"""

import math
from collections.abc import Iterable

from staniel.cooperation.config import CooperationConfig
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import Heartbeat, Message, Point

__all__ = ["Helping"]


class Helping:
    """One agent's choice of whom to help.

    Parameters
    ----------
    agent : int
        Its id.
    config : CooperationConfig

    Attributes
    ----------
    target : TrackId or None
        Whose holder it helps.
    position : (float, float) [m]
        Where that target was last said to be.
    """

    def __init__(self, agent: int, config: CooperationConfig) -> None:
        self.target: TrackId | None = None
        self.position: Point = (0.0, 0.0)
        self._agent, self._config = agent, config
        self._heard: dict[int, Heartbeat] = {}

    def step(self, time: float, pose: Pose, free: bool, inbox: Iterable[Message]) -> None:
        """Hear the heartbeats, and stay, leave or join.

        Parameters
        ----------
        time : float [s]
        pose : Pose
            The agent's own.
        free : bool
            Whether it holds no target itself.
        inbox : iterable of Message
            What arrived since the last call.
        """
        for message in inbox:
            if isinstance(message, Heartbeat):
                known = self._heard.get(message.sender)
                if known is None or known.sequence < message.sequence:
                    self._heard[message.sender] = message
        lease = self._config.lease
        self._heard = {k: v for k, v in self._heard.items() if time - v.time <= lease}
        wanted = self._config.helpers
        if not free or wanted == 0:
            self.target = None
            return
        held = {v.target: v for v in self._heard.values() if v.target is not None}
        helpers = {target: self._helpers(target) for target in held}
        if self.target in held:
            if sum(other < self._agent for other in helpers[self.target]) >= wanted:
                self.target = None
        else:
            self.target = None
        if self.target is None:
            short = [target for target in held if len(helpers[target]) < wanted]
            self.target = min(
                short, key=lambda target: self._order(pose, held[target]), default=None
            )
        if self.target is not None:
            self.position = held[self.target].target_position or self.position

    def partners(self, target: TrackId) -> list[Heartbeat]:
        """Last heartbeat of each other agent that holds the target or helps with it, by id."""
        said = sorted(self._heard.items())
        return [beat for _, beat in said if target in (beat.target, beat.helps)]

    def _helpers(self, target: TrackId) -> list[int]:
        return [sender for sender, beat in self._heard.items() if beat.helps == target]

    @staticmethod
    def _order(pose: Pose, holder: Heartbeat) -> tuple[float, int]:
        x, y = holder.target_position or (math.inf, math.inf)
        return math.hypot(x - pose.x, y - pose.y), holder.sender
