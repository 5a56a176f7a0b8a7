"""Particles of moving targets: spawn, predict, settle; one call a tick for all tracks.

A track's particles are stored plane by plane, ``state[track] = (x, y, vx, vy)`` with one row of
`n` float32 each, so that every hot loop runs over contiguous memory; positions are relative to the
track's own origin, which keeps float32 exact to millimetres anywhere on the map.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.random import bits, normals, uniform

__all__ = ["exp32", "predict", "resample", "settle", "spawn", "total_of", "warm"]

Array = NDArray[Any]

LANES = 64
"""Sums run in this many lanes, in a fixed order: they vectorise and stay the same everywhere."""

DRAWS = 4
"""Times the number of particles, and 2: counters that one step of one track may use."""

_F0, _F05, _F1 = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_LOWEST = np.float32(-87.0)
_LOG2E = np.float32(1.44269504)
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
_EXP = tuple(np.float32(c) for c in (1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0))
_TINY = np.float32(1e-12)
_GOLDEN_32 = np.uint32(0x9E3779B9)
_TWO_32 = np.float32(1.0 / 4294967296.0)


@njit(cache=True, error_model="numpy", inline="always")
def exp32(x: np.float32) -> np.float32:
    """Exponential of a float32 in [-87, 0] (less counts as -87), relative error below 3e-7."""
    x = max(x, _LOWEST)
    k = np.floor(x * _LOG2E + _F05)
    f = (x - k * _LN2_HIGH) - k * _LN2_LOW
    p = _EXP[0] + f * (_EXP[1] + f * (_EXP[2] + f * (_EXP[3] + f * (_EXP[4] + f * _EXP[5]))))
    power = np.int32((np.int32(k) + np.int32(127)) << np.int32(23)).view(np.float32)
    result: np.float32 = (_F1 + f * p) * power
    return result


@njit(cache=True, error_model="numpy")
def total_of(values: Array, lanes: Array) -> float:
    """Sum of a float32 array in `LANES` lanes."""
    n = values.size
    whole = n - n % LANES
    lanes[:] = _F0
    for first in range(0, whole, LANES):
        for lane in range(LANES):
            lanes[lane] += values[first + lane]
    total = 0.0
    for lane in range(LANES):
        total += lanes[lane]
    for i in range(whole, n):
        total += values[i]
    return total


@njit(cache=True, error_model="numpy")
def _greatest(values: Array, lanes: Array) -> np.float32:
    """Greatest of a float32 array, in `LANES` lanes as well."""
    n = values.size
    lanes[:] = values[0]
    for first in range(0, n - LANES + 1, LANES):
        for lane in range(LANES):
            value = values[first + lane]
            lanes[lane] = value if value > lanes[lane] else lanes[lane]
    top: np.float32 = lanes[0]
    for lane in range(LANES):
        top = lanes[lane] if lanes[lane] > top else top
    for i in range(n - n % LANES, n):
        top = values[i] if values[i] > top else top
    return top


@njit(cache=True, error_model="numpy")
def _moments(state: Array, weights: Array, buffer: Array, lanes: Array, out: Array) -> None:
    """Weighted mean (x, y, vx, vy) and position covariance (xx, xy, yx, yy) into `out`.

    The weights sum to 1. Two passes: the covariance is taken about the mean.
    """
    n = weights.size
    for row in range(4):
        plane = state[row]
        for i in range(n):
            buffer[i] = weights[i] * plane[i]
        out[row] = total_of(buffer, lanes)
    mx, my = np.float32(out[0]), np.float32(out[1])
    x, y = state[0], state[1]
    for i in range(n):
        dx = x[i] - mx
        buffer[i] = weights[i] * dx * dx
    out[4] = total_of(buffer, lanes)
    for i in range(n):
        buffer[i] = weights[i] * (x[i] - mx) * (y[i] - my)
    out[5] = total_of(buffer, lanes)
    out[6] = out[5]
    for i in range(n):
        dy = y[i] - my
        buffer[i] = weights[i] * dy * dy
    out[7] = total_of(buffer, lanes)


@njit(cache=True, error_model="numpy")
def _move(state: Array, noise: Array, offset: np.uint32, dt: float, motion: Array) -> None:
    """Move one track's particles by `dt` under random controls; see `predict`."""
    n = state.shape[1]
    x, y, vx, vy = state[0], state[1], state[2], state[3]
    n_turn, n_speed, n_x, n_y = noise[0], noise[1], noise[2], noise[3]
    root = np.sqrt(dt)
    fastest = np.float32(motion[0])
    half_turn = np.float32(0.5 * motion[1] * root)
    kick = np.float32(motion[2] * root)
    diffusion = np.float32(motion[3] * root)
    p_turn = np.float32(1.0 - np.exp(-dt * motion[4]))
    p_restart = np.float32(1.0 - np.exp(-dt * motion[5]))
    p_any = p_turn + p_restart * (_F1 - p_turn)
    per_restart = fastest / max(p_any - p_turn, _TINY)
    half_step = np.float32(0.5 * dt)
    for i in range(n):
        # A golden-ratio sequence from a random start: uniform for one, even over all.
        u = np.float32(np.uint32(np.uint32(i) * _GOLDEN_32 + offset)) * _TWO_32
        old_vx, old_vy = vx[i], vy[i]
        speed = np.sqrt(old_vx * old_vx + old_vy * old_vy)
        walked = min(abs(speed + kick * n_speed[i]), fastest)
        restarted = (u - p_turn) * per_restart
        new = restarted if (u >= p_turn) & (u < p_any) else walked
        # Rotation by 2 atan(b/a): a small Gaussian angle, or, of two normals, a uniform one.
        fresh = u < p_any
        a = n_x[i] if fresh else _F1
        b = n_y[i] if fresh else half_turn * n_turn[i]
        scale = new / ((speed + _TINY) * (a * a + b * b + _TINY))
        c, s = (a * a - b * b) * scale, (a * b + a * b) * scale
        new_vx, new_vy = c * old_vx - s * old_vy, s * old_vx + c * old_vy
        x[i] += half_step * (old_vx + new_vx) + diffusion * n_x[i]
        y[i] += half_step * (old_vy + new_vy) + diffusion * n_y[i]
        vx[i] = new_vx
        vy[i] = new_vy


@njit(cache=True, error_model="numpy")
def predict(
    state: Array, weights: Array, keys: Array, count: int, step: int, dt: float, motion: Array
) -> Array:
    """Move all particles by one step under random controls, in place (thesis section 6.3).

    Speed does a random walk, reflected at 0 and held at its bound; course does a random walk; now
    and then a particle turns to a fresh course, or restarts with a fresh course and speed.

    Parameters
    ----------
    state : (capacity, 4, n) float32 array
        x, y [m, from the track's origin], vx, vy [m/s].
    weights : (capacity, n) float32 array
        Normalised.
    keys : (capacity,) uint64 array
        One random stream a track.
    count : int
        Only the first so many tracks are alive.
    step : int
        Number of the step: who draws and when are the counters.
    dt : float [s]
        Not negative.
    motion : (6,) float64 array
        Greatest speed [m/s], course noise [rad/√s], speed noise [m/s/√s], diffusion [m/√s], rate of
        fresh courses and of restarts [1/s].

    Returns
    -------
    (count, 8) float64 array
        Predicted mean x, y, vx, vy and position covariance xx, xy, yx, yy of each track; x and y
        from its origin.
    """
    n = state.shape[2]
    noise = np.empty((4, n), np.float32)
    lanes = np.empty(LANES, np.float32)
    moments = np.empty((count, 8), np.float64)
    for k in range(count):
        first = step * (DRAWS * n + 2)
        if dt > 0.0:
            normals(keys[k], first, noise.reshape(4 * n))
            offset = np.uint32(bits(keys[k], np.uint64(first + 2 * n)) >> np.uint64(32))
            _move(state[k], noise, offset, dt, motion)
        _moments(state[k], weights[k], noise[0], lanes, moments[k])
    return moments


@njit(cache=True, error_model="numpy")
def resample(weights: Array, start: float, ancestors: Array) -> None:
    """Systematic resampling: which particle each new one copies.

    Particle i gets ⌊N wᵢ⌋ or ⌈N wᵢ⌉ offspring, and none when its weight is zero.

    Parameters
    ----------
    weights : (n,) float32 array
        Not negative, not all zero; need not be normalised.
    start : float
        In [0, 1).
    ancestors : (n,) int32 array
        Filled, ascending.
    """
    n = weights.size
    total = 0.0
    last = 0
    for i in range(n):
        total += weights[i]
        last = i if weights[i] > _F0 else last
    spacing = total / n
    i = 0
    reached = np.float64(weights[0])
    for j in range(n):
        point = (start + j) * spacing
        # `last` bears weight: rounding at the end cannot hand offspring to an empty particle.
        while reached <= point and i < last:
            i += 1
            reached += weights[i]
        ancestors[j] = i


@njit(cache=True, error_model="numpy")
def settle(
    state: Array,
    weights: Array,
    log_weights: Array,
    origins: Array,
    keys: Array,
    count: int,
    step: int,
    threshold: float,
    roughening: float,
) -> Array:
    """Normalise the weights, estimate, and resample where few particles bear the weight.

    Weights by log-sum-exp; N_eff = 1/Σw² (thesis eq. 6.23, corrected); systematic resampling with a
    little Gaussian roughening, so that copies part.

    Parameters
    ----------
    state, weights, log_weights, origins, keys, count, step : as in `predict` and `associate`
        The first three are changed in place; both kinds of weight are normalised afterwards.
    threshold : float
        Resample below this share of effective particles.
    roughening : float
        Standard deviation of the jitter, in units of the cloud's own before it was weighed.

    Returns
    -------
    (count, 9) float64 array
        As `predict`, but with x and y on the map, and N_eff; taken before resampling.
    """
    n = state.shape[2]
    out = np.empty((count, 9), np.float64)
    buffer, lanes = np.empty(n, np.float32), np.empty(LANES, np.float32)
    noise = np.empty((2, n), np.float32)
    ancestors = np.empty(n, np.int32)
    for k in range(count):
        logs, own = log_weights[k], weights[k]
        top = _greatest(logs, lanes)
        for i in range(n):
            own[i] = exp32(logs[i] - top)
        total = total_of(own, lanes)
        scale, shift = np.float32(1.0 / total), top + np.float32(np.log(total))
        for i in range(n):
            own[i] *= scale
            logs[i] -= shift
            buffer[i] = own[i] * own[i]
        effective = 1.0 / total_of(buffer, lanes)
        _moments(state[k], own, buffer, lanes, out[k])
        out[k, 0] += origins[k, 0]
        out[k, 1] += origins[k, 1]
        out[k, 8] = effective
        if effective < threshold * n:
            first = step * (DRAWS * n + 2) + 2 * n + 1
            resample(own, uniform(keys[k], first), ancestors)
            normals(keys[k], first + 1, noise.reshape(2 * n))
            _copy(state[k], ancestors, noise, roughening, buffer)
            logs[:] = np.float32(-np.log(n))
            own[:] = np.float32(1.0 / n)
    return out


@njit(cache=True, error_model="numpy")
def _copy(state: Array, ancestors: Array, noise: Array, roughening: float, buffer: Array) -> None:
    """Replace particles by copies of their ancestors, each jittered a little.

    One normal an axis serves position and velocity: who is ahead is faster. The spread is that of
    every eighth particle, which is near enough for a jitter.
    """
    n = ancestors.size
    for row in range(4):
        plane, jitter = state[row], noise[row % 2]
        mean, square = 0.0, 0.0
        for i in range(0, n, 8):
            from_first = np.float64(plane[i] - plane[0])
            mean += from_first
            square += from_first * from_first
        share = 1.0 / ((n + 7) // 8)
        variance = max(square * share - (mean * share) ** 2, 0.0)
        size = np.float32(roughening * np.sqrt(variance))
        for i in range(n):
            buffer[i] = plane[ancestors[i]]
        for i in range(n):
            plane[i] = buffer[i] + size * jitter[i]


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
    place : (2, 5) float64 array
        Per axis position [m, from the origin], velocity [m/s], their variances and covariance
        (pp, pv, vv).
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
    state = np.zeros((1, 4, 32), np.float32)
    weights, logs = np.empty((1, 32), np.float32), np.empty((1, 32), np.float32)
    keys = np.array([1], np.uint64)
    spawn(state[0], weights[0], logs[0], keys[0], np.ones((2, 5)), 4.0)
    predict(state, weights, keys, 1, 1, 1.0, np.ones(6))
    settle(state, weights, logs, np.zeros((1, 2)), keys, 1, 1, 0.5, 0.05)
    resample(weights[0], 0.5, np.empty(32, np.int32))
