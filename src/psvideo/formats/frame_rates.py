"""Frame rates as they are written in files and on the command line, read as exact ratios."""

from fractions import Fraction

from psvideo.model.units import NTSC

MOST_FPS = 1_000_000
"""No camera of rows is faster: what is more is a slip, or a time."""
ROUNDED = Fraction(200, 1_000_000)
"""A rate that is written with a point may be rounded by this share of it."""


def parse_fps(fps: float | str) -> Fraction:
    """Return a frame rate as the exact ratio that it is written as; raises ValueError where it is none.

    >>> parse_fps("120000/1001")
    Fraction(120000, 1001)
    >>> parse_fps(23.976)
    Fraction(2997, 125)
    """
    try:
        rate = Fraction(str(fps))
    except (ValueError, ZeroDivisionError):
        raise ValueError('expected a number or a ratio as text, such as 100 or "120000/1001"') from None
    if not 0 < rate <= MOST_FPS:
        raise ValueError(f"expected a rate above 0, and at most {MOST_FPS:,} frames a second")
    return rate


def broadcast_fps(fps: float | str) -> Fraction:
    """Return a frame rate like ``parse_fps``; the usual roundings of broadcast rates, written with a point, become the
    exact ratio.

    >>> broadcast_fps(23.976), broadcast_fps("119.88"), broadcast_fps("2997/125"), broadcast_fps(24)
    (Fraction(24000, 1001), Fraction(120000, 1001), Fraction(2997, 125), Fraction(24, 1))
    """
    rate = parse_fps(fps)
    whole = round(rate / NTSC)
    exact = whole * NTSC
    is_rounded = "." in str(fps) and rate.denominator > 1 and abs(rate - exact) < ROUNDED * exact
    return exact if is_rounded and whole % 6 == 0 else rate
