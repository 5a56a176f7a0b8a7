"""Pictures onto the disk: whole or not at all."""

import os
from pathlib import Path

from staniel.errors import OutputError

__all__ = ["write_picture"]


def write_picture(path: str | os.PathLike[str], data: bytes) -> None:
    """Write an encoded picture; what is half-written when the disk is full is taken away again.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    file = Path(path)
    try:
        with file.open("wb") as stream:
            try:
                stream.write(data)
                stream.flush()
            except OSError:
                file.unlink(missing_ok=True)
                raise
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror or error})") from error
