"""The lines of a light list: which of their numbers are a direction, which strengths, and what names the light.

Lists write a name before the numbers or after them, number their lines or do not, put quotes around words, comment, or
hold a light in every column instead of every line. Where it is not plain which numbers are meant, those are that are of
unit length in all lines.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.formats.separators import pairs_with_points
from psvideo.model.units import counted

DIRECTION, WITH_ONE, WITH_STRENGTHS = 3, 4, 6
"""Numbers of a line: x y z, these and one strength, or these and red, green and blue strengths."""
UNIT = 0.02
"""A direction's length is off by no more than this from 1: two digits after the point make 0.01."""
COMMENT, REMARK = re.compile(r"\s*(#|//|%)"), re.compile(r"\s(#|//)")
"""A line that is one begins so; behind numbers one begins so, and a name may hold the same ("vase #2.png")."""
WORD = re.compile(r'"[^"]*"|[^\s,;]+')
BESIDE = ' \t,;"'
PLACED = re.compile(r"(\d+)[\s,;]+(\S.*)")


@dataclass(frozen=True, kw_only=True)
class ListLine:
    """One line that holds numbers, ``name`` what else it holds, and ``words`` as it writes its numbers."""

    name: str
    words: tuple[str, ...]

    @property
    def numbers(self) -> tuple[float, ...]:
        """The line's numbers."""
        return tuple(map(float, self.words))

    def from_place(self, place: int, count: int | None = None) -> "ListLine":
        """Return the line with ``count`` of its numbers from a place on (all of them where that is left out); those
        before are a part of its name."""
        name = " ".join(part for part in (self.name, *self.words[:place]) if part)
        return replace(self, name=name, words=self.words[place : None if count is None else place + count])


def lines_in(text: str) -> list[ListLine]:
    """Return the lines of a list that hold finite numbers.

    >>> lines_in("# two lights\\nvase 1.jpg  0 0 1\\n0.6, 0, 0.8, 'b'")[0]
    ListLine(name='vase 1.jpg', words=('0', '0', '1'))
    """
    return [line for line in map(_line, without_comments(text)) if line.words]


def without_comments(text: str) -> list[str]:
    """Return the lines of a list that are no comment, without the remarks behind their numbers."""
    return [_without_remark(raw) for raw in text.splitlines() if not COMMENT.match(raw)]


def directed(path: Path, lines: Sequence[ListLine], *, by_count: bool = False) -> list[ListLine]:
    """Return lines that hold nothing but a direction, or one and its strengths: one number or three.

    ``by_count`` are the lines of a list that says how many it has: they are lights, never columns, and where nothing in
    them is of unit length, the last three numbers behind a name that ends in whole numbers are a position. Raises
    PsvideoError where lines hold other numbers as well, and it cannot be told which are meant.
    """
    lines = lines if by_count else _in_columns(lines) or lines
    widths = {len(line.words) for line in lines}
    if widths == {DIRECTION} or min(widths) < DIRECTION or _have_strengths(lines):
        return _without_places(lines)
    rests = range(DIRECTION, min(widths) + 1) if len(widths) == 1 or all(line.name for line in lines) else ()
    right = [one for one in (_lines_from(lines, rest) for rest in rests) if _are_units(one)]
    if by_count and not right and WITH_STRENGTHS not in widths:
        right = _positions(lines)
    if len(right) != 1:
        odd = next((line for line in lines if len(line.words) not in (DIRECTION, WITH_STRENGTHS)), None)
        words = (odd or max(lines, key=lambda line: len(line.words))).words
        pointed = pairs_with_points(words)
        typed = f" Where commas were decimal points, write {' '.join(pointed)}." if len(pointed) >= DIRECTION else ""
        raise PsvideoError(
            f"{path}: a line has {counted(len(words), 'number')} ({' '.join(words[:8])}). Expected three in every "
            "line, x y z of the direction to the light, or these, of length 1, and the light's strength behind them: "
            f"one number, or red, green and blue.{typed}"
        )
    return _without_places(right[0])


def _have_strengths(lines: Sequence[ListLine]) -> bool:
    """Return whether every line is a direction, or one of unit length and three strengths."""
    long = [line for line in lines if len(line.words) != DIRECTION]
    return all(len(line.words) == WITH_STRENGTHS for line in long) and _are_units(long)


def _lines_from(lines: Sequence[ListLine], rest: int) -> list[ListLine]:
    """Return lines with the direction that begins ``rest`` numbers before the end, and with the strengths behind it."""
    lines = [line.from_place(len(line.words) - rest) for line in lines]
    if rest == WITH_STRENGTHS or (rest == WITH_ONE and _are_strengths([line.numbers[DIRECTION] for line in lines])):
        return lines
    return [line.from_place(0, DIRECTION) for line in lines]


def _are_strengths(last: Sequence[float]) -> bool:
    """Return whether a fourth number is a strength: neither the line's own number, nor 0 in every line, as computer
    graphics write behind directions."""
    return any(last) and not (len(last) > 1 and set(np.diff(last)) == {1})


def _positions(lines: Sequence[ListLine]) -> list[list[ListLine]]:
    """Return lines with their last three numbers, of any length; nothing where one before may be more than a name's."""
    if not all(word.isdigit() for line in lines for word in line.words[:-DIRECTION]):
        return []
    return [[line.from_place(len(line.words) - DIRECTION) for line in lines]]


def is_number(word: str) -> bool:
    """Return whether a word of a list is a finite number."""
    try:
        return bool(np.isfinite(float(word))) and "_" not in word
    except ValueError:
        return False


def _without_remark(text: str) -> str:
    before = (text[: found.start()] for found in REMARK.finditer(text))
    return next((part for part in before if is_number(part.split()[-1] if part.split() else "")), text)


def _line(text: str) -> ListLine:
    """Take a line apart: its numbers are the last ones, or the first ones where a name follows."""
    words = list(WORD.finditer(text))
    bare = [word.group().strip('"') for word in words]
    are = [is_number(word) for word in bare]
    last = next((place for place in range(len(words), 0, -1) if not are[place - 1]), 0)
    first = next((place for place, number in enumerate(are) if not number), len(words))
    if len(words) - last >= DIRECTION:
        name = text[: words[last].start()] if last else ""
        return ListLine(name=name.strip(BESIDE), words=tuple(bare[last:]))
    if first >= DIRECTION:
        return ListLine(name=text[words[first].start() :].strip(BESIDE), words=tuple(bare[:first]))
    return ListLine(name="", words=tuple(word for word, number in zip(bare, are, strict=True) if number))


def _are_units(lines: Sequence[ListLine]) -> bool:
    lengths = [np.linalg.norm(line.numbers[:DIRECTION]) for line in lines]
    return bool(np.all(np.abs(np.array(lengths) - 1) <= UNIT))


def _in_columns(lines: Sequence[ListLine]) -> list[ListLine]:
    """Return a line for every column where three lines hold x, y and z of more lights than three."""
    widths = {len(line.words) for line in lines}
    if len(lines) != DIRECTION or len(widths) != 1 or min(widths) <= DIRECTION or any(line.name for line in lines):
        return []
    turned = [ListLine(name="", words=words) for words in zip(*(line.words for line in lines), strict=True)]
    return turned if _are_units(turned) else []


def _without_places(lines: Sequence[ListLine]) -> list[ListLine]:
    """Return lines whose names do not begin with the line's own number."""
    found = [PLACED.fullmatch(line.name) for line in lines]
    places = [int(one[1]) for one in found if one]
    if len(places) < len(lines) or set(np.diff(places)) - {1}:
        return list(lines)
    return [replace(line, name=one[2]) for line, one in zip(lines, found, strict=True) if one]
