"""What was found out about a file, a folder or this machine, as records."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from psvideo.errors import PsvideoError

Level = Literal["ok", "note", "warn", "missing", "FAULT"]
STOPS = frozenset({"missing", "FAULT"})
"""The levels at which work stops."""

Fact = str | int | float | None | list[str] | list[int]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was looked at, in a footage folder (``info``) or on this machine (``doctor``), and what it means.

    ``ok``: as it should be. ``warn``: may cost accuracy. ``FAULT``: does not fit, commands would stop. Of the machine,
    ``note``: not there or slow, and only some work needs it; ``missing``: psvideo cannot do its work. ``name`` is what
    was looked at, ``next_step`` says what to do about it, ``value`` is the figure behind it in the unit that ``unit``
    names; each empty (None) where there is none.
    """

    name: str = ""
    level: Level
    text: str
    next_step: str = ""
    value: float | None = None
    unit: str = ""


def is_well(findings: Iterable[Finding]) -> bool:
    """Whether nothing was found that would stop work."""
    return all(finding.level not in STOPS for finding in findings)


@dataclass(frozen=True, kw_only=True)
class Description:
    """What a file or folder is, its figures for machines, and one finding per thing that was checked."""

    path: Path
    kind: str
    facts: Mapping[str, Fact] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def fits(self) -> bool:
        """Whether nothing was found that would stop a command."""
        return is_well(self.findings)


def ok(text: str) -> Finding:
    """Something is as it should be."""
    return Finding(level="ok", text=text)


def warn(text: str) -> Finding:
    """Something may cost accuracy, or was guessed."""
    return Finding(level="warn", text=text)


def fault(text: object) -> Finding:
    """Something does not fit; a PsvideoError gives its paragraph."""
    return Finding(level="FAULT", text=str(text))


def caught(findings: Iterable[Finding]) -> Iterator[Finding]:
    """Pass findings on; where finding them ends in a PsvideoError, that is the last one."""
    try:
        yield from findings
    except PsvideoError as error:
        yield fault(error)
