"""A page over many takes: what recurs, one line per take, and details of those that need attention."""

import html
from collections.abc import Sequence
from dataclasses import dataclass

from psvideo import __version__
from psvideo.model.units import counted, listed
from psvideo.report.html import MARKS, PAGE
from psvideo.report.style import STYLE

MOST_NAMES = 6
"""Takes that are named for what recurs; the table below has all."""


@dataclass(frozen=True, kw_only=True)
class TakeLine:
    """One take on the page: its ``name``, its ``grade`` and the words that sum it up, ``figures`` such as how many
    results it has, the ``address`` of its own report if it has one, what is ``bad`` and ``doubtful`` in it (subjects),
    and the HTML of what was found, empty where nothing is to be said."""

    name: str
    grade: str
    verdict: str
    figures: str = ""
    address: str = ""
    bad: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    section: str = ""


def overview_page(title: str, summary: str, lines: Sequence[TakeLine]) -> str:
    """Return a self-contained page over takes, in the given order; ``summary`` is a sentence."""
    rows = "".join(_row(number, line) for number, line in enumerate(lines))
    table = f'<table class="lines takes">{rows}</table>' if len(lines) > 1 else ""
    below = "".join(f'<div id="take{n}">{line.section}</div>' for n, line in enumerate(lines) if line.section)
    body = f"<p>{html.escape(summary)}</p>{_recurring(lines)}{table}{below}"
    return PAGE.format(title=html.escape(title), style=STYLE, head="", body=body, version=__version__)


def take_section(
    name: str, grade: str, verdict: str, findings: Sequence[str], *, links: Sequence[tuple[str, str]]
) -> str:
    """Return what was found of one take: its grade, what sums it up, sentences, and (words, address) to go on to."""
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in findings)
    found = f"<ol>{items}</ol>" if items else ""
    there = ", ".join(f'<a href="{address}">{html.escape(words)}</a>' for words, address in links)
    on = f'<p class="soft">{there}</p>' if there else ""
    return (
        f'<section><div class="verdict {grade}"><p class="word"><i>{MARKS[grade]}</i> {html.escape(name)}: '
        f"{html.escape(verdict)}</p>{found}</div>{on}</section>"
    )


def _row(number: int, line: TakeLine) -> str:
    to = f"#take{number}" if line.section else line.address
    name = f'<a href="{to}">{html.escape(line.name)}</a>' if to else html.escape(line.name)
    verdict = f'{html.escape(line.verdict)} <span class="soft">{html.escape(line.figures)}</span>'
    return (
        f'<tr><td class="grade {line.grade}"><i>{MARKS[line.grade]}</i> {line.grade}</td>'
        f"<th>{name}</th><td>{verdict}</td></tr>"
    )


def _recurring(lines: Sequence[TakeLine]) -> str:
    """Return a table of what speaks against more than one take, what is bad in most takes first."""
    subjects = dict.fromkeys(subject for line in lines for subject in (*line.bad, *line.doubtful))
    found = []
    for subject in subjects:
        bad = [n for n, line in enumerate(lines) if subject in line.bad]
        doubtful = [n for n, line in enumerate(lines) if subject in line.doubtful and n not in bad]
        if len(bad) + len(doubtful) > 1:
            found.append((subject, bad, doubtful))
    found.sort(key=lambda one: (-len(one[1]), -len(one[2])))
    rows = "".join(
        f"<tr><th>{html.escape(subject)}</th><td>{_counts(bad, doubtful)}: {_names(lines, [*bad, *doubtful])}</td></tr>"
        for subject, bad, doubtful in found
    )
    return f'<h2>In more than one take</h2><table class="facts">{rows}</table><h2>All takes</h2>' if rows else ""


def _counts(bad: Sequence[int], doubtful: Sequence[int]) -> str:
    return " and ".join(
        f"{word} in {counted(len(numbers), 'take')}"
        for numbers, word in ((bad, "bad"), (doubtful, "doubtful"))
        if numbers
    )


def _names(lines: Sequence[TakeLine], numbers: Sequence[int]) -> str:
    return listed([f'<a href="#take{n}">{html.escape(lines[n].name)}</a>' for n in numbers], MOST_NAMES)
