"""The run as Foxglove's 3D panel draws it: `foxglove.SceneUpdate` messages, as JSON text.

One entity for the city and one each for aircraft, vehicles and tracks, replaced as a whole in
every tick: the panel needs no set-up, and a seek in time shows the right thing.
"""

import json
import math
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import numpy as np
import shapely

from staniel.city import City
from staniel.datatypes.belief import Belief, TrackEstimate, TrackId
from staniel.datatypes.truth import Truth

__all__ = ["city_scene", "team_scene"]

FRAME_ID: Final = "map"

_TEAM_COLORS: Final = (
    (0.00, 0.45, 0.70), (0.90, 0.62, 0.00), (0.00, 0.62, 0.45), (0.80, 0.47, 0.65),
    (0.34, 0.71, 0.91), (0.84, 0.37, 0.00), (0.94, 0.89, 0.26), (0.45, 0.45, 0.45),
)  # fmt: skip
"""Okabe and Ito's palette, as in the pictures."""

_NOBODY: Final = (0.25, 0.25, 0.25)
"""A track that nobody pursues."""

_WALL: Final = (0.62, 0.62, 0.66, 1.0)
_ROOF: Final = (0.80, 0.80, 0.83, 1.0)
_VEHICLE_COLOR: Final = (0.85, 0.1, 0.1, 1.0)
_TRACK_SIZES: Final = (3.0, 40.0)
"""Smallest and largest sphere of a track [m]; between them two standard deviations across."""


def city_scene(city: City) -> str:
    """Draw the buildings once: walls and roofs as triangles, with the ground at z = 0.

    Returns
    -------
    str
        One `foxglove.SceneUpdate`.
    """
    points: list[list[float]] = []
    indices: list[int] = []
    colors: list[dict[str, float]] = []
    for outline, height in zip(city.outlines, city.heights, strict=True):
        _add_walls(outline, float(height), points, indices)
        colors += [_color(*_WALL)] * (len(points) - len(colors))
        _add_roof(outline, float(height), points, indices)
        colors += [_color(*_ROOF)] * (len(points) - len(colors))
    triangles = {
        "pose": {"position": _xyz(0.0, 0.0, 0.0), "orientation": {**_xyz(0.0, 0.0, 0.0), "w": 1.0}},
        "points": [_xyz(*point) for point in points],
        "color": _color(*_ROOF),
        "colors": colors,
        "indices": indices,
    }
    entity = _entity("city", 0, triangles=[triangles])
    return json.dumps({"deletions": [], "entities": [entity]}, separators=(",", ":"))


def _add_walls(
    outline: shapely.Polygon, height: float, points: list[list[float]], indices: list[int]
) -> None:
    for ring in (outline.exterior, *outline.interiors):
        corners = np.asarray(ring.coords)[:-1, :2].round(3).tolist()
        first = len(points)
        for x, y in corners:
            points += [[x, y, 0.0], [x, y, height]]
        for k in range(len(corners)):
            low, far = first + 2 * k, first + 2 * ((k + 1) % len(corners))
            indices += [low, far, far + 1, low, far + 1, low + 1]


def _add_roof(
    outline: shapely.Polygon, height: float, points: list[list[float]], indices: list[int]
) -> None:
    for triangle in shapely.constrained_delaunay_triangles(outline).geoms:
        first = len(points)
        for x, y in np.asarray(shapely.get_coordinates(triangle))[:3].round(3).tolist():
            points.append([x, y, height])
        indices += [first, first + 1, first + 2]


def _xyz(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _color(r: float, g: float, b: float, a: float) -> dict[str, float]:
    return {"r": r, "g": g, "b": b, "a": a}


def _entity(name: str, nanoseconds: int, **primitives: Sequence[object]) -> dict[str, Any]:
    """One entity as a dict, with every list of primitives that the schema knows."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    return {
        "timestamp": {"sec": seconds, "nsec": rest},
        "frame_id": FRAME_ID,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        **{kind: primitives.get(kind, []) for kind in kinds},
    }


def team_scene(truth: Truth, beliefs: Sequence[Belief], nanoseconds: int) -> str:
    """Draw one tick: aircraft as arrows with a wing that shows the bank, vehicles, tracks.

    A track is drawn once, in the colour of the aircraft that pursues it, and two standard
    deviations across.

    Returns
    -------
    str
        One `foxglove.SceneUpdate`; its time is `nanoseconds` since the start.
    """
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    arrows, wings = [], []
    for n, (x, y, z, heading, bank, _) in enumerate(truth.aircraft.tolist()):
        s, c = math.sin(0.5 * heading), math.cos(0.5 * heading)
        # A left bank rolls by -bank about the forward axis; the yaw comes after it.
        sr, cr = -math.sin(0.5 * bank), math.cos(0.5 * bank)
        arrow, wing = _aircraft_templates(n)
        arrows.append(arrow % (x, y, z, s, c))
        wings.append(wing % (x, y, z, c * sr, s * sr, s * cr, c * cr))
    cubes = [
        _VEHICLE_CUBE % (x, y, math.sin(0.5 * heading), math.cos(0.5 * heading))
        for x, y, heading, _ in truth.vehicles.tolist()
    ]
    spheres = []
    pursuers = {belief.target: agent for agent, belief in enumerate(beliefs)}
    for identity, track in _one_each(beliefs).items():
        x, y = track.position.tolist()
        (cxx, _), (_, cyy) = track.covariance.tolist()
        size = min(max(2.0 * math.sqrt(0.5 * (cxx + cyy)), _TRACK_SIZES[0]), _TRACK_SIZES[1])
        template = _track_template(pursuers.get(identity))
        spheres.append(template % (x, y, size, size, size))
    return _TEAM % (
        *(seconds, rest, ",".join(arrows), ",".join(wings)),
        *(seconds, rest, ",".join(cubes)),
        *(seconds, rest, ",".join(spheres)),
    )


def _one_each(beliefs: Sequence[Belief]) -> dict[TrackId, TrackEstimate]:
    """Each track once, as whoever is responsible for it sees it, or else the first who holds it."""
    tracks: dict[TrackId, TrackEstimate] = {}
    for belief in beliefs:
        for track in belief.tracks:
            if track.id == belief.target or track.id not in tracks:
                tracks[track.id] = track
    return tracks


def _text_color(color: Sequence[float], alpha: float) -> str:
    r, g, b = color
    return f'{{"r":{r},"g":{g},"b":{b},"a":{alpha}}}'


def _entity_text(name: str, **primitives: str) -> str:
    """Template of one entity: its time and the given primitives are left open."""
    text = json.dumps(_entity(name, 0), separators=(",", ":"))
    text = text.replace('"timestamp":{"sec":0,"nsec":0}', '"timestamp":{"sec":%d,"nsec":%d}')
    for kind, items in primitives.items():
        text = text.replace(f'"{kind}":[]', f'"{kind}":[{items}]')
    return text


_TEAM: Final = '{{"deletions":[],"entities":[{},{},{}]}}'.format(
    _entity_text("aircraft", arrows="%s", cubes="%s"),
    _entity_text("vehicles", cubes="%s"),
    _entity_text("tracks", spheres="%s"),
)
_YAW: Final = '"orientation":{"x":0,"y":0,"z":%.4f,"w":%.4f}'
_LEVEL: Final = '"orientation":{"x":0,"y":0,"z":0,"w":1}'
_VEHICLE_CUBE: Final = (
    '{"pose":{"position":{"x":%.2f,"y":%.2f,"z":1},'
    + _YAW
    + '},"size":{"x":5,"y":2.5,"z":2},"color":'
    + _text_color(_VEHICLE_COLOR[:3], 1.0)
    + "}"
)


@cache
def _aircraft_templates(identity: int) -> tuple[str, str]:
    color = _text_color(_TEAM_COLORS[identity % len(_TEAM_COLORS)], 1.0)
    position = '{"pose":{"position":{"x":%.2f,"y":%.2f,"z":%.2f},'
    sizes = '"shaft_length":8,"shaft_diameter":2,"head_length":5,"head_diameter":4'
    arrow = position + _YAW + "}," + sizes + ',"color":' + color + "}"
    rolled = '"orientation":{"x":%.4f,"y":%.4f,"z":%.4f,"w":%.4f}}'
    wing = position + rolled + ',"size":{"x":2.5,"y":16,"z":0.6},"color":' + color + "}"
    return arrow, wing


@cache
def _track_template(pursuer: int | None) -> str:
    color = _NOBODY if pursuer is None else _TEAM_COLORS[pursuer % len(_TEAM_COLORS)]
    position = '{"pose":{"position":{"x":%.2f,"y":%.2f,"z":1},'
    sizes = '},"size":{"x":%.1f,"y":%.1f,"z":%.1f},"color":'
    return position + _LEVEL + sizes + _text_color(color, 0.6) + "}"
