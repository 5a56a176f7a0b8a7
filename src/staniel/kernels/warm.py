"""Compile the kernels that a mission calls, or load them from the cache, before it starts."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from staniel.kernels.cache import drop_stale

__all__ = ["warm_all"]

ALWAYS = (
    "random",
    "walls",
    "footprint",
    "camera",
    "flight",
    "streets",
    "traffic",
    "radio",
    "dubins",
    "motion",
    "weighing",
    "misses",
    "particles",
    "gating",
    "association",
    "births",
    "intake",
    "lives",
    "search",
    "looked",
    "visibility",
    "unseen",
    "revisit",
)
"""What every mission calls. Others are named by the scenario that uses them."""

_COMPILE = """
import sys
from importlib import import_module
for name in sys.argv[1:]:
    import_module(f"staniel.kernels.{name}").warm()
"""


def warm_all(report: Callable[[int, int], None], others: Sequence[str] = ()) -> None:
    """Call each kernel once on tiny arrays.

    The first time on a machine this compiles, for tens of seconds and on two cores if there are
    two; then it takes a fraction of one.

    Parameters
    ----------
    report : callable
        ``report(done, total)``, before each module of kernels and once at the end.
    others : sequence of str, optional
        Modules of `staniel.kernels` beside those that every mission calls.
    """
    drop_stale()
    names = [*ALWAYS, *others]
    with _another_from_the_end(names):
        for done, name in enumerate(names):
            report(done, len(names))
            import_module(f"staniel.kernels.{name}").warm()
    report(len(names), len(names))


@contextmanager
def _another_from_the_end(names: Sequence[str]) -> Iterator[None]:
    """Where nothing is compiled yet, another process compiles too, from the end of the list.

    They meet somewhere in the middle: what one has compiled the other finds in the cache.
    """
    compiled = any(Path(__file__).parent.glob("__pycache__/*.nbi"))
    if compiled or "NUMBA_CACHE_DIR" in os.environ or (os.cpu_count() or 1) < 2:
        yield
        return
    helper = subprocess.Popen(
        [sys.executable, "-c", _COMPILE, *reversed(names)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        helper.kill()
        helper.wait()
