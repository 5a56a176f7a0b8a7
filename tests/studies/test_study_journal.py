"""The journal: whatever is cut off it, what was whole is still there."""

import json
import subprocess
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from staniel.errors import OutputError, RecordError
from staniel.studies.journal import RUNS, Journal
from staniel.studies.mission import Outcome


def outcome(point, seed, **more):
    return Outcome(point, seed, rows=[{"vehicle": 0, "longest_gap": 0.1 * seed}], **more)


def test_entries_come_in_the_order_of_points_and_seeds(tmp_path):
    with Journal(tmp_path) as journal:
        for point, seed in [(1, 5), (0, 9), (1, 2), (0, 3)]:
            journal.add(outcome(point, seed))
        before = list(journal.entries())
    with Journal(tmp_path) as journal:
        assert list(journal.entries()) == before
        assert [(entry["point"], entry["seed"]) for entry in before] == [
            (0, 3),
            (0, 9),
            (1, 2),
            (1, 5),
        ]
        assert before[0]["rows"] == outcome(0, 3).rows


def test_what_it_cost_is_elsewhere(tmp_path):
    with Journal(tmp_path) as journal:
        journal.add(outcome(0, 1, seconds=3.5, where="here"))
    assert "here" not in (tmp_path / RUNS).read_text()
    assert json.loads((tmp_path / "times.jsonl").read_text())["seconds"] == 3.5


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cut=st.integers(0, 400))
def test_a_torn_end_is_cut_off_and_the_rest_is_there(tmp_path, cut):
    file = tmp_path / RUNS
    file.unlink(missing_ok=True)
    with Journal(tmp_path) as journal:
        for seed in range(4):
            journal.add(outcome(0, seed))
    data = file.read_bytes()
    assert len(data) < 400
    file.write_bytes(data[:cut])
    whole = data[:cut].count(b"\n")
    with Journal(tmp_path) as journal:
        assert sorted(journal.done) == [(0, seed) for seed in range(whole)]
        journal.add(outcome(0, 7))
    with Journal(tmp_path) as journal:
        assert [entry["seed"] for entry in journal.entries()] == [*range(whole), 7]


@pytest.mark.parametrize("line", ["{}", "[]", '{"point": "0", "seed": 1, "rows": []}', "\x00\x00"])
def test_a_damaged_line_before_the_last_is_named(tmp_path, line):
    with Journal(tmp_path) as journal:
        journal.add(outcome(0, 0))
    with (tmp_path / RUNS).open("a") as file:
        file.write(line + '\n{"point": 0, "seed": 2, "rows": []}\n')
    with pytest.raises(RecordError, match=r"runs\.jsonl, line 2: not a run of a study"):
        Journal(tmp_path)


def test_one_at_a_time(tmp_path):
    with Journal(tmp_path), pytest.raises(OutputError, match="another process is working on"):
        Journal(tmp_path)
    Journal(tmp_path).close()


def test_failures_are_remembered_and_can_be_forgotten(tmp_path):
    with Journal(tmp_path) as journal:
        journal.add(Outcome(0, 0, error="Traceback\nOops"))
        journal.add(Outcome(0, 1, died="killed"))
        journal.add(outcome(0, 2))
    with Journal(tmp_path) as journal:
        assert (journal.failed, journal.died) == ({(0, 0)}, {(0, 1)})
        journal.forget(journal.failed | journal.died)
        assert set(journal.done) == {(0, 2)}
        journal.add(outcome(0, 0))
    with Journal(tmp_path) as journal:
        assert not journal.failed
        assert (0, 0) in journal.done


def test_a_full_disk_loses_nothing(tmp_path):
    """Files may grow to 2000 bytes in this process: as on a full disk, a write stops half-way."""
    program = f"""
import resource, signal
from staniel.errors import OutputError
from staniel.studies.journal import Journal
from staniel.studies.mission import Outcome
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
with Journal(__import__("pathlib").Path({str(tmp_path)!r})) as journal:
    for seed in range(100):
        try:
            journal.add(Outcome(0, seed, rows=[{{"vehicle": 0, "longest_gap": 1.5}}]))
        except OutputError as error:
            print(seed, error)
            break
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    count, message = done.stdout.split(" ", 1)
    assert f"cannot be written (No space left on device); {count} runs are kept" in message
    assert int(count) > 10
    with Journal(tmp_path) as journal:
        assert len(journal.done) == int(count)
