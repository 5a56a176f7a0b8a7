"""Options and their refusals, with a flight that does nothing."""

import json
import os
import signal
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from typer.testing import CliRunner

from staniel._version import __version__
from staniel.cli import app
from staniel.errors import OutputError
from staniel.scenario import load_scenario, preset_names

METRICS: dict[str, Any] = {
    "targets": [
        {
            "found_at": 12.0,
            "visible_fraction": 0.5,
            "tracked_fraction": 0.75,
            "longest_gap": 7.0,
            "position_rmse": 1.25,
        },
        {
            "found_at": None,
            "visible_fraction": None,
            "tracked_fraction": None,
            "longest_gap": None,
            "position_rmse": None,
        },
    ],
    "aircraft": [{"distance": 900.0, "min_separation": None, "building_strikes": 0}],
    "team": {"gospa_mean": 3.5, "auctions": 1, "messages_sent": 60, "messages_delivered": 59},
    "real_time_factor": 333.0,
}


@dataclass
class FlightDouble:
    """Stands in for `staniel.flight`: notes what it is asked for."""

    calls: list[dict[str, Any]] = field(default_factory=list)
    interrupted: bool = False
    error: BaseException | None = None

    def fly(self, scenario, seed=None, out=None, *, movie=False, on_event=None):
        self.calls.append({"scenario": scenario, "seed": seed, "out": out, "movie": movie})
        on_event("compiling", done=0, total=2)
        on_event("compiling", done=2, total=2)
        for time in range(0, 61, 15):
            on_event("tick", time=float(time), duration=60.0, real_time_factor=300.0)
        if self.error is not None:
            raise self.error
        if self.interrupted:
            on_event("stopped", reason="stopped by hand after 30 s of 60 s")
        on_event("rendering", what="overview.png")
        out.mkdir(parents=True)
        for name in ("mission.mcap", "metrics.json", "overview.png"):
            (out / name).touch()
        return Flown(out, METRICS, self.interrupted)


@dataclass
class Flown:
    folder: Path
    metrics: dict[str, Any]
    interrupted: bool


@pytest.fixture
def flight(monkeypatch, tmp_path):
    double = FlightDouble()
    module = ModuleType("staniel.flight")
    module.fly = double.fly
    import staniel

    monkeypatch.setitem(sys.modules, "staniel.flight", module)
    monkeypatch.setattr(staniel, "flight", module, raising=False)
    monkeypatch.chdir(tmp_path)
    return double


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def refused(*arguments: str) -> str:
    result = run(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return result.stderr


def test_the_default_is_downtown_into_a_folder_of_its_own(flight):
    result = run("fly")
    assert result.exit_code == 0, result.stderr
    (call,) = flight.calls
    assert call["scenario"] == load_scenario("downtown")
    assert call["out"] == Path("runs/downtown-0")
    assert not call["movie"]


def test_default_folders_do_not_collide(flight):
    for _ in range(3):
        assert run("fly", "village", "--seed", "5", "--quiet").exit_code == 0
    folders = [str(call["out"]) for call in flight.calls]
    assert folders == ["runs/village-5", "runs/village-5-2", "runs/village-5-3"]


def test_options_reach_the_scenario(flight, tmp_path):
    (tmp_path / "a.map").touch()
    arguments = ["--seed", "3", "--minutes", "2.5", "--movie", "--out", "here"]
    changes = ["--set", "aircraft.count=2", "--set", "guidance.pursuit=carrot"]
    result = run("fly", "village", *arguments, *changes, "--city", "a.map", "--cell", "3")
    assert result.exit_code == 0, result.stderr
    (call,) = flight.calls
    scenario = call["scenario"]
    assert (scenario.seed, scenario.minutes, scenario.aircraft.count) == (3, 2.5, 2)
    assert (scenario.city.source, scenario.city.cell) == ("grid", 3.0)
    assert scenario.city.file == str(tmp_path / "a.map")
    assert scenario.city.heights == load_scenario("village").city.heights
    assert (call["out"], call["movie"]) == (Path("here"), True)


def test_an_image_is_told_from_a_grid_by_its_name(flight):
    assert run("fly", "--city", "Some.PNG", "--cell", "1").exit_code == 0
    assert flight.calls[0]["scenario"].city.source == "image"


def test_json_is_all_there_is_on_standard_output(flight):
    result = run("fly", "--json")
    assert json.loads(result.stdout) == METRICS
    assert "Targets" in result.stderr


def test_the_summary_shows_every_figure_and_file(flight):
    shown = run("fly").stderr
    for text in ("12 s", "50%", "75%", "7.0 s", "1.2 m", "900 m", "3.5 m", "333×", "mission.mcap"):
        assert text in shown
    assert "–" in shown  # the vehicle that was never found
    assert "\x1b" not in shown  # no control codes where there is no terminal


def test_quiet_is_quiet(flight):
    result = run("fly", "--quiet")
    assert (result.stdout, result.stderr) == ("", "")


def test_a_run_that_was_stopped_ends_with_130_and_its_tables(flight):
    flight.interrupted = True
    result = run("fly")
    assert result.exit_code == 130
    assert "stopped by hand after 30 s of 60 s" in result.stderr
    assert "Targets" in result.stderr


def test_an_interrupt_that_nobody_caught_ends_with_130(flight):
    flight.error = KeyboardInterrupt()
    result = run("fly")
    assert result.exit_code == 130
    assert result.stderr.splitlines()[-1] == "stopped by hand"


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_the_next_event(flight, monkeypatch, sent):
    happened = []

    def fly(*_args, on_event, **_kwargs):
        os.kill(os.getpid(), sent)
        happened.append("the tick went on to its end")
        on_event("tick", time=1.0, duration=60.0, real_time_factor=1.0)
        happened.append("too far")

    monkeypatch.setattr(sys.modules["staniel.flight"], "fly", fly)
    before = signal.getsignal(sent)
    assert run("fly", "--quiet").exit_code == 130
    assert happened == ["the tick went on to its end"]
    assert signal.getsignal(sent) is before


def test_a_second_signal_does_not_wait(flight, monkeypatch):
    happened = []

    def fly(*_args, **_kwargs):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        happened.append("too far")

    monkeypatch.setattr(sys.modules["staniel.flight"], "fly", fly)
    assert run("fly", "--quiet").exit_code == 130
    assert happened == []


def test_our_errors_are_one_message_and_exit_code_2(flight):
    flight.error = OutputError("output folder x: not empty")
    assert refused("fly", "--quiet") == "error: output folder x: not empty\n"


def test_a_bug_keeps_its_traceback(flight):
    flight.error = RuntimeError("a bug")
    assert isinstance(run("fly").exception, RuntimeError)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fly", "dontown"], "error: scenario 'dontown' not found"),
        (["fly", "nowhere.toml"], "error: scenario 'nowhere.toml' not found"),
        (["fly", "--set", "aircraft.count"], "expected KEY=VALUE"),
        (["fly", "--set", "aircraft.sped=3"], 'aircraft.sped: unknown key, did you mean "speed"?'),
        (
            ["fly", "--set", "aircraft.count=many"],
            'aircraft.count = "many": expected a whole number',
        ),
        (["fly", "--set", "aircraft.speed=99"], "aircraft.speed = 99 must lie between"),
        (["fly", "--set", "guidance.pursuit=carot"], "unknown policy"),
        (["fly", "--minutes", "0"], "minutes = 0: expected greater than 0"),
        (["fly", "--minutes", "nan"], "minutes = nan: expected"),
        (["fly", "--minutes", "soon"], 'minutes = "soon": expected a number'),
        (["fly", "--seed", "-1"], "seed = -1: expected at least 0"),
        (["fly", "--seed", "1.5"], "seed = 1.5: expected a whole number"),
        (["fly", "--city", "a.map"], "city.cell is missing"),
        (["fly", "--city", "a.map", "--cell", "0"], "city.cell = 0: expected greater than 0"),
        (["fly", "--city", "a.map", "--cell", "-3"], "city.cell = -3: expected greater than 0"),
        (["fly", "--cell", "3"], "city.cell does not belong to source"),
        (["fly", "--sed", "3"], "No such option"),
        (["scenario", "check", "--city", "no.map", "--cell", "3"], "no.map': no such file"),
        (["scenario", "show", "dontown"], 'did you mean "downtown"?'),
        (["export", "somewhere"], "exactly one of --csv and --parquet"),
        (["export", "somewhere", "--csv", "--parquet"], "exactly one of --csv and --parquet"),
        (["export", "somewhere", "--csv"], "error: "),
        (["fly", "downtown", "village"], "unexpected extra argument"),
    ],
)
def test_bad_input_ends_with_one_message(flight, tmp_path, arguments, message):
    shown = " ".join(refused(*arguments).replace("│", " ").split())
    assert message in shown
    assert flight.calls == []
    assert list(tmp_path.iterdir()) == []


def test_show_prints_what_flies_and_reads_it_back(tmp_path):
    result = run("scenario", "show", "village", "--seed", "9", "--set", "aircraft.count=3")
    path = tmp_path / "shown.toml"
    path.write_text(result.stdout, encoding="utf-8")
    assert load_scenario(path) == load_scenario("village", seed=9, aircraft={"count": 3})


def test_list_names_every_preset():
    lines = run("scenario", "list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == preset_names()


def test_check_says_good():
    assert run("scenario", "check", "village").stdout == "village: good\n"


def test_version():
    assert run("--version").stdout == f"staniel {__version__}\n"
