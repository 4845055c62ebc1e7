"""What is wrong with a file under contract, in words: the mistakes of a validation in one paragraph."""

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from psvideo.errors import nearest
from psvideo.formats.separators import as_list

MOST_SAID, LOOKED_AT = 12, 200
"""So many mistakes are said, of so many that a validation finds first: a file that a program wrote wrong has as many as
it has lines."""


def mistakes_in_words(source: str, model: type[BaseModel], fault: ValidationError) -> str:
    """Put every mistake of a validation into one paragraph, of many the first."""
    found = _one_a_key(fault.errors()[:LOOKED_AT])
    text = f"{source}: " + "; ".join(_mistake(model, error) for error in found[:MOST_SAID])
    if len(found) > MOST_SAID or fault.error_count() > LOOKED_AT:
        text += "; and more like these"
    return text if text.endswith("?") else text + "."


def _one_a_key(errors: Sequence[Any]) -> list[Any]:
    """Put what a key of several allowed kinds may be into one mistake: it says first what each kind lacks."""
    by_key: dict[str, list[Any]] = {}
    for error in errors:
        by_key.setdefault(f"{_key_path(error['loc'])} {error['type'] == 'extra_forbidden'}", []).append(error)
    kept = []
    for key, same in by_key.items():
        if any(other.startswith(f"{key.split(' ')[0]}[") for other in by_key) and isinstance(same[0]["input"], list):
            continue  # it may be a list, and what is wrong with one of its values is said of that
        kinds = [_expected(error["msg"]) for error in same]
        kept.append(same[0] if len(same) == 1 else same[0] | {"msg": f"expected {' or '.join(dict.fromkeys(kinds))}"})
    return kept


def _expected(message: str) -> str:
    """Return what a message expects: ``Input should be a valid number`` expects ``a number``."""
    return (
        message.removeprefix("Value error, ")
        .removeprefix("Input should be ")
        .replace("a valid ", "a ")
        .replace("a integer", "a whole number")
        .replace("a string", "text")
    )


def _mistake(model: type[BaseModel], error: Any) -> str:
    place = error["loc"]
    key = _key_path(place)
    if error["type"] == "extra_forbidden":
        advice = nearest(str(place[-1]), _known_keys(model, place[:-1])).rstrip(".")
        return f"unknown key '{key}': {advice}"
    if error["type"] == "missing":
        return f"key '{key}' is missing"
    if error["type"] in ("too_short", "too_long"):
        allowed = error["ctx"].get("min_length", error["ctx"].get("max_length"))
        least = "at least" if error["type"] == "too_short" else "at most"
        typed = as_list(error["input"], most=allowed)
        return f"key '{key}' is {error['input']!r}: expected {least} {allowed} values{typed}"
    name = ".".join(part for part in place if isinstance(part, str))
    if error["type"] in ("model_type", "dict_type"):
        table = f"[[{name}]]" if isinstance(place[-1], int) else f"[{name}]"
        return f"key '{key}' is {error['input']!r}: expected a table, {table}, with keys below it"
    if error["type"] == "list_type" and isinstance(error["input"], dict):
        return f"'{key}' is one table: expected a list of them, so write [[{name}]], and not [{name}]"
    message = error["msg"].removeprefix("Value error, ")
    if message.startswith("Input should be "):
        message = f"expected {_expected(message)}"
        message += as_list(error["input"]) if error["type"] in ("list_type", "tuple_type") else ""
    message = message[:1].lower() + message[1:]
    if isinstance(error["input"], dict | list) and error["type"] == "value_error":
        return f"{message}" if not key else f"'{key}': {message}"
    return f"key '{key}' is {error['input']!r}: {message}"


def _key_path(place: tuple[str | int, ...]) -> str:
    """Write a place the way a reader of the file counts: ``strobe.flash[2].duration_s`` is the second flash.

    >>> _key_path(("strobe", "flash", 1, "duration_s"))
    'strobe.flash[2].duration_s'
    """
    path = ""
    for part in place:
        if isinstance(part, int):
            path += f"[{part + 1}]"
        elif "[" not in part and part.removeprefix("constrained-") not in {"float", "int", "str", "literal"}:
            path += f".{part}" if path else part
    return path


def _known_keys(model: type[BaseModel], place: tuple[str | int, ...]) -> list[str]:
    """Return the keys that the table at ``place`` may hold."""
    for part in place:
        if isinstance(part, str):
            field = next((f for n, f in model.model_fields.items() if part in (n, f.alias)), None)
            inner = _model_in(field.annotation) if field else None
            if inner is None:
                return []
            model = inner
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(_model_in, getattr(annotation, "__args__", ())) if m), None)
