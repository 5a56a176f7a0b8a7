"""TOML files that people write: read with a bound on their size, parsed, and made plain."""

import tomllib
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from staniel.errors import ScenarioError
from staniel.scenario.complain import nearest

__all__ = ["MAX_BYTES", "parse_toml", "plain", "read_text"]

MAX_BYTES = 1_000_000
"""No file that a person wrote is longer; what is, was named by mistake."""


def read_text(path: Path, what: str, names: Sequence[str]) -> str:
    """Text of a TOML file.

    Parameters
    ----------
    path : Path
    what : str
        Kind of file, for messages: "scenario" or "study".
    names : sequence of str
        Of the packaged ones, that could have been meant.

    Raises
    ------
    ScenarioError
        No such file, or it cannot be read, is too long or no text.
    """
    known = f"expected a TOML file or a packaged {what} ({', '.join(names)})"
    try:
        if path.is_dir():
            raise ScenarioError(f"{what} {str(path)!r} is a folder: {known}")
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        hint = nearest(str(path), list(names))
        hint = f"; {hint}" if hint.startswith("did") else ""
        raise ScenarioError(f"{what} {str(path)!r} not found: {known}{hint}") from None
    except OSError as error:
        reason = error.strerror or error
        raise ScenarioError(f"{what} {str(path)!r} cannot be read: {reason}; {known}") from None
    except ValueError as error:
        if isinstance(error, ScenarioError):
            raise
        raise ScenarioError(f"{what} {str(path)!r} cannot be read: {error}; {known}") from None
    if len(raw) > MAX_BYTES:
        raise ScenarioError(f"{path}: longer than {MAX_BYTES:,} bytes; {known}")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise ScenarioError(f"{path}, line {line}: not UTF-8 text; {known}") from None


def parse_toml(text: str, label: str) -> dict[str, Any]:
    """Tables and values of a TOML text, made `plain`.

    Raises
    ------
    ScenarioError
        Not TOML; begins with `label`.
    """
    try:
        data: dict[str, Any] = plain(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{label}: not valid TOML: {error}") from None
    except (RecursionError, ValueError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else error
        raise ScenarioError(f"{label}: not usable TOML: {reason}") from None
    return data


def plain(value: Any) -> Any:  # noqa: ANN401 - any value of TOML or of a caller
    """Tables as new dicts, lists as tuples, NumPy's numbers and paths as Python's and text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(map(plain, value))
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    return str(value) if isinstance(value, PathLike) else value
