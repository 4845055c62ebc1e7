"""What a check found of one take, and the page of many."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from psvideo import __version__
from psvideo.formats.whole_files import write_text
from psvideo.report.html import MARKS, PAGE, judgement_lines
from psvideo.report.judgement import Judgement, usable, verdict_of
from psvideo.report.style import STYLE

SCHEMA = "psvideo-check/1"


@dataclass(frozen=True, kw_only=True)
class Check:
    """What was found of one take, line by line; ``looked_at`` of its ``frames`` frames were decoded."""

    clip: str
    path: Path
    frames: int
    looked_at: int
    seconds: float
    judgements: tuple[Judgement, ...]
    notes: tuple[str, ...] = ()

    @property
    def usable(self) -> bool:
        """True where nothing is bad."""
        return usable(self.judgements)

    @property
    def verdict(self) -> str:
        """The sentence that sums the lines up."""
        return verdict_of(self.judgements)


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
        "notes": list(check.notes),
        "frames": check.frames,
        "looked_at": check.looked_at,
        "seconds": round(check.seconds, 2),
    }


def write_page(path: Path, checks: Sequence[Check], failed: Mapping[Path, str]) -> None:
    """Write the page of checks; ``failed`` says of other takes why they could not be checked."""
    write_text(path, check_page(checks, failed))


def check_page(checks: Sequence[Check], failed: Mapping[Path, str]) -> str:
    """Return a self-contained page; ``failed`` says of other takes why they could not be checked."""
    usable = sum(one.usable for one in checks)
    body = (
        f"<p>{len(checks) + len(failed)} takes: {usable} usable, {len(checks) - usable} not, {len(failed)} unread.</p>"
    )
    body += "".join(_fault(path, why) for path, why in failed.items()) + "".join(map(_take, reversed(checks)))
    return PAGE.format(title="Checked takes", style=STYLE, head="", body=body, version=__version__)


def _take(check: Check) -> str:
    kind = "bad" if not check.usable else "good" if check.verdict == "This take is usable." else "doubtful"
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in check.notes)
    return (
        f'<section><div class="verdict {kind}"><p class="word"><i>{MARKS[kind]}</i> {html.escape(check.clip)}: '
        f"{html.escape(check.verdict)}</p></div>{judgement_lines(check.judgements)}"
        + (f"<ul>{notes}</ul>" if notes else "")
        + f'<p class="soft">{html.escape(str(check.path))}: {check.looked_at} of {check.frames} frames looked at</p>'
        "</section>"
    )


def _fault(path: Path, why: str) -> str:
    return (
        f'<section><div class="verdict bad"><p class="word"><i>{MARKS["bad"]}</i> {html.escape(path.name)}: cannot be '
        f"checked.</p><p>{html.escape(why)}</p></div></section>"
    )
