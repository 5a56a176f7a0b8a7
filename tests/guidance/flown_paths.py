"""Fly paths with the path manager and the real flight kernel, many aircraft at once."""

import math

import numpy as np

from staniel.datatypes.autopilot import encode, limits
from staniel.datatypes.belief import Pose
from staniel.datatypes.equipment import Airframe
from staniel.guidance import PathState, follow
from staniel.kernels.flight import fly

AIRFRAME = Airframe()


def random_routes(seed, count, *, corners=5, legs=(300.0, 500.0), sharpest=2.0):
    """(count, corners + 2, 2) waypoints: legs and turns drawn uniformly."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-sharpest, sharpest, (count, corners))
    course = np.cumsum(np.column_stack([rng.uniform(-math.pi, math.pi, count), turns]), axis=1)
    lengths = rng.uniform(*legs, course.shape)
    steps = lengths[:, :, None] * np.stack([np.cos(course), np.sin(course)], axis=2)
    return np.concatenate([np.zeros((count, 1, 2)), np.cumsum(steps, axis=1)], axis=1)


def winds_from_all_sides(count, speed):
    """(count, 2) winds of one speed."""
    angle = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    return speed * np.column_stack([np.cos(angle), np.sin(angle)])


def fly_paths(paths, winds, *, following="carrot", seconds=900, **how):
    """Fly each path from its beginning, along it, until its end.

    Returns a list of (n, 6) states every 0.1 s, each until its path was done, and the states of the
    path manager every second.
    """
    count = len(paths)
    begin = np.array([path.places(1.0)[:2] for path in paths])
    course = np.arctan2(*(begin[:, 1] - begin[:, 0])[:, 1::-1].T)
    aircraft = np.column_stack(
        [begin[:, 0], course, np.zeros(count), np.full(count, AIRFRAME.speed)]
    )
    climbs, states = np.zeros(count), [PathState()] * count
    rows, air = limits([AIRFRAME] * count, following), np.empty((10, count, 2))
    air[:] = winds
    flown, log = [aircraft[None]], []
    done = np.full(count, -1)
    for second in range(seconds):
        commands = []
        for i, path in enumerate(paths):
            command, states[i] = follow(path, Pose(*aircraft[i].tolist()), states[i], **how)
            commands.append(command)
            if done[i] < 0 and states[i].leg == len(path.legs):
                done[i] = 10 * second
        log.append(list(states))
        if (done >= 0).all():
            break
        steps, climbs = fly(aircraft, climbs, encode(commands), rows, air, 0.1, 10)
        aircraft = steps[-1].copy()
        flown.append(steps)
    assert (done >= 0).all()
    way = np.concatenate(flown)
    return [way[: end + 1, i] for i, end in enumerate(done)], log
