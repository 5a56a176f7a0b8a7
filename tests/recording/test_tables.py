"""The tables against the record they come from, read back by other libraries."""

import csv
import sys

import numpy as np
import pytest
import synthetic_run

from staniel.city import City
from staniel.errors import OutputError
from staniel.recording import Recorder, export, read_record, tracks_table, truth_table

NAMES = ["truth", "sightings", "threats", "tracks", "messages", "awards", "commands", "decisions"]


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    city = City.open((300.0, 300.0))
    file = tmp_path_factory.mktemp("tables") / "mission.mcap"
    with Recorder(file, scenario={}, version="1", city=city, clock=synthetic_run.CLOCK) as recorder:
        for frame in synthetic_run.frames(city, 30, aircraft=3, vehicles=2):
            recorder.write(frame)
    return read_record(file)


def test_truth_table_has_a_row_a_machine_and_tick(record):
    table = truth_table(record)
    assert len(table) == 30 * (3 + 2)
    row = table[(table["kind"] == "aircraft") & (table["id"] == 2) & (table["time"] == 7.0)][0]
    assert row.tolist()[3:] == tuple(record.aircraft[6, 2])
    row = table[(table["kind"] == "vehicle") & (table["id"] == 1) & (table["time"] == 30.0)][0]
    x, y, heading, speed = record.vehicles[29, 1]
    assert row.tolist()[3:] == (x, y, 0.0, heading, 0.0, speed)
    assert (np.diff(table["time"]) >= 0.0).all()


def test_tracks_table_is_a_copy(record):
    table = tracks_table(record)
    assert np.array_equal(table, record.tracks)
    assert not np.shares_memory(table, record.tracks)


def same(cell, value):
    if isinstance(value, float):
        return cell == "" if np.isnan(value) else float(cell) == value
    return cell == str(value)


def test_csv_says_what_the_record_says(record, tmp_path):
    files = export(record, tmp_path / "csv", "csv")
    assert [file.name for file in files] == [f"{name}.csv" for name in NAMES]
    for file in files:
        table = truth_table(record) if file.stem == "truth" else getattr(record, file.stem)
        with file.open(newline="") as stream:
            header, *rows = csv.reader(stream)
        assert header == list(table.dtype.names)
        assert len(rows) == len(table)
        for cells, row in zip(rows, table.tolist(), strict=True):
            assert all(map(same, cells, row))


def test_parquet_says_what_the_record_says(record, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    files = export(record, tmp_path / "parquet", "parquet")
    assert [file.name for file in files] == [f"{name}.parquet" for name in NAMES]
    for file in files:
        table = truth_table(record) if file.stem == "truth" else getattr(record, file.stem)
        back = parquet.read_table(file)
        assert back.column_names == list(table.dtype.names)
        for name in table.dtype.names:
            column = np.array(back[name].to_pylist())
            wanted = table[name]
            equal = wanted.dtype.kind == "f"
            assert np.array_equal(column, wanted, equal_nan=equal)


def test_parquet_without_pyarrow_is_refused_before_anything_is_made(record, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(OutputError, match="pyarrow"):
        export(record, tmp_path / "none", "parquet")
    assert not (tmp_path / "none").exists()


def test_a_folder_in_use_is_refused(record, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty"):
        export(record, tmp_path, "csv")
    with pytest.raises(OutputError, match="cannot be written"):
        export(record, tmp_path / "mine.txt", "csv")
    with pytest.raises(OutputError, match="expected 'csv' or 'parquet'"):
        export(record, tmp_path / "new", "xlsx")
