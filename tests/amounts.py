"""How much of a sweep is run: a little at every change, all of it with ``STANIEL_FULL=1``."""

import os

FULL = os.environ.get("STANIEL_FULL", "") not in ("", "0")


def amount(little, full):
    """A number of seeds or cases."""
    return full if FULL else little
