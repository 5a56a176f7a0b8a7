"""Records made by hand: whatever a test does not set is quiet, empty and still."""

import math

import numpy as np
import shapely

from staniel.city import City
from staniel.record import (
    COMMAND_DTYPE,
    DECISION_DTYPE,
    MESSAGE_DTYPE,
    SIGHTING_DTYPE,
    TRACK_DTYPE,
    Record,
)

SCENARIO = {
    "name": "by-hand",
    "seed": 7,
    "minutes": 1.0,
    "clock": {"decision_step": 1.0, "dynamics_step": 0.1},
    "camera": {"half_aperture_deg": 60.0, "range": 250.0, "target_height": 1.0},
}


def rows(dtype, entries):
    """Structured array from dicts; a float that is not given is 0, in messages NaN."""
    table = np.zeros(len(entries), dtype)
    if dtype == MESSAGE_DTYPE:
        table["winner"] = -1
        for name in ("cost", "x", "y"):
            table[name] = np.nan
    for row, entry in zip(table, entries, strict=True):
        for name, value in entry.items():
            row[name] = value
    return table


def track(time, agent, name, x, y, *, vx=0.0, vy=0.0, last_seen=0.0):
    return {
        "time": time, "agent": agent, "id": name, "x": x, "y": y, "vx": vx, "vy": vy,
        "last_seen": last_seen, "existence": 1.0, "cxx": 1.0, "cyy": 1.0,
    }  # fmt: skip


def sighting(time, origin, reporter=0):
    return {"time": time, "origin": origin, "reporter": reporter}


def decision(time, agent, target=""):
    return {"time": time, "agent": agent, "target": target, "role": "search"}


def message(time, sender, sequence, kind, *, target="", receivers=0, heard=0):
    return {
        "time": time, "sender": sender, "sequence": sequence, "kind": kind, "target": target,
        "receivers": receivers, "heard": heard,
    }  # fmt: skip


def make_record(
    *,
    seconds,
    aircraft,
    vehicles,
    city=None,
    sightings=(),
    tracks=(),
    messages=(),
    decisions=(),
    fine=0.2,
    complete=True,
    camera=None,
    receptions=None,
    condition=None,
):
    """A record from poses as functions of time.

    Parameters
    ----------
    seconds : int
        Decision instants are 0, 1, ..., seconds; fine ones every `fine` from 0.
    aircraft, vehicles : list of callables
        From the time to a row of six and of four numbers.
    camera : dict, optional
        What is other than in `SCENARIO`.
    receptions : list of (int, int), optional
        Number of the message, aircraft that heard it.
    condition : callable, optional
        From the time to a row of eight numbers for each aircraft.
    """
    scenario = {**SCENARIO, "camera": {**SCENARIO["camera"], **(camera or {})}}
    times = np.arange(seconds + 1, dtype=float)
    fine_times = fine * np.arange(round(seconds / fine) + 1)

    def sample(movers, instants, columns):
        table = [[mover(t) for mover in movers] for t in instants.tolist()]
        return np.array(table, dtype=float).reshape(len(instants), len(movers), columns)

    return Record(
        scenario=scenario,
        version="0.0.0",
        city=city or City.open((1000.0, 1000.0)),
        times=times,
        aircraft=sample(aircraft, times, 6),
        vehicles=sample(vehicles, times, 4),
        fine_times=fine_times,
        fine_aircraft=sample(aircraft, fine_times, 6),
        fine_vehicles=sample(vehicles, fine_times, 4),
        sightings=rows(SIGHTING_DTYPE, sightings),
        tracks=rows(TRACK_DTYPE, tracks),
        messages=rows(MESSAGE_DTYPE, messages),
        commands=rows(COMMAND_DTYPE, ()),
        decisions=rows(DECISION_DTYPE, decisions),
        complete=complete,
        receptions=None if receptions is None else np.reshape(receptions, (-1, 2)).astype(np.int32),
        **({} if condition is None else {"condition": np.array([condition(t) for t in times])}),
    )


def hover(x, y, z=80.0):
    """An aircraft that stays where it is, level: it sees the disc of radius (z - 1) tan 60°."""
    return lambda t: (x, y, z, 0.0, 0.0, 15.0)


def fly_east(x, y, z=80.0, speed=15.0):
    return lambda t: (x + speed * t, y, z, 0.0, 0.0, speed)


def parked(x, y):
    return lambda t: (x, y, 0.0, 0.0)


def drive(x, y, heading=0.0, speed=2.0):
    return lambda t: (
        x + speed * t * math.cos(heading),
        y + speed * t * math.sin(heading),
        heading,
        speed,
    )


def block_city():
    """A city with one house, 40 m high, over x 480 to 520 and y 480 to 520."""
    return City.from_outlines([shapely.box(480, 480, 520, 520)], [40.0], (1000.0, 1000.0))
