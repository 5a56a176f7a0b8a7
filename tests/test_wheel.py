"""The built wheel, installed in an empty environment outside the checkout, flies."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import staniel.kernels

ROOT = Path(__file__).resolve().parents[1]


def run(*command, cwd, **changes):
    plain = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    return subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env={**plain, **changes},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    out = tmp_path_factory.mktemp("dist")
    built = run(
        sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", out, ROOT, cwd=out
    )
    assert built.returncode == 0, built.stdout + built.stderr
    (path,) = out.glob("*.whl")
    return path


def test_the_wheel_holds_the_package_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert "staniel/py.typed" in names
    assert "staniel/scenario/presets/downtown.toml" in names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"staniel"}
    assert not [name for name in names if name.endswith((".nbi", ".nbc", ".pyc"))]


def hand_over_what_is_compiled(kernels):
    """Give the installed kernels the cache of the checkout's, which is keyed by their times.

    To compile them once more would take minutes and show nothing of the wheel.
    """
    ours = Path(staniel.kernels.__file__).parent
    for source in ours.glob("*.py"):
        assert (kernels / source.name).read_bytes() == source.read_bytes()
        shutil.copystat(source, kernels / source.name)
    cache = kernels / "__pycache__"
    cache.mkdir(exist_ok=True)
    for file in [*ours.glob("__pycache__/*.nbi"), *ours.glob("__pycache__/*.nbc")]:
        shutil.copy(file, cache)


def test_the_wheel_flies_in_an_empty_environment(wheel, tmp_path):
    assert run(sys.executable, "-m", "venv", tmp_path / "env", cwd=tmp_path).returncode == 0
    python = tmp_path / "env" / "bin" / "python"
    installed = run(
        python,
        "-m",
        "pip",
        "install",
        "--quiet",
        "-c",
        ROOT / "constraints.txt",
        wheel,
        cwd=tmp_path,
    )
    if installed.returncode and "No matching distribution" in installed.stderr:
        pytest.skip(f"no package index within reach: {installed.stderr.splitlines()[-1]}")
    assert installed.returncode == 0, installed.stderr
    hand_over_what_is_compiled(next(tmp_path.glob("env/lib/*/site-packages/staniel/kernels")))
    flown = run(
        tmp_path / "env" / "bin" / "staniel",
        *("fly", "village", "--json", "--out", tmp_path / "run"),
        cwd=tmp_path,
    )
    assert flown.returncode == 0, flown.stderr
    assert json.loads(flown.stdout)["complete"] is True
    where = run(python, "-c", "import staniel; print(staniel.__file__)", cwd=tmp_path)
    assert where.stdout.startswith(str(tmp_path))
