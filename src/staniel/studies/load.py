"""From a TOML file or a packaged name to a checked study, and its points as scenarios."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from staniel.errors import ScenarioError
from staniel.scenario import Scenario, load_scenario, preset_names, read_settings
from staniel.scenario.complain import complaints
from staniel.scenario.lines import find_line, key_lines
from staniel.scenario.load import anchor
from staniel.scenario.toml import parse_toml, plain, read_text
from staniel.studies.model import Level, Study

__all__ = ["Point", "load_study", "points_of", "study_names"]


@dataclass(frozen=True)
class Point:
    """One combination of levels.

    Attributes
    ----------
    number : int
        From 0, in the order of the study.
    levels : tuple of Level
        One of each factor.
    scenario : Scenario
        What is flown, but for the seed.
    """

    number: int
    levels: tuple[Level, ...]
    scenario: Scenario


def study_names() -> list[str]:
    """Names of the packaged studies, in the order of the alphabet."""
    folder = resources.files("staniel.studies") / "presets"
    names = [entry.name for entry in folder.iterdir()]
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def load_study(path_or_name: str | PathLike[str], **changes: Any) -> Study:  # noqa: ANN401
    """Read a study and check it.

    Parameters
    ----------
    path_or_name : str or path
        A TOML file, or a packaged study by its name or by the number that it begins with.
    **changes
        Whole keys that replace the file's, such as ``seeds=10``.

    Returns
    -------
    Study
        Files that it names are absolute.

    Raises
    ------
    ScenarioError
        The file is missing, unreadable or malformed, or a key or value is not a study's.

    Examples
    --------
    >>> load_study("3", seeds=5).factors[0].key
    'city.density'
    """
    text, label, folder = _read(path_or_name)
    data = parse_toml(text, label)
    data.setdefault("name", Path(label).stem)
    if folder is not None:
        _anchor_all(data, folder)
    data |= {key: plain(value) for key, value in changes.items()}
    lines = key_lines(text)

    def where(path: tuple[str | int, ...]) -> str:
        line = None if path and path[0] in changes else find_line(lines, path)
        return f"{label}: " if line is None else f"{label}, line {line}: "

    try:
        return Study.model_validate(data, strict=True)
    except ValidationError as error:
        raise ScenarioError(complaints(error, where, Study)) from None


def points_of(study: Study, minutes: float | None = None) -> list[Point]:
    """The points of a study with their scenarios.

    Parameters
    ----------
    study : Study
    minutes : float, optional
        Mission time, instead of the one that the study's scenario has.

    Raises
    ------
    ScenarioError
        The base scenario, a change to it or a level is none that a scenario can have.
    """
    always = {} if minutes is None else {"minutes": minutes}
    points = []
    for number, combination in enumerate(study.combinations()):
        levels = tuple(
            factor.steps[step] for factor, step in zip(study.factors, combination, strict=True)
        )
        changes: dict[str, Any] = {}
        for part in (study.settings, *(level.set for level in levels), always):
            changes = read_settings([*changes.items(), *part.items()])
        try:
            scenario = load_scenario(study.base, **changes)
        except ScenarioError as error:
            names = [factor.name for factor in study.factors]
            place = ", ".join(
                f"{name} = {level.label}" for name, level in zip(names, levels, strict=True)
            )
            raise ScenarioError(f"{study.name}, point {number} ({place}): {error}") from None
        points.append(Point(number, levels, scenario))
    return points


def _read(path_or_name: str | PathLike[str]) -> tuple[str, str, Path | None]:
    """Text, name for messages, and folder (None for a packaged study)."""
    names = study_names()
    if isinstance(path_or_name, str):
        meant = [name for name in names if path_or_name in (name, name.partition("-")[0])]
        if len(meant) == 1:
            file = resources.files("staniel.studies") / "presets" / f"{meant[0]}.toml"
            return file.read_text(encoding="utf-8"), f"{meant[0]}.toml", None
    path = Path(path_or_name)
    return read_text(path, "study", names), str(path), path.absolute().parent


def _anchor_all(data: dict[str, Any], folder: Path) -> None:
    """Make the names of files absolute that a study's base, settings and levels hold."""
    base = data.get("base")
    if isinstance(base, str) and base not in preset_names():
        data["base"] = str(folder / base)
    for change in _changes(data):
        if isinstance(change.get("set"), Mapping):
            change["set"] = read_settings(change["set"].items())
            anchor(change["set"], folder)
    if isinstance(data.get("settings"), Mapping):
        data["settings"] = read_settings(data["settings"].items())
        anchor(data["settings"], folder)


def _changes(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The levels of all factors, of whatever is there."""
    found: list[dict[str, Any]] = []
    is_table: Callable[[Any], bool] = lambda item: isinstance(item, dict)  # noqa: E731
    factors = data.get("factors")
    for factor in filter(is_table, factors if isinstance(factors, tuple) else ()):
        levels = factor.get("levels")
        found += filter(is_table, levels if isinstance(levels, tuple) else ())
    return found
