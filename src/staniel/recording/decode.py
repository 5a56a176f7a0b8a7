"""JSON text of a record into arrays; whatever is not as the schemas say is refused."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from staniel.city import City
from staniel.datatypes.message import COST_TERMS
from staniel.datatypes.truth import (
    AIRCRAFT_COLUMNS,
    CONDITION_COLUMNS,
    VEHICLE_COLUMNS,
    nominal,
)
from staniel.errors import CityError, RecordError
from staniel.record import (
    AWARD_DTYPE,
    COMMAND_DTYPE,
    DECISION_DTYPE,
    MESSAGE_DTYPE,
    SIGHTING_DTYPE,
    THREAT_DTYPE,
    TRACK_DTYPE,
    Record,
)
from staniel.recording.schemas import FORMAT, MOST_OFFERS, TICK_TOPICS

__all__ = ["Contents", "decode"]

Floats = NDArray[np.float64]
Row = tuple[Any, ...]

_LARGEST: Final = 1e12
"""Numbers of this size and beyond are refused: sums and differences of them would overflow."""

_MALFORMED: Final = (TypeError, ValueError, LookupError, OverflowError, AttributeError)
"""What values of an unexpected type or shape raise on their way into arrays."""


@dataclass
class Contents:
    """What a file holds, not decoded yet: the JSON text of each message.

    Attributes
    ----------
    channels : dict of int to str
        Topic by channel.
    once : dict of str to bytes
        Text of the messages that come once, by topic.
    ticks : dict of int to dict of str to bytes
        Texts by tick and topic.
    complete : bool
        The file says that its run was not cut short.
    """

    channels: dict[int, str] = field(default_factory=dict)
    once: dict[str, bytes] = field(default_factory=dict)
    ticks: dict[int, dict[str, bytes]] = field(default_factory=dict)
    complete: bool = False


def decode(contents: Contents) -> Record:
    """Decode a whole record.

    Raises
    ------
    RecordError
        No scenario, city or whole tick, another format, or contents that are not what the schemas
        say.
    """
    version, scenario = _about(contents)
    city = _city(contents)
    ticks = _whole_ticks(contents.ticks)
    truth = [entry for _, entry in _entries(ticks, "truth")]
    poses, hearing, bidding = _poses(truth), _Hearing(), _Bidding()

    def message(time: float, item: Mapping[str, Any]) -> Row:
        bidding.add(item)
        return hearing.row(time, item)

    count = poses["aircraft"].shape[1]
    condition, wind = _conditions(ticks, count)
    messages = _table(ticks, "messages", MESSAGE_DTYPE, message, ("cost", "x", "y"))
    receptions, links = hearing.gathered(count)
    return Record(
        scenario=scenario,
        version=version,
        city=city,
        **poses,
        sightings=_table(ticks, "sightings", SIGHTING_DTYPE, _sighting),
        tracks=_table(ticks, "tracks", TRACK_DTYPE, _track),
        messages=messages,
        commands=_table(ticks, "commands", COMMAND_DTYPE, _command, _PATH_COLUMNS),
        decisions=_table(ticks, "decisions", DECISION_DTYPE, _decision),
        complete=contents.complete,
        links=links,
        receptions=receptions,
        condition=condition,
        wind=wind,
        threats=_table(ticks, "threats", THREAT_DTYPE, _threat, ("x", "y", "cxx", "cxy", "cyy")),
        awards=bidding.gathered(),
    )


def _about(contents: Contents) -> tuple[str, dict[str, Any]]:
    about = _once(contents, "/staniel/scenario")
    if about.get("format") != FORMAT:
        raise RecordError(f"format is {about.get('format')!r}, this staniel reads format {FORMAT}")
    version, scenario = about.get("version"), about.get("scenario")
    if not isinstance(version, str) or not isinstance(scenario, dict):
        raise RecordError("/staniel/scenario: expected a version and a scenario")
    return version, scenario


def _city(contents: Contents) -> City:
    try:
        return City.from_dict(_once(contents, "/staniel/city"))
    except CityError as error:
        raise RecordError(f"/staniel/city: {error}") from error


def _once(contents: Contents, topic: str) -> dict[str, Any]:
    text = contents.once.get(topic)
    if text is None:
        raise RecordError(
            f"holds no {topic}: not a record of staniel's, or cut off at its beginning"
        )
    return _json(text, topic)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")


_DECODER: Final = json.JSONDecoder(parse_constant=_refuse_constant)


def _json(text: bytes, topic: str) -> dict[str, Any]:
    try:
        value = _DECODER.decode(text.decode())
    except (ValueError, RecursionError) as error:
        raise RecordError(f"{topic}: not JSON ({error})") from error
    if not isinstance(value, dict):
        raise RecordError(f"{topic}: expected a JSON object, got {type(value).__name__}")
    return value


def _whole_ticks(ticks: Mapping[int, Mapping[str, bytes]]) -> dict[int, Mapping[str, bytes]]:
    """The ticks from the first on that have all their messages, up to the first gap."""
    whole: dict[int, Mapping[str, bytes]] = {}
    first = min(ticks, default=0)
    while ticks.get(first + len(whole), {}).keys() >= set(TICK_TOPICS):
        whole[first + len(whole)] = ticks[first + len(whole)]
    if not whole:
        raise RecordError("holds no whole tick: the run was cut off before its first one ended")
    return whole


def _entries(
    ticks: Mapping[int, Mapping[str, bytes]], kind: str
) -> Iterator[tuple[int, dict[str, Any]]]:
    topic = f"/staniel/{kind}"
    for tick, texts in ticks.items():
        if topic in texts:  # A whole tick lacks none but what it may lack.
            yield tick, _json(texts[topic], f"{topic}, tick {tick}")


def _poses(truth: Sequence[Mapping[str, Any]]) -> dict[str, Floats]:
    """Everything of a record that comes from the truth, by the record's field."""
    where = "/staniel/truth"
    try:
        times = [entry["time"] for entry in truth]
        aircraft = [[[a[c] for c in AIRCRAFT_COLUMNS] for a in e["aircraft"]] for e in truth]
        vehicles = [[[v[c] for c in VEHICLE_COLUMNS] for v in e["vehicles"]] for e in truth]
        fine = [entry["fine"] for entry in truth]
        fine_times = [time for part in fine for time in part["times"]]
        fine_aircraft = [pose for part in fine for pose in part["aircraft"]]
        fine_vehicles = [pose for part in fine for pose in part["vehicles"]]
        n, m = len(times), len(fine_times)
        n_aircraft, n_vehicles = len(aircraft[0]), len(vehicles[0])
        poses = {
            "times": _floats(times, (n,)),
            "aircraft": _floats(aircraft, (n, n_aircraft, 6)),
            "vehicles": _floats(vehicles, (n, n_vehicles, 4)),
            "fine_times": _floats(fine_times, (m,)),
            "fine_aircraft": _floats(fine_aircraft, (m, n_aircraft, 6)),
            "fine_vehicles": _floats(fine_vehicles, (m, n_vehicles, 4)),
        }
    except _MALFORMED as error:
        raise _malformed(where, error) from error
    for name in ("times", "fine_times"):
        if np.any(np.diff(poses[name]) <= 0.0):
            raise RecordError(f"{where}: {name} do not increase")
    return poses


def _conditions(ticks: Mapping[int, Mapping[str, bytes]], count: int) -> tuple[Floats, Floats]:
    """Conditions (n, count, 8) and winds (n, count, 2); a tick without a message is nominal."""
    where = "/staniel/condition"
    columns = (*CONDITION_COLUMNS, "wind_x", "wind_y")
    plain = np.hstack([nominal(count), np.zeros((count, 2))])
    rows = np.tile(plain, (len(ticks), 1, 1))
    try:
        for k, (tick, texts) in enumerate(ticks.items()):
            if where in texts:
                found = _json(texts[where], f"{where}, tick {tick}")["aircraft"]
                values = [[item[column] for column in columns] for item in found]
                rows[k] = _floats(values, plain.shape)
    except RecordError:
        raise
    except _MALFORMED as error:
        raise _malformed(where, error) from error
    width = len(CONDITION_COLUMNS)
    return np.ascontiguousarray(rows[:, :, :width]), np.ascontiguousarray(rows[:, :, width:])


def _floats(values: Sequence[Any], shape: tuple[int, ...]) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.size == 0 == math.prod(shape) and len(values) == shape[0]:
        return np.zeros(shape)
    if array.shape != shape:
        raise ValueError(f"got the shape {array.shape}, expected {shape}")
    if not (np.abs(array) < _LARGEST).all():
        raise ValueError("got a number that is not finite, or too large")
    return array


def _malformed(where: str, error: Exception) -> RecordError:
    reason = f"lacks {error}" if isinstance(error, KeyError) else str(error)
    return RecordError(f"{where}: not what its schema says ({reason})")


def _table(
    ticks: Mapping[int, Mapping[str, bytes]],
    kind: str,
    dtype: np.dtype[np.void],
    row: Callable[[float, Mapping[str, Any]], Row],
    may_lack: Sequence[str] = (),
) -> NDArray[np.void]:
    """All rows of one kind; `may_lack` names the float columns where null stands for NaN."""
    rows: list[Row] = []
    where = f"/staniel/{kind}"
    try:
        for _, entry in _entries(ticks, kind):
            time = entry["time"]
            rows += [row(time, item) for item in entry[kind]]
        table = np.array(rows, dtype=dtype)
    except RecordError:
        raise
    except _MALFORMED as error:
        raise _malformed(where, error) from error
    return _sound(table, where, may_lack)


def _sound(table: NDArray[np.void], where: str, may_lack: Sequence[str]) -> NDArray[np.void]:
    """The table itself, its floats checked."""
    for name in table.dtype.names or ():
        if table.dtype[name].kind == "f":
            good = np.abs(table[name]) < _LARGEST
            if name in may_lack:
                good |= np.isnan(table[name])
            if not good.all():
                raise RecordError(f"{where}: {name} has a number that is not finite, or too large")
    return table


def _text(value: Any, longest: int) -> str:  # noqa: ANN401
    """A text that fits its column; null is the empty text."""
    if value is None:
        return ""
    if not isinstance(value, str) or len(value) > longest:
        raise ValueError(f"{str(value)[:40]!r} is not a text of up to {longest} characters")
    return value


def _sighting(_: float, item: Mapping[str, Any]) -> Row:
    return (
        item["time"], item["reporter"], item["x"], item["y"],
        item["cxx"], item["cxy"], item["cyy"], item["origin"],
    )  # fmt: skip


def _track(_: float, item: Mapping[str, Any]) -> Row:
    return (
        item["time"], item["agent"], _text(item["id"], 16),
        item["x"], item["y"], item["vx"], item["vy"],
        item["cxx"], item["cxy"], item["cyy"], item["existence"], item["last_seen"],
    )  # fmt: skip


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _threat(_: float, item: Mapping[str, Any]) -> Row:
    return (
        item["time"], item["agent"], _text(item["kind"], 8), item["origin"],
        *(_or_nan(item[name]) for name in ("x", "y", "cxx", "cxy", "cyy")),
    )  # fmt: skip


def _message(_: float, item: Mapping[str, Any]) -> Row:
    winner = item["winner"]
    return (
        item["time"], item["sender"], item["sequence"], _text(item["kind"], 20),
        _text(item["target"], 16), -1 if winner is None else winner, _or_nan(item["cost"]),
        _or_nan(item["x"]), _or_nan(item["y"]), item["receivers"], len(item["heard_by"]),
    )  # fmt: skip


class _Hearing:
    """Who heard what: taken down row by row, gathered at the end."""

    def __init__(self) -> None:
        self._senders: list[int] = []
        self._heard_by: list[Sequence[int]] = []

    def row(self, time: float, item: Mapping[str, Any]) -> Row:
        self._senders.append(item["sender"])
        self._heard_by.append(item["heard_by"])
        return _message(time, item)

    def gathered(self, count: int) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """A record's `receptions`, and its `links`: their number for each two aircraft."""
        try:
            lengths = [len(heard) for heard in self._heard_by]
            senders = np.array(self._senders, dtype=np.int64)
            rows = np.repeat(np.arange(len(senders)), lengths)
            receivers = np.fromiter(chain.from_iterable(self._heard_by), np.int64, sum(lengths))
        except _MALFORMED as error:
            raise _malformed("/staniel/messages", error) from error
        known = (receivers >= 0) & (receivers < count)
        receptions = np.stack([rows[known], receivers[known]], axis=1).astype(np.int32)
        senders = senders[rows]
        known &= (senders >= 0) & (senders < count)
        links = np.bincount(senders[known] * count + receivers[known], minlength=count * count)
        return receptions, links.reshape(count, count).astype(np.int64)


class _Bidding:
    """What awards tell of the bids for them: taken down award by award, gathered at the end."""

    def __init__(self) -> None:
        self._rows: list[Row] = []

    def add(self, item: Mapping[str, Any]) -> None:
        if item["kind"] != "award":
            return
        said = item["time"], item["sender"], item["sequence"], _text(item["target"], 16)
        winner, bids = item["winner"], item.get("bids", [])  # Older records have none.
        if not isinstance(bids, list) or len(bids) > MOST_OFFERS:
            raise ValueError(f"bids are not a list of up to {MOST_OFFERS}")
        if winner is not None and all(bid["bidder"] != winner for bid in bids):
            bids = [*bids, {"bidder": winner, "cost": item["cost"], "terms": {}}]
        for bid in bids:
            bidder, terms = bid["bidder"], bid["terms"]
            told = [_or_nan(terms.get(name)) for name in COST_TERMS]
            self._rows.append((*said, bidder, _or_nan(bid["cost"]), bidder == winner, *told))

    def gathered(self) -> NDArray[np.void]:
        """A record's `awards`."""
        where = "/staniel/messages, bids"
        try:
            table = np.array(self._rows, dtype=AWARD_DTYPE)
        except _MALFORMED as error:
            raise _malformed(where, error) from error
        return _sound(table, where, ("cost", *COST_TERMS))


_PATH_COLUMNS: Final = ("ax", "ay", "bx", "by", "radius")
_NOWHERE: Final = (math.nan, math.nan)


def _command(time: float, item: Mapping[str, Any]) -> Row:
    kind = _text(item["kind"], 8)
    a, b, radius, turn = _NOWHERE, _NOWHERE, math.nan, 0
    if kind == "line":
        a, b = item["start"], item["end"]
    elif kind == "orbit":
        a, radius, turn = item["center"], item["radius"], item["turn"]
    elif kind == "banks":
        a = item.get("look", _NOWHERE)
    (ax, ay), (bx, by) = a, b
    return time, item["agent"], kind, ax, ay, bx, by, radius, turn, item["speed"], item["altitude"]


def _decision(time: float, item: Mapping[str, Any]) -> Row:
    x, y = item["goal"]
    guard = _text(item.get("guard", ""), 8)
    return time, item["agent"], _text(item["role"], 8), _text(item["target"], 16), x, y, guard
