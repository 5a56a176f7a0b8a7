"""From a TOML file or a packaged name, and changes to it, to a checked scenario."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from staniel.errors import ScenarioError
from staniel.scenario.complain import complaints, nearest
from staniel.scenario.lines import find_line, key_lines
from staniel.scenario.model import CITY_KEYS, Scenario
from staniel.scenario.toml import parse_toml, plain, read_text

__all__ = ["anchor", "load_scenario", "preset_names", "preset_text", "read_settings"]


def load_scenario(path_or_name: str | PathLike[str], **overrides: Any) -> Scenario:  # noqa: ANN401
    r"""Read a scenario, change it, check it.

    Parameters
    ----------
    path_or_name : str or path
        A TOML file, or the name of a packaged scenario such as ``"downtown"``.
    **overrides
        Changes, checked like the file: whole keys (``seed=3``), parts of a section
        (``aircraft={"count": 2}``) or dotted keys (``**{"aircraft.count": 2}``). A file that they
        name is relative to the working directory, one named in the TOML file to that file's folder.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        The file is missing, unreadable or malformed, or a key or value is not a scenario's. The
        message names file, line, field, value and what was expected, one finding a line.

    Examples
    --------
    >>> load_scenario("downtown", **{"aircraft.count": 2}).aircraft.count
    2
    """
    text, label, folder = _read(path_or_name)
    data = parse_toml(text, label)
    if folder is not None:
        data.setdefault("name", _as_name(Path(label).stem))
        anchor(data, folder)
    changes = read_settings(overrides.items())
    anchor(changes, Path.cwd())
    _drop_old_source(data, changes)
    _merge(data, changes)
    origin = _Origin(label, key_lines(text), _leaves(changes))
    try:
        # Strict: a number in quotes is not a number. Lists are tuples by now.
        scenario = Scenario.model_validate(data, strict=True)
    except ValidationError as error:
        raise ScenarioError(complaints(error, origin.where, Scenario)) from None
    _check_pursuit(scenario, origin)
    return scenario


def preset_names() -> list[str]:
    """Names of the packaged scenarios, in the order of the alphabet."""
    folder = resources.files("staniel.scenario") / "presets"
    names = [entry.name for entry in folder.iterdir()]
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def preset_text(name: str) -> str:
    """TOML text of a packaged scenario."""
    file = resources.files("staniel.scenario") / "presets" / f"{name}.toml"
    return file.read_text(encoding="utf-8")


def read_settings(settings: Iterable[str | tuple[str, Any]]) -> dict[str, Any]:
    """Nested changes from ``key=value`` texts or (dotted key, value) pairs; the last one wins.

    Raises
    ------
    ScenarioError
        A text without an equals sign.

    Examples
    --------
    >>> read_settings(["aircraft.count=2", "guidance.pursuit=carrot", ("city", {"cell": 3.0})])
    {'aircraft': {'count': 2}, 'guidance': {'pursuit': 'carrot'}, 'city': {'cell': 3.0}}
    """
    changes: dict[str, Any] = {}
    for setting in settings:
        key, value = _split(setting) if isinstance(setting, str) else setting
        nested = plain(value)
        for part in reversed(key.split(".")):
            nested = {part: nested}
        _merge(changes, nested)
    return changes


@dataclass(frozen=True)
class _Origin:
    """Where each value came from, for messages."""

    label: str
    lines: dict[tuple[str | int, ...], int]
    changed: set[tuple[str, ...]] = field(default_factory=set)

    def where(self, path: tuple[str | int, ...]) -> str:
        if any(path[: len(change)] == change for change in self.changed):
            return ""
        line = find_line(self.lines, path)
        return f"{self.label}: " if line is None else f"{self.label}, line {line}: "


def _read(path_or_name: str | PathLike[str]) -> tuple[str, str, Path | None]:
    """Text, name for messages, and folder (None for a packaged scenario)."""
    names = preset_names()
    if isinstance(path_or_name, str) and path_or_name in names:
        return preset_text(path_or_name), f"{path_or_name}.toml", None
    path = Path(path_or_name)
    return read_text(path, "scenario", names), str(path), path.absolute().parent


def _split(setting: str) -> tuple[str, Any]:
    key, equals, text = setting.partition("=")
    if not equals or not key.strip():
        raise ScenarioError(f"setting {setting!r}: expected KEY=VALUE, such as aircraft.count=2")
    try:
        values = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        values = {}
    return key.strip(), values["value"] if len(values) == 1 else text.strip()


def _merge(base: dict[str, Any], changes: Mapping[str, Any]) -> None:
    for key, value in changes.items():
        if isinstance(value, dict) and isinstance(base.get(key), dict):
            _merge(base[key], value)
        else:
            base[key] = value


def _drop_old_source(data: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Another city takes the place of the old one: keep only what it also has, and no old roads."""
    old, new = data.get("city"), changes.get("city")
    if isinstance(old, dict) and isinstance(new, dict):
        own = CITY_KEYS.get(str(new.get("source")))
        if own is not None:
            for key in [key for key in old if key not in ("source", *own)]:
                del old[key]
        if "file" in new:
            old.pop("roads", None)


def anchor(data: dict[str, Any], folder: Path) -> None:
    """Make the names of files absolute."""
    for name, key in (("city", "file"), ("city", "roads"), ("vehicles", "replay")):
        section = data.get(name)
        if isinstance(section, dict) and isinstance(section.get(key), str) and section[key]:
            section[key] = str(folder / section[key])


def _leaves(changes: Mapping[str, Any]) -> set[tuple[str, ...]]:
    found: set[tuple[str, ...]] = set()
    for key, value in changes.items():
        if isinstance(value, dict) and value:
            found |= {(key, *rest) for rest in _leaves(value)}
        else:
            found.add((key,))
    return found


def _as_name(stem: str) -> str:
    """A file's stem as a scenario's name."""
    name = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in stem)
    return name.lstrip("._-")[:64] or "mission"


def _check_pursuit(scenario: Scenario, origin: _Origin) -> None:
    from staniel.guidance import pursuit_names  # here: a caller may register one until now

    names, name = list(pursuit_names()), scenario.guidance.pursuit
    if name not in names:
        where = origin.where(("guidance", "pursuit"))
        raise ScenarioError(
            f'{where}guidance.pursuit = "{name}": unknown policy, {nearest(name, names)}'
        )
