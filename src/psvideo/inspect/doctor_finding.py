"""One thing that was looked at, and what it means."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "note", "missing"]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """``ok``: there. ``note``: not there or slow, and only some work needs it. ``missing``: psvideo cannot do its work.

    ``next_step`` says what to do about it; empty where there is nothing to do. ``value`` is the figure behind it, in
    the unit that ``unit`` names, where there is one.
    """

    name: str
    level: Level
    text: str
    next_step: str = ""
    value: float | None = None
    unit: str = ""


def is_well(findings: Iterable[Finding]) -> bool:
    """Tell whether nothing is missing."""
    return all(finding.level != "missing" for finding in findings)
