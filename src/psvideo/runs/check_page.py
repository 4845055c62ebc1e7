"""The page of checks: every take that was checked, the newest first, each with its lines."""

import html
from collections.abc import Mapping, Sequence
from pathlib import Path

from psvideo import __version__
from psvideo.report.page import MARKS, PAGE, judgement_lines
from psvideo.report.style import STYLE
from psvideo.runs.checking import Check


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
