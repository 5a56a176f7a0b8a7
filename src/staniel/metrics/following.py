"""How the team's tracks follow the true vehicles, decision instant by decision instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from staniel.angles import wrap_array
from staniel.metrics.correspondence import Correspondence
from staniel.metrics.gospa import CUTOFF, ORDER, gospa_of_squares
from staniel.metrics.identity import GATE, IdentityScores, scores_of
from staniel.metrics.ospa import ospa_of_gospa
from staniel.metrics.picture import freshest, id_codes
from staniel.record import Record

__all__ = ["Following", "follow", "gospa_steps", "ospa_steps"]

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
    position_nees : (n, k) float array [-]
        Of the same track's position, see `nees`; NaN where there is none, or where its recorded
        covariance is not positive definite.
    switches : (k,) int array
        Identity switches of each vehicle.
    identity : IdentityScores
        Of the team picture over all instants.
    gospa : (n, 4) float array
        Distance and parts of each instant, see `Gospa`.
    ospa : (n,) float array [m]
        Of each instant.
    tracks_started : int
        Different track ids.
    false_tracks : int
        Those of them never within `GATE` of any vehicle, in any agent's hands.
    """

    tracked: NDArray[np.bool_]
    position_error: Floats
    speed_error: Floats
    course_error: Floats
    position_nees: Floats
    switches: NDArray[np.int64]
    identity: IdentityScores
    gospa: Floats
    ospa: Floats
    tracks_started: int
    false_tracks: int


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
    numbers = range(k)
    found = Correspondence(GATE)
    for step in range(n):
        truth = vehicles[step, :, :2].T
        rows = slice(row_bounds[step], row_bounds[step + 1])
        near = _squares(truth, positions[:, rows]) <= GATE * GATE
        tracked[step] = near.any(axis=1)
        near_a_vehicle[codes[rows][near.any(axis=0)]] = True
        first, last = picture_bounds[step], picture_bounds[step + 1]
        squares = _squares(truth, shown[:, first:last])
        parts[step] = gospa_of_squares(squares, CUTOFF, ORDER)
        found.update(np.sqrt(squares), numbers, shown_codes[first:last])
        if squares.size:
            best = squares.argmin(axis=1)
            close = squares[np.arange(k), best] <= GATE * GATE
            nearest[step, close] = picture[first + best[close]]
    return Following(
        tracked,
        *_errors(tracks, vehicles, nearest),
        np.array([found.switches[vehicle] for vehicle in numbers], dtype=np.int64),
        scores_of(found),
        parts,
        ospa_of_gospa(parts, np.maximum(np.diff(picture_bounds), max(k, 1)), ORDER),
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
) -> tuple[Floats, Floats, Floats, Floats]:
    """Position, speed and course errors, and NEES, of the tracks in rows `nearest` (-1: NaN)."""
    position, speed, course, squared = (np.full(nearest.shape, np.nan) for _ in range(4))
    where = nearest >= 0
    rows, truth = tracks[nearest[where]], vehicles[where]
    vx, vy = truth[:, 3] * np.cos(truth[:, 2]), truth[:, 3] * np.sin(truth[:, 2])
    dx, dy = rows["x"] - truth[:, 0], rows["y"] - truth[:, 1]
    position[where] = np.hypot(dx, dy)
    speed[where] = np.hypot(rows["vx"], rows["vy"]) - np.abs(truth[:, 3])
    turned = wrap_array(np.arctan2(rows["vy"], rows["vx"]) - np.arctan2(vy, vx))
    course[where] = np.where(np.abs(truth[:, 3]) >= STANDING, turned, np.nan)
    squared[where] = _squared(dx, dy, rows["cxx"], rows["cxy"], rows["cyy"])
    return position, speed, course, squared


def _squared(dx: Floats, dy: Floats, xx: Floats, xy: Floats, yy: Floats) -> Floats:
    """NEES of two dimensions, written out."""
    determinant = xx * yy - xy * xy
    squares = yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy
    definite = (xx > 0.0) & (determinant > 0.0)
    result: Floats = np.where(definite, squares, np.nan) / np.where(definite, determinant, 1.0)
    return result


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


def ospa_steps(record: Record) -> Floats:
    """OSPA of each decision instant, between all vehicles and the team picture.

    Parameters
    ----------
    record : Record

    Returns
    -------
    (n,) float array [m]
        At ``record.times``; see `staniel.metrics.ospa`.
    """
    return follow(record).ospa
