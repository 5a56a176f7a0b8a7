"""Whole studies: the same results whoever flies them, resumed, and with runs that fail."""

import json
import math
import shutil
import subprocess
import sys

import pyarrow.parquet as pq
import pytest
from small_study import TEXT, small

import staniel
from staniel.errors import OutputError, StudyError
from staniel.studies import load_study, read_results, run
from staniel.studies.catalogue import CATALOGUE
from staniel.studies.load import points_of
from staniel.studies.results import RESULTS


def told(events):
    def listen(event, **info):
        if event not in ("wait", "compiling"):
            events.append((event, info))

    return listen


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A study flown by one process, and its table."""
    folder = tmp_path_factory.mktemp("flown")
    study = small(folder)
    return folder / "out", study, run(study, folder / "out", workers=1)


def test_one_row_a_run_and_vehicle_with_everything(flown):
    _, study, table = flown
    rows = table.to_pylist()
    assert [(row["point"], row["aircraft"], row["seed"], row["vehicle"]) for row in rows] == [
        (0, 1.0, 0, 0),
        (0, 1.0, 1, 0),
        (1, 2.0, 0, 0),
        (1, 2.0, 1, 0),
    ]
    assert {row["version"] for row in rows} == {staniel.__version__}
    assert set(CATALOGUE) < set(table.column_names)
    assert study.metrics[0] in CATALOGUE


def test_the_figures_are_those_of_the_flight(flown, tmp_path):
    """What a study says of a run, `staniel.fly` says of the same scenario and seed."""
    _, study, table = flown
    scenario = points_of(study)[1].scenario
    metrics = staniel.fly(scenario, seed=1, out=tmp_path / "run").metrics
    row = table.to_pylist()[-1]
    for name, value in metrics["targets"][0].items():
        if name in CATALOGUE:
            assert row[name] == value, name
    causes = metrics["targets"][0]["unwatched"]
    assert row["watched"] == metrics["targets"][0]["watched"]
    assert {name: row[f"unwatched_{name}"] for name in causes} == causes
    assert row["watched"] + sum(causes.values()) == pytest.approx(metrics["duration"])
    assert row["team_gospa_mean"] == metrics["team"]["gospa_mean"]
    distances = [one["distance"] for one in metrics["aircraft"]]
    assert row["aircraft_distance"] == pytest.approx(math.fsum(distances))
    assert row["aircraft_min_separation"] == metrics["aircraft"][0]["min_separation"]


def test_two_processes_give_the_same_bytes(flown, tmp_path):
    folder, study, _ = flown
    run(study, tmp_path / "two", workers=2)
    assert (tmp_path / "two" / RESULTS).read_bytes() == (folder / RESULTS).read_bytes()


def test_what_is_there_is_not_flown_again(flown, tmp_path):
    folder, study, _ = flown
    events = []

    def stop_after_one(event, **info):
        if event == "runs" and info["done"] == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(study, tmp_path / "again", workers=1, on_event=stop_after_one)
    assert read_results(tmp_path / "again").table.num_rows == 1
    run(study, tmp_path / "again", workers=1, on_event=told(events))
    assert [info["done"] for event, info in events if event == "runs"] == [1, 2, 3, 4]
    assert (tmp_path / "again" / RESULTS).read_bytes() == (folder / RESULTS).read_bytes()


def test_more_seeds_are_added_to_what_is_there(flown, tmp_path):
    _, study, table = flown
    run(study, tmp_path / "more", seeds=1, workers=1)
    events = []
    more = run(study, tmp_path / "more", seeds=2, workers=1, on_event=told(events))
    assert events[0][1]["done"] == 2
    assert more == table


def test_a_folder_of_another_study_is_refused(flown, tmp_path):
    folder, study, _ = flown
    with pytest.raises(StudyError, match=r"holds the runs of another study \(point 0 is another"):
        run(study, folder, minutes=0.2)
    text = TEXT.replace("values = [1, 2]", "values = [1, 2, 3]")
    with pytest.raises(StudyError, match=r"another study \(2 points there, 3 now\)"):
        run(small(tmp_path, text), folder)
    with pytest.raises(StudyError, match=r"holds no study\.json, expected the folder of a study"):
        run(study, tmp_path)
    about = json.loads((folder / "study.json").read_text())
    other = tmp_path / "older"
    other.mkdir()
    (other / "study.json").write_text(json.dumps({**about, "version": "0.0.1"}))
    with pytest.raises(StudyError, match=r"flown by staniel 0\.0\.1, this is .*a new folder"):
        run(study, other)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"study folder .*file: cannot be written"):
        run(study, tmp_path / "file")
    with pytest.raises(StudyError, match=r"workers = 0: expected at least 1"):
        run(study, tmp_path / "none", workers=0)


def test_claims_and_metrics_may_change_without_flying_again(flown):
    folder, study, table = flown
    changed = study.model_copy(update={"metrics": ("found_at",), "claims": ()})
    events = []
    assert run(changed, folder, on_event=told(events)) == table
    assert events == [("runs", {"done": 4, "total": 4, "failed": 0})]
    assert read_results(folder).study.metrics == ("found_at",)
    run(study, folder)


def test_a_run_that_fails_is_recorded_and_stops_nobody(tmp_path):
    """Streets around blocks of this size leave no room to build over four fifths."""
    text = TEXT.replace("aircraft.count", "city.density").replace("[1, 2]", "[0.3, 0.8]")
    text = text.replace("aircraft = 2", "aircraft = 0.3").replace("aircraft = 1", "aircraft = 0.8")
    study = small(tmp_path, text.replace("seeds = 2", "seeds = 1"))
    events = []
    table = run(study, tmp_path / "out", workers=1, on_event=told(events))
    assert table["point"].to_pylist() == [0]
    results = read_results(tmp_path / "out")
    (failure,) = results.failures
    assert (failure["point"], failure["seed"]) == (1, 0)
    assert "city.density: expected what" in failure["error"]
    assert "Traceback" in failure["error"]
    # It would fail again: only who asks for it flies it again.
    events.clear()
    run(study, tmp_path / "out", workers=1, on_event=told(events))
    assert [info["done"] for event, info in events] == [2]
    run(study, tmp_path / "out", workers=1, retry=True, on_event=told(events))
    assert [event for event, _ in events].count("failed") == 1


def test_seeds_are_added_until_the_interval_is_narrow(tmp_path):
    text = TEXT.replace(
        "[settings]",
        '[until]\nmetric = "aircraft_distance"\nhalf_width = 1e-9\nmost = 5\n\n[settings]',
    )
    table = run(small(tmp_path, text), tmp_path / "out", workers=1)
    assert sorted(set(table["seed"].to_pylist())) == [0, 1, 2, 3, 4]
    text = text.replace("1e-9", "1e6").replace("seeds = 2", "seeds = 3")
    table = run(small(tmp_path, text), tmp_path / "wide", workers=1)
    assert sorted(set(table["seed"].to_pylist())) == [0, 1, 2]


def test_a_disk_too_full_for_the_table_leaves_the_journal(flown, tmp_path):
    folder, _, _ = flown
    out = tmp_path / "out"
    shutil.copytree(folder, out)
    (out / RESULTS).unlink()
    program = f"""
import resource, signal, pathlib
from staniel.errors import OutputError
from staniel.studies import load_study
from staniel.studies.journal import Journal
from staniel.studies.load import points_of
from staniel.studies.results import write_table
study = load_study({str(folder.parent / "small.toml")!r})
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
folder = pathlib.Path({str(out)!r})
with Journal(folder) as journal:
    try:
        write_table(folder, study, points_of(study), journal)
    except OutputError as error:
        print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    assert "results.parquet: cannot be written" in done.stdout
    names = {path.name for path in out.iterdir()}
    assert names == {"study.json", "runs.jsonl", "times.jsonl", "failures.json"}
    assert (out / "runs.jsonl").read_bytes() == (folder / "runs.jsonl").read_bytes()
    run(load_study(folder.parent / "small.toml"), out)
    assert (out / RESULTS).read_bytes() == (folder / RESULTS).read_bytes()


def test_damaged_results_are_refused(flown, tmp_path):
    folder, _, _ = flown
    with pytest.raises(StudyError, match=r"holds no study\.json"):
        read_results(tmp_path)
    (tmp_path / "study.json").write_text((folder / "study.json").read_text())
    with pytest.raises(StudyError, match=r"holds no results\.parquet"):
        read_results(tmp_path)
    (tmp_path / RESULTS).write_bytes(b"PAR1nonsense")
    with pytest.raises(StudyError, match=r"cannot be read"):
        read_results(tmp_path)
    (tmp_path / "failures.json").write_text("[]")
    pq.write_table(read_results(folder).table.drop_columns(["longest_gap"]), tmp_path / RESULTS)
    with pytest.raises(StudyError, match=r"not the columns of study 'small'"):
        read_results(tmp_path)
