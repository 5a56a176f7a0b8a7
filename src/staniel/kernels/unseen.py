"""Why a vehicle goes unwatched: who is assigned to it, what keeps it from sight, who was told."""

import math
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.footprint import BODY, Mount, camera_axes, in_cone, in_range
from staniel.kernels.walls import Walls, line_of_sight, warm_walls

__all__ = [
    "AIRCRAFT_LOST",
    "BUILDING",
    "MESSAGE_LOST",
    "MISSED_DETECTION",
    "NOBODY_ASSIGNED",
    "OUTSIDE_FOOTPRINT",
    "OUT_OF_RANGE",
    "TRACK_LOST",
    "WATCHED",
    "assignments",
    "attribute",
    "hindrances",
    "told",
    "warm",
]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]
Codes = NDArray[np.int8]

WATCHED: Final = 0
AIRCRAFT_LOST: Final = 1
NOBODY_ASSIGNED: Final = 2
OUT_OF_RANGE: Final = 3
OUTSIDE_FOOTPRINT: Final = 4
BUILDING: Final = 5
MISSED_DETECTION: Final = 6
MESSAGE_LOST: Final = 7
TRACK_LOST: Final = 8

_SEEN: Final = BUILDING + 1  # lacks less than what any hindrance leaves


@njit(cache=True, error_model="numpy")
def _nearest(x: float, y: float, vehicles: Floats, near: Bools, square: float) -> int:
    """Vehicle nearest to (x, y) within the root of `square`, or -1; all within are marked near."""
    least, nearest = square, -1
    for k in range(vehicles.shape[0]):
        dx, dy = vehicles[k, 0] - x, vehicles[k, 1] - y
        distance = dx * dx + dy * dy
        if distance <= square:
            near[k] = True
            if nearest < 0 or distance < least:
                least, nearest = distance, k
    return nearest


@njit(cache=True, error_model="numpy")
def assignments(
    vehicles: Floats,
    n_aircraft: int,
    n_names: int,
    tracks: Indices,
    places: Floats,
    decisions: Indices,
    gate: float,
) -> tuple[Bools, Indices]:
    """Which vehicles have a track near them, and which vehicle each aircraft is assigned to.

    An agent's track belongs to the vehicle that it is near. While it stays near that one it
    belongs to no other, and while it is near none, to the last one. A track that was never near
    any vehicle in the agent's own hands belongs where one of its name was last near in another's.

    Parameters
    ----------
    vehicles : (n, k, 4) float array
    n_aircraft, n_names : int
    tracks : (r, 3) int array
        Instant, agent and name of each estimate, in the order of the instants.
    places : (r, 2) float array [m]
        Of the estimates.
    decisions : (d, 3) int array
        Instant, agent and name of each target that an agent holds, in the order of the instants.
    gate : float [m]
        What is no farther is near.

    Returns
    -------
    near : (n, k) bool array
    assigned : (n, n_aircraft) int array
        Vehicle that the target held by each aircraft belongs to; -1 for none.
    """
    n, k = vehicles.shape[0], vehicles.shape[1]
    near, scratch = np.zeros((n, k), dtype=np.bool_), np.zeros(k, dtype=np.bool_)
    assigned = np.full((n, n_aircraft), -1, dtype=np.int64)
    own = np.full((n_aircraft, n_names), -1, dtype=np.int32)
    team = np.full(n_names, -1, dtype=np.int32)
    since, teller = np.full(n_names, -1, dtype=np.int64), np.zeros(n_names, dtype=np.int64)
    row, square = 0, gate * gate
    for decision in range(decisions.shape[0] + 1):
        # What was believed up to this decision; after the last one, all the rest.
        until = decisions[decision, 0] if decision < decisions.shape[0] else n
        while row < tracks.shape[0] and tracks[row, 0] <= until:
            t, agent, name = tracks[row, 0], tracks[row, 1], tracks[row, 2]
            x, y = places[row, 0], places[row, 1]
            nearest = _nearest(x, y, vehicles[t], near[t], square)
            row += 1
            if nearest < 0:
                continue
            kept = own[agent, name]
            if kept < 0 or _nearest(x, y, vehicles[t, kept : kept + 1], scratch, square) < 0:
                own[agent, name] = nearest
            if since[name] < t or agent < teller[name]:
                team[name], since[name], teller[name] = own[agent, name], t, agent
        if decision < decisions.shape[0]:
            agent, name = decisions[decision, 1], decisions[decision, 2]
            assigned[until, agent] = own[agent, name] if own[agent, name] >= 0 else team[name]
    return near, assigned


@njit(cache=True, error_model="numpy")
def hindrances(
    walls: Walls,
    aircraft: Floats,
    vehicles: Floats,
    assigned: Indices,
    height: float,
    half_aperture: float,
    reach: float,
    mount: Mount,
    looks: Floats,
) -> Codes:
    """What keeps each aircraft from seeing the vehicle that it is assigned to.

    Parameters
    ----------
    walls : Walls
    aircraft : (n, a, 6) float array
    vehicles : (n, k, 4) float array
    assigned : (n, a) int array
        A vehicle, or -1 for none.
    height, half_aperture, reach, mount, looks
        As in `staniel.kernels.visibility.seen_by`.

    Returns
    -------
    (n, a) int8 array
        `OUT_OF_RANGE`, `OUTSIDE_FOOTPRINT` or `BUILDING`; more where nothing does; 0 where it is
        assigned to none. The higher, the less was lacking.
    """
    hindered = np.zeros(assigned.shape, dtype=np.int8)
    cosine = math.cos(half_aperture)
    for t in range(assigned.shape[0]):
        axes = camera_axes(aircraft[t], looks[t], mount)
        for i in range(assigned.shape[1]):
            k = assigned[t, i]
            if k < 0:
                continue
            x, y, z = aircraft[t, i, 0], aircraft[t, i, 1], aircraft[t, i, 2]
            px, py = vehicles[t, k, 0], vehicles[t, k, 1]
            dx, dy, dz = px - x, py - y, height - z
            if not in_range(math.sqrt(dx * dx + dy * dy + dz * dz), reach):
                hindered[t, i] = OUT_OF_RANGE
            elif not in_cone(dx, dy, dz, axes[i, 0], axes[i, 1], axes[i, 2], cosine, reach):
                hindered[t, i] = OUTSIDE_FOOTPRINT
            elif not line_of_sight(walls, x, y, z, px, py, height):
                hindered[t, i] = BUILDING
            else:
                hindered[t, i] = _SEEN
    return hindered


@njit(cache=True, error_model="numpy")
def told(
    sightings: Indices,
    assigned: Indices,
    n_vehicles: int,
    reports: Indices,
    first: Indices,
    receivers: Indices,
) -> tuple[Bools, Bools]:
    """When each vehicle is sighted, and whether any that is assigned to it learns of that.

    Parameters
    ----------
    sightings : (s, 5) int array
        Vehicle, reporter, the first instant that it counts for, the one after the last, and the
        instant at which the reporter had it.
    assigned : (n, a) int array
    n_vehicles : int
    reports : (n, a) int array
        Message in which each aircraft reported its sightings of each instant; -1 for none on
        record, which is taken as heard by all.
    first : (m + 1,) int array
        Where each message's receivers begin.
    receivers : (r,) int array

    Returns
    -------
    sighted, told : (n, n_vehicles) bool array
    """
    n, count = assigned.shape
    sighted = np.zeros((n, n_vehicles), dtype=np.bool_)
    knows = np.zeros((n, n_vehicles), dtype=np.bool_)
    for s in range(sightings.shape[0]):
        vehicle, reporter = sightings[s, 0], sightings[s, 1]
        message = reports[sightings[s, 4], reporter]
        for t in range(sightings[s, 2], sightings[s, 3]):
            sighted[t, vehicle] = True
            for i in range(count):
                if assigned[t, i] != vehicle or knows[t, vehicle]:
                    continue
                hears = i == reporter or message < 0
                if not hears:
                    for r in range(first[message], first[message + 1]):
                        hears = hears or receivers[r] == i
                knows[t, vehicle] = hears
    return sighted, knows


@njit(cache=True, error_model="numpy")
def attribute(
    visible: Bools,
    near: Bools,
    assigned: Indices,
    fit: Bools,
    hindered: Codes,
    sighted: Bools,
    knows: Bools,
) -> Codes:
    """The first cause that holds, of each instant and vehicle; `WATCHED` where it is watched.

    Parameters
    ----------
    visible, near : (n, k) bool array
    assigned : (n, a) int array
        Of `assignments`.
    fit : (n, a) bool array
        The aircraft flies and its camera works.
    hindered : (n, a) int8 array
        Of `hindrances`.
    sighted, knows : (n, k) bool array
        Of `told`.

    Returns
    -------
    (n, k) int8 array
    """
    n, count = visible.shape
    causes = np.zeros((n, count), dtype=np.int8)
    orphaned = np.zeros(count, dtype=np.bool_)
    for t in range(n):
        # By vehicle: how many are and were assigned, how many of these could look now, and what
        # hinders the best of them.
        now, fit_now = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
        before, fit_before = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
        least = np.zeros(count, dtype=np.int8)
        for i in range(assigned.shape[1]):
            k = assigned[t, i]
            if k >= 0:
                now[k] += 1
                if fit[t, i]:
                    fit_now[k] += 1
                    least[k] = max(least[k], hindered[t, i])
            k = assigned[t - 1, i] if t > 0 else -1
            if k >= 0:
                before[k] += 1
                fit_before[k] += fit[t, i]
        for k in range(count):
            if now[k] > 0:
                orphaned[k] = fit_now[k] == 0
            elif before[k] > 0:
                orphaned[k] = fit_before[k] == 0
            if visible[t, k] and near[t, k]:
                causes[t, k] = WATCHED
            elif orphaned[k]:
                causes[t, k] = AIRCRAFT_LOST
            elif now[k] == 0:
                causes[t, k] = NOBODY_ASSIGNED
            elif not visible[t, k]:
                causes[t, k] = least[k]
            elif not sighted[t, k]:
                causes[t, k] = MISSED_DETECTION
            elif not knows[t, k]:
                causes[t, k] = MESSAGE_LOST
            else:
                causes[t, k] = TRACK_LOST
    return causes


def warm() -> None:
    """Compile, or load from the cache, what a flight's metrics call."""
    poses, looks = np.zeros((1, 1, 6)), np.zeros((1, 1, 2))
    vehicles, rows = np.zeros((1, 1, 4)), np.zeros((1, 3), dtype=np.int64)
    near, assigned = assignments(vehicles, 1, 1, rows, np.zeros((1, 2)), rows, 1.0)
    hindered = hindrances(warm_walls(), poses, vehicles, assigned, 1.0, 1.0, 1.0, BODY, looks)
    sightings = np.zeros((0, 5), dtype=np.int64)
    indices = np.zeros(2, dtype=np.int64)
    sighted, knows = told(sightings, assigned, 1, assigned, indices, indices)
    attribute(near, near, assigned, near, hindered, sighted, knows)
