import importlib.util
from pathlib import Path

import numpy as np
import pytest

from staniel.city import City
from staniel.recording import Recorder, read_record


def made_up_run():
    """The module that makes the frames of the recorder's tests."""
    path = Path(__file__).resolve().parents[1] / "recording" / "synthetic_run.py"
    spec = importlib.util.spec_from_file_location("made_up_for_pictures", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def make_record(tmp_path_factory):
    """Fly a made-up run over a city and read its record."""
    synthetic_run = made_up_run()

    def make(city, ticks=60, scenario=None, **options):
        file = tmp_path_factory.mktemp("run") / "mission.mcap"
        about = synthetic_run.scenario() if scenario is None else scenario
        with Recorder(
            file, scenario=about, version="1", city=city, clock=synthetic_run.CLOCK
        ) as recorder:
            for frame in synthetic_run.frames(city, ticks, **options):
                recorder.write(frame)
            recorder.finish(complete=True)
        return read_record(file)

    return make


@pytest.fixture(scope="session")
def record(make_record):
    return make_record(City.generate(size=(300.0, 300.0), seed=3))


@pytest.fixture(scope="session")
def bare_record(make_record):
    """A wide city without buildings, one aircraft, nothing seen, an empty scenario."""
    return make_record(
        City.open((400.0, 100.0)), ticks=3, scenario={}, aircraft=1, vehicles=0, tracks=0
    )


@pytest.fixture
def count_color():
    """Pixels of a picture within a few levels of a colour."""

    def count(picture, color):
        pixels = np.asarray(picture.convert("RGB")).astype(int)
        return int((np.abs(pixels - np.array(color)).max(axis=2) <= 6).sum())

    return count
