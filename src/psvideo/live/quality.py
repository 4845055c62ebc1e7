"""Quality that steps down instead of falling behind: how much smaller than the camera's the live picture is.

Results are to come often and soon. Where they do not, the picture is made smaller, step by step, until they do; where
there has been time to spare for a while, larger again. Every change is said.
"""

from dataclasses import dataclass, replace

MOST_AGE_S = 0.2
"""From the end of an exposure to the picture it may take so long."""
LEAST_RATE = 15.0
"""Results a second that look like motion; fewer are enough only where the strobe's rounds come more slowly."""
MOST_RATE = 17.0
"""More results a second nobody sees: they would only take time from frames and pages."""
MOST_BUSY, SPARE_BUSY = 0.9, 0.2
"""Share of the time that solving may take; below the second, four times as many pixels find room."""
CALM = 5
"""Seconds with time to spare until the picture is made larger."""
FIRST_PIXELS = 250_000
"""The picture begins at no more pixels than this."""
MOST_STEP = 8


@dataclass(frozen=True, kw_only=True)
class Quality:
    """The live picture's ``step``: a pixel of it is so many of the camera's wide. ``least`` is the finest there is."""

    step: int
    least: int = 1
    calm: int = 0

    def after(self, *, age_s: float, rate: float, rounds_per_s: float, busy: float) -> "Quality":
        """Return the quality after a second in which results were so old and came so often.

        ``rate`` is results a second, ``busy`` the share of the second that making them took.
        """
        wanted = 0.9 * min(LEAST_RATE, rounds_per_s)
        if (age_s > MOST_AGE_S or rate < wanted or busy > MOST_BUSY) and self.step < MOST_STEP:
            return replace(self, step=2 * self.step, calm=0)
        if busy < SPARE_BUSY and self.step > self.least:
            if self.calm + 1 >= CALM:
                return replace(self, step=self.step // 2, calm=0)
            return replace(self, calm=self.calm + 1)
        return replace(self, calm=0)


def first_quality(width_px: int, height_px: int, *, mosaic: bool) -> Quality:
    """Return the quality to begin with; a mosaic becomes colour by cells of two pixels at least."""
    least = 2 if mosaic else 1
    step = least
    while width_px * height_px / step**2 > FIRST_PIXELS and step < MOST_STEP:
        step *= 2
    return Quality(step=step, least=least)
