"""Options that belong together, as one record: a command's function takes the record, its users type the options."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_type_hints


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command's function whose parameters that are dataclasses are spread into one option for each field.

    A field is written as a parameter would be: ``Annotated`` with its ``typer.Option``, and its default. Help shows the
    options where the record stood. Fields without ``init`` are the record's own, and no options.
    """
    signature = inspect.signature(command, eval_str=True)
    records: dict[str, Any] = {
        one.name: one.annotation for one in signature.parameters.values() if is_dataclass(one.annotation)
    }

    @functools.wraps(command)
    def called(**given: Any) -> None:
        for name, record in records.items():
            given[name] = record(**{field.name: given.pop(field.name) for field in fields(record) if field.init})
        command(**given)

    options = [
        option
        for one in signature.parameters.values()
        for option in (_options_of(one.annotation) if one.name in records else [one.replace(kind=one.KEYWORD_ONLY)])
    ]
    called.__signature__ = signature.replace(parameters=options)  # type: ignore[attr-defined]
    return called


def _options_of(record: Any) -> list[inspect.Parameter]:
    """Return a record's fields as parameters."""
    types = get_type_hints(record, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=types[field.name],
        )
        for field in fields(record)
        if field.init
    ]
