"""Times, frame rates, and how many there are of something, as people write them."""

from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction

NTSC = Fraction(1000, 1001)
"""What broadcast rates are slower than whole ones by."""
MISNAMED_PPM = 1000.0
"""By how much a clock seems off where such a rate is taken for the whole one, or the other way round."""


def counted(count: int, thing: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "plate"), counted(0, "plate"), counted(3, "flash")
    ('1 plate', '0 plates', '3 flashes')
    """
    if count == 1:
        return f"{count} {thing}"
    return f"{count} {thing}{'es' if thing.endswith(('s', 'sh', 'ch', 'x')) else 's'}"


def listed(words: Sequence[object], most: int, *, things: str = "") -> str:
    """Return the first ``most`` of several words in a row, and how many more ``things`` there are.

    >>> listed(["key", "left", "right"], 2), listed([7, 9], 2), listed([7, 9, 11, 20], 2, things="places")
    ('key, left and 1 more', '7, 9', '7, 9 and 2 more places')
    """
    more = f" and {len(words) - most} more {things}".rstrip() if len(words) > most else ""
    return ", ".join(map(str, words[:most])) + more


def show_seconds(seconds: float, *, figures: int = 4) -> str:
    """Return a time as people write it, with this many figures.

    >>> show_seconds(0.0008), show_seconds(0.000_05), show_seconds(1.5), show_seconds(0.000_157, figures=2)
    ('0.8 ms', '50 us', '1.5 s', '0.16 ms')
    >>> show_seconds(0.99996), show_seconds(0.000_099_999_6)
    ('1 s', '0.1 ms')
    """
    seconds = float(f"{seconds:.{figures}g}")  # the unit is that of what is shown
    if abs(seconds) >= 1:
        return f"{seconds:.{figures}g} s"
    in_ms = abs(seconds) >= 1e-4 or seconds == 0
    return f"{seconds * 1e3:.{figures}g} ms" if in_ms else f"{seconds * 1e6:.{figures}g} us"


def no_less(value: float, *, figures: int = 4) -> float:
    """Return the least number of this many figures that is not below a value: what is advised as "at least".

    >>> no_less(8.34250083, figures=6), no_less(0.0008)
    (8.34251, 0.0008)
    """
    return float(Context(prec=figures, rounding=ROUND_CEILING).create_decimal(Decimal(repr(float(value)))))


def no_more(value: float, *, figures: int = 4) -> float:
    """Return the largest number of this many figures that is not above a value: what is advised as "at most".

    >>> no_more(0.00088889), no_more(0.0008)
    (0.0008888, 0.0008)
    """
    return float(Context(prec=figures, rounding=ROUND_FLOOR).create_decimal(Decimal(repr(float(value)))))


def show_ppm(ppm: float) -> str:
    """Return millionths as people write them, with four figures.

    >>> show_ppm(10_000.4), show_ppm(0.12345), show_ppm(-1_000_000.0)
    ('10000 ppm', '0.1235 ppm', '-1000000 ppm')
    """
    return f"{float(f'{ppm:.4g}'):.10g} ppm"


def show_rate(fps: Fraction) -> str:
    """Return a frame rate with its exact ratio where it is no whole number.

    >>> show_rate(Fraction(120000, 1001)), show_rate(Fraction(60))
    ('119.88 fps (120000/1001)', '60 fps')
    """
    return f"{fps} fps" if fps.denominator == 1 else f"{float(fps):.5g} fps ({fps})"
