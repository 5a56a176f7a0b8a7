"""A record as tables: one row a fact, for a notebook, a spreadsheet or a database."""

import csv
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from staniel.errors import OutputError
from staniel.record import Record

__all__ = ["TRUTH_DTYPE", "export", "tracks_table", "truth_table"]

TRUTH_DTYPE: Final = np.dtype(
    [
        *[("time", "f8"), ("kind", "U8"), ("id", "i4"), ("x", "f8"), ("y", "f8"), ("z", "f8")],
        *[("heading", "f8"), ("bank", "f8"), ("speed", "f8")],
    ]
)


def truth_table(record: Record) -> NDArray[np.void]:
    """Tabulate what was so at each decision instant.

    Parameters
    ----------
    record : Record

    Returns
    -------
    (n,) structured array
        Columns ``time`` [s], ``kind`` (``"aircraft"`` or ``"vehicle"``), ``id``, ``x``, ``y``,
        ``z`` [m], ``heading``, ``bank`` [rad], ``speed`` [m/s]; in the order of time, aircraft
        before vehicles, then by id. A vehicle has ``z`` and ``bank`` 0.
    """
    ticks, n_aircraft = record.aircraft.shape[:2]
    n_vehicles = record.vehicles.shape[1]
    table = np.zeros((ticks, n_aircraft + n_vehicles), dtype=TRUTH_DTYPE)
    table["time"] = record.times[:, None]
    table["kind"] = np.repeat(["aircraft", "vehicle"], [n_aircraft, n_vehicles])
    table["id"] = np.concatenate([np.arange(n_aircraft), np.arange(n_vehicles)])
    aircraft, vehicles = table[:, :n_aircraft], table[:, n_aircraft:]
    for column, name in enumerate(("x", "y", "z", "heading", "bank", "speed")):
        aircraft[name] = record.aircraft[:, :, column]
    for column, name in enumerate(("x", "y", "heading", "speed")):
        vehicles[name] = record.vehicles[:, :, column]
    return table.reshape(-1)


def tracks_table(record: Record) -> NDArray[np.void]:
    """Tabulate what the agents believed.

    Returns
    -------
    (n,) structured array
        Columns of `staniel.record.TRACK_DTYPE`, in the order of time; a copy.
    """
    return record.tracks.copy()


def export(
    record: Record, folder: str | os.PathLike[str], format: Literal["csv", "parquet"]
) -> list[Path]:
    """Write a record's tables, one file each.

    Truth, sightings, threats, tracks, messages, awards, commands and decisions.

    Parameters
    ----------
    record : Record
    folder : path
        New or empty; made where it is missing.
    format : {"csv", "parquet"}
        In CSV a missing number is an empty cell, in Parquet it is NaN.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    OutputError
        The folder is not empty or cannot be written, an unknown format, or Parquet without pyarrow.
    """
    if format not in ("csv", "parquet"):
        raise OutputError(f"format = {format!r}: expected 'csv' or 'parquet'")
    if format == "parquet":
        _require_pyarrow()
    target = Path(folder)
    files = []
    try:
        target.mkdir(parents=True, exist_ok=True)
        if any(target.iterdir()):
            raise OutputError(f"{target}: is not empty, expected a new or an empty folder")
        for name, table in _tables(record).items():
            files.append(target / f"{name}.{format}")
            (_write_csv if format == "csv" else _write_parquet)(table, files[-1])
    except OSError as error:
        raise OutputError(f"{target}: cannot be written ({error.strerror or error})") from error
    return files


def _tables(record: Record) -> Mapping[str, NDArray[np.void]]:
    return {
        "truth": truth_table(record),
        "sightings": record.sightings,
        "threats": record.threats,
        "tracks": record.tracks,
        "messages": record.messages,
        "awards": record.awards,
        "commands": record.commands,
        "decisions": record.decisions,
    }


def _columns(table: NDArray[np.void]) -> dict[str, NDArray[np.generic]]:
    return {name: np.ascontiguousarray(table[name]) for name in table.dtype.names or ()}


def _write_csv(table: NDArray[np.void], path: Path) -> None:
    columns = _columns(table)
    cells = []
    for values in columns.values():
        column = values.tolist()
        if values.dtype.kind == "f":
            column = ["" if value != value else value for value in column]
        cells.append(column)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))


def _require_pyarrow() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise OutputError(
            "Parquet needs pyarrow, which is not installed: pip install 'staniel[studies]', "
            "or export CSV"
        ) from error


def _write_parquet(table: NDArray[np.void], path: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(_columns(table)), path)
