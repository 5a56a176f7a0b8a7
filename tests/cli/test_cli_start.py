"""`staniel --help` is there at once, because it imports nothing heavy."""

import subprocess
import sys
import time

import pytest

HEAVY = {"numpy", "numba", "scipy", "shapely", "pydantic", "matplotlib", "PIL", "mcap", "pyarrow"}


def start(*arguments: str, options: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *options, "-m", "staniel", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)


def test_help_is_there_at_once():
    def seconds() -> float:
        before = time.perf_counter()
        start("--help")
        return time.perf_counter() - before

    # The best of some: the machine may be busy. Undisturbed it takes a quarter of a second.
    assert min(seconds() for _ in range(3)) < 1.5


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (("--help",), set()),
        (("--version",), set()),
        # Typer itself may take pydantic to read a command's options.
        (("fly", "--help"), {"pydantic"}),
    ],
)
def test_help_imports_nothing_heavy(arguments, allowed):
    report = start(*arguments, options=("-X", "importtime")).stderr
    imported = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in report.splitlines()}
    assert "typer" in imported
    assert imported & HEAVY <= allowed


def test_help_names_every_command():
    shown = start("--help").stdout
    assert all(command in shown for command in ("fly", "replay", "export", "scenario"))
