"""What happens to a run that is stopped, killed, or runs out of disk."""

import json
import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

import staniel
from staniel.errors import OutputError
from staniel.flight import replay
from staniel.recording import read_record

STANIEL = [sys.executable, "-m", "staniel", "fly", "downtown", "--minutes", "600"]


def start(out, *options):
    """Begin a ten-hour mission and wait until some of it is on the disk."""
    process = subprocess.Popen(
        [*STANIEL, "--out", str(out), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        if process.poll() is not None:
            pytest.fail(process.communicate()[1])
        record = Path(out) / "mission.mcap"
        if record.exists() and record.stat().st_size > 2_000_000:
            return process
        time.sleep(0.05)
    process.kill()
    process.communicate()
    pytest.fail("the mission did not start")


def test_a_killed_run_can_be_read_and_replayed(tmp_path):
    process = start(tmp_path / "run")
    process.send_signal(signal.SIGKILL)
    process.communicate()
    flown = len(read_record(tmp_path / "run").times)
    assert flown > 50
    assert not read_record(tmp_path / "run").complete
    run = replay(tmp_path / "run", tmp_path / "again")
    assert run.metrics["duration"] == flown - 1
    assert (tmp_path / "again" / "overview.png").stat().st_size > 10_000


def test_the_last_second_is_on_the_disk_while_it_flies(tmp_path):
    """What the disk holds keeps up with the flight: no second of it waits in memory."""
    process = start(tmp_path / "run")
    try:
        sizes = []
        for _ in range(4):
            sizes.append((tmp_path / "run" / "mission.mcap").stat().st_size)
            time.sleep(1.0)
        assert all(b > a for a, b in pairwise(sizes))
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_run_ends_cleanly_and_keeps_its_record(tmp_path, how):
    process = start(tmp_path / "run", "--json")
    process.send_signal(how)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "Traceback" not in stderr
    metrics = json.loads(stdout)
    assert metrics["complete"] is False
    assert json.loads((tmp_path / "run" / "metrics.json").read_text()) == metrics
    assert len(read_record(tmp_path / "run").times) == metrics["duration"] + 1
    names = sorted(path.name for path in (tmp_path / "run").iterdir())
    assert names == ["metrics.json", "mission.mcap", "overview.png", "scenario.toml"]


FULL_DISK = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))
from staniel.cli import main
sys.argv = ["staniel", "fly", "downtown", "--minutes", "600", "--out", sys.argv[1]]
main()
"""


def test_a_full_disk_is_said_in_one_line_and_what_was_written_is_kept(tmp_path):
    # Compiled kernels are files too: they must be there before the limit holds.
    staniel.fly(staniel.load_scenario("village"), out=tmp_path / "warm")
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(tmp_path / "run")],
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
        env={**os.environ, "COLUMNS": "200"},
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert "mission.mcap" in done.stderr
    assert len(read_record(tmp_path / "run").times) > 50


def test_an_output_folder_that_holds_something_is_refused_untouched(tmp_path):
    (tmp_path / "mine.txt").write_text("keep me")
    with pytest.raises(OutputError, match="not empty"):
        staniel.fly(staniel.load_scenario("village"), out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    with pytest.raises(OutputError, match="is a file"):
        staniel.fly(staniel.load_scenario("village"), out=tmp_path / "mine.txt")
    with pytest.raises(OutputError, match="not writable"):
        staniel.fly(staniel.load_scenario("village"), out="/proc/staniel")
