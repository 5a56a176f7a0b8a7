"""Fly a scenario into a run folder, and read one back: record, metrics, pictures."""

import json
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from staniel._version import __version__
from staniel.errors import OutputError, ScenarioError
from staniel.kernels.warm import warm_all
from staniel.metrics import compute_metrics
from staniel.mission import Mission
from staniel.record import Record
from staniel.recording import Recorder, read_record, tracks_table, truth_table
from staniel.scenario import Scenario, build_city, dump_scenario, load_scenario
from staniel.scenario.assemble import assemble, kernels_of

__all__ = ["Run", "fly", "replay"]

RECORD, SCENARIO, METRICS = "mission.mcap", "scenario.toml", "metrics.json"
OVERVIEW, MOVIE = "overview.png", "mission.gif"

Listener = Callable[..., None]
"""``on_event(event, **info)``: "compiling" (done, total), "tick" (time, duration,
real_time_factor), "rendering" (what), "stopped" (reason)."""


@dataclass(frozen=True)
class Run:
    """One mission's folder and what is in it.

    Attributes
    ----------
    folder : Path
    metrics : dict
        The contents of ``metrics.json``.
    interrupted : bool
        True when a person stopped it before its end.
    """

    folder: Path
    metrics: dict[str, Any]
    interrupted: bool = False
    _record: list[Record] = field(default_factory=list, repr=False)

    @property
    def record(self) -> Record:
        """Everything that was recorded, read when first asked for."""
        if not self._record:
            self._record.append(read_record(self.folder / RECORD))
        return self._record[0]

    @cached_property
    def truth(self) -> NDArray[np.void]:
        """True poses of all aircraft and vehicles: a structured array, see ``docs/record.md``."""
        return truth_table(self.record)

    @cached_property
    def tracks(self) -> NDArray[np.void]:
        """Every agent's track estimates: a structured array, see ``docs/record.md``."""
        return tracks_table(self.record)


def fly(
    scenario: Scenario | str | Path,
    seed: int | None = None,
    out: str | Path | None = None,
    *,
    movie: bool = False,
    on_event: Listener | None = None,
) -> Run:
    """Fly a scenario from its start to its end and leave a run folder.

    Parameters
    ----------
    scenario : Scenario, str or path
        From `staniel.load_scenario`, or what it takes: a packaged name or a TOML file.
    seed : int, optional
        Of everything random; the scenario's own when not given.
    out : path, optional
        Folder to write, new or empty; a new temporary one when not given.
    movie : bool, optional
        Draw ``mission.gif`` too.
    on_event : callable, optional
        Told how it goes, see `Listener`.

    Returns
    -------
    Run
        A Ctrl-C ends the mission early; the run then holds what was flown.

    Raises
    ------
    ScenarioError, CityError
        The scenario cannot be flown.
    OutputError
        The folder is not empty or not writable, or the disk is full. What was recorded is kept.
    """
    tell = on_event or _silent
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if seed is not None:
        scenario = _reseeded(scenario, seed)
    if out is not None:
        check_folder(Path(out))  # A refusal should not have to wait for the kernels.
    city = build_city(scenario.city, scenario.seed)
    warm_all(lambda done, total: tell("compiling", done=done, total=total), kernels_of(scenario))
    mission = assemble(scenario, city)
    folder = claim_folder(out)
    _write_text(folder / SCENARIO, dump_scenario(scenario, __version__))
    with Recorder(
        folder / RECORD,
        scenario=scenario.model_dump(mode="json"),
        version=__version__,
        city=city,
        clock=scenario.clock,
    ) as recorder:
        complete, factor = _fly_and_record(mission, recorder, scenario, tell)
        recorder.finish(complete)
    metrics = _render(read_record(folder / RECORD), folder, factor, movie, tell)
    return Run(folder, metrics, interrupted=not complete)


def replay(
    run: str | Path,
    out: str | Path | None = None,
    *,
    movie: bool = False,
    on_event: Listener | None = None,
) -> Run:
    """Metrics and pictures anew, from the record of a run alone.

    Parameters
    ----------
    run : path
        A run folder, or an ``.mcap`` file.
    out : path, optional
        Folder to write to; the run's own when not given.
    movie, on_event
        As in `fly`.

    Returns
    -------
    Run

    Raises
    ------
    RecordError
        There is no record, or it cannot be read.
    OutputError
        The folder cannot be written.
    """
    record = read_record(Path(run))
    source = Path(run) if Path(run).is_dir() else Path(run).parent
    folder = source if out is None else claim_folder(out)
    metrics = _render(record, folder, _old_factor(source), movie, on_event or _silent)
    return Run(folder, metrics, interrupted=not record.complete, _record=[record])


def claim_folder(out: str | Path | None) -> Path:
    """Make the folder that results go to; refuse one that holds something or cannot be written."""
    if out is None:
        return Path(tempfile.mkdtemp(prefix="staniel-"))
    folder = Path(out)
    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(
            f"output folder {folder}: not writable ({error.strerror or error}); "
            "expected a folder that can be created or written"
        ) from error
    return folder


def check_folder(folder: Path) -> None:
    """Refuse an output folder that is a file or holds something already."""
    if folder.is_dir():
        if any(folder.iterdir()):
            raise OutputError(f"output folder {folder}: not empty; expected a new or empty folder")
    elif folder.exists():
        raise OutputError(f"output folder {folder}: is a file; expected a new or empty folder")


def _fly_and_record(
    mission: Mission, recorder: Recorder, scenario: Scenario, tell: Listener
) -> tuple[bool, float]:
    """The mission's ticks into the record: was it flown to its end, and how fast."""
    duration = mission.ticks * scenario.clock.decision_step
    started, flown, factor = math.nan, 0.0, 0.0
    try:
        for frame in mission.frames():
            recorder.write(frame)
            if math.isnan(started):  # The first frame is the start itself: nothing has moved yet.
                started = time.perf_counter()
                continue
            flown = frame.truth.time
            factor = flown / (time.perf_counter() - started)
            tell("tick", time=flown, duration=duration, real_time_factor=factor)
    except (KeyboardInterrupt, SystemError) as stop:
        if isinstance(stop, SystemError) and not isinstance(stop.__cause__, KeyboardInterrupt):
            raise  # A Ctrl-C while a kernel is being called arrives wrapped in a SystemError.
        tell("stopped", reason=f"stopped by hand after {flown:.0f} s of {duration:.0f} s")
        return False, factor
    return True, factor


def _reseeded(scenario: Scenario, seed: int) -> Scenario:
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**63:
        raise ScenarioError(f"seed = {seed!r}: expected a whole number from 0 to 2^63 - 1")
    return scenario.model_copy(update={"seed": seed})


def _render(
    record: Record, folder: Path, factor: float | None, movie: bool, tell: Listener
) -> dict[str, Any]:
    tell("rendering", what=METRICS)
    metrics = compute_metrics(record)
    metrics["real_time_factor"] = None if factor is None else round(factor, 1)
    _write_text(folder / METRICS, json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    from staniel.pictures import draw_movie, draw_overview  # only now: it loads matplotlib

    tell("rendering", what=OVERVIEW)
    draw_overview(record, folder / OVERVIEW)
    if movie:
        tell("rendering", what=MOVIE)
        draw_movie(record, folder / MOVIE)
    return metrics


def _old_factor(folder: Path) -> float | None:
    """Real-time factor of the flight itself, where its metrics are still there."""
    try:
        factor = json.loads((folder / METRICS).read_text(encoding="utf-8"))["real_time_factor"]
        return float(factor)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _write_text(path: Path, text: str) -> None:
    """Write the whole file or leave nothing of it."""
    partial = path.with_name(path.name + ".part")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from error


def _silent(event: str, **info: Any) -> None:  # noqa: ANN401 - whatever the event carries
    """Report nothing."""
