"""Ctrl-C and SIGTERM, held back until it is good to stop."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["INTERRUPTED", "stop_between_events"]

INTERRUPTED = 130
"""Exit code of what Ctrl-C or SIGTERM cut short: 128 + SIGINT, as shells have it."""


@contextmanager
def stop_between_events() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and SIGTERM back until the function that this yields is called; not the second.

    An exception out of a signal may strike anywhere: while a compiled kernel takes its arguments it
    turns into a SystemError, while the record is written it leaves half a message.
    """
    asked = False

    def ask(_signal: int, _frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    def stop_if_asked() -> None:
        nonlocal asked
        if asked:
            asked = False
            raise KeyboardInterrupt

    # What started us may want us to ignore one of them; then we do.
    before = {
        number: signal.signal(number, ask)
        for number in (signal.SIGINT, signal.SIGTERM)
        if signal.getsignal(number) is not signal.SIG_IGN
    }
    try:
        yield stop_if_asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
