"""How particles move by a step: random or learned controls, or nearly straight on; in the streets.

A track's particles are stored plane by plane, ``state[track] = (x, y, vx, vy)`` with one row of
`n` float32 each, so that every hot loop runs over contiguous memory; positions are relative to the
track's own origin, which keeps float32 exact to millimetres anywhere on the map.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.lineage import SLOTS, advance
from staniel.kernels.random import bits, normals

__all__ = ["CONTROLS", "STRAIGHT", "learn", "predict", "spread", "warm"]

Array = NDArray[Any]

CONTROLS, STRAIGHT = range(2)
"""Kinds of motion: controls drawn per particle; straight on, the noise left to the update."""

STRIDE, SAMPLE = 8, 125
"""Moments that only gate and smooth are taken over every eighth particle, or so many at least."""

_F1 = np.float32(1.0)
_TINY = np.float32(1e-12)
_GOLDEN_32 = np.uint32(0x9E3779B9)
_TWO_32 = np.float32(1.0 / 4294967296.0)
_AWAY = tuple(
    (np.float32(math.cos(math.radians(a))), np.float32(math.sin(math.radians(a))))
    for a in (30.0, 60.0, 90.0, 120.0)
)
_BURIED = np.float32(math.log(0.3))  # weight left to a particle that stays inside a building
_HASTE = 1.5  # no particle is faster than so many times the fastest that its track was, and
_START = 8.0  # and anybody may drive off at this [m/s]
_PATIENCE = 60.0  # in which a track's fastest is forgotten [s]
_ONWARD = np.float32(1.0)  # a faster one that changes its speed keeps its course [m/s]
_CRAWL = 0.5  # a slower one has no course to speak of [m/s]


@njit(cache=True, error_model="numpy")
def _steer(
    state: Array, first: int, last: int, noise: Array, sign: np.float32, offset: np.uint32,
    dt: float, motion: Array, habits: Array,
) -> None:  # fmt: skip
    """Move the particles from `first` to `last` by `dt` under controls; see `predict`."""
    x, y = state[0, first:last], state[1, first:last]
    vx, vy = state[2, first:last], state[3, first:last]
    n_turn, n_speed, n_x, n_y = noise[0], noise[1], noise[2], noise[3]
    root = np.sqrt(dt)
    fastest = np.float32(min(motion[0], max(_HASTE * habits[0] + 2.0, _START)))
    half_turn = np.float32(0.5 * habits[2] * root) * sign
    half_bend = np.float32(0.5 * habits[1] * dt)
    kick = np.float32(habits[3] * root) * sign
    diffusion = np.float32(motion[1] * root) * sign
    p_turn = np.float32(1.0 - np.exp(-dt * motion[2]))
    p_restart = np.float32(1.0 - np.exp(-dt * motion[3]))
    p_any = p_turn + p_restart * (_F1 - p_turn)
    per_restart = fastest / max(p_any - p_turn, _TINY)
    half_step = np.float32(0.5 * dt)
    for i in range(last - first):
        # A golden-ratio sequence from a random start: uniform for one, even over all.
        u = np.float32(np.uint32(np.uint32(first + i) * _GOLDEN_32 + offset)) * _TWO_32
        old_vx, old_vy = vx[i], vy[i]
        speed = np.sqrt(old_vx * old_vx + old_vy * old_vy)
        walked = min(abs(speed + kick * n_speed[i]), fastest)
        restarted = (u - p_turn) * per_restart
        new = restarted if (u >= p_turn) & (u < p_any) else walked
        # Rotation by 2 atan(b/a): a small Gaussian angle, or, of two normals, a uniform one.
        fresh = (u < p_turn) | ((u < p_any) & (speed < _ONWARD))
        a = n_x[i] if fresh else _F1
        b = n_y[i] if fresh else half_bend + half_turn * n_turn[i]
        scale = new / ((speed + _TINY) * (a * a + b * b + _TINY))
        c, s = (a * a - b * b) * scale, (a * b + a * b) * scale
        new_vx, new_vy = c * old_vx - s * old_vy, s * old_vx + c * old_vy
        x[i] += half_step * (old_vx + new_vx) + diffusion * n_x[i]
        y[i] += half_step * (old_vy + new_vy) + diffusion * n_y[i]
        vx[i] = new_vx
        vy[i] = new_vy


@njit(cache=True, error_model="numpy", inline="always")
def _built(blocked: Array, frame: Array, x: float, y: float) -> bool:
    """Whether the cell of the chart's raster at (x, y) [m] is built over; nothing is outside it."""
    column = math.floor((x - frame[0]) * frame[2])
    row = math.floor((y - frame[1]) * frame[2])
    inside = (row >= 0) & (row < blocked.shape[0]) & (column >= 0) & (column < blocked.shape[1])
    return bool(inside and blocked[row, column] != 0)


@njit(cache=True, error_model="numpy")
def _keep_to_streets(
    state: Array, logs: Array, origin: Array, before: Array, blocked: Array, frame: Array, dt: float
) -> None:
    """Particles that drove into a building turn away from it; one that stays inside loses weight.

    The least turn that is free is taken, in steps of 30 degrees: who grazes a wall goes on along
    it. Odd particles look to the left and even ones to the right first; where nothing is free up
    to 120 degrees, the particle turns round.
    """
    x, y, vx, vy = state[0], state[1], state[2], state[3]
    step = np.float32(dt)
    for i in range(x.size):
        if not _built(blocked, frame, origin[0] + x[i], origin[1] + y[i]):
            continue
        old_x, old_y = before[0, i], before[1, i]
        if _built(blocked, frame, origin[0] + old_x, origin[1] + old_y):
            logs[i] += _BURIED
            continue
        side = _F1 if i % 2 == 1 else -_F1
        found = False
        for c, sine in _AWAY:
            for _ in range(2):
                s = side * sine
                new_vx, new_vy = c * vx[i] - s * vy[i], s * vx[i] + c * vy[i]
                new_x, new_y = old_x + step * new_vx, old_y + step * new_vy
                if not _built(blocked, frame, origin[0] + new_x, origin[1] + new_y):
                    found = True
                    break
                side = -side
            if found:
                break
        if found:
            x[i], y[i], vx[i], vy[i] = new_x, new_y, new_vx, new_vy
        else:
            x[i], y[i] = old_x, old_y
            vx[i], vy[i] = -vx[i], -vy[i]


@njit(cache=True, error_model="numpy")
def spread(state: Array, weights: Array, mean: Array, cov: Array) -> None:
    """Weighted mean and covariance of evenly spaced particles, into `mean` and `cov`.

    Zero where none of these bears weight.

    Parameters
    ----------
    state : (4, n) float32 array
    weights : (n,) float32 array
    mean : (4,) float64 array
    cov : (4, 4) float64 array
    """
    n = weights.size
    stride = max(min(n // SAMPLE, STRIDE), 1)
    total, mx, my, mu, mv = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(0, n, stride):
        w = np.float64(weights[i])
        total += w
        mx += w * state[0, i]
        my += w * state[1, i]
        mu += w * state[2, i]
        mv += w * state[3, i]
    share = 1.0 / total if total > 0.0 else 0.0
    mx, my, mu, mv = mx * share, my * share, mu * share, mv * share
    xx, xy, xu, xv, yy, yu, yv, uu, uv, vv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(0, n, stride):
        w = weights[i] * share
        x, y, u, v = state[0, i] - mx, state[1, i] - my, state[2, i] - mu, state[3, i] - mv
        wx, wy, wu = w * x, w * y, w * u
        xx += wx * x
        xy += wx * y
        xu += wx * u
        xv += wx * v
        yy += wy * y
        yu += wy * u
        yv += wy * v
        uu += wu * u
        uv += wu * v
        vv += w * v * v
    mean[0], mean[1], mean[2], mean[3] = mx, my, mu, mv
    cov[0, 0], cov[1, 1], cov[2, 2], cov[3, 3] = xx, yy, uu, vv
    cov[0, 1] = cov[1, 0] = xy
    cov[0, 2] = cov[2, 0] = xu
    cov[0, 3] = cov[3, 0] = xv
    cov[1, 2] = cov[2, 1] = yu
    cov[1, 3] = cov[3, 1] = yv
    cov[2, 3] = cov[3, 2] = uv


@njit(cache=True, error_model="numpy")
def predict(
    state: Array,
    weights: Array,
    log_weights: Array,
    origins: Array,
    keys: Array,
    habits: Array,
    past: Array,
    copied: Array,
    depth: Array,
    head: int,
    count: int,
    step: int,
    draws: int,
    dt: float,
    kind: int,
    motion: Array,
    rests: Array,
    acceleration: float,
    blocked: Array,
    frame: Array,
) -> tuple[Array, Array]:
    """Move all particles by one step, in place (thesis section 6.3).

    Under controls, speed does a random walk, reflected at 0 and held at its bound; course does a
    random walk; now and then a particle turns to a fresh course, or changes to any speed, and from
    a stand to any course too. The second half of the particles draws the opposite of the first.

    Parameters
    ----------
    state : (capacity, 4, n) float32 array
        x, y [m, from the track's origin], vx, vy [m/s].
    weights, log_weights : (capacity, n) float32 arrays
        Normalised.
    origins : (capacity, 2) float64 array [m]
    keys : (capacity,) uint64 array
        One random stream a track.
    habits : (capacity, 4) float64 array
        Of each track: fastest so far [m/s], mean turn rate [rad/s], noises of course [rad/√s] and
        speed [m/s/√s].
    past, copied, depth, head : as in `staniel.kernels.lineage.advance`
    count : int
        Only the first so many tracks are alive.
    step, draws : int
        Number of the step, and counters that a step may use: who draws and when are the counters.
    dt : float [s]
        Not negative; at 0 nothing moves.
    kind : int
        `CONTROLS` or `STRAIGHT`.
    motion : (4,) float64 array
        Greatest speed [m/s], diffusion [m/√s], rates of fresh courses and of restarts [1/s].
    rests : (capacity, 4, 4) float64 array
        Of `STRAIGHT`: covariance that all particles of a track have in common, of the velocity
        before and, changed in place, of the whole state after the step.
    acceleration : float [m/s/√s]
        Of `STRAIGHT`: noise of a white acceleration on each axis.
    blocked : (rows, columns) uint8 array
        The chart's buildings as a raster; empty: none.
    frame : (3,) float64 array
        Its west and south edge [m], cells per metre.

    Returns
    -------
    means : (count, 4) float64 array
        Of x, y [m, from the origin], vx, vy, over evenly spaced particles.
    covariances : (count, 4, 4) float64 array
    """
    n = state.shape[2]
    half = (n + 1) // 2
    noise = np.empty((4, half), np.float32)
    means, covariances = np.empty((count, 4)), np.empty((count, 4, 4))
    for k in range(count):
        if dt > 0.0:
            advance(past, copied, depth, state, k, head)
            first = step * draws
            if kind == CONTROLS:
                normals(keys[k], first, noise.reshape(4 * half))
                offset = np.uint32(bits(keys[k], np.uint64(first + 2 * half)) >> np.uint64(32))
                _steer(state[k], 0, half, noise, _F1, offset, dt, motion, habits[k])
                _steer(state[k], half, n, noise, -_F1, offset, dt, motion, habits[k])
            else:
                ahead = np.float32(dt)
                for row in range(2):
                    for i in range(n):
                        state[k, row, i] += ahead * state[k, 2 + row, i]
                _coast(rests[k], dt, acceleration)
            if blocked.size:
                _keep_to_streets(
                    state[k], log_weights[k], origins[k], past[k, head % SLOTS], blocked, frame, dt
                )
        spread(state[k], weights[k], means[k], covariances[k])
    return means, covariances


@njit(cache=True, error_model="numpy")
def _coast(rest: Array, dt: float, noise: float) -> None:
    """Take a common covariance of the velocity on by `dt` of white acceleration, in place."""
    q = noise * noise
    for a in range(2):
        for b in range(2):
            vv = rest[2 + a, 2 + b]
            rest[a, b] = dt * dt * vv
            rest[a, 2 + b] = rest[2 + b, a] = dt * vv
        rest[a, a] += q * dt**3 / 3.0
        rest[a, 2 + a] += 0.5 * q * dt * dt
        rest[2 + a, a] += 0.5 * q * dt * dt
        rest[2 + a, 2 + a] += q * dt


@njit(cache=True, error_model="numpy")
def learn(
    habits: Array,
    spans: Array,
    velocities: Array,
    covariances: Array,
    seen: Array,
    count: int,
    dt: float,
    least: Array,
    memory: float,
) -> None:
    """How each track moves, from how its mean velocity changed while it was seen; in place.

    Means with exponential forgetting. An unseen track's turn is forgotten: nobody circles for ever.

    Parameters
    ----------
    habits : (capacity, 4) float64 array
        As in `predict`.
    spans : (capacity, 6) float64 array
        What is remembered: time learnt [s], last vx, vy [m/s], means of the turn rate, of its
        square and of the acceleration's square.
    velocities : (count, 2) float64 array [m/s]
        Means after the update.
    covariances : (count, 4, 4) float64 array
        Before it: what the velocity's own uncertainty adds to its changes is no motion.
    seen : (count,) bool array
        Whether there was a sighting in this step.
    dt : float [s]
        Greater than 0.
    least : (2,) float64 array
        Noises of course [rad/√s] and speed [m/s/√s] that are always kept.
    memory : float [s]
        Time constant; 0 learns nothing but how fast a track was.
    """
    for k in range(count):
        vx, vy = velocities[k, 0], velocities[k, 1]
        speed = math.hypot(vx, vy)
        known, own = spans[k], habits[k]
        old = math.hypot(known[1], known[2])
        # A track's fastest is forgotten slowly: what has driven fast may do so again.
        own[0] = max(speed, own[0] - (own[0] - speed) * min(dt / _PATIENCE, 1.0))
        if memory > 0.0 and known[0] > 0.0:
            keep = math.exp(-dt / memory)
            if seen[k]:
                turn = 0.0
                if min(old, speed) > _CRAWL:
                    cross, dot = known[1] * vy - known[2] * vx, known[1] * vx + known[2] * vy
                    turn = math.atan2(cross, dot) / dt
                known[3] = keep * known[3] + (1.0 - keep) * turn
                known[4] = keep * known[4] + (1.0 - keep) * turn * turn
                faster = (speed - old) / dt
                known[5] = keep * known[5] + (1.0 - keep) * faster * faster
            else:
                known[3] *= keep
            sure = 1.0 - math.exp(-known[0] / memory)
            # Trusted as far as the turns of late agree.
            own[1] = sure * known[3] * min(known[3] * known[3] / (known[4] + 1e-12), 1.0)
            doubt = 0.5 * (covariances[k, 2, 2] + covariances[k, 3, 3]) / (dt * dt)
            turning = known[4] - doubt / max(speed * speed, _CRAWL * _CRAWL)
            own[2] = max(least[0], math.sqrt(max(turning, 0.0) * dt))
            own[3] = max(least[1], math.sqrt(max(known[5] - doubt, 0.0) * dt))
        known[0] += dt
        known[1], known[2] = vx, vy


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    state = np.zeros((1, 4, 32), np.float32)
    weights, logs = np.full((1, 32), 1.0 / 32.0, np.float32), np.zeros((1, 32), np.float32)
    habits, origins, keys = np.ones((1, 4)), np.zeros((1, 2)), np.array([1], np.uint64)
    past, copied = np.zeros((1, SLOTS, 2, 32), np.float32), np.zeros((1, SLOTS), np.bool_)
    blocked, frame = np.zeros((1, 1), np.uint8), np.array([0.0, 0.0, 1.0])
    means, _ = predict(
        state, weights, logs, origins, keys, habits, past, copied, np.zeros(1, np.int64), 0, 1, 1,
        200, 1.0, CONTROLS, np.ones(4), np.zeros((1, 4, 4)), 1.0, blocked, frame,
    )  # fmt: skip
    square = np.zeros((1, 4, 4))
    learn(
        habits, np.ones((1, 6)), means[:, 2:].copy(), square, np.ones(1, np.bool_), 1, 1.0,
        np.ones(2), 10.0,
    )  # fmt: skip
