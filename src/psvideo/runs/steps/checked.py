"""What a check found of one take, and the page of many."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from psvideo.formats.whole_files import write_text
from psvideo.model.units import counted
from psvideo.report.html import MARKS, judgement_lines
from psvideo.report.judgement import DECISIVE, Judgement, usable, verdict_of
from psvideo.report.overview import TakeLine, overview_page

SCHEMA = "psvideo-check/1"


@dataclass(frozen=True, kw_only=True)
class Check:
    """What was found of one take, line by line; ``looked_at`` of its ``frames`` frames were decoded, and ``judged`` are
    the first and the last number of those that the lines are about. ``warnings`` say what of the footage itself may
    cost accuracy, ``notes`` what else is worth a word."""

    clip: str
    path: Path
    frames: int
    looked_at: int
    judged: tuple[int, int]
    seconds: float
    judgements: tuple[Judgement, ...]
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def usable(self) -> bool:
        """Whether nothing is bad."""
        return usable(self.judgements)

    @property
    def looked(self) -> str:
        """How many frames were looked at, and which the lines are about."""
        first, last = self.judged
        return f"{self.looked_at} of {self.frames} frames looked at, {first} to {last} judged"

    @property
    def verdict(self) -> str:
        """The sentence that sums the lines up."""
        return verdict_of(self.judgements, warned=bool(self.warnings))


def check_record(check: Check) -> dict[str, object]:
    """Return a check as a record for machines."""
    lines = [
        {"subject": one.subject, "grade": one.grade, "found": one.found, "advice": one.advice}
        for one in check.judgements
    ]
    return {
        "schema": SCHEMA,
        "clip": check.clip,
        "path": str(check.path),
        "usable": check.usable,
        "verdict": check.verdict,
        "judgements": lines,
        "warnings": list(check.warnings),
        "notes": list(check.notes),
        "frames": check.frames,
        "looked_at": check.looked_at,
        "judged": list(check.judged),
        "seconds": round(check.seconds, 2),
    }


def write_checks_page(
    path: Path, checks: Sequence[Check], failed: Mapping[Path, str], *, worst_first: bool = False
) -> None:
    """Write the page of checks; ``failed`` says of other takes why they could not be checked."""
    write_text(path, check_page(checks, failed, worst_first=worst_first))


def check_page(checks: Sequence[Check], failed: Mapping[Path, str], *, worst_first: bool = False) -> str:
    """Return a self-contained page, the newest check first, or the worst; ``failed`` says of other takes why they could
    not be checked."""
    usable = sum(one.usable for one in checks)
    said = (
        f"{counted(len(checks) + len(failed), 'take')}: {usable} usable, {len(checks) - usable} not, "
        f"{len(failed)} unread."
    )
    shown = sorted(checks, key=_badness) if worst_first else [*reversed(checks)]
    lines = [_unread_line(path, why) for path, why in failed.items()] + [*map(_line, shown)]
    return overview_page("Checked takes", said, lines)


def _badness(check: Check) -> tuple[int, bool, int, str]:
    bad, doubtful = _subjects(check, "bad"), _subjects(check, "doubtful")
    return -len(bad), not any(subject in DECISIVE for subject in doubtful), -len(doubtful), str(check.path)


def _subjects(check: Check, grade: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(one.subject for one in check.judgements if one.grade == grade))


def _line(check: Check) -> TakeLine:
    return TakeLine(
        name=check.clip,
        grade=_grade(check),
        verdict=check.verdict,
        bad=_subjects(check, "bad"),
        doubtful=_subjects(check, "doubtful"),
        section=_take(check),
    )


def _unread_line(path: Path, why: str) -> TakeLine:
    return TakeLine(name=path.name, grade="bad", verdict="cannot be checked.", section=_fault(path, why))


def _grade(check: Check) -> str:
    return "bad" if not check.usable else "good" if check.verdict == "This take is usable." else "doubtful"


def _take(check: Check) -> str:
    kind = _grade(check)
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in (*check.warnings, *check.notes))
    return (
        f'<section><div class="verdict {kind}"><p class="word"><i>{MARKS[kind]}</i> {html.escape(check.clip)}: '
        f"{html.escape(check.verdict)}</p></div>{judgement_lines(check.judgements)}"
        + (f"<ul>{notes}</ul>" if notes else "")
        + f'<p class="soft">{html.escape(str(check.path))}: {check.looked}</p>'
        "</section>"
    )


def _fault(path: Path, why: str) -> str:
    return (
        f'<section><div class="verdict bad"><p class="word"><i>{MARKS["bad"]}</i> {html.escape(path.name)}: cannot be '
        f"checked.</p><p>{html.escape(why)}</p></div></section>"
    )
