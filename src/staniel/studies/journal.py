"""The journal of a study: a line a run, on the disk before the next one counts.

A line that a kill or a full disk has torn is cut off when the journal is opened again: nothing that
was whole is lost, and what was torn is flown anew.
"""

import errno
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from staniel.errors import OutputError, RecordError
from staniel.studies.mission import Outcome

__all__ = ["Journal"]

RUNS, TIMES = "runs.jsonl", "times.jsonl"
_LONGEST: Final = 64 << 20
"""No line is longer [bytes]: thousands of vehicles make a few megabytes."""


class Journal:
    """What is known of each run of a study, on the disk.

    ``runs.jsonl`` holds what a run resulted in, ``times.jsonl`` what it cost and where it was
    flown: the order of their lines, and all of the second, differ from one try to the next.

    Parameters
    ----------
    folder : Path

    Attributes
    ----------
    done : dict of (int, int) to int
        Byte at which the line of each (point, seed) begins.
    failed, died : set of (int, int)
        Those of them that raised an error, and those whose worker died.

    Raises
    ------
    OutputError
        Another process has it open, or it cannot be written.
    RecordError
        A line before the last is not one of a journal.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / RUNS
        self._times_path = folder / TIMES
        self.done: dict[tuple[int, int], int] = {}
        self.failed: set[tuple[int, int]] = set()
        self.died: set[tuple[int, int]] = set()
        try:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise self._unwritable(error) from error
        try:
            self._lock()
            self._end = self._scan()
            os.ftruncate(self._file, self._end)
        except BaseException:
            os.close(self._file)
            raise

    def add(self, outcome: Outcome) -> None:
        """Write one run down; it is with the operating system when this returns.

        Raises
        ------
        OutputError
            The disk is full or gone; what was written before is kept.
        """
        entry = {"point": outcome.point, "seed": outcome.seed}
        what: dict[str, Any] = {"rows": outcome.rows}
        if outcome.error or outcome.died:
            what = {"error": outcome.error} if outcome.error else {"died": outcome.died}
        line = _line({**entry, **what})
        try:
            written = os.write(self._file, line)
            if written < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._file, self._end)
            raise self._unwritable(error) from error
        self._know(outcome.point, outcome.seed, self._end, what)
        self._end += len(line)
        # What it cost is for people: it is no reason to stop.
        with suppress(OSError), self._times_path.open("ab") as times:
            cost = {"seconds": outcome.seconds, "where": outcome.where, "at": time.time()}
            times.write(_line({**entry, **cost}))

    def forget(self, runs: set[tuple[int, int]]) -> None:
        """Let runs count as not flown: they are flown again, and the new line counts."""
        for key in tuple(runs):
            del self.done[key]
            self.failed.discard(key)
            self.died.discard(key)

    def entries(self) -> Iterator[dict[str, Any]]:
        """The runs in the order of points and seeds, one at a time from the disk."""
        with self._path.open("rb") as file:
            for key in sorted(self.done):
                file.seek(self.done[key])
                yield json.loads(file.readline(_LONGEST))

    def close(self) -> None:
        """Let go of the file and of its lock."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _lock(self) -> None:
        try:
            import fcntl
        except ImportError:  # not on every system; there two at once are the user's to avoid
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise OutputError(
                f"{self._path}: another process is working on this study; expected to be alone"
            ) from None

    def _scan(self) -> int:
        """Find the lines; returns where the last whole one ends."""
        end, number = 0, 0
        with self._path.open("rb") as file:
            while line := file.readline(_LONGEST):
                number += 1
                try:
                    entry = json.loads(line)
                    point, seed = entry["point"], entry["seed"]
                    whole = line.endswith(b"\n") and bool({"rows", "error", "died"} & set(entry))
                    if not (isinstance(point, int) and isinstance(seed, int) and whole):
                        raise ValueError
                except (ValueError, LookupError, TypeError, RecursionError):
                    if file.read(1):
                        raise RecordError(
                            f"{self._path}, line {number}: not a run of a study; expected what "
                            "a study wrote (the lines before are good)"
                        ) from None
                    return end
                self._know(point, seed, end, entry)
                end += len(line)
        return end

    def _know(self, point: int, seed: int, start: int, entry: Mapping[str, Any]) -> None:
        key = point, seed
        self.done[key] = start
        for kind, keys in (("error", self.failed), ("died", self.died)):
            (keys.add if kind in entry else keys.discard)(key)

    def _unwritable(self, error: OSError) -> OutputError:
        return OutputError(
            f"{self._path}: cannot be written ({error.strerror or error}); "
            f"{len(self.done)} runs are kept"
        )


def _line(entry: dict[str, Any]) -> bytes:
    return (json.dumps(entry, separators=(",", ":"), allow_nan=False) + "\n").encode()
