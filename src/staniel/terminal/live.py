"""The bar that both reporters redraw on a terminal, and the lines they write elsewhere."""

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

__all__ = ["REFRESH", "LiveBar"]

REFRESH = 0.2
"""Shortest time between two redraws of the bar [s]; a redraw costs about a millisecond."""


class LiveBar:
    """A context in which one bar may be shown; on a console that is no terminal there is none.

    Parameters
    ----------
    quiet : bool
        Show nothing.
    console : rich.console.Console, optional
        Where to write; one on standard error when not given.
    """

    def __init__(self, *, quiet: bool = False, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True, quiet=quiet, highlight=False)
        self._live = self.console.is_terminal and not quiet
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[text]}"),
            console=self.console,
            auto_refresh=False,
            transient=True,
        )
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        if self._live:
            self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._live:
            self._progress.stop()

    def _show(self, what: str, done: float, total: float, text: str) -> None:
        if not self._live:
            return
        if self._task is None:
            self._task = self._progress.add_task(what, text="")
        self._progress.update(
            self._task, description=what, completed=done, total=total, text=text, refresh=True
        )

    def _say(self, text: str) -> None:
        self.console.print(text, markup=False, soft_wrap=True)
