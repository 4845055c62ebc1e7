"""A caution: one thing to think about before a shoot."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class Caution:
    """One thing to know: ``warning`` where people, footage or lights suffer, ``note`` where it is good to know."""

    kind: str
    level: Literal["warning", "note"]
    text: str


def warning(kind: str, text: str) -> Caution:
    """Return a caution on what people, footage or lights suffer from."""
    return Caution(kind=kind, level="warning", text=text)


def note(kind: str, text: str) -> Caution:
    """Return a caution on what is good to know."""
    return Caution(kind=kind, level="note", text=text)
