"""Parts of messages as bytes, and back: little-endian, nothing aligned.

Writers trust: what they write has passed `staniel.datatypes.malformed.fault_of`. Readers take
nothing for granted but that this check comes after them: they read within the packet, build no more
than the packet has bytes for, and refuse what they cannot build.
"""

from struct import Struct
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from staniel.datatypes.belief import Pose, Sighting, TrackId
from staniel.datatypes.command import Command, FlyBanks, FlyLine, FlyOrbit
from staniel.datatypes.message import Point
from staniel.datatypes.parts import NOBODY
from staniel.datatypes.risk import RiskRegion
from staniel.datatypes.threats import Carrier
from staniel.errors import WireError

__all__ = [
    "Reader",
    "Writer",
    "code_of",
    "get_carrier",
    "get_command",
    "get_region",
    "get_sighting",
    "put_carrier",
    "put_command",
    "put_region",
    "put_sighting",
    "word_of",
]

_NAME, _POINT, _POSE = Struct("<dHI"), Struct("<2f"), Struct("<6f")
_BYTE, _ID, _COUNT = Struct("<B"), Struct("<H"), Struct("<H")
_FLOAT, _DOUBLE = Struct("<f"), Struct("<d")
_PLACED: Final = Struct("<d5fH")  # time, x, y, covariance, reporter
_CARRIED: Final = Struct("<2f")
_SPEEDS, _TURN = Struct("<2f"), Struct("<fb")
_BANKED: Final = Struct("<3fB")
_DISC: Final = Struct("<3d")

_NO_ONE: Final = 65_535  # what `NOBODY` is on the wire
_BANKS_PER_RADIAN: Final = 1e4

_LINE, _ORBIT, _BANKS = range(3)
_WITH_POSE, _WITH_DEVIATION, _NAMED = 1, 2, 4
_THREAT, _POLYGON, _RATED, _CEILED, _BRIEFED = 1, 2, 4, 8, 16


class Writer:
    """Collects the bytes of one message."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def __bytes__(self) -> bytes:
        return b"".join(self._parts)

    def put(self, form: Struct, *values: Any) -> None:  # noqa: ANN401 - what the form holds
        """So many values in that form."""
        self._parts.append(form.pack(*values))

    def raw(self, data: bytes) -> None:
        """Bytes as they are."""
        self._parts.append(data)

    def byte(self, value: int) -> None:
        """A small number, or flags."""
        self._parts.append(_BYTE.pack(value))

    def count(self, value: int) -> None:
        """How many follow."""
        self._parts.append(_COUNT.pack(value))

    def agent(self, value: int) -> None:
        """An agent's number, or `NOBODY`."""
        self._parts.append(_ID.pack(_NO_ONE if value == NOBODY else value))

    def number(self, value: float) -> None:
        """A number in four bytes."""
        self._parts.append(_FLOAT.pack(value))

    def time(self, value: float) -> None:
        """A number in eight bytes."""
        self._parts.append(_DOUBLE.pack(value))

    def point(self, value: Point) -> None:
        """A place or a velocity."""
        self._parts.append(_POINT.pack(*value))

    def pose(self, value: Pose) -> None:
        """Where an aircraft is and how it lies."""
        self._parts.append(_POSE.pack(*value))

    def name(self, value: TrackId) -> None:
        """Name of a track."""
        self._parts.append(_NAME.pack(*value))

    def terms(self, values: tuple[float, ...]) -> None:
        """A few numbers, after how many."""
        self._parts.append(_BYTE.pack(len(values)) + Struct(f"<{len(values)}f").pack(*values))


class Reader:
    """Reads the bytes of one message from the front to the end, and not beyond.

    Every method raises `WireError` where the packet ends too early.
    """

    def __init__(self, packet: bytes) -> None:
        self._packet, self._at = packet, 0

    @property
    def left(self) -> int:
        """Bytes that have not been read."""
        return len(self._packet) - self._at

    def take(self, form: Struct) -> tuple[Any, ...]:
        """Values in that form."""
        at = self._at
        self._need(form.size)
        self._at = at + form.size
        return form.unpack_from(self._packet, at)

    def raw(self, count: int) -> bytes:
        """Bytes as they are."""
        self._need(count)
        self._at += count
        return self._packet[self._at - count : self._at]

    def byte(self) -> int:
        """A small number, or flags."""
        value: int = self.take(_BYTE)[0]
        return value

    def flags(self, known: int) -> int:
        """Flags, none of them but the known ones."""
        flags = self.byte()
        if flags & ~known:
            raise WireError(f"flags {flags:#04x}: expected none but {known:#04x}")
        return flags

    def count(self, least: int) -> int:
        """How many follow, each of at least so many bytes: no more than there are bytes for."""
        value: int = self.take(_COUNT)[0]
        self._need(value * least)
        return value

    def agent(self) -> int:
        """An agent's number, or `NOBODY`."""
        value: int = self.take(_ID)[0]
        return NOBODY if value == _NO_ONE else value

    def number(self) -> float:
        """A number in four bytes."""
        value: float = self.take(_FLOAT)[0]
        return value

    def time(self) -> float:
        """A number in eight bytes."""
        value: float = self.take(_DOUBLE)[0]
        return value

    def point(self) -> Point:
        """A place or a velocity."""
        x, y = self.take(_POINT)
        return x, y

    def pose(self) -> Pose:
        """Where an aircraft is and how it lies."""
        return Pose(*self.take(_POSE))

    def name(self) -> TrackId:
        """Name of a track."""
        return TrackId(*self.take(_NAME))

    def terms(self) -> tuple[float, ...]:
        """A few numbers, after how many."""
        return self.take(Struct(f"<{self.byte()}f"))

    def _need(self, count: int) -> None:
        if count > self.left:
            raise WireError(f"ends {count - self.left} bytes too early")


def code_of(word: str, words: tuple[str, ...]) -> int:
    """What a word is on the wire."""
    return words.index(word)


def word_of(code: int, words: tuple[str, ...]) -> str:
    """The word of a code.

    Raises
    ------
    WireError
        There is none.
    """
    if code >= len(words):
        raise WireError(f"code {code}: expected one of {', '.join(words)}")
    return words[code]


def put_command(writer: Writer, command: Command) -> None:
    """What an aircraft flies; banks are rounded to 1e-4 rad."""
    if isinstance(command, FlyLine):
        writer.byte(_LINE)
        writer.point(command.start)
        writer.point(command.end)
        writer.put(_SPEEDS, command.speed, command.altitude)
    elif isinstance(command, FlyOrbit):
        writer.byte(_ORBIT)
        writer.point(command.center)
        writer.put(_TURN, command.radius, int(command.turn))
        writer.put(_SPEEDS, command.speed, command.altitude)
    else:
        banks, look = command.banks, command.look
        # The flag of a look is the upper half of the byte that names the kind.
        writer.byte(_BANKS if look is None else _BANKS | 16)
        writer.put(_BANKED, command.hold, command.speed, command.altitude, len(banks))
        rounded = [round(bank * _BANKS_PER_RADIAN) for bank in banks]
        writer.put(Struct(f"<{len(banks)}h"), *rounded)
        if look is not None:
            writer.point(look)


def get_command(reader: Reader) -> Command:
    """What `put_command` wrote."""
    kind = reader.byte()
    if kind == _LINE:
        start, end = reader.point(), reader.point()
        return FlyLine(start, end, *reader.take(_SPEEDS))
    if kind == _ORBIT:
        center, (radius, turn) = reader.point(), reader.take(_TURN)
        return FlyOrbit(center, radius, turn, *reader.take(_SPEEDS))
    if kind & ~16 != _BANKS:
        raise WireError(f"command of kind {kind}: expected a line, an orbit or banks")
    hold, speed, altitude, count = reader.take(_BANKED)
    banks = tuple(bank / _BANKS_PER_RADIAN for bank in reader.take(Struct(f"<{count}h")))
    return FlyBanks(banks, hold, speed, altitude, reader.point() if kind & 16 else None)


def _placed(
    time: float, position: NDArray[np.float64], covariance: NDArray[np.float64], reporter: int
) -> bytes:
    """Time, place, covariance and who says so.

    Rounding must not make a flat ellipse an impossible one: the correlation gives way.
    """
    xx, xy, _, yy = covariance.astype(np.float32).ravel()
    while float(xx) * float(yy) <= float(xy) * float(xy):
        xy = np.nextafter(xy, np.float32(0.0))
    whom = _NO_ONE if reporter == NOBODY else reporter
    return _PLACED.pack(time, *position.tolist(), xx, xy, yy, whom)


def _get_placed(reader: Reader) -> tuple[float, list[float], list[list[float]], int]:
    time, x, y, xx, xy, yy, whom = reader.take(_PLACED)
    return time, [x, y], [[xx, xy], [xy, yy]], NOBODY if whom == _NO_ONE else whom


def put_sighting(writer: Writer, seen: Sighting, name: TrackId | None) -> None:
    """A sighting, and the name by which its cause is known."""
    with_pose = 0 if seen.pose is None else _WITH_POSE
    with_deviation = _WITH_DEVIATION if seen.pose_deviation else 0
    writer.byte(with_pose | with_deviation | (0 if name is None else _NAMED))
    writer.raw(_placed(seen.time, seen.position, seen.covariance, seen.reporter))
    if seen.pose is not None:
        writer.pose(seen.pose)
    if seen.pose_deviation:
        writer.number(seen.pose_deviation)
    if name is not None:
        writer.name(name)


def get_sighting(reader: Reader) -> tuple[Sighting, TrackId | None]:
    """What `put_sighting` wrote."""
    flags = reader.flags(_WITH_POSE | _WITH_DEVIATION | _NAMED)
    time, position, covariance, reporter = _get_placed(reader)
    pose = reader.pose() if flags & _WITH_POSE else None
    off = reader.number() if flags & _WITH_DEVIATION else 0.0
    seen = Sighting(
        time,
        np.array(position),
        np.array(covariance),
        reporter=reporter,
        pose=pose,
        pose_deviation=off,
    )
    return seen, reader.name() if flags & _NAMED else None


def put_carrier(writer: Writer, carrier: Carrier) -> None:
    """A vehicle that is a threat."""
    writer.raw(_placed(carrier.time, carrier.position, carrier.covariance, carrier.reporter))
    writer.put(_CARRIED, carrier.radius, carrier.rate)


def get_carrier(reader: Reader) -> Carrier:
    """What `put_carrier` wrote."""
    time, position, covariance, reporter = _get_placed(reader)
    radius, rate = reader.take(_CARRIED)
    return Carrier(time, np.array(position), np.array(covariance), radius, rate, reporter=reporter)


def put_region(writer: Writer, region: RiskRegion) -> None:
    """A region, to the last bit: a region is known again by what it is."""
    flags = (
        (_THREAT if region.kind == "threat" else 0)
        | (0 if region.polygon is None else _POLYGON)
        | (0 if region.rate is None else _RATED)
        | (0 if region.ceiling is None else _CEILED)
        | (_BRIEFED if region.briefed else 0)
    )
    writer.byte(flags)
    writer.time(region.floor)
    if region.rate is not None:
        writer.time(region.rate)
    if region.ceiling is not None:
        writer.time(region.ceiling)
    if region.polygon is not None:
        writer.count(len(region.polygon))
        corners = [x for corner in region.polygon for x in corner]
        writer.put(Struct(f"<{len(corners)}d"), *corners)
    elif region.center is not None:
        writer.put(_DISC, *region.center, region.radius)


def get_region(reader: Reader) -> RiskRegion:
    """What `put_region` wrote."""
    flags = reader.flags(_THREAT | _POLYGON | _RATED | _CEILED | _BRIEFED)
    shape: dict[str, Any] = {"floor": reader.time()}
    if flags & _RATED:
        shape["rate"] = reader.time()
    if flags & _CEILED:
        shape["ceiling"] = reader.time()
    if flags & _POLYGON:
        count = reader.count(16)
        corners = reader.take(Struct(f"<{2 * count}d"))
        shape["polygon"] = tuple(zip(corners[::2], corners[1::2], strict=True))
    else:
        x, y, radius = reader.take(_DISC)
        shape["center"], shape["radius"] = (x, y), radius
    kind = "threat" if flags & _THREAT else "no-fly"
    return RiskRegion(kind=kind, briefed=bool(flags & _BRIEFED), **shape)
