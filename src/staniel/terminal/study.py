"""What a person sees while a study runs and after it: progress with the time left, tables, claims.

Everything goes to standard error while it runs; elsewhere than on a terminal the progress is a line
now and then.
"""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from staniel.terminal.live import REFRESH, LiveBar

__all__ = ["StudyReporter", "print_summary"]

_LINE = 30.0  # between two lines where there is no bar [s]
_MARKS = {"supported": "[green]✓ supported[/]", "contradicted": "[red]✗ contradicted[/]"}


class StudyReporter(LiveBar):
    """Listens to a study's events and shows them.

    Parameters
    ----------
    name : str
        Of the study.
    quiet : bool
        Show nothing.
    console : rich.console.Console, optional
        Where to write; one on standard error when not given.
    """

    def __init__(self, name: str, *, quiet: bool = False, console: Console | None = None) -> None:
        super().__init__(quiet=quiet, console=console)
        self._name = name
        self._counts = (0, 0, 0)
        self._began: tuple[float, int] | None = None
        self._next = 0.0
        self._next_line = 0.0

    def on_event(self, event: str, **info: Any) -> None:  # noqa: ANN401
        """Show one event of a study: compiling, runs, wait or failed."""
        now = time.monotonic()
        if event == "compiling":
            if now >= self._next or info["done"] == info["total"]:
                self._next = now + REFRESH
                self._show("preparing kernels", info["done"], info["total"], "the first time 30 s")
        elif event == "failed":
            outcome = info["outcome"]
            reason = (outcome.error or outcome.died).strip().splitlines()[-1]
            self._say(f"point {outcome.point}, seed {outcome.seed} failed: {reason[:200]}")
        elif event == "runs":
            self._counts = info["done"], info["total"], info["failed"]
            if self._began is None:
                self._began = now, info["done"]
                if info["done"]:
                    self._say(f"{info['done']} of {info['total']} runs are there already")
            self._runs(now)
        elif event == "wait":
            self._runs(now)

    def stopped(self, folder: Path) -> None:
        """Say that it was stopped by hand, and how to go on."""
        done, total, _ = self._counts
        self._say(
            f"stopped by hand: {done} of {total} runs are kept in {folder}; "
            "the same command flies the rest"
        )

    def summarise(self, about: Mapping[str, Any], folder: Path) -> None:
        """Tables of the results, the claims, and where to read more."""
        print_summary(about, self.console)
        self._say(f"\n{folder}: results.parquet; `staniel study report {folder}` draws the report")

    def _runs(self, now: float) -> None:
        done, total, failed = self._counts
        ended = done >= total
        if now < self._next and not ended:
            return
        self._next = now + REFRESH
        text = f"{done} of {total} runs · {self._left(now, done, total)} left"
        if failed:
            text += f" · {failed} failed"
        self._show(self._name, done, total, text)
        if not self._live and (now >= self._next_line or ended):
            self._next_line = now + _LINE
            self._say(f"{self._name}: {text}")

    def _left(self, now: float, done: int, total: int) -> str:
        began, before = self._began or (now, done)
        if done == before:
            return "--:--" if done < total else "0:00"
        seconds = round((total - done) * (now - began) / (done - before))
        hours, rest = divmod(seconds, 3600)
        minutes, rest = divmod(rest, 60)
        return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def print_summary(about: Mapping[str, Any], console: Console) -> None:
    """The results of a study: a table for each metric, and what they say of its claims.

    Parameters
    ----------
    about : mapping
        As `staniel.studies.tables.summary` gives it.
    console : rich.console.Console
    """
    console.print(about["title"] or about["study"], style="bold")
    for metric, heading in about["headings"].items():
        console.print(_table(about["points"], metric, heading))
    for claim in about["claims"]:
        mark = _MARKS.get(claim["answer"], "[yellow]? open[/]")
        console.print(f"{mark}  ", end="")
        found = f"{claim['text']}, expected {claim['expected']}"
        console.print(f"{claim['claim']}: {found}", markup=False, soft_wrap=True)
    if about["failures"]:
        console.print(f"{len(about['failures'])} runs failed; they count nowhere above")


def _table(points: Sequence[Mapping[str, Any]], metric: str, heading: str) -> Table:
    """One metric at every point; where there is a baseline, the difference to it."""
    # As text: a unit in brackets would be taken for a style.
    table = Table(title=Text(f"\n{heading}"), title_justify="left", box=None, pad_edge=False)
    for name in points[0]["levels"] if points else ():
        table.add_column(name, justify="right")
    for name in ("mean and interval", "difference", "runs"):
        table.add_column(name, justify="right")
    for point in points:
        found = point["metrics"][metric]
        change = found["difference"]["text"] if "difference" in found else ""
        table.add_row(*point["levels"].values(), found["text"], change, str(found["n"]))
    return table
