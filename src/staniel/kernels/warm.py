"""Compile every kernel, or load it from the cache on disk, before the first tick."""

from collections.abc import Callable

from staniel.kernels import (
    association,
    births,
    camera,
    dubins,
    flight,
    footprint,
    particles,
    radio,
    search,
    traffic,
    visibility,
    walls,
)
from staniel.kernels.cache import drop_stale

__all__ = ["warm_all"]

_MODULES = (
    walls,
    footprint,
    camera,
    flight,
    traffic,
    radio,
    dubins,
    particles,
    association,
    births,
    search,
    visibility,
)


def warm_all(report: Callable[[int, int], None]) -> None:
    """Call each kernel once on tiny arrays.

    The first time on a machine this compiles, for tens of seconds; then it takes a fraction of one.

    Parameters
    ----------
    report : callable
        ``report(done, total)``, before each module of kernels and once at the end.
    """
    drop_stale()
    for done, module in enumerate(_MODULES):
        report(done, len(_MODULES))
        module.warm()
    report(len(_MODULES), len(_MODULES))
