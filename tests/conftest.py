"""Before anything is called: no compiled kernel that is older than its sources.

With several workers a file is one worker's, and the files that take longest begin first: otherwise
one worker would be left with them while the others are done.
"""

from pathlib import Path

import pytest

from staniel import kernels
from staniel.kernels.cache import drop_stale
from staniel.kernels.warm import ALWAYS, warm_all

LONGEST_FIRST = ("test_wheel", "test_downtown", "test_study_kill", "test_examples", "test_survives")

drop_stale()


def pytest_configure(config: pytest.Config) -> None:
    """Compile everything once, before several workers would do it all at the same time."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        sources = Path(kernels.__file__).parent.glob("*.py")
        able = {file.stem for file in sources if "\ndef warm()" in file.read_text(encoding="utf-8")}
        warm_all(lambda done, total: None, sorted(able - set(ALWAYS)))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring the longest files to the front; the others stay in order."""
    rank = {name: number for number, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: rank.get(Path(item.path).stem, len(rank)))
