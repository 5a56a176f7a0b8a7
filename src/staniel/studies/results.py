"""What a study's folder holds, and its journal as one table."""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from staniel._version import __version__
from staniel.errors import OutputError, StudyError
from staniel.studies.catalogue import CATALOGUE
from staniel.studies.journal import Journal
from staniel.studies.load import Point
from staniel.studies.model import Study

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["RESULTS", "Results", "claim_study", "read_results", "write_table"]

STUDY, RESULTS, FAILURES = "study.json", "results.parquet", "failures.json"
_FORMAT: Final = 1
_BATCH: Final = 500
"""Runs that are turned into columns at a time: so much is in memory, however long the study."""


@dataclass(frozen=True)
class Results:
    """A study's folder, read.

    Attributes
    ----------
    folder : Path
    study : Study
    duration : float [s]
        Of each mission, by the point's number.
    table : pyarrow.Table
        One row a run and vehicle, in the order of points, seeds and vehicles: ``point``, a column
        for each factor, ``seed``, ``vehicle``, ``version`` and every metric of
        `staniel.studies.catalogue.CATALOGUE`.
    failures : list of dict
        Runs that failed: ``point``, ``seed``, ``error`` or ``died``.
    version : str
        Of staniel, that flew them.
    """

    folder: Path
    study: Study
    duration: tuple[float, ...]
    table: "pa.Table"
    failures: list[dict[str, Any]]
    version: str


def claim_study(folder: Path, study: Study, points: Sequence[Point]) -> None:
    """Make a study's folder, or see to it that the one that is there belongs to the same study.

    How many seeds, which metrics are shown and what is claimed may change from one call to the
    next; whatever changes the runs may not.

    Raises
    ------
    OutputError
        A folder with other contents, or it cannot be written.
    StudyError
        A folder of another study or of another version of staniel.
    """
    runs = _what_is_flown(study, points)
    about = {
        "format": _FORMAT,
        "version": __version__,
        "study": study.model_dump(mode="json"),
        "durations": [point.scenario.minutes * 60.0 for point in points],
        "runs": runs,
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        before = _read_about(folder) if any(folder.iterdir()) else None
        if before is not None:
            _check_same(folder, before, runs)
        _replace(folder / STUDY, json.dumps(about, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise OutputError(
            f"study folder {folder}: cannot be written ({error.strerror or error})"
        ) from error


def write_table(folder: Path, study: Study, points: Sequence[Point], journal: Journal) -> None:
    """Write what the journal holds as ``results.parquet``, and what failed as ``failures.json``.

    The same runs give the same bytes, whatever the order in which they were flown.

    Raises
    ------
    OutputError
        They cannot be written; the journal still has everything.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = _schema(study)
    partial = folder / (RESULTS + ".part")
    failures: list[dict[str, Any]] = []
    try:
        with pq.ParquetWriter(partial, schema, compression="zstd") as writer:
            for rows in _batches(study, points, journal, failures):
                columns = {name: [row.get(name) for row in rows] for name in schema.names}
                writer.write_table(pa.table(columns, schema=schema))
        partial.replace(folder / RESULTS)
        _replace(folder / FAILURES, json.dumps(failures, indent=1) + "\n")
    except (OSError, pa.ArrowException) as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{folder / RESULTS}: cannot be written ({error})") from error


def read_results(folder: str | os.PathLike[str]) -> Results:
    """Read a study's folder.

    Parameters
    ----------
    folder : path

    Returns
    -------
    Results

    Raises
    ------
    StudyError
        No study, none that has results, or a damaged one.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    place = Path(folder)
    about = _read_about(place)
    file = place / RESULTS
    if not file.is_file():
        raise StudyError(f"{place}: holds no {RESULTS}, expected a study that was run")
    try:
        table = pq.read_table(file)
        failures = json.loads((place / FAILURES).read_text(encoding="utf-8"))
        study = Study.model_validate(about["study"])
    except (OSError, ValueError, pa.ArrowException, ValidationError) as error:
        raise StudyError(f"{place}: cannot be read ({error})") from error
    if table.schema != _schema(study):
        raise StudyError(f"{file}: not the columns of study {study.name!r} of this staniel")
    return Results(place, study, tuple(about["durations"]), table, failures, str(about["version"]))


def _schema(study: Study) -> "pa.Schema":
    import pyarrow as pa

    factors = [
        (factor.name, pa.float64() if factor.numeric else pa.string()) for factor in study.factors
    ]
    return pa.schema(
        [
            ("point", pa.int32()),
            *factors,
            ("seed", pa.int64()),
            ("vehicle", pa.int32()),
            ("version", pa.string()),
            *((name, pa.float64()) for name in CATALOGUE),
        ]
    )


def _batches(
    study: Study, points: Sequence[Point], journal: Journal, failures: list[dict[str, Any]]
) -> Iterator[list[dict[str, Any]]]:
    """Rows of a few hundred runs at a time; what failed goes into `failures` instead."""
    heads = []
    for point in points:
        head: dict[str, Any] = {"point": point.number, "version": __version__}
        for factor, level in zip(study.factors, point.levels, strict=True):
            head[factor.name] = level.x if factor.numeric else level.label
        heads.append(head)
    entries = journal.entries()
    while batch := list(islice(entries, _BATCH)):
        rows = []
        for entry in batch:
            if "rows" not in entry:
                failures.append(entry)
                continue
            head = {**heads[entry["point"]], "seed": entry["seed"]}
            rows += [{**head, **row} for row in entry["rows"]]
        if rows:
            yield rows


def _what_is_flown(study: Study, points: Sequence[Point]) -> dict[str, Any]:
    """All that determines the runs: to be compared, so scenarios by their fingerprint."""
    named = []
    for point in points:
        scenario = point.scenario.model_dump(mode="json", exclude={"seed"})
        text = json.dumps(scenario, sort_keys=True)
        levels = {
            factor.name: level.label
            for factor, level in zip(study.factors, point.levels, strict=True)
        }
        named.append({"levels": levels, "scenario": hashlib.sha256(text.encode()).hexdigest()})
    return {"first_seed": study.first_seed, "points": named}


def _check_same(folder: Path, before: Mapping[str, Any], runs: Mapping[str, Any]) -> None:
    if before["version"] != __version__:
        raise StudyError(
            f"study folder {folder}: flown by staniel {before['version']}, this is {__version__}; "
            "expected a new folder, for runs of two versions are not one study"
        )
    if before["runs"] != runs:
        old, new = before["runs"].get("points", []), runs["points"]
        changed = [n for n, pair in enumerate(zip(old, new, strict=False)) if pair[0] != pair[1]]
        what = (
            f"{len(old)} points there, {len(new)} now"
            if len(old) != len(new)
            else f"point {changed[0]} is another one now"
            if changed
            else "other seeds"
        )
        raise StudyError(
            f"study folder {folder}: holds the runs of another study ({what}); "
            "expected a new or empty folder, or the study that was begun there"
        )


def _read_about(folder: Path) -> dict[str, Any]:
    file = folder / STUDY
    try:
        about = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise StudyError(
            f"{folder}: holds no {STUDY}, expected the folder of a study, or a new or empty one"
        ) from None
    except (OSError, ValueError) as error:
        raise StudyError(f"{file}: cannot be read ({error})") from error
    keys = {"format", "version", "study", "durations", "runs"}
    if not isinstance(about, dict) or not keys <= set(about) or about["format"] != _FORMAT:
        raise StudyError(f"{file}: not a study of this staniel's format {_FORMAT}")
    return about


def _replace(path: Path, text: str) -> None:
    """Write the whole file or leave the old one."""
    partial = path.with_name(path.name + ".part")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise
