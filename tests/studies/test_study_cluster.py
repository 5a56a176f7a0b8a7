"""A real Dask scheduler with two worker processes on the loopback gives the same bytes."""

import re
import subprocess
import sys
import time

import pytest
from small_study import TEXT, small

from staniel.errors import StudyError
from staniel.studies import run, workers
from staniel.studies.results import RESULTS

pytest.importorskip("distributed", reason="needs the extra `cluster`")

START = [sys.executable, "-W", "ignore", "-m"]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Address of a scheduler without workers, and a function that starts one."""
    folder = tmp_path_factory.mktemp("dask")
    log = folder / "scheduler.log"
    processes = []

    def start(name, *arguments):
        with (folder / f"{name}.log").open("w") as file:
            command = [*START, "distributed.cli." + arguments[0], *arguments[1:]]
            processes.append(
                subprocess.Popen(command, cwd=folder, stdout=file, stderr=subprocess.STDOUT)
            )
        return processes[-1]

    start("scheduler", "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    address = None
    for _ in range(600):
        found = re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text())
        if found:
            address = found[0]
            break
        time.sleep(0.1)
    assert address, log.read_text()

    def worker(name):
        return start(
            name, "dask_worker", address, "--host", "127.0.0.1", "--nthreads", "1",
            "--no-dashboard", "--no-nanny", "--name", name,
        )  # fmt: skip

    yield address, worker
    for process in reversed(processes):
        process.kill()
        process.wait(timeout=30)


@pytest.mark.slow
def test_a_cluster_gives_the_same_bytes_as_one_process(scheduler, tmp_path):
    address, worker = scheduler
    study = small(tmp_path, TEXT.replace("seeds = 2", "seeds = 4"))
    with pytest.raises(StudyError, match=r"it has no workers, expected some"):
        run(study, tmp_path / "none", scheduler=address)
    crew = [worker("one"), worker("two")]
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    run(study, tmp_path / "many", scheduler=address)
    run(study, tmp_path / "one", workers=1)
    assert (tmp_path / "many" / RESULTS).read_bytes() == (tmp_path / "one" / RESULTS).read_bytes()
    places = re.findall(r'"where":"[^"]*:(\d+)"', (tmp_path / "many" / "times.jsonl").read_text())
    assert set(places) == {str(process.pid) for process in crew}


def test_nobody_there(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "CONNECT_WITHIN", 1)
    with pytest.raises(StudyError, match=r"scheduler tcp://127\.0\.0\.1:9: cannot be reached"):
        run(small(tmp_path), tmp_path / "out", scheduler="tcp://127.0.0.1:9")
    with pytest.raises(StudyError, match=r"scheduler nonsense://x: cannot be reached"):
        run(small(tmp_path), tmp_path / "out", scheduler="nonsense://x")
