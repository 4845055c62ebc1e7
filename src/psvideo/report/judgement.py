"""Judgements: one subject, one word, what was found, and what to change on set."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

Grade = Literal["good", "doubtful", "bad", "unknown"]
DECISIVE = ("strobe", "curve", "timing", "order", "rig")
"""Where one of these is doubtful, all normals may be wrong, and not only parts of them."""


NAMED = 4
"""This many lights or rounds are named one by one; of more, only how many."""


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """One line of a judgement. ``subject`` is a word such as ``exposure``; ``found`` a sentence with its figures;
    ``advice`` what to change on set, empty where there is nothing to change. ``unknown``: it could not be judged."""

    subject: str
    grade: Grade
    found: str
    advice: str = ""

    @property
    def sentence(self) -> str:
        """What was found, and what to do about it."""
        return f"{self.found} {self.advice}".strip()

    def spelled(self, spell: Callable[[str], str]) -> "Judgement":
        """Return the line in the words of whoever reads it: parameters, or options."""
        return replace(self, found=spell(self.found), advice=spell(self.advice))


def usable(judgements: Sequence[Judgement]) -> bool:
    """Return whether nothing is bad."""
    return all(one.grade != "bad" for one in judgements)


def verdict_of(judgements: Sequence[Judgement], *, warned: bool = False) -> str:
    """Return the sentence that a report begins with; ``warned``: the footage itself has something to be warned of."""
    grades = {one.grade for one in judgements}
    if "bad" in grades:
        subjects = list(dict.fromkeys(one.subject for one in judgements if one.grade == "bad"))
        return f"This take is not usable as it is: {', '.join(subjects)}."
    if any(one.grade == "doubtful" and one.subject in DECISIVE for one in judgements):
        return "This take is doubtful: see below before using it."
    reserved = warned or "doubtful" in grades
    return "This take is usable, with reservations." if reserved else "This take is usable."


def gravest_first(judgements: Sequence[Judgement]) -> tuple[Judgement, ...]:
    """Return what is bad, then what is doubtful, of both first what may spoil all normals, else in the given order;
    what is good or unknown is left out."""
    graver = sorted(judgements, key=lambda one: one.subject not in DECISIVE)
    return tuple(one for grade in ("bad", "doubtful") for one in graver if one.grade == grade)
