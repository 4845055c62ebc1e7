"""One report over several takes, the worst first: report.json for machines, report.html for people."""

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import quote

from psvideo import __version__
from psvideo.model.units import counted
from psvideo.report.html import MARKS, PAGE
from psvideo.report.style import STYLE

SCHEMA = "psvideo-takes/1"


@dataclass(frozen=True, kw_only=True)
class TakeResult:
    """What became of one take: a ``fault``, in a sentence, or the ``verdict`` of its report, and what it found.

    Attributes
    ----------
    clip, out
        The footage, and the folder of its results.
    usable
        Whether nothing speaks against it; False where it failed.
    findings
        What to distrust and what to change on set, the gravest first.
    instants
        How many results it has.
    valid_share
        The share of the subject that is valid in a typical one; None where it is not known.
    """

    clip: Path
    out: Path
    fault: str = ""
    verdict: str = ""
    usable: bool = False
    findings: tuple[str, ...] = ()
    instants: int = 0
    valid_share: float | None = None

    @classmethod
    def of(cls, clip: Path, out: Path, record: Mapping[str, Any]) -> "TakeResult":
        """Return what a take's report.json says."""
        shares = [one["valid_share"] for one in record["instants"] if one["valid_share"] is not None]
        return cls(
            clip=clip,
            out=out,
            verdict=record["verdict"],
            usable=record["usable"],
            findings=tuple(record["findings"]),
            instants=len(record["instants"]),
            valid_share=median(shares) if shares else None,
        )


def worst_first(results: Iterable[TakeResult]) -> tuple[TakeResult, ...]:
    """Return takes in the order in which to look at them: those that failed, that are not usable, and then by what
    speaks against them."""
    return tuple(sorted(results, key=_badness))


def _badness(one: TakeResult) -> tuple[bool, bool, int, float, str]:
    valid = 1.0 if one.valid_share is None else one.valid_share
    return not one.fault, one.usable, -len(one.findings), valid, one.clip.name


def takes_record(results: Sequence[TakeResult]) -> dict[str, object]:
    """Return the report as what report.json holds."""
    return {"schema": SCHEMA, "version": __version__, "takes": list(map(take_row, results))}


def take_row(one: TakeResult) -> dict[str, object]:
    """Return what a record holds of one take."""
    return {
        "clip": str(one.clip),
        "out": one.out.name,
        "fault": one.fault,
        "verdict": one.verdict,
        "usable": one.usable,
        "findings": list(one.findings),
        "instants": one.instants,
        "valid_share": one.valid_share,
    }


def takes_page(results: Sequence[TakeResult]) -> str:
    """Return the report as one self-contained HTML page, with links to every take's own."""
    usable, failed = sum(one.usable for one in results), sum(bool(one.fault) for one in results)
    said = f"{len(results)} takes: {usable} usable, {len(results) - usable - failed} not, {failed} failed."
    body = f"<p>{said}</p>" + "".join(map(_take, results))
    return PAGE.format(title="Takes", style=STYLE, head="", body=body, version=__version__)


def _take(one: TakeResult) -> str:
    kind = "bad" if not one.usable else "good" if not one.findings else "doubtful"
    valid = "" if one.valid_share is None else f", {100 * one.valid_share:.0f} % valid"
    links = [] if one.fault else [(f"{counted(one.instants, 'result')}{valid}", f"{quote(one.out.name)}/report.html")]
    words = (one.fault,) if one.fault else one.findings
    return take_section(one.clip.name, kind, "failed." if one.fault else one.verdict, words, links=links)


def take_section(
    name: str, kind: str, verdict: str, findings: Sequence[str], *, links: Sequence[tuple[str, str]]
) -> str:
    """Return a take's part of a page: one of the grades, what sums it up, what was found, and (words, address) to go
    on to."""
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in findings)
    found = f"<ol>{items}</ol>" if items else ""
    there = ", ".join(f'<a href="{address}">{html.escape(words)}</a>' for words, address in links)
    on = f'<p class="soft">{there}</p>' if there else ""
    return (
        f'<section><div class="verdict {kind}"><p class="word"><i>{MARKS[kind]}</i> {html.escape(name)}: '
        f"{html.escape(verdict)}</p>{found}</div>{on}</section>"
    )
