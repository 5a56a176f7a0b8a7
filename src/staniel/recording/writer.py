"""The recorder: every tick is on its way to the disk before the next one begins."""

import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from mcap.writer import CompressionType, Writer

from staniel.city import City
from staniel.datatypes.clock import Clock
from staniel.errors import OutputError
from staniel.record import Frame
from staniel.recording.encode import FineSteps, encode_tick
from staniel.recording.scene import city_scene, team_scene
from staniel.recording.schemas import FORMAT, RUN_METADATA, SCHEMAS, schema_bytes

__all__ = ["Recorder"]

_NANOSECONDS: Final = 1_000_000_000
_CHUNK_LIMIT: Final = 1 << 40
"""No chunk is ever closed for its size: the recorder closes one a tick."""

_LEAN_TICKS: Final = 50  # in a chunk of a lean record


class Recorder:
    """Writes one run to an MCAP file that can be read up to its last tick, however it ends.

    Each tick is one chunk, handed to the operating system by a single write before `write`
    returns. A kill leaves a file without its index, a full disk is cut back to its last whole tick:
    both can be read. The file holds simulated time only, so the same run writes the same bytes.

    Parameters
    ----------
    path : path
        Of the new file; one that exists is refused.
    scenario : mapping
        The resolved scenario, seed included, of what JSON can say.
    version : str
        Of staniel.
    city : City
        The true one.
    clock : Clock
        The run's.
    lean : bool, optional
        For who reads it back at once: no scenes for viewers, and up to 50 ticks in a chunk, which a
        kill takes along.

    Raises
    ------
    OutputError
        The file exists or cannot be written.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        scenario: Mapping[str, Any],
        version: str,
        city: City,
        clock: Clock,
        lean: bool = False,
    ) -> None:
        self.path = Path(path)
        self._lean = lean
        self.ticks = 0
        self._fine = FineSteps(clock)
        self._open = True
        self._half_written = False
        self._sink = _Sink(self.path)
        writer: Any = Writer(
            self._sink,  # type: ignore[arg-type]
            chunk_size=_CHUNK_LIMIT,
            compression=CompressionType.NONE,
        )
        self._writer = writer
        try:
            self._guarded(lambda: self._begin(scenario, version, city, clock))
        except OutputError:
            self.path.unlink(missing_ok=True)
            raise

    def _begin(self, scenario: Mapping[str, Any], version: str, city: City, clock: Clock) -> None:
        self._writer.start(profile="", library=f"staniel {version}")
        schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        for topic, (name, schema) in SCHEMAS.items():
            if name not in schemas:
                schemas[name] = self._writer.register_schema(
                    name, "jsonschema", schema_bytes(schema)
                )
            self._channels[topic] = self._writer.register_channel(topic, "json", schemas[name])
        about = {
            "format": FORMAT,
            "version": version,
            "clock": clock.model_dump(mode="json"),
            "scenario": dict(scenario),
        }
        self._add("/staniel/scenario", _text(about), 0, 0)
        self._add("/staniel/city", _text(city.to_dict()), 0, 0)
        if not self._lean:
            self._add("/scene/city", city_scene(city), 0, 0)
        self._writer.flush()

    def write(self, frame: Frame) -> None:
        """Write one tick and hand it to the operating system.

        Raises
        ------
        OutputError
            The disk is full or gone; names the file and the ticks kept, which can be read.
        """
        if not self._open:
            raise OutputError(
                f"{self.path}: the record is closed, tick {frame.truth.tick} comes late"
            )
        tick = frame.truth.tick
        now = round(frame.truth.time * _NANOSECONDS)
        texts = encode_tick(frame, self._fine)
        if not self._lean:
            texts.append(("/scene/team", team_scene(frame.truth, frame.beliefs, now)))
        self._half_written = True
        for topic, text in texts:
            self._add(topic, text, now, tick)
        if not self._lean or self.ticks % _LEAN_TICKS == 0:
            self._guarded(self._writer.flush)
        self._half_written = False
        self.ticks += 1

    def finish(self, complete: bool) -> None:
        """Write what the run ended like, the summary and the index, and close the file.

        Does nothing when the file is closed already. Where an interrupt has torn a tick apart, the
        file is cut back to the last whole one and stays without an index, like after a kill.

        Parameters
        ----------
        complete : bool
            False when the run was cut short.

        Raises
        ------
        OutputError
            The disk is full or gone; all ticks written before are kept and can be read.
        """
        if not self._open:
            return
        if self._half_written:
            self._open = False
            self._sink.abandon()
            return
        self._guarded(lambda: self._end(complete))
        self._open = False

    def _end(self, complete: bool) -> None:
        ending = {"complete": "true" if complete else "false", "ticks": str(self.ticks)}
        self._writer.add_metadata(RUN_METADATA, ending)
        self._writer.finish()
        self._sink.flush()
        self._sink.close()

    def _add(self, topic: str, text: str, nanoseconds: int, sequence: int) -> None:
        data = text.encode()
        self._writer.add_message(
            self._channels[topic], nanoseconds, data, nanoseconds, sequence=sequence
        )

    def _guarded(self, step: Callable[[], object]) -> None:
        """Take one step that writes; when it fails keep what is whole, and close."""
        try:
            step()
        except OSError as error:
            self._open = False
            self._sink.abandon()
            raise OutputError(
                f"{self.path}: cannot be written ({error.strerror or error}); "
                f"{self.ticks} whole ticks are kept and can be read"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.finish(complete=False)


class _Sink:
    """The file, written in whole steps: gathers what comes and hands it over in `flush`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parts: list[bytes] = []
        self._gathered = 0
        self._written = 0
        try:
            self._file = path.open("xb", buffering=0)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror})") from error

    def write(self, data: bytes) -> int:
        self._parts.append(data)
        self._gathered += len(data)
        return len(data)

    def tell(self) -> int:
        return self._written + self._gathered

    def flush(self) -> None:
        # At its own place in the file: what an interrupt tore apart is simply written again.
        rest = memoryview(b"".join(self._parts))
        done = 0
        self._file.seek(self._written)
        while done < len(rest):
            done += self._file.write(rest[done:])
        self._written += done
        self._parts.clear()
        self._gathered = 0

    def abandon(self) -> None:
        """Cut the file back to its last whole step and close it, as far as the disk allows."""
        with suppress(OSError):
            self._file.truncate(self._written)
        with suppress(OSError):
            self._file.close()

    def close(self) -> None:
        self._file.close()


def _text(value: Mapping[str, Any]) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
