"""Run a study: what is missing is flown, everything is kept, the rest is arithmetic."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from staniel.errors import StudyError
from staniel.kernels.warm import warm_all
from staniel.scenario.assemble import kernels_of
from staniel.studies.execute import execute
from staniel.studies.journal import Journal
from staniel.studies.load import Point, load_study, points_of
from staniel.studies.mission import Outcome, Task
from staniel.studies.model import Study
from staniel.studies.results import claim_study, read_results, write_table
from staniel.studies.workers import Cluster, Processes, Workers

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["run"]

Listener = Callable[..., None]
"""``on_event(event, **info)``: "compiling" (done, total), "runs" (done, total, failed), "wait",
"failed" (outcome), "stopped"."""


def run(
    study: Study | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    seeds: int | None = None,
    minutes: float | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    modules: Sequence[str] = (),
    retry: bool = False,
    on_event: Listener | None = None,
) -> "pa.Table":
    """Fly what is missing of a study, and return all of its results.

    Parameters
    ----------
    study : Study, str or path
        From `load_study`, or what it takes: a packaged name or number, or a TOML file.
    out : path, optional
        Folder of the study; ``studies/<name>`` when not given. What is there already of the same
        study is kept, and only the rest is flown.
    seeds : int, optional
        Instead of the study's number.
    minutes : float, optional
        Mission time, instead of the scenario's.
    workers : int, optional
        Processes; as many as there are cores when not given.
    scheduler : str, optional
        Address of a Dask scheduler whose workers fly the runs instead.
    modules : sequence of str, optional
        Python modules that every worker imports first, such as one that registers a pursuit policy.
    retry : bool, optional
        Fly runs again that failed with an error.
    on_event : callable, optional
        Told how it goes, see `Listener`. What it raises stops the study; everything is kept.

    Returns
    -------
    pyarrow.Table
        See `staniel.studies.Results`.

    Raises
    ------
    ScenarioError
        The study or one of its scenarios is not one.
    StudyError
        The folder is another study's, the workers cannot be had, or too few workers are asked for.
    OutputError
        The folder cannot be written, or the disk is full: what was flown is kept.

    Notes
    -----
    A script that calls this with processes needs ``if __name__ == "__main__":`` around the call,
    since every process imports the script anew.
    """
    tell = on_event or _silent
    if not isinstance(study, Study):
        study = load_study(study)
    if seeds is not None:
        study = Study.model_validate({**study.model_dump(), "seeds": seeds})
    if workers is not None and workers < 1:
        raise StudyError(f"workers = {workers}: expected at least 1")
    points = points_of(study, minutes)
    folder = Path("studies", study.name) if out is None else Path(out)
    crew: Workers = Cluster(scheduler) if scheduler else Processes(workers)
    try:
        claim_study(folder, study, points)
        with Journal(folder) as journal:
            journal.forget(journal.died | (journal.failed if retry else set()))
            try:
                if not scheduler:
                    # Once, here: or every worker would compile the same kernels at the same time.
                    _warm(points, tell)
                _fly_missing(study, points, journal, crew, modules, tell)
            finally:
                write_table(folder, study, points, journal)
    finally:
        crew.stop()
    return read_results(folder).table


def _fly_missing(
    study: Study,
    points: Sequence[Point],
    journal: Journal,
    crew: Workers,
    modules: Sequence[str],
    tell: Listener,
) -> None:
    """Fly the study's seeds, and more of them as long as an interval is too wide."""
    count = study.seeds
    while True:
        wanted = [
            Task(point.number, study.first_seed + k, point.scenario, tuple(modules))
            for k in range(count)
            for point in points
        ]
        missing = [task for task in wanted if (task.point, task.seed) not in journal.done]
        progress = _Progress(len(wanted), len(wanted) - len(missing), tell)
        execute(missing, crew, journal, progress)
        if study.until is None or count >= study.until.most:
            return
        from staniel.studies.statistics import narrow_enough

        if narrow_enough(study, points, journal, count):
            return
        count = min(count + study.seeds, study.until.most)


class _Progress:
    """Turns what the execution tells into what a listener is told."""

    def __init__(self, total: int, done: int, tell: Listener) -> None:
        self._total, self._done, self._failed, self._tell = total, done, 0, tell
        tell("runs", done=done, total=total, failed=0)

    def __call__(self, event: str, outcome: Outcome | None = None) -> None:
        if outcome is None:
            self._tell(event)
            return
        self._done += 1
        if outcome.error or outcome.died:
            self._failed += 1
            self._tell("failed", outcome=outcome)
        self._tell("runs", done=self._done, total=self._total, failed=self._failed)


def _warm(points: Sequence[Point], tell: Listener) -> None:
    names = sorted({name for point in points for name in kernels_of(point.scenario)})
    warm_all(lambda done, total: tell("compiling", done=done, total=total), names)


def _silent(event: str, **info: Any) -> None:  # noqa: ANN401 - whatever the event carries
    """Report nothing."""
