"""Who held which vehicle when, judged by the truth: double holders, orphans, and takeovers."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.truth import CAMERA, ENERGY, FLYING, RADIO
from staniel.record import Record

__all__ = ["Custody", "custody", "custody_metrics", "longest_run", "takeover_times"]

Bools = NDArray[np.bool_]

NEAR: Final = 15.0
"""A track nearer than this to a vehicle is that vehicle's [m]."""

_CLOSE: Final = 1e-5  # instants this near to each other are one [s]


@dataclass(frozen=True, slots=True)
class Custody:
    """For n decision instants, a aircraft and v vehicles.

    Attributes
    ----------
    known : (n, a, v) bool array
        The agent has a live track of the vehicle.
    held : (n, a, v) bool array
        It names the vehicle as the target that it is responsible for: by its own track of that
        name, or, where it has none, by another's: it was awarded it and is on its way.
    free : (n, a) bool array
        The agent is healthy and names no target.
    reach : (n, a, a) bool array
        Both fly with radios that work, in range, and no partition is between them.
    """

    known: Bools
    held: Bools
    free: Bools
    reach: Bools

    @property
    def watched(self) -> Bools:
        """(n, a, v): the agent holds the vehicle and has a live track of it."""
        return self.held & self.known

    @property
    def doubled(self) -> Bools:
        """(n, v): two that can hear each other hold the vehicle."""
        pairs = np.triu(np.ones(self.reach.shape[1:], dtype=np.bool_), 1)
        held = self.held.astype(np.float32)
        together = np.einsum("nab,nav,nbv->nv", (self.reach & pairs).astype(np.float32), held, held)
        doubled: Bools = np.greater(together, 0.0)
        return doubled

    @property
    def orphaned(self) -> Bools:
        """(n, v): one knows it, nobody holds it, and a free one can hear him or is himself."""
        reach = self.reach | np.eye(self.reach.shape[1], dtype=np.bool_)
        free = np.any(reach & self.free[:, None, :], axis=2)
        wanted = np.any(self.known & free[:, :, None], axis=1)
        orphaned: Bools = wanted & ~self.held.any(axis=1)
        return orphaned


def custody(record: Record) -> Custody:
    """Read a record for who held what.

    Parameters
    ----------
    record : Record

    Returns
    -------
    Custody
    """
    n, agents = record.aircraft.shape[:2]
    target = np.full((n, agents), "", dtype=record.decisions.dtype["target"])
    decisions = record.decisions[record.decisions["agent"] < agents]
    target[_ticks(record, decisions["time"]), decisions["agent"]] = decisions["target"]
    patrols = np.zeros((n, agents), dtype=np.bool_)
    patrols[_ticks(record, decisions["time"]), decisions["agent"]] = decisions["role"] == "patrol"
    known, held = _tracked(record, target)
    condition = record.condition
    flying = condition[:, :, FLYING] > 0.0
    weak = float(record.scenario.get("cooperation", {}).get("weak_below", 0.0))
    healthy = flying & (condition[:, :, [CAMERA, RADIO]] > 0.0).all(axis=2)
    free = healthy & (condition[:, :, ENERGY] >= weak) & (target == "") & ~patrols
    return Custody(known, held, free, _reach(record, flying & (condition[:, :, RADIO] > 0.0)))


def _tracked(record: Record, target: NDArray[np.str_]) -> tuple[Bools, Bools]:
    """`Custody.known` and `Custody.held`, given the (n, a) names of the targets."""
    known = np.zeros((*target.shape, record.vehicles.shape[1]), dtype=np.bool_)
    held = np.zeros_like(known)
    tracks = record.tracks[record.tracks["agent"] < target.shape[1]]
    if not known.size or not len(tracks):
        return known, held
    ticks, agents, names = _ticks(record, tracks["time"]), tracks["agent"], tracks["id"]
    places = np.stack([tracks["x"], tracks["y"]], axis=1)
    ways = np.linalg.norm(record.vehicles[ticks, :, :2] - places[:, None, :], axis=2)
    nearest = ways.argmin(axis=1)
    near = ways[np.arange(len(tracks)), nearest] <= NEAR
    known[ticks[near], agents[near], nearest[near]] = True
    own = names == target[ticks, agents]
    tracking = np.zeros(target.shape, dtype=np.bool_)
    tracking[ticks[own], agents[own]] = True
    held[ticks[near & own], agents[near & own], nearest[near & own]] = True
    # Who has no track of that name is responsible for what others call so.
    named = (target[ticks] == names[:, None]) & ~tracking[ticks] & near[:, None]
    rows, others = np.nonzero(named)
    held[ticks[rows], others, nearest[rows]] = True
    return known, held


def _ticks(record: Record, times: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.minimum(np.searchsorted(record.times, times - _CLOSE), len(record.times) - 1)


def _reach(record: Record, talking: Bools) -> Bools:
    """Pairs that could hear each other, whatever is lost on the way."""
    radio = record.scenario.get("radio", {})
    places = record.aircraft[:, :, :3]
    ways = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    near = ways <= float(radio.get("range", np.inf))
    reach: Bools = talking[:, :, None] & talking[:, None, :] & near
    count = places.shape[1]
    for partition in radio.get("partitions", ()):
        group = np.full(count, -1)
        for number, members in enumerate(partition["groups"]):
            group[[member for member in members if member < count]] = number
        during = (record.times >= partition["start"]) & (record.times < partition["end"])
        reach[during] &= group[:, None] == group[None, :]
    reach[:, np.arange(count), np.arange(count)] = False
    return reach


def longest_run(flags: Bools, step: float) -> float:
    """Longest time without a break that a column of (n, k) flags is true [s]."""
    longest = 0
    run = np.zeros(flags.shape[1], dtype=np.int64)
    for row in flags:
        run = np.where(row, run + 1, 0)
        longest = max(longest, int(run.max(initial=0)))
    return longest * step


def takeover_times(record: Record, kept: Custody, loss: float, aircraft: int) -> list[float]:
    """How long after an aircraft's loss each vehicle that it watched was watched by another one.

    Parameters
    ----------
    record : Record
    kept : Custody
        Of the record.
    loss : float [s]
        When it was lost.
    aircraft : int
        Which.

    Returns
    -------
    list of float [s]
        One for each vehicle that it held and tracked last; infinite where nobody else held and
        tracked it until the end.
    """
    before = np.flatnonzero(record.times < loss)
    if not len(before):
        return []
    times = []
    for vehicle in np.flatnonzero(kept.watched[before[-1], aircraft]):
        others = np.delete(kept.watched[:, :, vehicle], aircraft, axis=1).any(axis=1)
        after = np.flatnonzero(others & (record.times >= loss))
        times.append(float(record.times[after[0]] - loss) if len(after) else float("inf"))
    return times


def custody_metrics(record: Record) -> dict[str, Any]:
    """``double_held_longest`` and ``orphaned_longest`` of the team, see ``docs/metrics.md``."""
    if len(record.times) < 2 or not record.vehicles.shape[1]:
        return {"double_held_longest": None, "orphaned_longest": None}
    kept, step = custody(record), float(np.diff(record.times).mean())
    return {
        "double_held_longest": longest_run(kept.doubled, step),
        "orphaned_longest": longest_run(kept.orphaned, step),
    }
