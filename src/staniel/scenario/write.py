"""A scenario as TOML text: every key, its value and what it means."""

import json
from collections.abc import Iterator
from typing import Any

from staniel.datatypes.config import Config
from staniel.scenario.model import CITY_KEYS, CitySource, Scenario

__all__ = ["dump_scenario", "format_value"]


def dump_scenario(scenario: Scenario, version: str) -> str:
    """Text of a fully resolved scenario; `load_scenario` reads the same scenario back from it.

    Parameters
    ----------
    scenario : Scenario
    version : str
        Of staniel, written into the first line.

    Returns
    -------
    str
        TOML, each key with its meaning as a comment. What is not set is left out.
    """
    lines = [f"# {scenario.name}: a scenario of staniel {version}", *_table(scenario, "")]
    return "\n".join(lines) + "\n"


def format_value(value: Any) -> str:  # noqa: ANN401 - whatever stood in the file
    """One value as TOML: text, truth value, number, list; a table only for messages.

    Examples
    --------
    >>> format_value((1.0, "a", True))
    '[1.0, "a", true]'
    """
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for one character that TOML does not take bare.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Config):
        return format_value(value.model_dump(exclude_none=True))
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(format_value, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {format_value(item)}" for key, item in value.items()) + "}"
    return repr(value) if isinstance(value, int | float) else str(value)


def _table(section: Config, path: str) -> Iterator[str]:
    """Lines of one section: its own keys first, then the sections inside it."""
    rows: list[tuple[str, str]] = []
    inner: list[tuple[str, Config]] = []
    for key, field in type(section).model_fields.items():
        value = getattr(section, key)
        if isinstance(value, Config):
            inner.append((f"{path}.{key}" if path else key, value))
        elif value is not None and _is_own(section, key):
            rows.append((f"{key} = {format_value(value)}", field.description or ""))
    width = min(max((len(text) for text, _ in rows), default=0), 32)
    for text, meaning in rows:
        yield f"{text:<{width}}  # {meaning}" if meaning else text
    for name, child in inner:
        yield ""
        yield f"[{name}]"
        yield from _table(child, name)


def _is_own(section: Config, key: str) -> bool:
    return not isinstance(section, CitySource) or key in ("source", *CITY_KEYS[section.source])
