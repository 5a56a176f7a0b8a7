"""Why unseen: every second of every vehicle is watched, or has the one cause why it is not."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.truth import CAMERA, FLYING
from staniel.kernels import unseen as kernels
from staniel.metrics.identity import GATE
from staniel.metrics.picture import id_codes
from staniel.metrics.visible import sample_step, visible_decisions
from staniel.record import Record

__all__ = ["Cause", "Unwatched", "unwatched", "unwatched_metrics"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_CLOSE: Final = 1e-5  # instants this near to each other are one [s]


class Cause(IntEnum):
    """What a second of a vehicle was: watched, or unwatched for the first of these that holds.

    The tests, in this order, are in ``docs/metrics.md``.
    """

    WATCHED = kernels.WATCHED
    AIRCRAFT_LOST = kernels.AIRCRAFT_LOST
    NOBODY_ASSIGNED = kernels.NOBODY_ASSIGNED
    OUT_OF_RANGE = kernels.OUT_OF_RANGE
    OUTSIDE_FOOTPRINT = kernels.OUTSIDE_FOOTPRINT
    BUILDING = kernels.BUILDING
    MISSED_DETECTION = kernels.MISSED_DETECTION
    MESSAGE_LOST = kernels.MESSAGE_LOST
    TRACK_LOST = kernels.TRACK_LOST

    @property
    def key(self) -> str:
        """Name in ``metrics.json``, such as ``"out_of_range"``."""
        return self.name.lower()

    @property
    def words(self) -> str:
        """Name for people, such as ``"out of range"``."""
        return self.key.replace("_", " ")


@dataclass(frozen=True, slots=True)
class Unwatched:
    """What each second of each vehicle was, for n seconds, k vehicles and a aircraft.

    A *second* is a decision step, named by the decision instant that ends it.

    Attributes
    ----------
    times : (n,) float array [s]
        Its end: all decision instants but the start.
    seconds : (n,) float array [s]
        Its length; together the duration of the run.
    cause : (n, k) int8 array
        A `Cause`.
    assigned : (n, a) int array
        The vehicle that each aircraft was assigned to; -1 for none.
    """

    times: Floats
    seconds: Floats
    cause: NDArray[np.int8]
    assigned: Indices

    @property
    def totals(self) -> Floats:
        """Seconds of each vehicle (row) and each `Cause` (column), watched ones first."""
        return np.stack([self.seconds @ (self.cause == cause) for cause in Cause], axis=1)


def unwatched(record: Record) -> Unwatched:
    """Tell for every second of every vehicle whether it was watched, or else why not.

    A vehicle is watched while it is truly visible to an aircraft and a live track of any agent is
    within `GATE` of it. Every other second has one cause, the first that holds in the order of
    `Cause`; see ``docs/metrics.md`` for the test of each.

    Parameters
    ----------
    record : Record

    Returns
    -------
    Unwatched
    """
    return _unwatched(record, visible_decisions(record))


def _unwatched(record: Record, visible: NDArray[np.bool_]) -> Unwatched:
    assigned, near = _assignments(record)
    sighted, knows = _told(record, assigned)
    condition = record.condition
    cause = kernels.attribute(
        visible,
        near,
        assigned,
        (condition[:, :, FLYING] > 0.0) & (condition[:, :, CAMERA] > 0.0),
        _hindrances(record, assigned),
        sighted,
        knows,
    )
    return Unwatched(record.times[1:], np.diff(record.times), cause[1:], assigned[1:])


def unwatched_metrics(
    record: Record, visible: NDArray[np.bool_]
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """``watched`` and ``unwatched`` [s] of each vehicle, and their sums over the vehicles.

    Parameters
    ----------
    record : Record
    visible : (n, n_vehicles) bool array
        Of `visible_decisions`.

    Returns
    -------
    targets : list of dict
    team : dict
    """
    totals = _unwatched(record, visible).totals
    return [_figures(row) for row in totals], _figures(totals.sum(axis=0))


def _figures(seconds: Floats) -> dict[str, Any]:
    figures = dict(zip((cause.key for cause in Cause), seconds.tolist(), strict=True))
    return {"watched": figures.pop(Cause.WATCHED.key), "unwatched": figures}


def _instants(record: Record, times: Floats) -> Indices:
    """Index of the decision instant that each time is nearest to."""
    midway = 0.5 * (record.times[1:] + record.times[:-1])
    return np.searchsorted(midway, times).astype(np.int64)


def _assignments(record: Record) -> tuple[Indices, NDArray[np.bool_]]:
    """The vehicle that each aircraft is assigned to, and which vehicles have a track near them."""
    vehicles, count = record.vehicles, record.aircraft.shape[1]
    tracks = record.tracks[_among(record.tracks["agent"], count)]
    held = _among(record.decisions["agent"], count) & (record.decisions["target"] != "")
    decisions = record.decisions[held]
    codes = id_codes(np.concatenate([tracks["id"], decisions["target"]]))
    rows = [
        np.stack([_instants(record, table["time"]), table["agent"], names], axis=1)
        for table, names in (
            (tracks, codes[: len(tracks)]),
            (decisions, codes[len(tracks) :]),
        )
    ]
    near, assigned = kernels.assignments(
        np.ascontiguousarray(vehicles, dtype=np.float64),
        count,
        int(codes.max(initial=-1)) + 1,
        rows[0],
        np.stack([tracks["x"], tracks["y"]], axis=1),
        rows[1],
        GATE,
    )
    return assigned, near


def _hindrances(record: Record, assigned: Indices) -> NDArray[np.int8]:
    """What keeps each aircraft from seeing its vehicle, one kind of camera after the other."""
    cameras, looks = record.cameras, record.looks(record.times)
    aircraft = np.ascontiguousarray(record.aircraft, dtype=np.float64)
    vehicles = np.ascontiguousarray(record.vehicles, dtype=np.float64)
    hindered = np.zeros(assigned.shape, dtype=np.int8)
    for k, camera in enumerate(cameras):
        if camera in cameras[:k]:
            continue
        alike = np.array([other == camera for other in cameras])
        hindered += kernels.hindrances(
            record.city.walls,
            aircraft,
            vehicles,
            np.where(alike, assigned, -1),
            camera.target_height,
            camera.half_aperture,
            camera.range,
            camera.mounting,
            looks,
        )
    return hindered


def _told(record: Record, assigned: Indices) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """When each vehicle is sighted, and when any aircraft assigned to it learns of that."""
    times, n_vehicles = record.times, record.vehicles.shape[1]
    rows = record.sightings
    rows = rows[_among(rows["reporter"], assigned.shape[1]) & _among(rows["origin"], n_vehicles)]
    reporter, taken = rows["reporter"].astype(np.int64), rows["time"] - _CLOSE
    # A picture counts for the second in which it was taken, or until the next one is due.
    step = sample_step(times)
    cameras = record.cameras
    lasts = np.array([max(step, camera.frame_interval or 0.0) for camera in cameras])
    delays = np.array([camera.delay for camera in cameras])
    sightings = np.stack(
        [
            rows["origin"],
            reporter,
            np.searchsorted(times, taken),
            np.searchsorted(times, taken + lasts[reporter]),
            np.minimum(np.searchsorted(times, taken + delays[reporter]), len(times) - 1),
        ],
        axis=1,
    )
    return kernels.told(sightings, assigned, n_vehicles, *_reports(record, assigned.shape))


def _reports(record: Record, shape: tuple[int, int]) -> tuple[Indices, Indices, Indices]:
    """Row of each aircraft's report of each instant, and who heard each message."""
    messages, reports = record.messages, np.full(shape, -1, dtype=np.int64)
    if record.receptions is None:
        return reports, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    rows = np.flatnonzero((messages["kind"] == "report") & _among(messages["sender"], shape[1]))
    reports[_instants(record, messages["time"][rows]), messages["sender"][rows]] = rows
    heard, receivers = (record.receptions[:, column].astype(np.int64) for column in (0, 1))
    return reports, np.searchsorted(heard, np.arange(len(messages) + 1)), receivers


def _among(numbers: NDArray[Any], count: int) -> NDArray[np.bool_]:
    """Which numbers name one of `count` things."""
    return (numbers >= 0) & (numbers < count)
