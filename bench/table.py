"""One table for all benches: what was measured, its figure, its bar, and whether it was met."""

from collections.abc import Iterable
from typing import NamedTuple


class Row(NamedTuple):
    """A measurement. ``bar`` is empty and ``met`` None where none is set."""

    what: str
    figure: str
    bar: str
    met: bool | None


def table(rows: Iterable[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = ["| what | measured | bar | met |", "|---|---|---|---|"]
    words = {True: "yes", False: "NO", None: ""}
    lines += [f"| {row.what} | {row.figure} | {row.bar} | {words[row.met]} |" for row in rows]
    return "\n".join(lines)
