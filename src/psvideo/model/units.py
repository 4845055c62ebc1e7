"""Times and frame rates as people write them."""

from fractions import Fraction

NTSC = Fraction(1000, 1001)
"""What broadcast rates are slower than whole ones by."""


def counted(count: int, thing: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "plate"), counted(0, "plate")
    ('1 plate', '0 plates')
    """
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def show_seconds(seconds: float) -> str:
    """Return a time as people write it, with four figures.

    >>> show_seconds(0.0008), show_seconds(0.000_05), show_seconds(1.5)
    ('0.8 ms', '50 us', '1.5 s')
    """
    if abs(seconds) >= 1:
        return f"{seconds:.4g} s"
    return f"{seconds * 1e3:.4g} ms" if abs(seconds) >= 1e-4 or seconds == 0 else f"{seconds * 1e6:.4g} us"


def show_rate(fps: Fraction) -> str:
    """Return a frame rate with its exact ratio where it is no whole number.

    >>> show_rate(Fraction(120000, 1001)), show_rate(Fraction(60))
    ('119.88 fps (120000/1001)', '60 fps')
    """
    return f"{fps} fps" if fps.denominator == 1 else f"{float(fps):.5g} fps ({fps})"
