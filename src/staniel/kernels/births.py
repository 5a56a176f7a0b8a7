"""New targets: peaks on a grid of static particles, and the places that come back (thesis 6.3)."""

from math import exp, floor, inf, sqrt
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["fit", "follow", "grow", "propose", "warm"]

Array = NDArray[Any]

_CLIMB = 8
_SAME_TIME = 1e-6
_CHANGE, _TURN = 2.0, 0.7  # of a velocity: so many m/s, and this share of the speed, per second


@njit(cache=True, error_model="numpy")
def _window(
    sightings: Array,
    near: Array,
    found: int,
    node: tuple[int, int],
    spacing: float,
    reach: int,
    out: Array,
) -> tuple[int, int]:
    """Weights of the static particles around a node under the first `found` sightings of `near`.

    Returns the heaviest particle's steps east and north of the node.
    """
    own = 0.25 * spacing * spacing
    side = 2 * reach + 1
    for b in range(side):
        for a in range(side):
            out[b, a] = 0.0
    for i in range(found):
        z = sightings[near[i]]
        # A static particle stands for its cell: the cell's extent adds to the covariance.
        sxx, sxy, syy = z[3] + own, z[4], z[5] + own
        det = sxx * syy - sxy * sxy
        ixx, ixy, iyy = 0.5 * syy / det, 0.5 * sxy / det, 0.5 * sxx / det
        norm, west = 1.0 / sqrt(det), (node[0] - reach) * spacing - z[1]
        # From node to node the exponent changes by what changes evenly: a product does for an exp.
        turn = exp(-2.0 * ixx * spacing * spacing)
        for b in range(side):
            dy = (node[1] + b - reach) * spacing - z[2]
            # From the heaviest of the row outwards, so that nothing is lost that counts.
            first = min(max(floor((ixy / ixx * dy - west) / spacing + 0.5), 0), side - 1)
            dx = west + first * spacing
            heaviest = norm * exp(-dx * (ixx * dx - 2.0 * ixy * dy) - iyy * dy * dy)
            out[b, first] += heaviest
            for way in (-1, 1):
                step = exp(-spacing * (ixx * (2.0 * way * dx + spacing) - 2.0 * ixy * way * dy))
                value, a = heaviest * step, first + way
                while 0 <= a < side:
                    out[b, a] += value
                    step *= turn
                    value *= step
                    a += way
    east, north = reach, reach
    for b in range(side):
        for a in range(side):
            if out[b, a] > out[north, east]:
                east, north = a, b
    return east - reach, north - reach


@njit(cache=True, error_model="numpy")
def propose(sightings: Array, spacing: float, reach: int) -> Array:
    """Candidate places: local maxima of the static particles' weight, one time at a time.

    The grid is anchored at the origin and has no border: only windows near sightings are touched,
    so that the cost grows with the sightings and not with the area.

    Parameters
    ----------
    sightings : (m, 6) float64 array
        Time [s], x, y [m], covariance xx, xy, yy [m²]; in ascending order of time, then of x.
    spacing : float [m]
        Between static particles.
    reach : int
        A window has 2 reach + 1 static particles a side.

    Returns
    -------
    (p, 6) float64 array
        Places in the same columns: weighted centroid of the window around each local maximum, and
        the covariance of the sightings that led there, composed. In ascending order of time.
    """
    m = sightings.shape[0]
    side = 2 * reach + 1
    weights = np.empty((side, side))
    places = np.empty((m, 6))
    nodes = np.empty((m, 2), np.int64)
    near = np.empty(m, np.int64)
    count = 0
    width = (2 * reach + 1) * spacing
    for j in range(m):
        z = sightings[j]
        east, north = floor(z[1] / spacing + 0.5), floor(z[2] / spacing + 0.5)
        for _ in range(_CLIMB):
            found = _neighbours(sightings, j, east * spacing, north * spacing, width, near)
            a, b = _window(sightings, near, found, (east, north), spacing, reach, weights)
            if a == 0 and b == 0:
                break
            east += a
            north += b
        known = -1
        for p in range(count - 1, -1, -1):
            if z[0] - places[p, 0] > _SAME_TIME:
                break
            if nodes[p, 0] == east and nodes[p, 1] == north:
                known = p
                break
        if known >= 0:
            _compose(places[known], z[3], z[4], z[5])
            continue
        nodes[count, 0], nodes[count, 1] = east, north
        total, sum_x, sum_y = 0.0, 0.0, 0.0
        for b in range(side):
            for a in range(side):
                total += weights[b, a]
                sum_x += weights[b, a] * (a - reach)
                sum_y += weights[b, a] * (b - reach)
        place = places[count]
        place[0] = z[0]
        place[1] = (east + sum_x / total) * spacing
        place[2] = (north + sum_y / total) * spacing
        place[3], place[4], place[5] = z[3], z[4], z[5]
        count += 1
    return places[:count]


@njit(cache=True, error_model="numpy")
def _neighbours(sightings: Array, j: int, x: float, y: float, width: float, out: Array) -> int:
    """Sightings of the time of number `j` whose place is within `width` of (x, y) on both axes."""
    found = 0
    time = sightings[j, 0]
    first = j
    while first > 0 and time - sightings[first - 1, 0] <= _SAME_TIME:
        if x - sightings[first - 1, 1] > width:
            break
        first -= 1
    for number in range(first, sightings.shape[0]):
        z = sightings[number]
        if z[0] - time > _SAME_TIME or z[1] - x > width:
            break
        if abs(z[1] - x) <= width and abs(z[2] - y) <= width:
            out[found] = number
            found += 1
    return found


@njit(cache=True, error_model="numpy")
def _compose(place: Array, xx: float, xy: float, yy: float) -> None:
    """Covariance of a place after one more independent look: (P⁻¹ + Σ⁻¹)⁻¹, in place."""
    p_det = place[3] * place[5] - place[4] * place[4]
    z_det = xx * yy - xy * xy
    ixx, ixy, iyy = (
        place[5] / p_det + yy / z_det,
        -place[4] / p_det - xy / z_det,
        place[3] / p_det + xx / z_det,
    )
    det = ixx * iyy - ixy * ixy
    place[3], place[4], place[5] = iyy / det, -ixy / det, ixx / det


@njit(cache=True, error_model="numpy", forceinline=True)
def _share_of_reach(
    candidates: Array, i: int, place: Array, max_speed: float, gate: float
) -> float:
    """Squared distance of a place from where a candidate is expected, over that of its reach."""
    # By numbers and not by views of rows, each of which would be counted as a reference.
    hits = candidates[i, 0]
    t = 6 * int(hits) - 4
    x, y = candidates[i, t + 1], candidates[i, t + 2]
    variance, change = candidates[i, t + 3] + candidates[i, t + 5], max_speed
    gone = place[0] - candidates[i, t]
    if hits >= 2.0 and gone > _SAME_TIME:
        share = gone / (candidates[i, t] - candidates[i, t - 6])
        vx = (x - candidates[i, t - 5]) / gone * share
        vy = (y - candidates[i, t - 4]) / gone * share
        x, y = x + vx * gone, y + vy * gone
        before = candidates[i, t - 3] + candidates[i, t - 1]
        variance = (1.0 + share) ** 2 * variance + share * share * before
        change = min(max_speed, _CHANGE + _TURN * sqrt(vx * vx + vy * vy))
    dx, dy = place[1] - x, place[2] - y
    variance += place[3] + place[5]
    beyond = max(abs(dx), abs(dy)) - change * abs(gone)
    if beyond > 0.0 and beyond * beyond > gate * gate * variance:
        return inf  # Most are far away, and a root takes longer than all the rest.
    reach = gate * sqrt(variance) + change * abs(gone)
    square: float = (dx * dx + dy * dy) / (reach * reach)
    return square


@njit(cache=True, error_model="numpy")
def follow(candidates: Array, places: Array, max_speed: float, gate: float) -> Array:
    """Let candidates claim the places they can have reached; the rest become new candidates.

    A candidate claims the nearest place within reach of its last hit, ``max_speed·Δt`` plus `gate`
    standard deviations of both. One with two hits or more has a velocity: then the reach is about
    where that leads, and allows for a change of the velocity instead of for any velocity. A place
    at the time of its last hit refines that hit instead of counting again; an older one is
    absorbed. One step without a hit is allowed.

    Parameters
    ----------
    candidates : (c, 2 + 6 h) float64 array
        Number of hits, steps since the last, then up to `h` hits as in `propose`.
    places : (p, 6) float64 array
        Of `propose`, ascending in time.
    max_speed : float [m/s]
    gate : float [sigma]

    Returns
    -------
    (c', 2 + 6 h) float64 array
        The surviving and the new candidates; one with `h` hits is confirmed.
    """
    c, p = candidates.shape[0], places.shape[0]
    out = np.zeros((c + p, candidates.shape[1]))
    count = 0
    for i in range(c):
        if candidates[i, 1] < 2.0:
            for column in range(candidates.shape[1]):
                out[count, column] = candidates[i, column]
            out[count, 1] += 1.0
            count += 1
    alive = count
    full = (candidates.shape[1] - 2) // 6
    for q in range(p):
        place = places[q]
        best, closest = -1, 1.0
        for i in range(alive):
            share = _share_of_reach(out, i, place, max_speed, gate)
            if share < closest:
                best, closest = i, share
        if best < 0:
            out[count, 0] = 1.0
            for column in range(6):
                out[count, 2 + column] = place[column]
            count += 1
            continue
        base = 6 * int(out[best, 0]) - 4
        last = out[best, base : base + 6]
        if place[0] - last[0] > _SAME_TIME:
            if out[best, 0] < full:
                out[best, 0] += 1.0
                for column in range(6):
                    out[best, base + 6 + column] = place[column]
            out[best, 1] = 0.0
        elif last[0] - place[0] <= _SAME_TIME:
            share = (place[3] + place[5]) / (last[3] + last[5] + place[3] + place[5])
            last[1] = share * last[1] + (1.0 - share) * place[1]
            last[2] = share * last[2] + (1.0 - share) * place[2]
            _compose(last, place[3], place[4], place[5])
    return out[:count]


@njit(cache=True, error_model="numpy")
def grow(
    candidates: Array,
    sightings: Array,
    spacing: float,
    reach: int,
    max_speed: float,
    gate: float,
    enough: int,
) -> tuple[Array, int]:
    """Propose places and let candidates follow them.

    Parameters
    ----------
    candidates, max_speed, gate : as `follow` takes them
    sightings, spacing, reach : as `propose` takes them
    enough : int
        Hits of a confirmed candidate.

    Returns
    -------
    candidates : (c', 2 + 6 h) float64 array
        As `follow` gives them.
    confirmed : int
        How many of them are.
    """
    grown = follow(candidates, propose(sightings, spacing, reach), max_speed, gate)
    return grown, int((grown[:, 0] >= enough).sum())


@njit(cache=True, error_model="numpy")
def fit(candidate: Array, now: float, spread: float) -> Array:
    """Position and velocity of a confirmed candidate now: weighted least squares over its hits.

    Axis by axis, with a Gaussian prior of zero mean on the velocity.

    Parameters
    ----------
    candidate : (2 + 6 h,) float64 array
        As in `follow`.
    now : float [s]
    spread : float [m/s]
        Standard deviation of the prior.

    Returns
    -------
    (2, 6) float64 array
        Per axis position [m], velocity [m/s], their covariance pp, pv, vv, and the sum of the
        hits' squared distances from it [sigma²].
    """
    out = np.empty((2, 6))
    for axis in range(2):
        a, b, d, u, v = 0.0, 0.0, 1.0 / (spread * spread), 0.0, 0.0
        anchor = candidate[3 + axis]
        for i in range(int(candidate[0])):
            hit = candidate[2 + 6 * i : 8 + 6 * i]
            tau, information = hit[0] - now, 1.0 / hit[3 + 2 * axis]
            a += information
            b += information * tau
            d += information * tau * tau
            u += information * (hit[1 + axis] - anchor)
            v += information * tau * (hit[1 + axis] - anchor)
        det = a * d - b * b
        out[axis, 0] = anchor + (d * u - b * v) / det
        out[axis, 1] = (a * v - b * u) / det
        out[axis, 2], out[axis, 3], out[axis, 4] = d / det, -b / det, a / det
        out[axis, 5] = 0.0
        for i in range(int(candidate[0])):
            hit = candidate[2 + 6 * i : 8 + 6 * i]
            off = hit[1 + axis] - out[axis, 0] - (hit[0] - now) * out[axis, 1]
            out[axis, 5] += off * off / hit[3 + 2 * axis]
    return out


def warm() -> None:
    """Compile (or load) every kernel here with the types used in flight."""
    sightings = np.array([[0.0, 1.0, 1.0, 1.0, 0.0, 1.0], [0.0, 1.5, 1.0, 1.0, 0.0, 1.0]])
    candidates, _ = grow(np.zeros((0, 20)), sightings, 2.0, 3, 4.0, 3.0, 3)
    fit(candidates[0], 1.0, 2.0)
