"""Compile the kernels that a mission calls, or load them from the cache, before it starts."""

from collections.abc import Callable, Sequence
from importlib import import_module

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
    "search",
    "looked",
    "visibility",
    "unseen",
    "revisit",
)
"""What every mission calls. Others are named by the scenario that uses them."""


def warm_all(report: Callable[[int, int], None], others: Sequence[str] = ()) -> None:
    """Call each kernel once on tiny arrays.

    The first time on a machine this compiles, for tens of seconds; then it takes a fraction of one.

    Parameters
    ----------
    report : callable
        ``report(done, total)``, before each module of kernels and once at the end.
    others : sequence of str, optional
        Modules of `staniel.kernels` beside those that every mission calls.
    """
    drop_stale()
    names = [*ALWAYS, *others]
    for done, name in enumerate(names):
        report(done, len(names))
        import_module(f"staniel.kernels.{name}").warm()
    report(len(names), len(names))
