"""What psvideo says when something is wrong: one paragraph, and the exit status that goes with it.

The message names the file (or the option), says what was found, what was expected and what to do about it.
"""

import contextlib
import difflib
import math
from collections.abc import Iterable, Iterator


class PsvideoError(Exception):
    """A fault of the footage, of a file, or of the run."""

    exit_status = 1


class NoStrobeError(PsvideoError):
    """Footage that can be read, and in which no strobe like the plan's is seen."""


class UsageError(PsvideoError):
    """A command that was called in a way it cannot be meant."""

    exit_status = 2


class AllDoneError(PsvideoError):
    """A run was to be resumed that had ended well, with the same inputs: nothing was left to do."""

    exit_status = 0


@contextlib.contextmanager
def said_of(file: object) -> Iterator[None]:
    """Begin what is raised within by the name of the file that it is about; functions of records know of no file.

    >>> with said_of("rig.toml"):
    ...     raise PsvideoError("Light 'key' is behind the surface.")
    Traceback (most recent call last):
    psvideo.errors.PsvideoError: rig.toml: Light 'key' is behind the surface.
    """
    try:
        yield
    except PsvideoError as fault:
        raise type(fault)(f"{file}: {fault}") from None


def check_kind(name: str, given: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Raise UsageError where a parameter is not of the kind that ``expected`` describes.

    >>> check_kind("rig", "rig.toml", float, "a number")
    Traceback (most recent call last):
    psvideo.errors.UsageError: `rig` is 'rig.toml' (str); expected a number.
    """
    if not isinstance(given, kind):
        shown = f"{given!r:.60} ({type(given).__name__})" if isinstance(given, (str, int, float)) else None
        raise UsageError(f"`{name}` is {shown or f'of type {type(given).__name__}'}; expected {expected}.")


def check_within(name: str, number: float, least: float, most: float, *, unit: str = "") -> None:
    """Raise UsageError where a parameter is no number from ``least`` to ``most`` that is finite, as NaN is.

    >>> check_within("focal_px", float("nan"), 1, 1e6, unit="pixels")
    Traceback (most recent call last):
    psvideo.errors.UsageError: `focal_px` nan: expected 1 to 1e+06 pixels.
    """
    if not (least <= number <= most and abs(number) < math.inf):
        raise UsageError(f"`{name}` {number:g}: expected {least:g} to {most:g} {unit}".rstrip() + ".")


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the advice that ends a message about an unknown name: the nearest known one, else all of them.

    >>> nearest("shutter", ["shutter_deg", "fps"])
    "did you mean 'shutter_deg'?"
    >>> nearest("zzz", ["fps", "name"])
    'known are: fps, name.'
    """
    names = list(known)
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]!r}?"
    return f"known are: {', '.join(sorted(names))}."
