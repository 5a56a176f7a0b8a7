"""Why each second was unwatched, slowly: the definitions of docs/metrics.md in plain Python."""

import math

import numpy as np
import shapely

from staniel.datatypes.equipment import Camera

ORDER = (
    "watched", "aircraft_lost", "nobody_assigned", "out_of_range", "outside_footprint",
    "building", "missed_detection", "message_lost", "track_lost",
)  # fmt: skip


def causes(record):
    """Names of the causes, a list for each decision instant but the first."""
    camera = Camera(**record.scenario["camera"])
    holders, tracked = _believed(record)
    houses = shapely.STRtree(record.city.outlines)
    table, orphans = [], set()
    for t, time in enumerate(record.times.tolist()):
        fit = [row[1] > 0 and row[3] > 0 for row in record.condition[t].tolist()]
        row = []
        for vehicle, place in enumerate(record.vehicles[t].tolist()):
            looks = {
                a: _look(camera, houses, record.city, pose, place)
                for a, pose in enumerate(record.aircraft[t].tolist())
            }
            now = holders[t][vehicle]
            responsible = now or (holders[t - 1][vehicle] if t else [])
            if responsible:
                orphans.discard(vehicle)
                if not any(fit[a] for a in responsible):
                    orphans.add(vehicle)
            seen = any(
                looks[a] == "seen" and record.condition[t, a, 1] > 0 for a in range(len(fit))
            )
            if seen and vehicle in tracked[t]:
                row.append("watched")
            elif vehicle in orphans:
                row.append("aircraft_lost")
            elif not now:
                row.append("nobody_assigned")
            elif not seen:
                row.append(max((looks[a] for a in now if fit[a]), key=ORDER.index))
            else:
                row.append(_unheard(record, camera, time, vehicle, now))
        table.append(row)
    return table[1:]


def _believed(record):
    """For each instant: the aircraft assigned to each vehicle, and the vehicles tracked."""
    own, team = {}, {}
    holders, tracked = [], []
    for t, time in enumerate(record.times.tolist()):
        places = record.vehicles[t, :, :2].tolist()
        near, told = set(), {}
        for row in record.tracks[np.isclose(record.tracks["time"], time)]:
            distances = [math.dist(place, (row["x"], row["y"])) for place in places]
            reached = [v for v, distance in enumerate(distances) if distance <= 10.0]
            near.update(reached)
            agent, name = int(row["agent"]), str(row["id"])
            if reached and own.get((agent, name)) not in reached:
                own[agent, name] = min(reached, key=distances.__getitem__)
            if reached:
                told.setdefault(name, {})[agent] = own[agent, name]
        team.update({name: by_agent[min(by_agent)] for name, by_agent in told.items()})
        held = [[] for _ in places]
        for row in record.decisions[np.isclose(record.decisions["time"], time)]:
            agent, name = int(row["agent"]), str(row["target"])
            vehicle = own.get((agent, name), team.get(name))
            if vehicle is not None:
                held[vehicle].append(agent)
        holders.append(held)
        tracked.append(near)
    return holders, tracked


def _look(camera, houses, city, pose, place):
    """What a camera in the belly, or held level, lacks to see the vehicle, or "seen"."""
    x, y, z, heading, bank, _ = pose
    bank = 0.0 if camera.mount == "nadir" else bank
    turn = np.array([[math.cos(heading), -math.sin(heading), 0.0],
                     [math.sin(heading), math.cos(heading), 0.0],
                     [0.0, 0.0, 1.0]])  # fmt: skip
    roll = np.array([[1.0, 0.0, 0.0],
                     [0.0, math.cos(bank), math.sin(bank)],
                     [0.0, -math.sin(bank), math.cos(bank)]])  # fmt: skip
    ray = np.array([place[0] - x, place[1] - y, camera.target_height - z])
    slant = float(np.linalg.norm(ray))
    if slant > camera.range:
        return "out_of_range"
    angle = math.acos(np.clip(ray @ (turn @ roll @ [0.0, 0.0, -1.0]) / slant, -1.0, 1.0))
    if angle > camera.half_aperture:
        return "outside_footprint"
    ground = shapely.LineString([(x, y), place[:2]])
    for house in houses.query(ground, predicate="intersects"):
        under = shapely.intersection(ground, city.outlines[house])
        # The ray falls, so it is lowest at the far end of what lies over the house.
        far = max(math.dist((x, y), corner) for corner in shapely.get_coordinates(under))
        if under.length > 1e-9 and z + ray[2] * far / ground.length < city.heights[house]:
            return "building"
    return "seen"


def _unheard(record, camera, time, vehicle, holders):
    """Why a vehicle in plain sight of somebody has no track near it."""
    step = record.times[1] - record.times[0]
    span = max(step, camera.frame_interval or 0.0)
    rows = [
        row
        for row in record.sightings
        if row["origin"] == vehicle and time - span + 1e-6 < row["time"] <= time + 1e-6
    ]
    if not rows:
        return "missed_detection"
    for row in rows:
        handed = step * math.ceil((row["time"] + camera.delay) / step - 1e-6)
        reports = [
            number
            for number, message in enumerate(record.messages)
            if message["kind"] == "report"
            and message["sender"] == row["reporter"]
            and abs(message["time"] - handed) < 1e-6
        ]
        if row["reporter"] in holders or not reports or record.receptions is None:
            return "track_lost"
        heard = {aircraft for number, aircraft in record.receptions.tolist() if number in reports}
        if heard & set(holders):
            return "track_lost"
    return "message_lost"
