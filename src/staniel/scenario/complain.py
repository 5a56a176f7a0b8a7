"""What pydantic found wrong with a file, in words for the person who wrote it."""

import difflib
from collections.abc import Callable, Mapping
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from staniel.scenario.write import format_value

__all__ = ["complaints", "nearest"]

Path = tuple[str | int, ...]

_EXPECTED = {
    "bool_type": "true or false",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "int_type": "a whole number",
    "model_attributes_type": "a table of keys",
    "model_type": "a table of keys",
    "string_type": "text",
    "string_unicode": "text",
    "tuple_type": "a list in brackets",
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "literal_error": "{expected}",
    "string_pattern_mismatch": "a match of {pattern}",
    "string_too_long": "at most {max_length} characters",
    "string_too_short": "at least {min_length} character",
    "too_long": "{max_length} values in the list",
    "too_short": "{min_length} values in the list",
}


def complaints(error: ValidationError, where: Callable[[Path], str], model: type[BaseModel]) -> str:
    """Every finding on its own line: where, field, value, and what was expected.

    Parameters
    ----------
    error : pydantic.ValidationError
        From validating a `model`.
    where : callable
        From the path of a key to the start of its line in the message.
    model : type of pydantic.BaseModel
        Such as `staniel.Scenario`.

    Returns
    -------
    str
    """
    findings = error.errors(include_url=False)
    return "\n".join(_complaint(found, where, model) for found in findings)


def nearest(word: str, known: list[str]) -> str:
    """A hint at the nearest valid name, or all of them when none is near."""
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f'did you mean "{near[0]}"?' if near else "expected one of: " + ", ".join(known)


def _complaint(found: ErrorDetails, where: Callable[[Path], str], model: type[BaseModel]) -> str:
    location, kind = found["loc"], found["type"]
    path, name = tuple(location), _name(location)
    if kind == "extra_forbidden":
        known = sorted(_keys(model, path[:-1]))
        return f"{where(path)}{name}: unknown key, {nearest(str(path[-1]), known)}"
    if kind == "missing":
        return f"{where(path)}{name}: missing, expected a value"
    if kind == "value_error" and isinstance(found["input"], Mapping | BaseModel):
        return _about_section(path, str(found["ctx"]["error"]), where, model)
    value = format_value(found["input"])
    value = value if len(value) <= 60 else value[:57] + "..."
    return f"{where(path)}{name} = {value}: {_expectation(found, path, model)}"


def _about_section(
    path: Path, message: str, where: Callable[[Path], str], model: type[BaseModel]
) -> str:
    """A finding on several keys at once; by custom its message starts with the key at fault."""
    key = message.split(" ", 1)[0]
    if key in _keys(model, path):
        return f"{where((*path, key))}{_name((*path, message))}"
    return f"{where(path)}{_name(path)}: {message}" if path else f"{where(path)}{message}"


def _expectation(found: ErrorDetails, path: Path, model: type[BaseModel]) -> str:
    if found["type"] == "value_error":
        return str(found["ctx"]["error"])
    words = _EXPECTED.get(found["type"])
    if words is None:
        return found["msg"]
    context = {key: _short(value) for key, value in found.get("ctx", {}).items()}
    meaning = _keys(model, path[:-1]).get(str(path[-1]), "")
    return f"expected {words.format(**context)}" + (f" ({meaning})" if meaning else "")


def _name(location: Path) -> str:
    """A place as it is written: names joined by dots, numbers in brackets."""
    return "".join(f".{part}" if isinstance(part, str) else f"[{part}]" for part in location)[1:]


def _short(value: Any) -> str:  # noqa: ANN401 - a bound of any type
    return f"{value:g}" if isinstance(value, float) else str(value)


def _keys(model: type[BaseModel], path: Path) -> dict[str, str]:
    """Keys of the section at a path with their meanings, empty where there is no such section."""
    for part in path:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part)
        kind: Any = None if field is None else field.annotation
        if get_origin(kind) is tuple:  # a list of tables
            kind = get_args(kind)[0]
        if not (isinstance(kind, type) and issubclass(kind, BaseModel)):
            return {}
        model = kind
    return {key: field.description or "" for key, field in model.model_fields.items()}
