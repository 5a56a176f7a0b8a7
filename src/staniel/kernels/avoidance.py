"""Which command to fly so that the next one can be safe, too.

A command is *verified* if the aircraft can fly it for one decision step and then turn onto a small
circle and stay there, clear of everything all the way. Whoever flies only verified commands always
has such a circle left to fall back on. Of these the best is the one whose way over the next seconds
leads nearest to the goal without meeting what is known (thesis alg. 4.3: a feasible waypoint, close
to the target and clear). Ways are flown out with the autopilot's own dynamics.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from staniel.kernels.flight import COMMAND_WIDTH, ORBIT, fly_step
from staniel.kernels.occupancy import Tops
from staniel.kernels.risk import Regions
from staniel.kernels.threats import is_near

__all__ = ["Bans", "Choice", "Others", "Rules", "badness", "choose", "warm", "ways"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

_G = 9.80665
_WALL, _NEAR, _BAN = 0, 1, 2
"""What can be wrong with a way: seconds in closed air, how near others come, seconds banned."""


_MARGINAL = 0.2
"""What a second in the margin of a ban counts, of one in the ban."""


class Others(NamedTuple):
    """Where other aircraft are expected, at multiples of `step` from now."""

    places: Floats
    """(k, t, 3) east, north, height [m]."""
    apart: Floats
    """(k, t, 2) distance to keep, level and in height [m]."""
    step: float
    """Between two times [s]."""


class Bans(NamedTuple):
    """No-fly regions and the fence."""

    regions: Regions
    outside: Bools
    """Of which it is forbidden to be outside: the fence."""
    margin: float
    """Kept from them [m]."""


class Rules(NamedTuple):
    """How far ahead to look, and what is better than what."""

    dt: float
    """Of the dynamics [s]."""
    substeps: int
    """Of a decision step; after each of the first one's is looked at where the way leads."""
    stride: int
    """After that it is looked at only so often: after this many substeps."""
    foresight: float
    """How far a command is flown out over what is known [s]."""
    apart_for: float
    """How far ahead an escape keeps away from where others are expected [s]."""


class Choice(NamedTuple):
    """What to fly."""

    row: int
    """Row of the command."""
    escape: Floats
    """(COMMAND_WIDTH,) what to fly afterwards, if nothing better is found."""
    harm: Floats
    """(3,) seconds in closed air, how near others come, seconds banned; zeros: verified."""
    there: Floats
    """(6,) state after the decision step."""
    climb: float
    """Rate then [m/s]."""


@njit(cache=True, error_model="numpy")
def _blocked(tops: Tops, closed: bool, x: float, y: float, z: float) -> bool:
    """Whether a place cannot be entered; beyond the window nothing is known."""
    i, j = int((x - tops.west) // tops.cell), int((y - tops.south) // tops.cell)
    n = tops.closed.shape[0]
    if not (0 <= i < n and 0 <= j < n):
        return closed
    top = tops.closed[i, j] if closed else tops.solid[i, j]
    blocked: bool = z < top
    return blocked


@njit(cache=True, error_model="numpy")
def _too_near(others: Others, x: float, y: float, z: float, time: float) -> float:
    """Share of the distance to keep that is missing from the worst of the others; 0: none."""
    worst = 0.0
    t = min(int(time / others.step + 0.5), others.places.shape[1] - 1)
    for k in range(others.places.shape[0]):
        high = 1.0 - abs(z - others.places[k, t, 2]) / others.apart[k, t, 1]
        if high <= worst:
            continue
        dx, dy = x - others.places[k, t, 0], y - others.places[k, t, 1]
        level = 1.0 - math.sqrt(dx * dx + dy * dy) / others.apart[k, t, 0]
        worst = max(worst, min(high, level))
    return worst


@njit(cache=True, error_model="numpy")
def _banned(bans: Bans, x: float, y: float, z: float) -> int:
    """2 in a no-fly region or beyond the fence, 1 within the margin of one, else 0."""
    worst = 0
    for k in range(bans.outside.shape[0]):
        if is_near(bans.regions, k, x, y, z, bans.margin, bans.outside[k]):
            worst = max(worst, 1)
            if is_near(bans.regions, k, x, y, z, 0.0, bans.outside[k]):
                return 2
    return worst


@njit(cache=True, error_model="numpy")
def badness(harm: Floats) -> float:
    """One number for what is wrong: walls and real nearness of others first, then bans.

    A fraction of a second in closed air is a matter of its cells and of the clearance, not of a
    wall; and of the distance to keep from others half is for what nobody expects of them.

    Parameters
    ----------
    harm : (3,) float array
        As in `Choice`.

    Returns
    -------
    float
    """
    wall, near = harm[_WALL], harm[_NEAR]
    total: float = 1e4 * max(wall - 0.3, 0.0) + 30.0 * wall
    total += 1e4 * max(near - 0.5, 0.0) + 5.0 * near + 10.0 * harm[_BAN]
    return total


@njit(cache=True, error_model="numpy")
def _fly_out(
    state: Floats,
    climb: float,
    command: Floats,
    limits: Floats,
    wind: Floats,
    start: float,
    dt: float,
    stride: int,
    looks: int,
    tops: Tops,
    closed: bool,
    others: Others,
    apart_until: float,
    bans: Bans,
    tolerated: int,
    harm: Floats,
    enough: float,
) -> tuple[float, float]:
    """Fly a command, `state` in place, and add to `harm` what is wrong on the way.

    It is looked at `looks` times, after every `stride` substeps of `dt`.

    Bans of a `tolerated` level do not count. It stops where that is as bad as `enough`.

    Returns the climb rate and when the way first meets something, infinite where it does not. What
    comes early weighs more: there is less time to think again.
    """
    first, time, seen = np.inf, start, dt * stride
    for look in range(looks):
        if first < np.inf and badness(harm) >= enough:
            break
        for k in range(stride):
            climb = fly_step(state, climb, command, limits, wind[0], wind[1], time + k * dt, dt)
        time = start + (look + 1) * seen
        x, y, z = state[0], state[1], state[2]
        wrong = False
        if _blocked(tops, closed, x, y, z):
            harm[_WALL] += seen * math.exp(-0.2 * time)
            wrong = True
        if time <= apart_until:
            near = _too_near(others, x, y, z, time) * math.exp(-0.1 * time)
            harm[_NEAR] = max(harm[_NEAR], near)
            wrong = wrong or near > 0.0
        level = _banned(bans, x, y, z)
        if level > tolerated:
            harm[_BAN] += seen if level > 1 else _MARGINAL * seen
            wrong = True
        if wrong and first == np.inf:
            first = time
    return climb, first


@njit(cache=True, error_model="numpy")
def _escapes(
    state: Floats, command: Floats, limits: Floats, wind: Floats, speed: float
) -> tuple[Floats, Floats]:
    """Circles to turn onto from a state, and how long it takes to know that they are clear.

    The command's own circle where it is one; then to the right and to the left, slow and tight, at
    `speed`, and slow on the wide one.
    """
    circles = np.zeros((7, COMMAND_WIDTH))
    seconds = np.zeros(7)
    east, north = wind[0], wind[1]
    x = state[5] * math.cos(state[3]) + east
    y = state[5] * math.sin(state[3]) + north
    course, blows = math.atan2(y, x), math.hypot(east, north)
    tan = math.tan(limits[4])
    tight = 1.15 * (limits[0] + blows) ** 2 / (_G * tan)
    wide = 1.1 * (speed + blows) ** 2 / (_G * tan)
    for e in range(7):
        if e == 0:
            circles[e] = command
            continue
        turn = -1.0 if e % 2 == 1 else 1.0
        radius = tight if e < 3 else wide
        circles[e, 0] = ORBIT
        circles[e, 1] = speed if 3 <= e < 5 else limits[0]
        circles[e, 2] = command[2]
        circles[e, 3] = state[0] - turn * radius * math.sin(course)
        circles[e, 4] = state[1] + turn * radius * math.cos(course)
        circles[e, 5], circles[e, 6] = radius, turn
    for e in range(7):
        if circles[e, 0] == ORBIT:
            slowest = max(min(circles[e, 1], state[5]) - blows, 0.3 * limits[0])
            seconds[e] = min(2.0 * math.pi * circles[e, 5] / slowest + 3.0, 40.0)
    return circles, seconds


@njit(cache=True, error_model="numpy")
def ways(
    state: Floats,
    climb: float,
    commands: Floats,
    limits: Floats,
    wind: Floats,
    tops: Tops,
    others: Others,
    bans: Bans,
    rules: Rules,
) -> tuple[Floats, Floats, Floats]:
    """Fly commands out over what is known.

    Parameters
    ----------
    state : (6,) float array
    climb : float [m/s]
    commands : (m, COMMAND_WIDTH) float array
    limits : (11,) float array
        State, commands and limits as in `staniel.kernels.flight`.
    wind : (2,) float array [m/s]
    tops : Tops
    others : Others
    bans : Bans
    rules : Rules

    Returns
    -------
    ends : (m, 2) float array [m]
        Where each way ends: at its first trouble, or after `Rules.foresight`.
    clear : (m,) float array [s]
        How long it is clear.
    banned : (m,) float array [s]
        How long it is banned.
    """
    m = commands.shape[0]
    ends, clear, banned_for = np.empty((m, 2)), np.empty(m), np.zeros(m)
    seen = rules.dt * rules.stride
    looks = int((rules.foresight - rules.dt * rules.substeps) / seen + 0.5)
    for c in range(m):
        own, harm = state.copy(), np.zeros(3)
        rate, time = climb, 0.0
        clear[c] = rules.foresight
        for k in range(1 + looks):
            stride, count = (1, rules.substeps) if k == 0 else (rules.stride, 1)
            rate, first = _fly_out(
                own, rate, commands[c], limits, wind, time, rules.dt, stride, count, tops, False,
                others, np.inf, bans, 0, harm, np.inf,
            )  # fmt: skip
            time += rules.dt * stride * count
            if first < np.inf and clear[c] >= rules.foresight:
                clear[c] = first
                ends[c, 0], ends[c, 1] = own[0], own[1]
        if clear[c] >= rules.foresight:
            ends[c, 0], ends[c, 1] = own[0], own[1]
        banned_for[c] = harm[_BAN]
    return ends, clear, banned_for


@njit(cache=True, error_model="numpy")
def choose(
    state: Floats,
    climb: float,
    commands: Floats,
    order: Ints,
    speed: float,
    limits: Floats,
    wind: Floats,
    tops: Tops,
    others: Others,
    bans: Bans,
    rules: Rules,
) -> Choice:
    """The first command, in a given order, that is verified; else the one that does least harm.

    Parameters
    ----------
    state, climb, commands, limits, wind, tops, others, bans, rules
        As in `ways`.
    order : (m,) int array
        Of the commands, the best first.
    speed : float [m/s]
        Cruise.

    Returns
    -------
    Choice
        Walls and other aircraft come first, bans after them. Who is inside a ban already, or in its
        margin, is not asked that the escape be outside of it.
    """
    within = _banned(bans, state[0], state[1], state[2])
    best, least, least_harm = order[0], np.inf, np.zeros(3)
    best_escape, best_there, best_climb = np.zeros(COMMAND_WIDTH), state, climb
    for place in range(order.shape[0]):
        c = order[place]
        there, first_harm = state.copy(), np.zeros(3)
        rate, _ = _fly_out(
            there, climb, commands[c], limits, wind, 0.0, rules.dt, 1, rules.substeps,
            tops, True, others, rules.apart_for, bans, within, first_harm, least,
        )  # fmt: skip
        if badness(first_harm) >= least:
            continue
        circles, seconds = _escapes(there, commands[c], limits, wind, speed)
        for e in range(circles.shape[0]):
            if seconds[e] == 0.0:
                continue
            own, harm = there.copy(), first_harm.copy()
            _fly_out(
                own, rate, circles[e], limits, wind, rules.dt * rules.substeps, rules.dt,
                rules.stride, int(seconds[e] / (rules.dt * rules.stride)), tops, True, others,
                rules.apart_for, bans, within, harm, least,
            )  # fmt: skip
            total = badness(harm)
            if total < least:
                best, least, least_harm = c, total, harm
                best_escape, best_there, best_climb = circles[e].copy(), there, rate
            if least == 0.0:
                return Choice(best, best_escape, least_harm, best_there, best_climb)
    return Choice(best, best_escape, least_harm, best_there, best_climb)


def warm() -> None:
    """Compile, or load from the disk cache, what this module is called with."""
    limits = np.array([11.0, 20.0, 1.5, 3.0, 0.6, 1.0, 3.0, 1.2, 1.0, 1.0, 0.25])
    commands, state = np.zeros((1, COMMAND_WIDTH)), np.array([2.0, 2.0, 80.0, 0.0, 0.0, 15.0])
    commands[0, 1] = 15.0
    cells = np.zeros((4, 4), dtype=np.float32)
    none = Regions(
        np.zeros((0, 6)), np.zeros((0, 3)), np.zeros(1, dtype=np.int64), np.zeros((0, 2))
    )
    common = (
        limits,
        np.zeros(2),
        Tops(cells, cells, 0.0, 0.0, 3.0),
        Others(np.zeros((0, 1, 3)), np.zeros((0, 1, 2)), 1.0),
        Bans(none, np.zeros(0, dtype=np.bool_), 1.0),
        Rules(0.1, 1, 2, 1.0, 1.0),
    )
    ways(state, 0.0, commands, *common)
    choose(state, 0.0, commands, np.zeros(1, dtype=np.int64), 15.0, *common)
