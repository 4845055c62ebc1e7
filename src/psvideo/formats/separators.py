"""Commas, points and spaces that stand where a file expects another of them: what to type instead."""

import re
from collections.abc import Sequence

SPACED = re.compile(r"\[\s*(-?[\d.]+(?:[ \t]+-?[\d.]+)+)\s*\]")
DECIMAL_COMMA = re.compile(r"=\s*(-?\d+,\d+)\s*(?:#.*)?$", re.MULTILINE)
WHOLE = re.compile(r"-?\d+")
WRITE_LIST = "Write commas between the numbers of a list"


def pairs_with_points(words: Sequence[str]) -> tuple[str, ...]:
    """Return the numbers that words are where commas were decimal points; empty where they cannot have been.

    >>> pairs_with_points(["0", "1", "-0", "2", "0", "97"])
    ('0.1', '-0.2', '0.97')
    >>> pairs_with_points(["0", "0", "1"])
    ()
    """
    behind = words[1::2]
    if len(words) % 2 or not all(map(WHOLE.fullmatch, words)) or any(word.startswith("-") for word in behind):
        return ()
    return tuple(f"{before}.{after}" for before, after in zip(words[::2], behind, strict=True))


def toml_separators(text: str) -> str:
    """Return a sentence on what to type where text is no TOML for its commas and spaces; "" where they are not why.

    >>> toml_separators("direction = [0.1 0.2 0.97]")
    'Write commas between the numbers of a list: [0.1, 0.2, 0.97].'
    >>> toml_separators("fps = 23,976")
    'Write numbers with a point: 23.976.'
    """
    if spaced := SPACED.search(text):
        return f"{WRITE_LIST}: [{', '.join(spaced[1].split())}]."
    if comma := DECIMAL_COMMA.search(text):
        return f"Write numbers with a point: {comma[1].replace(',', '.')}."
    return ""


def as_list(found: object, *, most: int = 0) -> str:
    """Return ", such as [...]" with what to type for a list of numbers that was found as text, or, of ``most`` numbers,
    with commas for decimal points; "" elsewhere.

    >>> as_list("0.1 0.2 0.97"), as_list([0, 1, 0, 2, 0, 97], most=3), as_list([0, 0, 0, 1], most=3)
    (', such as [0.1, 0.2, 0.97]', ', such as [0.1, 0.2, 0.97]', '')
    """
    if isinstance(found, str):
        words = tuple(re.split(r"[\s,;]+", found.strip()))
        numbers = words if all(re.fullmatch(r"-?\d*\.?\d+", word) for word in words) else ()
    else:
        pairs = pairs_with_points([str(one) for one in found]) if isinstance(found, list | tuple) else ()
        numbers = pairs if len(pairs) == most else ()
    return f", such as [{', '.join(numbers)}]" if numbers else ""
