"""After `warm_all` nothing compiles, in flight or after it: no kernel meets a type new to it."""

import importlib
import os
import pkgutil
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

import staniel.kernels
from staniel.kernels.warm import warm_all
from staniel.metrics import compute_metrics
from staniel.recording import Recorder, read_record
from staniel.scenario import build_city, load_scenario
from staniel.scenario.assemble import assemble, kernels_of

HIDDEN = {"kind": "no-fly", "center": [300.0, 300.0], "radius": 90.0, "briefed": False}
DANGERS = {
    "regions": [HIDDEN],
    "carried": {"radius": 120.0, "rate": 0.1, "briefed": True},
    "sensor": {"range": 150.0, "needs_sight": True},
}
EXTRAS = {
    "plain": {},
    "gusts": {"wind": {"gusts": True}},
    "lidar": {"lidar": {"mount": "scanner"}},
    "gimbal": {"camera": {"mount": "gimbal"}},
    "threats": {"risk": DANGERS},
    "lookahead": {
        "guidance": {"pursuit": "lookahead"},
        "cooperation": {"assistance": "always", "helpers": 1},
    },
}


def compiled():
    """Every kernel of the package and how many signatures it is compiled for."""
    counts = {}
    for module in pkgutil.iter_modules(staniel.kernels.__path__):
        members = vars(importlib.import_module(f"staniel.kernels.{module.name}"))
        for name, member in members.items():
            if isinstance(member, Dispatcher):
                counts[module.name, name] = len(member.signatures)
    return counts


@pytest.fixture(scope="module")
def apart():
    """A process of its own: in this one other tests may have called kernels with any types."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        yield process


@pytest.mark.parametrize("changes", EXTRAS.values(), ids=EXTRAS)
def test_nothing_compiles_in_flight_or_after_it(apart, changes, tmp_path):
    assert apart.submit(compiled_in_flight, changes, tmp_path).result() == {}


def compiled_in_flight(changes, folder):
    """How many signatures each kernel has after a flight that has more than before."""
    scenario = load_scenario("downtown", minutes=2.0, **changes)
    city = build_city(scenario.city, scenario.seed)
    warm_all(lambda done, total: None, kernels_of(scenario))
    before = compiled()
    settings = scenario.model_dump(mode="json")
    with Recorder(
        folder / "mission.mcap", scenario=settings, version="0", city=city, clock=scenario.clock
    ) as recorder:
        for frame in assemble(scenario, city).frames():
            recorder.write(frame)
        recorder.finish(complete=True)
    compute_metrics(read_record(folder))
    return {name: count for name, count in compiled().items() if count != before[name]}


def test_progress_is_told_from_nothing_to_all():
    told = []
    warm_all(lambda done, total: told.append((done, total)), ["polygon"])
    assert told[0][0] == 0
    assert told[-1][0] == told[-1][1] == len(told) - 1


def test_on_a_new_machine_another_process_compiles_from_the_end(tmp_path):
    """In a copy without a cache: what it was left to compile is there, and then it is gone."""
    source = Path(staniel.__file__).parent
    shutil.copytree(source, tmp_path / "staniel", ignore=shutil.ignore_patterns("__pycache__"))
    script = """
import time
from pathlib import Path
from staniel.kernels import warm
folder = Path(warm.__file__).parent / "__pycache__"
with warm._another_from_the_end(["walls", "polygon"]):
    end = time.monotonic() + 120.0
    while not list(folder.glob("polygon.*.nbi")) and time.monotonic() < end:
        time.sleep(0.1)
assert list(folder.glob("polygon.*.nbi"))
"""
    path = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", script], env=path, cwd=tmp_path, check=False)
    assert done.returncode == 0
