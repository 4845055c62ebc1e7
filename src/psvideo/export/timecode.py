"""Time codes of pictures that lie between a clip's frames: the first frame's code, counted on."""

import re
from fractions import Fraction

CODE = re.compile(r"(\d\d):(\d\d):(\d\d):(\d\d)")
MOST_FRAMES = 30
"""EXR's time code counts at most 30 frames a second."""


def advanced(code: str, time_s: float, fps: Fraction) -> str | None:
    """Return the code of the frame that is exposed at ``time_s``; ``code`` is frame 0's, ``HH:MM:SS:FF``.

    None where that cannot be said: above 30 frames a second, and for drop-frame codes.

    >>> advanced("01:00:59:23", 2 / 24, Fraction(24))
    '01:01:00:01'
    >>> advanced("01:00:59:23", 0.1, Fraction(120)) is None
    True
    """
    found = CODE.fullmatch(code)
    base = round(fps)
    if found is None or base > MOST_FRAMES:
        return None
    hours, minutes, seconds, frame = map(int, found.groups())
    total = ((hours * 60 + minutes) * 60 + seconds) * base + frame + int(time_s * fps + Fraction(1, 10**6))
    seconds, frame = divmod(total, base)
    return f"{seconds // 3600 % 24:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{frame:02d}"
