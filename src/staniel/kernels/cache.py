"""Drop compiled kernels that are older than the sources.

Numba notices a change in a kernel's own file but not in a file whose kernels it calls: after an
edit in `walls.py`, yesterday's `look` would go on running yesterday's walls. So the cache of this
folder is kept only while it is younger than every source in it.
"""

from pathlib import Path

__all__ = ["drop_stale"]


def drop_stale() -> None:
    """Remove this folder's compiled kernels if any source is newer than one of them."""
    folder = Path(__file__).parent
    compiled = [*folder.glob("__pycache__/*.nbi"), *folder.glob("__pycache__/*.nbc")]
    newest = max(source.stat().st_mtime for source in folder.glob("*.py"))
    try:
        if any(file.stat().st_mtime < newest for file in compiled):
            for file in compiled:
                file.unlink(missing_ok=True)
    except OSError:
        # Somebody else's folder, or another process was faster: Numba copes with both.
        return
