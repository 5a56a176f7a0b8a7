"""The floors of the house hold, and the contract notices when somebody breaks them."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from staniel import __version__

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "staniel"
COMMAND = "import sys; from importlinter.cli import lint_imports_command; lint_imports_command()"


def lint(source: Path) -> subprocess.CompletedProcess[str]:
    """Run the contracts of the project on the package under a folder."""
    command = [sys.executable, "-c", COMMAND, "--no-cache", "--config", str(ROOT / ".importlinter")]
    environment = {**os.environ, "PYTHONPATH": str(source)}
    return subprocess.run(
        command, cwd=source, env=environment, capture_output=True, text=True, timeout=120
    )


@pytest.fixture
def copy(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "staniel", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def add(copy: Path, module: str, statement: str) -> None:
    path = copy / "staniel" / module
    path.write_text(path.read_text(encoding="utf-8") + f"\n{statement}\n", encoding="utf-8")


def test_the_contracts_are_kept():
    result = lint(ROOT / "src")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("module", "statement", "contract"),
    [
        ("tracking/tracker.py", "import staniel.world", "What flies does not see the truth BROKEN"),
        (
            "tracking/tracker.py",
            "from staniel.datatypes.truth import Truth",
            "What flies does not see the truth BROKEN",
        ),
        (
            "agent.py",
            "def peek():\n    import staniel.datatypes.truth",
            "What flies does not see the truth BROKEN",
        ),
        # Through another: city is below, and now holds what an agent may not see.
        (
            "city/city.py",
            "from staniel.datatypes.truth import Truth",
            "What flies does not see the truth BROKEN",
        ),
        ("kernels/random.py", "import staniel.errors", "Kernels import nothing of ours BROKEN"),
        ("tracking/tracker.py", "import staniel.guidance", "Imports go down only BROKEN"),
        ("city/city.py", "import staniel.mission", "Imports go down only BROKEN"),
    ],
)
def test_a_breach_breaks_the_build(copy, module, statement, contract):
    add(copy, module, statement)
    result = lint(copy)
    assert result.returncode != 0
    assert contract in result.stdout


def test_a_room_without_a_floor_breaks_the_build(copy):
    (copy / "staniel" / "attic.py").write_text('"""A room of nobody\'s."""\n', encoding="utf-8")
    result = lint(copy)
    assert result.returncode != 0
    assert "attic" in result.stdout + result.stderr


def test_the_source_page_names_only_what_is_there():
    page = (ROOT / "docs" / "source.md").read_text(encoding="utf-8")
    named = re.findall(r"`([a-z_/]+(?:\.py|/))`", page)
    assert len(named) > 20
    assert [name for name in named if not (PACKAGE / name).exists()] == []


def test_every_page_says_the_same_version():
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"version: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_kernels_import_only_numpy_numba_and_one_another():
    allowed = {"numpy", "numba", "llvmlite", *sys.stdlib_module_names}
    for file in sorted((PACKAGE / "kernels").glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            else:
                continue
            for name in names:
                kernel = name == "staniel.kernels" or name.startswith("staniel.kernels.")
                assert kernel or name.split(".")[0] in allowed, f"{file.name} imports {name}"
