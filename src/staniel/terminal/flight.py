"""What a person sees while a mission flies and after it: progress, tables, the files.

Everything goes to standard error. On a terminal the progress is a bar that is redrawn a few times a
second; elsewhere it is a line of text now and then, without control codes.
"""

import math
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from rich.console import Console
from rich.table import Table

from staniel.terminal.live import REFRESH, LiveBar

__all__ = ["Reporter"]

PATIENCE = 1.5
"""Kernels that take longer to be ready are being compiled, not loaded [s]."""

REASONS = 3
"""So many causes of what was unwatched are named, the largest first: what fits in one line."""

FILES = {
    "mission.mcap": "the record: every tick, opens in Foxglove",
    "scenario.toml": "the scenario as it was flown, with seed and version",
    "metrics.json": "the metrics, definitions in docs/metrics.md",
    "overview.png": "city, paths flown and driven, detections, auctions",
    "mission.gif": "the mission as a movie",
}


class Flown(Protocol):
    """What the summary needs of a run."""

    @property
    def folder(self) -> Path: ...

    @property
    def metrics(self) -> Mapping[str, Any]: ...


class Reporter(LiveBar):
    """Listens to a flight's events and shows them.

    Parameters
    ----------
    quiet : bool
        Show nothing.
    console : rich.console.Console, optional
        Where to write; one on standard error when not given.
    """

    def __init__(self, *, quiet: bool = False, console: Console | None = None) -> None:
        super().__init__(quiet=quiet, console=console)
        note = "compiling the kernels: only the first time, about a minute"
        self._note = threading.Timer(PATIENCE, self._say, [note])
        self._note.daemon = True
        self._noting = False
        self._next = 0.0
        self._next_line = 0.25

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._note.cancel()
        super().__exit__(kind, error, traceback)

    def on_event(self, event: str, **info: Any) -> None:  # noqa: ANN401
        """Show one event of a flight: compiling, tick, rendering or stopped."""
        if event == "tick":
            now = time.monotonic()
            if now >= self._next or info["time"] >= info["duration"]:
                self._next = now + REFRESH
                self._tick(**info)
        elif event == "compiling":
            self._compiling(info["done"], info["total"])
        elif event == "rendering":
            self._show("writing", 1.0, 1.0, info["what"])
            if not self._live:
                self._say(f"writing {info['what']}")
        elif event == "stopped":
            self._say(f"{info['reason']}; the record until then is kept")

    def summarise(self, run: Flown) -> None:
        """Tables of the targets, the aircraft and the team, why unseen, and the list of files."""
        metrics = run.metrics
        self.console.print(
            _table(
                "Targets",
                metrics["targets"],
                {
                    "found at": ("found_at", " s", 0),
                    "in sight": ("visible_fraction", "%", 0),
                    "tracked": ("tracked_fraction", "%", 0),
                    "longest gap": ("longest_gap", " s", 1),
                    "position error": ("position_rmse", " m", 1),
                },
            )
        )
        if reasons := _reasons(metrics["team"]):
            self._say(reasons)
        self.console.print(
            _table(
                "Aircraft",
                metrics["aircraft"],
                {
                    "flown": ("distance", " m", 0),
                    "closest other": ("min_separation", " m", 0),
                    "building strikes": ("building_strikes", "", 0),
                },
            )
        )
        self.console.print(_team(metrics))
        self._list_files(run.folder)

    def _compiling(self, done: int, total: int) -> None:
        if not self._noting:
            self._noting = True
            self._note.start()
        if done == total:
            self._note.cancel()
        self._show("preparing kernels", done, total, f"{done} of {total}")

    def _tick(self, time: float, duration: float, real_time_factor: float) -> None:
        left = (duration - time) / real_time_factor if real_time_factor > 0.0 else math.nan
        text = (
            f"{_clock(time)} of {_clock(duration)} · {_clock(left)} left"
            f" · {real_time_factor:.0f}× real time"
        )
        self._show("flying", time, duration, text)
        if not self._live and time >= self._next_line * duration:
            self._next_line = math.floor(4.0 * time / duration + 1.0) / 4.0
            self._say(f"flying: {text}")

    def _list_files(self, folder: Path) -> None:
        self._say(f"\nfiles in {folder}")
        for file in sorted(folder.iterdir()):
            self._say(f"  {file.name:<14}  {FILES.get(file.name, '')}".rstrip())


def _table(
    title: str, rows: Sequence[Mapping[str, Any]], columns: Mapping[str, tuple[str, str, int]]
) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("#", justify="right")
    for heading in columns:
        table.add_column(heading, justify="right")
    for number, row in enumerate(rows):
        cells = [_cell(row.get(key), unit, digits) for key, unit, digits in columns.values()]
        table.add_row(str(number), *cells)
    return table


def _team(metrics: Mapping[str, Any]) -> Table:
    team = metrics["team"]
    table = Table(title="Team", title_justify="left", box=None, pad_edge=False, show_header=False)
    table.add_column()
    table.add_column(justify="right")
    table.add_row("mean GOSPA", _cell(team.get("gospa_mean"), " m", 1))
    table.add_row("auctions", _cell(team.get("auctions"), "", 0))
    table.add_row("messages sent", _cell(team.get("messages_sent"), "", 0))
    possible = team.get("messages_possible")
    of = "" if possible is None else f" of {possible}"  # each may be heard by several
    table.add_row("messages delivered", _cell(team.get("messages_delivered"), of, 0))
    table.add_row("real-time factor", _cell(metrics.get("real_time_factor"), "×", 0))
    return table


def _reasons(team: Mapping[str, Any]) -> str:
    """How much of the vehicles' time nobody watched, and what it was for the most part."""
    causes: Mapping[str, float] = team.get("unwatched", {})
    unwatched = sum(causes.values())
    total = team.get("watched", 0.0) + unwatched
    if total <= 0.0:
        return ""
    largest = sorted(causes.items(), key=lambda item: -item[1])[:REASONS]
    shares = {name.replace("_", " "): 100.0 * seconds / total for name, seconds in largest}
    named = ", ".join(f"{name} {share:.0f}%" for name, share in shares.items() if share >= 0.5)
    return f"unwatched {100.0 * unwatched / total:.0f}%" + (f": {named}" if named else "")


def _cell(value: float | None, unit: str, digits: int) -> str:
    if value is None:
        return "–"
    return f"{100.0 * value if unit == '%' else value:.{digits}f}{unit}"


def _clock(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "--:--"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes:d}:{rest:02d}"
