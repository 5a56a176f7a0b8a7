"""The JSON schemas of every channel, and the names and numbers that writer and reader share."""

import json
from typing import Any, Final

from staniel.datatypes.message import COST_TERMS

__all__ = [
    "FILE_NAME",
    "FORMAT",
    "MOST_OFFERS",
    "ONCE_TOPICS",
    "OPTIONAL_TOPICS",
    "RUN_METADATA",
    "SCHEMAS",
    "TICK_TOPICS",
    "schema_bytes",
]

FORMAT: Final = 1
"""Version of the layout below; a reader refuses any other."""

FILE_NAME: Final = "mission.mcap"
"""The record's name in a run folder."""

MOST_OFFERS: Final = 100
"""How many bids of one message are recorded; a reader refuses more."""

RUN_METADATA: Final = "staniel.run"
"""Name of the metadata record that a finished file ends with."""

Schema = dict[str, Any]


def _object(title: str = "", /, **properties: Schema) -> Schema:
    titled = {"title": title} if title else {}
    required = list(properties)
    return {**titled, "type": "object", "properties": properties, "required": required}


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _number(description: str) -> Schema:
    return {"type": "number", "description": description}


def _integer(description: str) -> Schema:
    return {"type": "integer", "description": description}


def _boolean(description: str) -> Schema:
    return {"type": "boolean", "description": description}


def _string(description: str) -> Schema:
    return {"type": "string", "description": description}


def _or_null(schema: Schema) -> Schema:
    return {**schema, "type": [schema["type"], "null"]}


def _tick(title: str, /, **properties: Schema) -> Schema:
    tick = {"tick": _integer("decision steps since the start"), "time": _number("[s]")}
    return _object(title, **tick, **properties)


_X, _Y = _number("east [m]"), _number("north [m]")
_POINT = {**_list(_number("[m]")), "minItems": 2, "maxItems": 2, "description": "east, north [m]"}
_COVARIANCE = {"cxx": _number("[m²]"), "cxy": _number("[m²]"), "cyy": _number("[m²]")}
_COURSE = {"heading": _number("counter-clockwise from east [rad]"), "speed": _number("[m/s]")}

_AIRCRAFT = _object(
    id=_integer("of the aircraft"),
    x=_X,
    y=_Y,
    z=_number("above ground [m]"),
    heading=_COURSE["heading"],
    bank=_number("left positive [rad]"),
    speed=_number("airspeed [m/s]"),
)
_CONDITION = _object(
    id=_integer("of the aircraft"),
    energy=_number("share left"),
    camera=_boolean("it delivers"),
    radio=_boolean("it sends and hears"),
    flying=_boolean("launched and not lost"),
    lost=_boolean("for good"),
    drift_x=_number("how far its navigation is off to the east [m]"),
    drift_y=_number("to the north [m]"),
    climb=_number("rate [m/s]"),
    wind_x=_number("velocity of the air around it to the east [m/s]"),
    wind_y=_number("to the north [m/s]"),
)
_VEHICLE = _object(id=_integer("of the vehicle"), x=_X, y=_Y, **_COURSE)
_FINE = _object(
    times=_list(_number("[s]")),
    aircraft=_list(_list(_list(_number("x, y, z [m], heading, bank [rad], airspeed [m/s]")))),
    vehicles=_list(_list(_list(_number("x, y [m], heading [rad], speed [m/s]")))),
)
_SIGHTING = _object(
    time=_number("of the picture [s]"),
    reporter=_integer("the aircraft that saw it"),
    x=_X,
    y=_Y,
    **_COVARIANCE,
    origin=_integer("the vehicle that caused it, -1 for a false alarm"),
)
_THREAT = _object(
    time=_number("[s]"),
    agent=_integer("whose sensor noticed it"),
    kind=_string("region or carrier"),
    origin=_integer("the region's number in the scenario, or the vehicle; no agent knows it"),
    x=_or_null(_number("east: of a carrier, as measured [m]")),
    y=_or_null(_number("north [m]")),
    **{name: _or_null(schema) for name, schema in _COVARIANCE.items()},
)
_TRACK = _object(
    agent=_integer("whose belief this is"),
    id=_string("founder-serial"),
    time=_number("of the estimate [s]"),
    x=_X,
    y=_Y,
    vx=_number("east [m/s]"),
    vy=_number("north [m/s]"),
    **_COVARIANCE,
    existence=_number("probability"),
    last_seen=_number("time of the newest sighting in it [s]"),
)
_MESSAGE = _object(
    time=_number("when it was said [s]"),
    sender=_integer("aircraft"),
    sequence=_integer("running number at the sender"),
    kind=_string("heartbeat, report, award, ...: as on the wire"),
    target=_or_null(_string("track, founder-serial")),
    winner=_or_null(_integer("aircraft")),
    cost=_or_null(_number("of pursuing the target; null when none or not finite")),
    x=_or_null(_number("east: the sender's in a heartbeat, else the target's [m]")),
    y=_or_null(_number("north [m]")),
    receivers=_integer("how many could have heard it"),
    heard_by=_list(_integer("aircraft")),
)
_COST = _or_null(_number("[m]; null when not finite"))
_OFFER = {
    "cost": _COST,
    "terms": {
        **_object(),
        "properties": dict.fromkeys(COST_TERMS, _COST),
        "description": "what the cost is the sum of; empty: the distance alone",
    },
}
_MESSAGE["properties"] |= {
    "bids": {
        **_list(_object(bidder=_integer("aircraft"), **_OFFER)),
        "maxItems": MOST_OFFERS,
        "description": "of an award: the bids that it tells",
    },
    "offers": {
        **_list(
            _object(
                target=_string("track, founder-serial"),
                auctioneer=_integer("who announced it"),
                **_OFFER,
            )
        ),
        "maxItems": MOST_OFFERS,
        "description": "of a bid: each target that it is for",
    },
}
_COMMAND = {
    **_object(
        agent=_integer("aircraft"),
        kind=_string("line, orbit or banks"),
        speed=_number("airspeed [m/s]"),
        altitude=_number("above ground [m]"),
    ),
    "description": "line: start, end; orbit: center, radius, turn; banks: banks, hold (look)",
}
_COMMAND["properties"] |= {
    "start": _POINT,
    "end": _POINT,
    "center": _POINT,
    "radius": _number("[m]"),
    "turn": _integer("+1 counter-clockwise seen from above, -1 clockwise"),
    "banks": _list(_number("left positive [rad]")),
    "hold": _number("of each bank [s]"),
    "look": {**_POINT, "description": "of a gimbal, where banks name one: east, north [m]"},
}
_DECISION = _object(
    agent=_integer("aircraft"),
    role=_string("search, pursue, help, recover, loiter where no flight was safe, or down"),
    target=_or_null(_string("track it is responsible for, founder-serial")),
    goal=_POINT,
)
_DECISION["properties"]["guard"] = _string("avoid or loiter: not what was decided; absent: it is")
_CLOCK = _object(decision_step=_number("[s]"), dynamics_step=_number("[s]"))

_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_XYZ = _object(x={"type": "number"}, y={"type": "number"}, z={"type": "number"})
_QUATERNION = _object(**{axis: {"type": "number"} for axis in "xyzw"})
_COLOR = _object(**{part: {"type": "number"} for part in "rgba"})
_POSE = _object("foxglove.Pose", position=_XYZ, orientation=_QUATERNION)
_ARROW = _object(
    pose=_POSE,
    shaft_length={"type": "number"},
    shaft_diameter={"type": "number"},
    head_length={"type": "number"},
    head_diameter={"type": "number"},
    color=_COLOR,
)
_SOLID = _object(pose=_POSE, size=_XYZ, color=_COLOR)
_TRIANGLES = _object(
    pose=_POSE,
    points=_list(_XYZ),
    color=_COLOR,
    colors=_list(_COLOR),
    indices=_list({"type": "integer", "minimum": 0}),
)
_ENTITY = _object(
    timestamp=_TIME,
    frame_id={"type": "string"},
    id={"type": "string"},
    lifetime=_TIME,
    frame_locked={"type": "boolean"},
    metadata=_list(_object(key={"type": "string"}, value={"type": "string"})),
    arrows=_list(_ARROW),
    cubes=_list(_SOLID),
    spheres=_list(_SOLID),
    cylinders=_list({"type": "object"}),
    lines=_list({"type": "object"}),
    triangles=_list(_TRIANGLES),
    texts=_list({"type": "object"}),
    models=_list({"type": "object"}),
)
_SCENE = _object(
    "foxglove.SceneUpdate", deletions=_list({"type": "object"}), entities=_list(_ENTITY)
)

SCHEMAS: Final[dict[str, tuple[str, Schema]]] = {
    "/staniel/scenario": (
        "staniel.Scenario",
        _object(
            "staniel.Scenario",
            format=_integer("version of this layout"),
            version=_string("of staniel, that wrote it"),
            clock=_CLOCK,
            scenario={"type": "object", "description": "the resolved scenario, seed included"},
        ),
    ),
    "/staniel/city": (
        "staniel.City",
        {"title": "staniel.City", "type": "object", "description": "City.to_dict"},
    ),
    "/staniel/truth": (
        "staniel.Truth",
        _tick("staniel.Truth", aircraft=_list(_AIRCRAFT), vehicles=_list(_VEHICLE), fine=_FINE),
    ),
    "/staniel/sightings": (
        "staniel.Sightings",
        _tick("staniel.Sightings", sightings=_list(_SIGHTING)),
    ),
    "/staniel/tracks": ("staniel.Tracks", _tick("staniel.Tracks", tracks=_list(_TRACK))),
    "/staniel/messages": ("staniel.Messages", _tick("staniel.Messages", messages=_list(_MESSAGE))),
    "/staniel/commands": ("staniel.Commands", _tick("staniel.Commands", commands=_list(_COMMAND))),
    "/staniel/decisions": (
        "staniel.Decisions",
        _tick("staniel.Decisions", decisions=_list(_DECISION)),
    ),
    "/staniel/condition": (
        "staniel.Condition",
        _tick("staniel.Condition", aircraft=_list(_CONDITION)),
    ),
    "/staniel/threats": ("staniel.Threats", _tick("staniel.Threats", threats=_list(_THREAT))),
    "/scene/city": ("foxglove.SceneUpdate", _SCENE),
    "/scene/team": ("foxglove.SceneUpdate", _SCENE),
}
"""Schema name and JSON schema of each topic."""

ONCE_TOPICS: Final = ("/staniel/scenario", "/staniel/city")
"""The topics that a reader needs and that have one message at the beginning."""

TICK_TOPICS: Final = tuple(
    f"/staniel/{kind}"
    for kind in ("truth", "sightings", "tracks", "messages", "commands", "decisions")
)
"""The topics that every tick has one message on."""

OPTIONAL_TOPICS: Final = ("/staniel/condition", "/staniel/threats")
"""The topics that have a message in the ticks that need one."""


def schema_bytes(schema: Schema) -> bytes:
    """Encode one schema as it stands in the file."""
    return json.dumps(schema, separators=(",", ":"), ensure_ascii=False).encode()
