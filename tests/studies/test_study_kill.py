"""Real processes, killed at random: what is resumed is, byte for byte, what nobody disturbed.

``STANIEL_KILLS=20 pytest tests/studies/test_study_kill.py`` kills as often as that.
"""

import os
import random
import signal
import subprocess
import sys
import time

import psutil
import pytest
from small_study import TEXT, written

from staniel.studies import run
from staniel.studies.results import RESULTS

KILLS = int(os.environ.get("STANIEL_KILLS", "2"))


def workers_of(process):
    """The processes that a study started."""
    try:
        return psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def begin(study, out):
    command = [sys.executable, "-m", "staniel", "study", "run", str(study), "--out", str(out)]
    return subprocess.Popen(
        [*command, "--workers", "2", "--quiet"], stderr=subprocess.PIPE, text=True
    )


def flown(out):
    journal = out / "runs.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


@pytest.mark.slow
def test_killed_at_random_and_resumed_it_gives_the_same_bytes(tmp_path):
    text = TEXT.replace("seeds = 2", f"seeds = {4 * KILLS}").replace("0.15", "0.5")
    study = written(tmp_path, text)
    dice, out, kills = random.Random(7), tmp_path / "killed", 0
    while kills < KILLS:
        process = begin(study, out)
        before, wanted = flown(out), dice.randint(1, 3)
        while process.poll() is None and flown(out) < before + wanted:
            time.sleep(0.02)
        if process.poll() is not None:
            process.communicate()
            break  # all is flown
        time.sleep(dice.uniform(0.0, 0.3))
        workers = workers_of(process)
        if workers and dice.random() < 0.5:
            # A worker: the study gets over it, and is killed a little later.
            dice.choice(workers).kill()
            kills += 1
            time.sleep(dice.uniform(0.5, 2.0))
        process.kill()
        kills += 1
        process.communicate(timeout=60)
        _, left = psutil.wait_procs(workers, timeout=20)
        assert not left, "workers outlive the study that was killed"
    assert kills >= KILLS // 2
    ended = begin(study, out)
    assert ended.communicate(timeout=300) is not None
    assert ended.returncode == 0
    run(study, tmp_path / "whole", workers=1)
    assert (out / RESULTS).read_bytes() == (tmp_path / "whole" / RESULTS).read_bytes()


def test_a_worker_that_dies_is_replaced_and_ctrl_c_keeps_everything(tmp_path):
    study = written(tmp_path, TEXT.replace("seeds = 2", "seeds = 200").replace("0.15", "0.5"))
    out = tmp_path / "out"
    process = begin(study, out)
    for wanted in (1, 4):
        while flown(out) < wanted:
            assert process.poll() is None
            time.sleep(0.02)
        if wanted == 1:
            worker = next(w for w in workers_of(process) if "spawn_main" in " ".join(w.cmdline()))
            worker.kill()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130
    kept = flown(out)
    assert kept >= 4
    assert b'"died"' not in (out / "runs.jsonl").read_bytes()
    assert (out / RESULTS).is_file()
