"""Who calls a run: where its sentences go while it lasts, and how parameters are spelled there."""

import logging
from collections.abc import Callable
from dataclasses import dataclass

_LOG = logging.getLogger("psvideo")


def as_in_python(text: str) -> str:
    """Return a sentence as it is: parameters stand in it as Python calls them."""
    return text


@dataclass(frozen=True, kw_only=True)
class Caller:
    """What a run says besides its result, and to whom; by default to Python's log under the name ``psvideo``.

    ``say`` takes what people wait for, ``warn`` what a result is to be distrusted for, ``detail`` what is good to know:
    whole sentences, as they come. ``spell`` puts a sentence that names parameters (`` `first_light` ``) into the
    caller's own words, for what is written into files. ``command`` is what was typed, for the report; empty in
    Python.
    """

    say: Callable[[str], None] = _LOG.info
    warn: Callable[[str], None] = _LOG.warning
    detail: Callable[[str], None] = _LOG.info
    spell: Callable[[str], str] = as_in_python
    command: str = ""


PYTHON = Caller()
"""Somebody's own Python."""
