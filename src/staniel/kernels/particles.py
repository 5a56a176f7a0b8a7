"""Particles of moving targets: launched around a place, and settled after each step.

See `staniel.kernels.motion` for how they are stored and moved, `staniel.kernels.weighing` for how
they meet what was seen.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.lanes import (
    exp32,
    greatest,
    total_of,
    weighted,
    weighted_product,
)
from staniel.kernels.lineage import SLOTS, descend
from staniel.kernels.motion import spread
from staniel.kernels.random import normals
from staniel.kernels.resampling import resample

__all__ = ["draws_of", "settle", "spawn", "warm"]

Array = NDArray[Any]

_F0 = np.float32(0.0)


def draws_of(particles: int) -> int:
    """Counters of a track's stream that one step may use: moving, resampling, jitter."""
    return 5 * particles + 16


@njit(cache=True, error_model="numpy")
def _weighed(state: Array, logs: Array, own: Array, out: Array) -> tuple[float, float]:
    """Weights by log-sum-exp, not normalised yet, and all moments.

    Returns the greatest log weight and the sum of the weights in units of the greatest. `out` is a
    row as `settle` gives it.
    """
    top = greatest(logs)
    for i in range(own.size):
        own[i] = exp32(logs[i] - top)
    total = float(total_of(own))
    share = 1.0 / total
    for row in range(4):
        out[row] = share * weighted(own, state[row])
    x, y, mx, my = state[0], state[1], np.float32(out[0]), np.float32(out[1])
    out[4] = share * weighted_product(own, x, x, mx, mx)
    out[5] = out[6] = share * weighted_product(own, x, y, mx, my)
    out[7] = share * weighted_product(own, y, y, my, my)
    out[8] = total * total / float(weighted(own, own))
    return float(top), total


@njit(cache=True, error_model="numpy")
def settle(
    state: Array,
    weights: Array,
    log_weights: Array,
    origins: Array,
    keys: Array,
    ancestors: Array,
    copied: Array,
    head: int,
    count: int,
    step: int,
    draws: int,
    threshold: float,
    scheme: int,
    roughening: float,
    rests: Array,
    whole: bool,
) -> Array:
    """Normalise the weights, estimate, resample where few particles bear the weight, and jitter.

    Weights by log-sum-exp; N_eff = 1/Σw² (thesis eq. 6.23, corrected).

    Parameters
    ----------
    state, weights, log_weights, origins, keys, count, step, draws : as in `predict`
        The first three are changed in place; both kinds of weight are normalised afterwards.
    ancestors, copied, head : as in `staniel.kernels.lineage.descend`
    threshold : float
        Resample below this share of effective particles; 0: never.
    scheme : int
        Of `staniel.kernels.resampling`.
    roughening : float
        Where copies would stay alike: standard deviation of their jitter, in units of the cloud's.
    rests : (capacity, 4, 4) float64 array
        Covariance of the Gaussian that each particle stands for; zero: it is a point. Particles are
        drawn from it, and what is left is put in its place: nothing, or, not `whole`, that of the
        velocity given the place, which all particles go on having in common.
    whole : bool

    Returns
    -------
    (count, 10) float64 array
        Mean x, y [m, on the map], vx, vy [m/s], position covariance xx, xy, yx, yy [m²] with its
        jitter, N_eff, and the log of the weights' sum: how likely all that was seen or missed is.
    """
    n = state.shape[2]
    half = (n + 1) // 2
    out = np.empty((count, 10), np.float64)
    buffer = np.empty(n, np.float32)
    noise, chosen = np.empty((4, half), np.float32), np.empty(n, np.int32)
    even, level = np.float32(1.0 / n), np.float32(-np.log(n))
    mean = np.empty(4)
    drawn = 4 if whole else 2
    for k in range(count):
        logs, own, row, rest = log_weights[k], weights[k], out[k], rests[k]
        top, total = _weighed(state[k], logs, own, row)
        row[0] += origins[k, 0]
        row[1] += origins[k, 1]
        for a in range(2):
            for b in range(2):
                row[4 + 2 * a + b] += rest[a, b]
        row[9] = top + np.log(total)
        first = step * draws + 2 * half + 1
        if row[8] < threshold * n:
            resample(own, total, scheme, keys[k], first, chosen)
            # What is shared of the velocity alone is no reason to jitter, nor to be forgotten.
            if whole and rest[0, 0] <= 0.0:
                spread(state[k], own, mean, rest)
                rest *= roughening * roughening
            for a in range(4):
                plane = state[k, a]
                for i in range(n):
                    buffer[i] = plane[i]
                for i in range(n):
                    plane[i] = buffer[np.int64(chosen[i])]
            descend(ancestors, copied, k, head, chosen)
            logs[:] = level
            own[:] = even
        else:
            scale, shift = np.float32(1.0 / total), np.float32(row[9])
            for i in range(n):
                own[i] *= scale
                logs[i] -= shift
        if rest[0, 0] > 0.0:
            normals(keys[k], first + n + 1, noise[:drawn].reshape(drawn * half))
            _shake(state[k], noise[:drawn], rest)
    return out


@njit(cache=True, error_model="numpy")
def _shake(state: Array, noise: Array, covariance: Array) -> None:
    """Draw each particle from its Gaussian; the second half draw the opposite of the first.

    With two rows of noise the places are drawn, and the velocities are what they are on average at
    these places. `covariance` is left with what is common to all particles then.
    """
    root = _root(covariance)
    drawn, half = noise.shape
    n = state.shape[1]
    for a in range(4):
        plane = state[a]
        for b in range(min(a + 1, drawn)):
            size = np.float32(root[a, b])
            if size == _F0:
                continue
            draw = noise[b]
            for i in range(half):
                plane[i] += size * draw[i]
            for i in range(n - half):
                plane[half + i] -= size * draw[i]
    for a in range(4):
        for b in range(4):
            left = 0.0
            for c in range(drawn, min(a, b) + 1):
                left += root[a, c] * root[b, c]
            covariance[a, b] = left


@njit(cache=True, error_model="numpy")
def _root(covariance: Array) -> Array:
    """Lower triangular root; directions without variance, or with less by rounding, have none."""
    d = covariance.shape[0]
    root = np.zeros((d, d))
    for a in range(d):
        for b in range(a + 1):
            rest = covariance[a, b]
            for c in range(b):
                rest -= root[a, c] * root[b, c]
            if a == b:
                root[a, a] = np.sqrt(max(rest, 0.0))
            elif root[b, b] > 1e-9:
                root[a, b] = rest / root[b, b]
    return root


@njit(cache=True, error_model="numpy")
def spawn(
    state: Array, weights: Array, log_weights: Array, key: np.uint64, place: Array, fastest: float
) -> None:
    """Launch one track's particles around a confirmed place, in place.

    Parameters
    ----------
    state : (4, n) float32 array
    weights, log_weights : (n,) float32 arrays
    key : uint64
    place : (2, 6) float64 array
        Per axis position [m, from the origin], velocity [m/s], their variances and covariance
        (pp, pv, vv); one column unused.
    fastest : float [m/s]
        Faster particles are slowed down to it.
    """
    n = weights.size
    noise = np.empty((4, n), np.float32)
    first: Any = np.int64(0)
    normals(key, first, noise.reshape(4 * n))
    for axis in range(2):
        root = np.sqrt(place[axis, 2])
        slope = place[axis, 3] / root
        rest = np.sqrt(max(place[axis, 4] - slope * slope, 0.0))
        for i in range(n):
            one = noise[axis, i]
            state[axis, i] = place[axis, 0] + root * one
            state[2 + axis, i] = place[axis, 1] + slope * one + rest * noise[2 + axis, i]
    for i in range(n):
        speed = np.sqrt(state[2, i] ** 2 + state[3, i] ** 2)
        share = min(1.0, fastest / max(speed, fastest))
        state[2, i] *= share
        state[3, i] *= share
    log_weights[:] = np.float32(-np.log(n))
    weights[:] = np.float32(1.0 / n)


def warm() -> None:
    """Compile (or load) every kernel here with the types used in flight."""
    n = 32
    state = np.zeros((1, 4, n), np.float32)
    weights, logs = np.empty((1, n), np.float32), np.empty((1, n), np.float32)
    keys = np.array([1], np.uint64)
    spawn(state[0], weights[0], logs[0], keys[0], np.ones((2, 6)), 4.0)
    ancestors, copied = np.zeros((1, SLOTS, n), np.int32), np.zeros((1, SLOTS), np.bool_)
    settle(
        state, weights, logs, np.zeros((1, 2)), keys, ancestors, copied, 0, 1, 1, draws_of(n), 0.5,
        0, 0.1, np.zeros((1, 4, 4)), True,
    )  # fmt: skip
