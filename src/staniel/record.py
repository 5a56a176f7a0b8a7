"""What one tick and one run hold: the frame that is recorded, the record that is read back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from staniel.city import City
from staniel.datatypes.belief import Belief, Percept
from staniel.datatypes.command import Command
from staniel.datatypes.equipment import Camera
from staniel.datatypes.message import COST_TERMS, Delivery
from staniel.datatypes.risk import RiskConfig
from staniel.datatypes.truth import CONDITION_COLUMNS, Truth, nominal
from staniel.errors import RecordError

__all__ = [
    "AWARD_DTYPE",
    "COMMAND_DTYPE",
    "DECISION_DTYPE",
    "MESSAGE_DTYPE",
    "SIGHTING_DTYPE",
    "THREAT_DTYPE",
    "TRACK_DTYPE",
    "Frame",
    "Record",
]


@dataclass(frozen=True, slots=True)
class Frame:
    """One tick: what was so, what was perceived, said, believed and commanded.

    Truth and origins are here for the recorder, the metrics and a marked debug overlay, for nobody
    else.

    Attributes
    ----------
    truth : Truth
    percepts : sequence of Percept
        One an aircraft.
    origins : sequence of tuple of int
        Per percept and sighting the vehicle that caused it, -1 for a false alarm.
    deliveries : sequence of Delivery
        The messages that went on the air on the way to this tick and whom they reach, at once or
        later; and those that were dropped before.
    commands : sequence of Command
        Decided in this tick, one an aircraft.
    beliefs : sequence of Belief
        After this tick, one an aircraft.
    noticed : sequence of tuple of int
        Per percept and region that its threat sensor noticed the region's number in the scenario,
        then per carrier the vehicle; empty where there are no sensors.
    """

    truth: Truth
    percepts: Sequence[Percept]
    origins: Sequence[tuple[int, ...]]
    deliveries: Sequence[Delivery]
    commands: Sequence[Command]
    beliefs: Sequence[Belief]
    noticed: Sequence[tuple[int, ...]] = ()


def _columns(text: str) -> np.dtype[np.void]:
    """Structured type from ``"name:format ..."``."""
    return np.dtype([tuple(column.split(":")) for column in text.split()])


SIGHTING_DTYPE = _columns("time:f8 reporter:i4 x:f8 y:f8 cxx:f8 cxy:f8 cyy:f8 origin:i4")
TRACK_DTYPE = _columns(
    "time:f8 agent:i4 id:U16 x:f8 y:f8 vx:f8 vy:f8 cxx:f8 cxy:f8 cyy:f8 existence:f8 last_seen:f8"
)
MESSAGE_DTYPE = _columns(
    "time:f8 sender:i4 sequence:i8 kind:U20 target:U16 winner:i4 cost:f8 x:f8 y:f8 "
    "receivers:i4 heard:i4"
)
COMMAND_DTYPE = _columns(
    "time:f8 agent:i4 kind:U8 ax:f8 ay:f8 bx:f8 by:f8 radius:f8 turn:i4 speed:f8 altitude:f8"
)
THREAT_DTYPE = _columns("time:f8 agent:i4 kind:U8 origin:i4 x:f8 y:f8 cxx:f8 cxy:f8 cyy:f8")
AWARD_DTYPE = _columns(
    "time:f8 auctioneer:i4 sequence:i8 target:U16 bidder:i4 cost:f8 won:? "
    + " ".join(f"{term}:f8" for term in COST_TERMS)
)
_SAME = 1e-6  # instants this near to each other are one [s]

DECISION_DTYPE = _columns("time:f8 agent:i4 role:U8 target:U16 goal_x:f8 goal_y:f8 guard:U8")


@dataclass(frozen=True)
class Record:
    """A whole run in memory, as plain arrays. Times in seconds, everything else as in `Truth`.

    Attributes
    ----------
    scenario : mapping
        The resolved scenario, seed included.
    version : str
        Of staniel, that wrote it.
    city : City
        The true one.
    times : (n,) float array
        Decision instants.
    aircraft : (n, n_aircraft, 6) float array
    vehicles : (n, n_vehicles, 4) float array
    fine_times : (m,) float array
        Instants at 0.2 s, or at the dynamics step where that is longer.
    fine_aircraft : (m, n_aircraft, 6) float array
    fine_vehicles : (m, n_vehicles, 4) float array
    sightings, tracks, messages, commands, decisions : structured arrays
        In the order of time; see the ``_DTYPE`` constants. In `messages`, `target` is empty and
        `winner` -1 where a kind has none; `x`, `y` and `cost` are NaN there.
    complete : bool
        False when the run was cut short.
    links : (n_aircraft, n_aircraft) int array
        How many broadcasts of each aircraft (row) each other one (column) heard; (0, 0) when not
        known.
    receptions : (r, 2) int array or None
        Who heard what: a row of `messages` and an aircraft for each reception, in the order of the
        rows. None when not known.
    condition : (n, n_aircraft, 8) float array
        Not given: nominal throughout.
    wind : (n, n_aircraft, 2) float array
        Not given: calm.
    threats : structured array
        What threat sensors noticed, in the order of time; not given: nothing. `kind` is ``region``
        or ``carrier``, `origin` the region's number in the scenario or the vehicle; a region has
        NaN for the rest.
    awards : structured array
        Why targets went to whom: a row for each bid that an award told, in the order of `messages`
        and of the award; not given: none. `sequence` is the auctioneer's number of the award, `won`
        marks the winner's bid. `cost` is NaN where it is not finite, and each of its terms, by the
        names of `COST_TERMS`, where the bid told none. A winner whose bid was not told has a row
        of its own, without terms.
    """

    scenario: Mapping[str, Any]
    version: str
    city: City
    times: NDArray[np.float64]
    aircraft: NDArray[np.float64]
    vehicles: NDArray[np.float64]
    fine_times: NDArray[np.float64]
    fine_aircraft: NDArray[np.float64]
    fine_vehicles: NDArray[np.float64]
    sightings: NDArray[np.void]
    tracks: NDArray[np.void]
    messages: NDArray[np.void]
    commands: NDArray[np.void]
    decisions: NDArray[np.void]
    complete: bool
    links: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    receptions: NDArray[np.int32] | None = None
    condition: NDArray[np.float64] = field(
        default_factory=lambda: np.zeros((0, 0, len(CONDITION_COLUMNS)))
    )
    wind: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 2)))
    threats: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, dtype=THREAT_DTYPE))
    awards: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, dtype=AWARD_DTYPE))

    def __post_init__(self) -> None:
        ticks, count = self.aircraft.shape[:2]
        if self.condition.shape[:2] != (ticks, count):
            object.__setattr__(self, "condition", np.tile(nominal(count), (ticks, 1, 1)))
        if self.wind.shape[:2] != (ticks, count):
            object.__setattr__(self, "wind", np.zeros((ticks, count, 2)))

    def looks(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where gimballed cameras were to look, by the command that was flown then.

        Parameters
        ----------
        times : (m,) float array [s]

        Returns
        -------
        (m, n_aircraft, 2) float array [m]
            NaN before the first command and where a command leads to no point.
        """
        ends = np.full((len(self.times) + 1, self.aircraft.shape[1], 2), np.nan)
        rows = self.commands[self.commands["agent"] < ends.shape[1]]
        decided = np.searchsorted(self.times, rows["time"] - _SAME)
        line = (rows["kind"] == "line")[:, None]  # Others have their point, if any, in the first.
        first = np.stack([rows["ax"], rows["ay"]], axis=1)
        second = np.stack([rows["bx"], rows["by"]], axis=1)
        # Row 0 stands for the time before any command; a decision rules what comes after it.
        ends[decided + 1, rows["agent"]] = np.where(line, second, first)
        looks: NDArray[np.float64] = ends[np.searchsorted(self.times, times - _SAME)]
        return looks

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera of each aircraft, as the run's scenario has it.

        Raises
        ------
        RecordError
            A camera or a group that no scenario can have.
        """
        count = self.aircraft.shape[1]
        try:
            common = dict(self.scenario.get("camera", {}))
            groups = [(group["count"], group) for group in self.scenario.get("groups", ())]
            kinds = [
                camera
                for number, group in groups or [(count, {})]
                for camera in [Camera(**(common | dict(group.get("camera", {}))))] * number
            ]
        except (ValidationError, TypeError, KeyError, ValueError) as error:
            raise RecordError(f"scenario.camera or scenario.groups: {error}") from error
        if len(kinds) != count:
            raise RecordError(f"scenario.groups: {len(kinds)} aircraft, expected {count}")
        return tuple(kinds)

    @property
    def risk(self) -> RiskConfig:
        """Threats and no-fly regions of the run's scenario; none where it names none.

        Raises
        ------
        RecordError
            A risk section that no scenario can have.
        """
        try:
            return RiskConfig.model_validate(self.scenario.get("risk", {}))
        except ValidationError as error:
            raise RecordError(f"scenario.risk: {error.errors()[0]['msg']}") from error
