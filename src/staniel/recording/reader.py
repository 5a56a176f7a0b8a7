"""The record read back: whole files and cut ones, trusted by nobody."""

import os
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import Final

from staniel.errors import RecordError
from staniel.record import Record
from staniel.recording.decode import Contents, decode
from staniel.recording.schemas import (
    FILE_NAME,
    ONCE_TOPICS,
    OPTIONAL_TOPICS,
    RUN_METADATA,
    TICK_TOPICS,
)

__all__ = ["read_record"]

MAX_FILE_SIZE: Final = 2 << 30
"""Largest file that is read [bytes]: some fifty hours of the default mission."""

_MAGIC: Final = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _METADATA, _DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0C, 0x0F
_HEAD: Final = Struct("<BQ")
_MESSAGE_HEAD: Final = Struct("<HIQQ")
_CHUNK_HEAD: Final = Struct("<QQQII")
_LENGTH: Final = Struct("<I")
_SHORT: Final = Struct("<H")
_LONG: Final = Struct("<Q")


def read_record(path: str | os.PathLike[str]) -> Record:
    """Read a run that `Recorder` wrote, finished or cut off at any byte.

    Of a file that was cut off all whole ticks are read: those whose messages are all there.

    Parameters
    ----------
    path : path
        A run folder or its ``.mcap`` file.

    Returns
    -------
    Record

    Raises
    ------
    RecordError
        No such file, not an MCAP file of staniel's, of another format version, cut off before the
        first whole tick, or with contents that are not what the schemas say. Names the file.
    """
    file = Path(path)
    if file.is_dir():
        file = file / FILE_NAME
    contents = Contents()
    try:
        _scan(_bytes(file), contents)
        return decode(contents)
    except RecordError as error:
        raise RecordError(f"{file}: {error}") from error.__cause__


def _bytes(file: Path) -> bytes:
    try:
        size = file.stat().st_size
        if size > MAX_FILE_SIZE:
            raise RecordError(f"has {size} bytes, expected at most {MAX_FILE_SIZE}")
        return file.read_bytes()
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror or error})") from error


def _scan(data: bytes, contents: Contents) -> None:
    """Sort the messages by tick and topic, up to the end of the data or the first torn record."""
    if not data.startswith(_MAGIC):
        raise RecordError("not an MCAP file: it does not begin with MCAP's eight bytes")
    for opcode, start, end in _records(data, len(_MAGIC), len(data)):
        if opcode == _CHUNK:
            _scan_chunk(data, start, end, contents)
        elif opcode == _METADATA:
            _scan_metadata(data, start, end, contents)
        elif opcode == _DATA_END:
            return
        else:
            _scan_record(data, opcode, start, end, contents)


def _records(data: bytes, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Opcode, start and end of the contents of each whole record."""
    while start + _HEAD.size <= end:
        opcode, length = _HEAD.unpack_from(data, start)
        start += _HEAD.size
        if start + length > end:
            return
        yield opcode, start, start + length
        start += length


def _scan_chunk(data: bytes, start: int, end: int, contents: Contents) -> None:
    if start + _CHUNK_HEAD.size > end:
        raise RecordError(f"a chunk at byte {start} is too short")
    *_, name_length = _CHUNK_HEAD.unpack_from(data, start)
    records = start + _CHUNK_HEAD.size + name_length + _LONG.size
    if name_length:
        raise RecordError(f"the chunk at byte {start} is compressed, expected uncompressed chunks")
    if records > end or _LONG.unpack_from(data, records - _LONG.size)[0] != end - records:
        raise RecordError(f"the chunk at byte {start} has a wrong length")
    for opcode, first, last in _records(data, records, end):
        _scan_record(data, opcode, first, last, contents)


def _scan_record(data: bytes, opcode: int, start: int, end: int, contents: Contents) -> None:
    if opcode == _CHANNEL:
        identity, topic = _channel(data, start, end)
        contents.channels[identity] = topic
    elif opcode == _MESSAGE:
        if start + _MESSAGE_HEAD.size > end:
            raise RecordError(f"a message at byte {start} is too short")
        channel, tick, _, _ = _MESSAGE_HEAD.unpack_from(data, start)
        topic = contents.channels.get(channel, "")
        body = data[start + _MESSAGE_HEAD.size : end]
        if topic in TICK_TOPICS or topic in OPTIONAL_TOPICS:
            contents.ticks.setdefault(tick, {})[topic] = body
        elif topic in ONCE_TOPICS:
            contents.once[topic] = body


def _channel(data: bytes, start: int, end: int) -> tuple[int, str]:
    if start + 8 > end:
        raise RecordError(f"a channel at byte {start} is too short")
    (identity,) = _SHORT.unpack_from(data, start)
    topic, _ = _string(data, start + 4, end)
    return identity, topic


def _string(data: bytes, start: int, end: int) -> tuple[str, int]:
    if start + _LENGTH.size > end:
        raise RecordError(f"a text at byte {start} is cut off")
    (length,) = _LENGTH.unpack_from(data, start)
    last = start + _LENGTH.size + length
    if last > end:
        raise RecordError(f"a text at byte {start} is cut off")
    return data[start + _LENGTH.size : last].decode(errors="replace"), last


def _scan_metadata(data: bytes, start: int, end: int, contents: Contents) -> None:
    name, place = _string(data, start, end)
    if name != RUN_METADATA:
        return
    place += _LENGTH.size
    while place < end:
        key, place = _string(data, place, end)
        value, place = _string(data, place, end)
        if key == "complete":
            contents.complete = value == "true"
