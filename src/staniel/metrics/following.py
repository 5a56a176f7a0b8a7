"""How the team's tracks follow the true vehicles, decision instant by decision instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from staniel.angles import wrap_array
from staniel.metrics.gospa import CUTOFF, ORDER, gospa_of_squares
from staniel.metrics.picture import freshest, id_codes
from staniel.record import Record

__all__ = ["GATE", "Following", "IdentityKeeper", "follow", "gospa_steps"]

GATE = 10.0
"""A track is a vehicle's as long as it is within this distance of it [m]."""

STANDING = 0.1
"""A slower vehicle has no course [m/s]."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Following:
    """What comparing the tracks with the vehicles gives, for n instants and k vehicles.

    Attributes
    ----------
    tracked : (n, k) bool array
        A live track of any agent is within `GATE`.
    position_error, speed_error, course_error : (n, k) float array [m, m/s, rad]
        Of the nearest track of the team picture; NaN where none is within `GATE`, and, for the
        course, while the vehicle stands.
    switches : (k,) int array
        Identity switches of each vehicle.
    gospa : (n, 4) float array
        Distance and parts of each instant, see `Gospa`.
    tracks_started : int
        Different track ids.
    false_tracks : int
        Those of them never within `GATE` of any vehicle, in any agent's hands.
    """

    tracked: NDArray[np.bool_]
    position_error: Floats
    speed_error: Floats
    course_error: Floats
    switches: NDArray[np.int64]
    gospa: Floats
    tracks_started: int
    false_tracks: int


class IdentityKeeper:
    """Matches vehicles with tracks one to one, holds on to the matches, counts the changes.

    CLEAR MOT's correspondence (Bernardin and Stiefelhagen 2008, section 2.1.3): a vehicle keeps
    the track that it was last matched with while that is within the gate; the others are matched
    so that as many as possible have a track, and then that the distances sum to the least.

    Parameters
    ----------
    vehicles : int
        How many there are.

    Attributes
    ----------
    switches : list of int
        Per vehicle: how often its match had another id than its last match before, however long
        ago that was.
    """

    def __init__(self, vehicles: int) -> None:
        self.switches = [0] * vehicles
        self._last: list[int | None] = [None] * vehicles

    def update(self, distances: Floats, codes: list[int]) -> None:
        """Take in one instant.

        Parameters
        ----------
        distances : (k, m) float array [m]
            From each vehicle to each track.
        codes : list of m int
            The tracks' ids, as numbers.
        """
        near = distances <= GATE
        column_of = {code: column for column, code in enumerate(codes)}
        taken: set[int] = set()
        free: list[int] = []
        for vehicle, last in enumerate(self._last):
            column = None if last is None else column_of.get(last)
            if column is None or column in taken or not near[vehicle, column]:
                free.append(vehicle)
            else:
                taken.add(column)
        if len(taken) == len(codes) or not free:
            return
        columns = [column for column in range(len(codes)) if column not in taken]
        open_pairs = np.ix_(free, columns)
        if near[open_pairs].any():
            self._match(np.where(near, distances, np.inf)[open_pairs], free, columns, codes)

    def _match(
        self, distances: Floats, vehicles: list[int], columns: list[int], codes: list[int]
    ) -> None:
        from scipy.optimize import linear_sum_assignment

        # A forbidden pair costs more than all allowed ones together, so matches come first.
        forbidden = GATE * (1 + min(distances.shape))
        pairs = linear_sum_assignment(np.where(np.isinf(distances), forbidden, distances))
        for row, column in zip(*(side.tolist() for side in pairs), strict=True):
            if np.isinf(distances[row, column]):
                continue
            vehicle, code = vehicles[row], codes[columns[column]]
            if self._last[vehicle] is not None and self._last[vehicle] != code:
                self.switches[vehicle] += 1
            self._last[vehicle] = code


def follow(record: Record) -> Following:
    """Compare every track of a record with every vehicle.

    Parameters
    ----------
    record : Record

    Returns
    -------
    Following
    """
    tracks, vehicles = record.tracks, record.vehicles
    n, k = vehicles.shape[:2]
    codes = id_codes(tracks["id"])
    picture = freshest(tracks, codes)
    row_bounds = _bounds(record.times, tracks["time"])
    picture_bounds = _bounds(record.times, tracks["time"][picture])
    positions = np.stack((tracks["x"], tracks["y"]))
    shown, shown_codes = np.ascontiguousarray(positions[:, picture]), codes[picture].tolist()

    tracked = np.zeros((n, k), dtype=bool)
    near_a_vehicle = np.zeros(len(set(shown_codes)), dtype=bool)
    nearest = np.full((n, k), -1)
    parts = np.zeros((n, 4))
    keeper = IdentityKeeper(k)
    for step in range(n):
        truth = vehicles[step, :, :2].T
        rows = slice(row_bounds[step], row_bounds[step + 1])
        near = _squares(truth, positions[:, rows]) <= GATE * GATE
        tracked[step] = near.any(axis=1)
        near_a_vehicle[codes[rows][near.any(axis=0)]] = True
        first, last = picture_bounds[step], picture_bounds[step + 1]
        squares = _squares(truth, shown[:, first:last])
        parts[step] = gospa_of_squares(squares, CUTOFF, ORDER)
        if squares.size:
            best = squares.argmin(axis=1)
            found = squares[np.arange(k), best] <= GATE * GATE
            nearest[step, found] = picture[first + best[found]]
            keeper.update(np.sqrt(squares), shown_codes[first:last])
    return Following(
        tracked,
        *_errors(tracks, vehicles, nearest),
        np.array(keeper.switches, dtype=np.int64),
        parts,
        len(near_a_vehicle),
        int((~near_a_vehicle).sum()),
    )


def _bounds(times: Floats, row_times: Floats) -> list[int]:
    """Where each instant's rows begin and, one farther, end; rows belong to the nearest instant."""
    if len(times) == 0:
        return [0]
    edges = np.concatenate(([-np.inf], 0.5 * (times[1:] + times[:-1]), [np.inf]))
    bounds: list[int] = np.searchsorted(row_times, edges).tolist()
    return bounds


def _squares(truth: Floats, positions: Floats) -> Floats:
    """Squared distances (k, m) between the columns of (2, k) and (2, m) arrays."""
    dx: Floats = truth[0][:, None] - positions[0]
    dy: Floats = truth[1][:, None] - positions[1]
    dx *= dx
    dy *= dy
    dx += dy
    return dx


def _errors(
    tracks: NDArray[np.void], vehicles: Floats, nearest: NDArray[np.intp]
) -> tuple[Floats, Floats, Floats]:
    """Position, speed and course errors of the tracks in rows `nearest` (-1: none, gives NaN)."""
    position, speed, course = (np.full(nearest.shape, np.nan) for _ in range(3))
    where = nearest >= 0
    rows, truth = tracks[nearest[where]], vehicles[where]
    vx, vy = truth[:, 3] * np.cos(truth[:, 2]), truth[:, 3] * np.sin(truth[:, 2])
    position[where] = np.hypot(rows["x"] - truth[:, 0], rows["y"] - truth[:, 1])
    speed[where] = np.hypot(rows["vx"], rows["vy"]) - np.abs(truth[:, 3])
    turned = wrap_array(np.arctan2(rows["vy"], rows["vx"]) - np.arctan2(vy, vx))
    course[where] = np.where(np.abs(truth[:, 3]) >= STANDING, turned, np.nan)
    return position, speed, course


def gospa_steps(record: Record) -> Floats:
    """GOSPA of each decision instant, between all vehicles and the team picture.

    Parameters
    ----------
    record : Record

    Returns
    -------
    (n, 4) float array
        Distance [m], and its parts for localisation, missed vehicles and false tracks [m²], at
        ``record.times``; see `staniel.metrics.Gospa`.
    """
    return follow(record).gospa
