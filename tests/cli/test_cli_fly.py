"""Real flights of the small packaged scenario, from the command line to the files."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

import staniel
from staniel.cli import app

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(staniel.__file__).parents[1])}
COMMAND = [sys.executable, "-m", "staniel"]


def run(*arguments: str | Path):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(*arguments: str | Path) -> str:
    result = run(*arguments)
    assert result.exit_code == 2, result.stderr
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert [line for line in lines if line.startswith("error: ")] == [lines[-1]]
    return lines[-1]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A flight in a process of its own, as a user starts it, and what it printed."""
    here = tmp_path_factory.mktemp("here")
    result = subprocess.run(
        [*COMMAND, "fly", "village", "--minutes", "0.5", "--json"],
        cwd=here,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=180,
    )
    assert result.returncode == 0, result.stderr
    return here / "runs" / "village-0", result


def test_a_flight_leaves_its_files_and_metrics(flown):
    folder, result = flown
    names = {file.name for file in folder.iterdir()}
    assert names == {"mission.mcap", "scenario.toml", "metrics.json", "overview.png"}
    printed = json.loads(result.stdout)
    assert printed == json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    assert {"targets", "aircraft", "team", "real_time_factor"} <= set(printed)
    assert all(name in result.stderr for name in ("Targets", "Aircraft", "Team", *names))


def test_the_written_scenario_flies_again_to_the_same_metrics(flown, tmp_path):
    folder, _ = flown
    again = staniel.fly(staniel.load_scenario(folder / "scenario.toml"), out=tmp_path / "again")
    first = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    second = dict(again.metrics)
    for metrics in (first, second):
        del metrics["real_time_factor"]
    assert json.loads(json.dumps(second)) == first


def test_replay_needs_the_record_alone(flown, tmp_path):
    folder, _ = flown
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "mission.mcap").write_bytes((folder / "mission.mcap").read_bytes())
    result = run("replay", alone, "--out", tmp_path / "replayed", "--movie")
    assert result.exit_code == 0, result.stderr
    names = {file.name for file in (tmp_path / "replayed").iterdir()}
    assert {"metrics.json", "overview.png", "mission.gif"} <= names
    assert "Targets" in result.stderr


def test_export_writes_tables_and_names_them(flown, tmp_path):
    folder, _ = flown
    result = run("export", folder, "--csv", "--out", tmp_path / "tables")
    assert result.exit_code == 0, result.stderr
    files = [Path(line) for line in result.stdout.splitlines()]
    assert {"truth.csv", "tracks.csv"} <= {file.name for file in files}
    assert all(file.is_file() for file in files)
    assert "not empty" in refused("export", folder, "--csv", "--out", tmp_path / "tables")


def test_tables_of_a_lone_record_go_beside_it(flown, tmp_path):
    folder, _ = flown
    (tmp_path / "a.mcap").write_bytes((folder / "mission.mcap").read_bytes())
    result = run("export", tmp_path / "a.mcap", "--csv")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "csv" / "truth.csv").is_file()


def test_an_output_folder_that_is_in_use_or_impossible_is_refused(tmp_path):
    full = tmp_path / "full"
    full.mkdir()
    (full / "notes").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    assert "not empty" in refused("fly", "village", "--out", full)
    assert "is a file" in refused("fly", "village", "--out", full / "notes")
    assert "not writable" in refused("fly", "village", "--out", full / "notes" / "run")
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("settings", "messages"),
    [
        (["aircraft.altitude=8", "city.heights=[10, 12]"], ["altitude", "tallest roof"]),
        (["vehicles.count=300", "vehicles.radius=10"], ["vehicle", "cannot be placed"]),
        (["city.density=0.8"], ["city.density"]),
    ],
)
def test_what_cannot_be_flown_is_refused_with_the_reason(tmp_path, settings, messages):
    options = [text for setting in settings for text in ("--set", setting)]
    shown = refused("fly", "village", *options, "--out", tmp_path / "run")
    assert all(message in shown for message in messages)
    assert refused("scenario", "check", "village", *options) == shown
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("full.map", b"type octile\nheight 2\nwidth 2\nmap\n@@\n@@\n", "free space"),
        ("short.map", b"type octile\nheight 9\nwidth 2\nmap\n..\n", "short.map"),
        ("empty.map", b"", "empty.map"),
        ("no.png", b"no picture", "no.png"),
        ("empty.png", b"", "empty.png"),
    ],
)
def test_a_map_that_cannot_be_used_is_named(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    out = tmp_path / "run"
    shown = refused("fly", "village", "--city", path, "--cell", "3", "--out", out)
    assert message in shown
    assert not out.exists()


def test_a_run_that_is_not_there_is_named(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "text").write_text("no record")
    for name in ("nowhere", "empty", "text"):
        assert name in refused("replay", tmp_path / name)
        assert name in refused("export", tmp_path / name, "--csv")


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_and_keeps_the_record(tmp_path, sent):
    if signal.getsignal(sent) is signal.SIG_IGN:
        pytest.skip(f"this process, and so what it starts, ignores {sent.name}")
    out = tmp_path / "run"
    process = subprocess.Popen(
        [*COMMAND, "fly", "village", "--minutes", "1440", "--out", str(out), "--json"],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    record = out / "mission.mcap"
    deadline = time.monotonic() + 150.0
    while not (record.exists() and record.stat().st_size > 300_000):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(sent)
    printed, shown = process.communicate(timeout=120)
    assert process.returncode == 130, shown
    assert "stopped by hand after" in shown
    assert "Traceback" not in shown
    metrics = json.loads(printed)
    assert not metrics["complete"]
    assert 0.0 < metrics["duration"] < 1440 * 60.0
    assert {"metrics.json", "overview.png"} <= {file.name for file in out.iterdir()}
