"""One report over several takes, the worst first: report.json for machines, report.html for people."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import quote

from psvideo import __version__
from psvideo.model.units import counted
from psvideo.report.judgement import DECISIVE
from psvideo.report.overview import TakeLine, overview_page, take_section

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
    bad, doubtful
        What speaks against it: subjects of its report's lines.
    """

    clip: Path
    out: Path
    fault: str = ""
    verdict: str = ""
    usable: bool = False
    findings: tuple[str, ...] = ()
    instants: int = 0
    valid_share: float | None = None
    bad: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()

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
            bad=_subjects(record, "bad"),
            doubtful=_subjects(record, "doubtful"),
        )


def _subjects(record: Mapping[str, Any], grade: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(one["subject"] for one in record["judgements"] if one["grade"] == grade))


def worst_first(results: Iterable[TakeResult]) -> tuple[TakeResult, ...]:
    """Return takes in the order in which to look at them: those that failed, that are not usable, that are doubtful as
    a whole, and then by how much speaks against them."""
    return tuple(sorted(results, key=_badness))


def _badness(one: TakeResult) -> tuple[bool, bool, int, bool, int, float, str]:
    valid = 1.0 if one.valid_share is None else one.valid_share
    as_a_whole = any(subject in DECISIVE for subject in one.doubtful)
    return not one.fault, one.usable, -len(one.bad), not as_a_whole, -len(one.findings), valid, one.clip.name


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
        "bad": list(one.bad),
        "doubtful": list(one.doubtful),
        "instants": one.instants,
        "valid_share": one.valid_share,
    }


def takes_page(results: Sequence[TakeResult]) -> str:
    """Return the report as one self-contained HTML page, with links to every take's own."""
    usable, failed = sum(one.usable for one in results), sum(bool(one.fault) for one in results)
    doubted = sum(one.usable and bool(one.findings) for one in results)
    but = f" ({doubted} of them with reservations or doubts)" if doubted else ""
    said = (
        f"{counted(len(results), 'take')}: {usable} usable{but}, {len(results) - usable - failed} not, {failed} failed."
    )
    return overview_page("Takes", said, [*map(_line, results)])


def _line(one: TakeResult) -> TakeLine:
    grade = "bad" if not one.usable else "good" if not one.findings else "doubtful"
    verdict = "failed." if one.fault else one.verdict
    valid = "" if one.valid_share is None else f", {100 * one.valid_share:.0f} % valid"
    figures = "" if one.fault else f"{counted(one.instants, 'result')}{valid}"
    address = "" if one.fault else f"{quote(one.out.name)}/report.html"
    words = (one.fault,) if one.fault else one.findings
    links = [(f"Its report: {figures}", address)] if address else []
    return TakeLine(
        name=one.clip.name,
        grade=grade,
        verdict=verdict,
        figures=figures,
        address=address,
        bad=one.bad,
        doubtful=one.doubtful,
        section=take_section(one.clip.name, grade, verdict, words, links=links) if words else "",
    )
