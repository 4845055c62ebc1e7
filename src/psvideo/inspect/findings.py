"""What was found out about a file or folder, and whether it fits together: records without judgement of their own."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from psvideo.errors import PsvideoError

Level = Literal["ok", "warn", "FAULT"]
Fact = str | int | float | None | list[str] | list[int]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One line: ``ok`` is as it should be, ``warn`` may cost accuracy, with a ``FAULT`` the commands would stop."""

    level: Level
    text: str


@dataclass(frozen=True, kw_only=True)
class Description:
    """What a file or folder is, its figures for machines, and one finding per thing that was checked."""

    path: Path
    kind: str
    facts: Mapping[str, Fact] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def fits(self) -> bool:
        """True where nothing was found that would stop a command."""
        return all(finding.level != "FAULT" for finding in self.findings)


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
