"""Times, speeds, sizes and places in a picture as people type them, each with its unit."""

import math
import re
from collections.abc import Sequence
from fractions import Fraction

from psvideo.cli.console import plain
from psvideo.errors import UsageError
from psvideo.formats.frame_rates import broadcast_fps
from psvideo.model.choices import PREVIEWS, Preview

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"


def parse_seconds(text: str, *, option: str) -> float:
    """Return a time in seconds from text such as ``0.8ms``, ``800us``, ``1/1250s``; a bare 0 needs no unit.

    Raises UsageError that names the option where the text is no time.

    >>> parse_seconds("0.8ms", option="--flash"), parse_seconds("1/1250 s", option="--flash")
    (0.0008, 0.0008)
    """
    found = re.fullmatch(rf"\s*({NUMBER})(?:\s*/\s*({NUMBER}))?\s*([a-zµμ]*)\s*", text, re.IGNORECASE)
    unit = found[3].lower() if found else ""
    if found is None or (unit not in SECONDS and not (unit == "" and float(found[1]) == 0)):
        raise UsageError(
            f"{option} {text!r} is not a time. Write a number and its unit, such as 0.8ms, 800us or 1/1250s."
        )
    below = float(found[2] or 1)
    if below == 0:
        raise UsageError(f"{option} {text!r} divides by zero. Write a time such as 0.8ms, 800us or 1/1250s.")
    seconds = float(found[1]) / below / round(1 / SECONDS.get(unit, 1.0))
    if not math.isfinite(seconds):
        raise UsageError(f"{option} {text!r} is no number of seconds. Write a time such as 0.8ms, 800us or 1/1250s.")
    return seconds


def parse_starts_s(text: str) -> list[float]:
    """Return the seconds of a list such as ``0,1.3,-2.1``. Raises UsageError that names the option.

    >>> parse_starts_s("0, 1.3")
    [0.0, 1.3]
    """
    parts = [part.strip() for part in text.split(",")]
    if not all(re.fullmatch(NUMBER, part, re.IGNORECASE) and math.isfinite(float(part)) for part in parts):
        raise UsageError(f"--starts {text!r} is not a list of seconds. Write one for each clip, such as 0,1.3,2.1.")
    return [float(part) for part in parts]


def parse_positive_seconds(text: str, *, option: str) -> float:
    """Return a time above zero, as `parse_seconds` does."""
    seconds = parse_seconds(text, option=option)
    if not 0 < seconds < math.inf:
        raise UsageError(f"{option} {text!r} is not above zero. Write a time such as 0.8ms or 800us.")
    return seconds


def parse_speed_px_s(text: str, *, field_width_m: float | None, width_px: int | None) -> float:
    """Return a speed in pixels per second from ``800`` or ``800px/s``, or from ``0.5m/s`` and the field's width.

    >>> parse_speed_px_s("0.5 m/s", field_width_m=0.6, width_px=1920)
    1600.0
    """
    found = re.fullmatch(rf"\s*({NUMBER})\s*(px/s|m/s)?\s*", text, re.IGNORECASE)
    if found is None or not 0 < float(found[1]) < math.inf:
        raise UsageError(f"--speed {text!r} is not a speed above zero. Write pixels per second (800) or 0.5m/s.")
    if (found[2] or "px/s").lower() == "px/s":
        return float(found[1])
    if field_width_m is None or width_px is None:
        raise UsageError(
            f"--speed {text!r} is in metres per second, which needs the width of what the camera sees: add "
            "--field-width, such as --field-width 0.6m, or give the speed in pixels per second."
        )
    return float(found[1]) / field_width_m * width_px


def parse_metres(text: str, *, option: str) -> float:
    """Return a length in metres from ``0.6m``, ``60cm``, ``600mm`` or a bare number of metres."""
    found = re.fullmatch(rf"\s*({NUMBER})\s*(m|cm|mm)?\s*", text, re.IGNORECASE)
    if found is None or not 0 < float(found[1]) < math.inf:
        raise UsageError(f"{option} {text!r} is not a length above zero. Write it as 0.6m, 60cm or 600mm.")
    return float(found[1]) / {"m": 1, "cm": 100, "mm": 1000}[(found[2] or "m").lower()]


def parse_radius_mm(text: str) -> float:
    """Return a length in millimetres from ``40``, ``40mm``, ``4cm``, ``0.04m`` or ``1.5in``.

    >>> parse_radius_mm("40"), parse_radius_mm("4 cm"), parse_radius_mm("2in")
    (40.0, 40.0, 50.8)
    """
    found = re.fullmatch(rf"\s*({NUMBER})\s*(m|cm|mm|in|inch|\")?\s*", text, re.IGNORECASE)
    if found is None:
        raise UsageError(f"--radius-mm {text!r} is not a length. Write it as 40, 40mm, 4cm or 1.5in.")
    return float(found[1]) * {"m": 1000, "cm": 10, "mm": 1}.get((found[2] or "mm").lower(), 25.4)


def parse_size_px(text: str) -> tuple[int, int]:
    """Return (width, height) from ``1920x1080``."""
    found = re.fullmatch(r"\s*(\d{1,6})\s*[x×*]\s*(\d{1,6})\s*", text, re.IGNORECASE)
    if found is None or int(found[1]) == 0 or int(found[2]) == 0:
        raise UsageError(f"--size {text!r} is not a size. Write width x height in pixels, such as 1920x1080.")
    return int(found[1]), int(found[2])


def parse_rate(text: str) -> Fraction:
    """Return a frame rate; the usual roundings of broadcast rates (23.98, 59.94, 119.88) become the exact ratio.

    >>> parse_rate("119.88"), parse_rate("120"), parse_rate("60000/1001")
    (Fraction(120000, 1001), Fraction(120, 1), Fraction(60000, 1001))
    """
    try:
        return broadcast_fps(text.strip())
    except ValueError as fault:
        raise UsageError(f"--fps {text!r} is not a frame rate: {fault}.") from None


def parse_instants(text: str) -> str | Fraction:
    """Return which instants are wanted: ``round``, ``flash``, ``frame``, or an exact rate.

    >>> parse_instants("flash"), parse_instants("23.976")
    ('flash', Fraction(24000, 1001))
    """
    word = text.strip().lower()
    if word in ("round", "flash", "frame"):
        return word
    try:
        return parse_rate(text)
    except UsageError:
        wanted = "expected round, flash, frame, or a rate above 0 such as 24, 23.976 or 24000/1001"
        raise UsageError(f"--fps {text!r}: {wanted}.") from None


def parse_fraction(text: str, *, option: str) -> float:
    """Return a share above 0 and at most 1 from ``0.1`` or ``10%``."""
    found = re.fullmatch(rf"\s*({NUMBER})\s*(%?)\s*", text)
    share = float(found[1]) / (100 if found[2] else 1) if found else math.nan
    if not 0 < share <= 1:
        raise UsageError(f"{option} {text!r} is not a share. Write a number above 0 and at most 1, or a percentage.")
    return share


def parse_columns(text: str) -> tuple[int, int]:
    """Return the first column and one past the last one from ``0-80``; raises UsageError where that is no range."""
    first, dash, end = text.partition("-")
    if not (dash and first.strip().isdecimal() and end.strip().isdecimal() and int(first) < int(end)):
        raise UsageError(
            f"--columns {text!r} is not a range. Write the first column and one past the last one, as 0-80."
        )
    return int(first), int(end)


def parse_numbers(text: str, count: int, *, option: str, form: str) -> tuple[float, ...]:
    """Return this many numbers in pixels from ``10,20,5``; the third of three is a length above 0.

    >>> parse_numbers("10,20,5", 3, option="--circle", form="x,y,radius")
    (10.0, 20.0, 5.0)
    """
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)) or (count == 3 and values[2] <= 0):
        raise UsageError(f"{option} {text!r}: expected {form}, numbers in pixels with commas between them.")
    return values


def parse_circle(text: str) -> tuple[float, float, float]:
    """Return a circle's x, y and radius in pixels from ``10,20,5``."""
    x, y, radius = parse_numbers(text, 3, option="--circle", form="x,y,radius")
    return x, y, radius


def parse_box(text: str) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom in pixels from ``0,0,64,48``."""
    left, top, right, bottom = map(int, parse_numbers(text, 4, option="--box", form="left,top,right,bottom"))
    return left, top, right, bottom


def parse_point(text: str, *, option: str) -> tuple[float, float]:
    """Return x and y in pixels from ``320,240``."""
    x, y = parse_numbers(text, 2, option=option, form="x,y")
    return x, y


def chosen_previews(named: Sequence[Preview] | None, *, no_preview: bool) -> Sequence[Preview]:
    """Return the movies for eyes that are to be made: those named, none, or else the usual ones."""
    if named and no_preview:
        raise UsageError("--preview asks for a movie, and --no-preview for none. Leave one of the two out.")
    return () if no_preview else plain(named) or PREVIEWS
