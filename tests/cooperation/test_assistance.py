"""Help by request, offer and heartbeat; nobody helps who is not asked, and it ends."""

import pytest

from staniel.cooperation import Assistance, CooperationConfig, Holding
from staniel.datatypes.belief import Pose, TrackId
from staniel.datatypes.message import (
    AssistanceEnd,
    AssistanceOffer,
    AssistanceRequest,
    Heartbeat,
)

TARGET, OTHER = TrackId(1.0, 0, 1), TrackId(2.0, 9, 1)
CONFIG = CooperationConfig(assistance="asked", helpers=1, lease=8.0)


class Team:
    """Agents on a bus: the first holds a target, the others are free."""

    def __init__(self, places, config=CONFIG):
        self.config, self.time = config, 0.0
        self.poses = [Pose(x, y, 80.0, 0.0, 0.0, 15.0) for x, y in places]
        self.sides = [Assistance(k, config, step=1.0) for k in range(len(places))]
        self.holding = {0: Holding(TARGET, (0.0, 0.0), 0.0, 0.0)}
        self.need, self.unfit, self.lost = {0: "visibility"}, set(), lambda message, to: False
        self.inboxes = [[] for _ in places]
        self.sequence, self.log = 0, []

    def tick(self):
        self.time += 1.0
        said = []
        for k, side in enumerate(self.sides):
            held = self.holding.get(k)
            words = side.step(
                self.time, self.poses[k], held, self.need.get(k),
                held is None and k not in self.unfit, self.inboxes[k],
            )  # fmt: skip
            for kind, content in words:
                self.sequence += 1
                said.append(kind(k, self.sequence, self.time, **content))
            self.sequence += 1
            said.append(
                Heartbeat(
                    k, self.sequence, self.time, pose=self.poses[k], role="search",
                    goal=(0.0, 0.0), target=None if held is None else held.id,
                    target_position=None if held is None else held.position, cost=1.0,
                    helps=side.target, helpers=side.helpers,
                )
            )  # fmt: skip
        self.log += said
        self.inboxes = [
            [m for m in said if m.sender != k and not self.lost(m, k)]
            for k in range(len(self.sides))
        ]

    def run(self, ticks):
        for _ in range(ticks):
            self.tick()
        return self

    @property
    def helping(self):
        return [k for k, side in enumerate(self.sides) if side.target == TARGET]

    def said(self, kind):
        return [m for m in self.log if isinstance(m, kind)]


def test_the_nearest_free_agent_is_taken():
    team = Team([(0, 0), (500, 0), (100, 0), (300, 0)]).run(4)
    assert team.helping == [2]
    assert team.sides[0].helpers == (2,)
    assert team.said(AssistanceRequest)[0].reason == "visibility"
    assert {m.sender for m in team.said(AssistanceOffer)} == {1, 2, 3}
    team.run(20)
    assert team.helping == [2]
    assert len(team.said(AssistanceRequest)) == 1  # enough is enough


@pytest.mark.parametrize("how", ["none", "no need"])
def test_nobody_helps_who_was_not_asked(how):
    config = CONFIG.model_copy(update={"assistance": "none"}) if how == "none" else CONFIG
    team = Team([(0, 0), (100, 0)], config)
    if how == "no need":
        team.need = {}
    assert team.run(10).helping == []
    assert not team.said(AssistanceOffer)


def test_it_ends_a_lease_after_the_need():
    team = Team([(0, 0), (100, 0)]).run(4)
    team.need = {}
    team.run(6)
    assert team.helping == [1]
    team.run(6)
    assert team.helping == []
    assert [m.sender for m in team.said(AssistanceEnd)] == [0]


def test_a_helper_that_takes_a_target_says_so_and_another_is_taken():
    team = Team([(0, 0), (100, 0), (200, 0)]).run(4)
    assert team.helping == [1]
    team.holding[1] = Holding(OTHER, (90.0, 0.0), 4.0, 4.0)
    team.run(8)
    assert [m.sender for m in team.said(AssistanceEnd)] == [1]
    assert team.helping == [2]


def test_a_holder_that_loses_the_target_frees_its_helper():
    team = Team([(0, 0), (100, 0)]).run(4)
    del team.holding[0]
    assert team.run(3).helping == []


def test_a_silent_holder_frees_its_helper_and_a_silent_helper_is_replaced():
    team = Team([(0, 0), (100, 0), (200, 0)]).run(4)
    team.lost = lambda message, to: message.sender == 0
    team.run(12)
    assert team.helping == []
    team = Team([(0, 0), (100, 0), (200, 0)]).run(4)
    team.lost = lambda message, to: message.sender == 1
    team.run(20)
    assert team.sides[0].helpers == (2,)


def test_an_unfit_agent_does_not_offer():
    team = Team([(0, 0), (100, 0)])
    team.unfit = {1}
    assert team.run(6).helping == []


def test_as_many_as_the_scenario_allows():
    config = CONFIG.model_copy(update={"helpers": 2})
    assert Team([(0, 0), (100, 0), (200, 0), (300, 0)], config).run(6).helping == [1, 2]


def test_partners_are_all_others_on_the_target_by_the_newest_word_of_each():
    team = Team([(0, 0), (100, 0), (200, 0)]).run(6)
    assert [beat.sender for beat in team.sides[2].partners(TARGET)] == [0, 1]
    assert all(beat.time == team.time - 1.0 for beat in team.sides[2].partners(TARGET))
