"""What people type for lights: their names, and one value for all of them or one for each."""

import math
import re
from collections.abc import Mapping, Sequence

from psvideo.cli.options.typed import parse_fraction
from psvideo.errors import UsageError, nearest
from psvideo.formats.contract import TAKEN_NAMES


def parse_lights(text: str) -> tuple[str, ...]:
    """Return the lights' names from ``key,left,right``, in the order in which they will flash."""
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name) is None:
            raise UsageError(
                f"--lights {text!r}: {name!r} cannot name a light, because plates are kept in folders of that name. "
                "Use letters, digits, - and _, such as --lights key,left,right."
            )
        if names.count(name) > 1:
            raise UsageError(f"--lights {text!r} names {name!r} twice. Give every light a name of its own.")
        if name.lower() in TAKEN_NAMES:
            raise UsageError(
                f"--lights {text!r}: {name!r} names what lies beside the lights' plates. Choose another name."
            )
    return names


def parse_per_light(text: str, lights: Sequence[str], *, option: str) -> dict[str, str]:
    """Return one text per light from ``0.8ms`` (all alike) or ``key=0.8ms,left=0.4ms,right=0.4ms`` (each one named)."""
    if "=" not in text:
        return dict.fromkeys(lights, text)
    given: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not value:
            raise UsageError(f"{option} {text!r}: expected name=value in {part.strip()!r}, such as key=0.8ms.")
        if name not in lights:
            raise UsageError(
                f"{option} {text!r} names {name!r}, which is not among the lights; {nearest(name, lights)}"
            )
        if name in given:
            raise UsageError(f"{option} {text!r} gives {name!r} twice. Give one value for each light.")
        given[name] = value
    lacking = [name for name in lights if name not in given]
    if lacking:
        raise UsageError(
            f"{option} {text!r} leaves out {', '.join(lacking)}. Give a value for every light, or one for all."
        )
    return given


def parse_powers(text: str, lights: Sequence[str]) -> Mapping[str, float]:
    """Return the power of each light from ``0.5`` or ``key=1,left=0.5,right=0.5``."""
    parts = parse_per_light(text, lights, option="--power")
    return {name: parse_fraction(value, option="--power") for name, value in parts.items()}


def parse_weights(words: Sequence[str] | None) -> dict[str, float]:
    """Return how strong lights are in the beauty plate, from ``key=0.5``, or several in one word.

    >>> parse_weights(["key=0.5", "left=2,rim=0"])
    {'key': 0.5, 'left': 2.0, 'rim': 0.0}
    """
    found: dict[str, float] = {}
    for word in words or ():
        for text in word.split(","):
            name, equals, number = text.strip().partition("=")
            try:
                weight = float(number)
            except ValueError:
                weight = math.nan
            if not equals or not math.isfinite(weight) or weight < 0:
                raise UsageError(
                    f"--weight {word}: expected a light's name and how strong it is to be, such as key=0.5."
                )
            if name in found and found[name] != weight:
                raise UsageError(f"--weight {word}: {name} is {found[name]:g} already. Give one weight for each light.")
            found[name] = weight
    return found


def parse_lines(words: Sequence[str] | None) -> dict[str, int]:
    """Return light names and lines out of ``key=0``, ``key=0,left=1``, or ``key,rim=0`` for lights that share one.

    >>> parse_lines(["key=0", "left,rim=3", "top=1,low=2"])
    {'key': 0, 'left': 3, 'rim': 3, 'top': 1, 'low': 2}
    """
    lines: dict[str, int] = {}
    for word in words or ():
        waiting: list[str] = []
        for part in word.split(","):
            name, equals, line = part.strip().partition("=")
            if not name or (equals and not line.isdecimal()):
                raise _no_line(word)
            waiting.append(name)
            if equals:
                for wired in waiting:
                    if wired in lines:
                        raise UsageError(f"--line {word}: {wired} is wired to line {lines[wired]} already.")
                    lines[wired] = int(line)
                waiting = []
        if waiting:
            raise _no_line(word)
    return lines


def _no_line(word: str) -> UsageError:
    return UsageError(f"--line {word}: expected a light's name and a line's number, such as key=0.")
