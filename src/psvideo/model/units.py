"""Times and frame rates as people write them."""

from fractions import Fraction

NTSC = Fraction(1000, 1001)
"""What broadcast rates are slower than whole ones by."""


def counted(count: int, thing: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "plate"), counted(0, "plate"), counted(3, "flash")
    ('1 plate', '0 plates', '3 flashes')
    """
    if count == 1:
        return f"{count} {thing}"
    return f"{count} {thing}{'es' if thing.endswith(('s', 'sh', 'ch', 'x')) else 's'}"


def show_seconds(seconds: float, *, figures: int = 4) -> str:
    """Return a time as people write it, with this many figures.

    >>> show_seconds(0.0008), show_seconds(0.000_05), show_seconds(1.5), show_seconds(0.000_157, figures=2)
    ('0.8 ms', '50 us', '1.5 s', '0.16 ms')
    """
    if abs(seconds) >= 1:
        return f"{seconds:.{figures}g} s"
    in_ms = abs(seconds) >= 1e-4 or seconds == 0
    return f"{seconds * 1e3:.{figures}g} ms" if in_ms else f"{seconds * 1e6:.{figures}g} us"


def show_rate(fps: Fraction) -> str:
    """Return a frame rate with its exact ratio where it is no whole number.

    >>> show_rate(Fraction(120000, 1001)), show_rate(Fraction(60))
    ('119.88 fps (120000/1001)', '60 fps')
    """
    return f"{fps} fps" if fps.denominator == 1 else f"{float(fps):.5g} fps ({fps})"
