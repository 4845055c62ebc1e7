"""Parts of a USD text file (usda): prims as blocks, numbers, matrices and names."""

import re
from collections.abc import Sequence
from itertools import chain, count

import numpy as np

from psvideo.model.arrays import Doubles


def indented(lines: Sequence[str]) -> list[str]:
    """Return lines one level further in."""
    return [f"    {line}" if line else line for line in lines]


def prim(head: str, *parts: Sequence[str] | str) -> list[str]:
    """Return a prim: its head, and what stands in it, lines or lists of them."""
    inner = [line for part in parts for line in ([part] if isinstance(part, str) else part)]
    return [head, "{", *indented(inner), "}"]


def numbers_of(values: Sequence[float] | Doubles) -> str:
    """Return a tuple.

    >>> numbers_of([1, 0.5])
    '(1, 0.5)'
    """
    return "(" + ", ".join(f"{value:.9g}" for value in values) + ")"


def matrix_of(matrix: Doubles) -> str:
    """Return a matrix as USD has it: rows are what the axes become, the last one the place."""
    return "(" + ", ".join(numbers_of(row) for row in np.asarray(matrix).T) + ")"


def asset(path: str) -> str:
    """Return a path to another file, from where the stage lies.

    >>> asset("a.exr"), asset("a@b.exr")
    ('@./a.exr@', '@@@./a@b.exr@@@')
    """
    mark = "@@@" if "@" in path else "@"
    return f"{mark}./{path}{mark}"


def identifiers(words: Sequence[str]) -> list[str]:
    """Return words as prims beside each other may be called, no two alike.

    >>> identifiers(["key 1", "key-1", "3"])
    ['key_1', 'key_1_2', '_3']
    """
    names: list[str] = []
    for word in words:
        name = identifier(word)
        candidates = chain([name], (f"{name}_{n}" for n in count(2)))
        names.append(next(one for one in candidates if one not in names))
    return names


def identifier(word: str) -> str:
    """Return a word as a prim may be called.

    >>> identifier("key 1"), identifier("3")
    ('key_1', '_3')
    """
    name = re.sub(r"\W", "_", word, flags=re.ASCII)
    return f"_{name}" if not name or name[0].isdigit() else name
