"""One run of a study, wherever it is flown: a scenario and a seed in, figures out."""

import os
import tempfile
import time
import traceback
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from staniel._version import __version__
from staniel.errors import OutputError
from staniel.kernels.warm import warm_all
from staniel.metrics import compute_metrics
from staniel.recording import Recorder, read_record
from staniel.scenario import Scenario, build_city
from staniel.scenario.assemble import assemble, kernels_of
from staniel.studies.catalogue import figures

__all__ = ["Outcome", "Task", "fly_task"]

Row = dict[str, float | int | None]

_warm: set[str] = set()
"""Kernels that this process has warmed beside those of every mission."""


@dataclass(frozen=True, slots=True)
class Task:
    """One run to be flown.

    Attributes
    ----------
    point, seed : int
    scenario : Scenario
        Of the point; its own seed does not count.
    modules : tuple of str
        Python modules to import before, such as one that registers a pursuit policy.
    """

    point: int
    seed: int
    scenario: Scenario
    modules: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a task.

    Attributes
    ----------
    point, seed : int
    rows : list of dict
        See `staniel.studies.catalogue.figures`; none of a run that failed.
    error : str
        Traceback of a run that failed, else empty.
    died : str
        Why a run was given up whose worker died again and again, else empty.
    seconds : float
        Processor time, compiling not counted.
    where : str
        Host and process.
    """

    point: int
    seed: int
    rows: list[Row] = field(default_factory=list)
    error: str = ""
    died: str = ""
    seconds: float = 0.0
    where: str = ""


def fly_task(task: Task) -> Outcome:
    """Fly one run and measure it; an error of any kind is part of the outcome.

    The figures come from a record on the disk, as those of `staniel.fly` do; the record is not
    kept.

    Parameters
    ----------
    task : Task

    Returns
    -------
    Outcome
    """
    where = f"{os.uname().nodename}:{os.getpid()}" if hasattr(os, "uname") else str(os.getpid())
    started = time.process_time()
    try:
        for module in task.modules:
            import_module(module)
        _prepare(task.scenario)
        started = time.process_time()
        rows = _fly(task.scenario.model_copy(update={"seed": task.seed}))
    except Exception:
        error = traceback.format_exc(limit=20)
        spent = time.process_time() - started
        return Outcome(task.point, task.seed, error=error, seconds=spent, where=where)
    spent = time.process_time() - started
    return Outcome(task.point, task.seed, rows, seconds=spent, where=where)


def _prepare(scenario: Scenario) -> None:
    """Warm the kernels that this process has not warmed yet."""
    needed = {"", *kernels_of(scenario)}
    if not needed <= _warm:
        warm_all(lambda done, total: None, kernels_of(scenario))
        _warm.update(needed)


def _fly(scenario: Scenario) -> list[Row]:
    city = build_city(scenario.city, scenario.seed)
    mission = assemble(scenario, city)
    with tempfile.TemporaryDirectory(prefix="staniel-") as folder:
        file = Path(folder) / "mission.mcap"
        with Recorder(
            file,
            scenario=scenario.model_dump(mode="json"),
            version=__version__,
            city=city,
            clock=scenario.clock,
            lean=True,
        ) as recorder:
            for frame in mission.frames():
                recorder.write(frame)
            recorder.finish(complete=True)
        record = read_record(file)
    if not record.complete:
        raise OutputError(f"the record of seed {scenario.seed} is not complete")
    return figures(compute_metrics(record))
