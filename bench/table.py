"""One form for the tables of all benches: a named tuple a row, its fields' names over the columns."""

from collections.abc import Iterable
from typing import Any, NamedTuple


class Row(NamedTuple):
    """A measurement. ``bar`` is empty and ``met`` None where none is set."""

    what: str
    measured: str
    bar: str
    met: bool | None


def table(rows: Iterable[Any]) -> str:
    """Return rows, named tuples of one kind, as a Markdown table."""
    words = {True: "yes", False: "NO", None: ""}
    lines: list[str] = []
    for row in rows:
        if not lines:
            titles = [name.replace("_", " ") for name in row._fields]
            lines += [f"| {' | '.join(titles)} |", "|" + "---|" * len(titles)]
        cells = [words[cell] if isinstance(cell, bool | None) else str(cell) for cell in row]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)
