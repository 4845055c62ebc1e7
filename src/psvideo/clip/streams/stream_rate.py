"""Whether a stream runs at the rate that was planned, by its first time stamps."""

from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

LEAST_STEPS, LEAST_S = 24, 0.5
"""So many steps from frame to frame, over so long, say what the rate is: stamps may be whole milliseconds."""
OFF = 0.02
"""A rate that is off by more is another one."""
ALIKE, MOST_UNLIKE, MOST_LOST = 0.3, 0.25, 0.5
"""Of steps that say anything, no more than a quarter differ from whole usual ones by more than this share, and no more
than half of the frames are lost: stamps of frames that come in bursts say when they came, and not when they were taken.
"""


@dataclass(kw_only=True)
class StreamRate:
    """What a stream's stamps say of its rate, until that is known."""

    planned_hz: float
    _stamps_s: list[float] = field(default_factory=list)
    _judged: bool = False

    def other_hz(self, stamp_s: float | None) -> float | None:
        """Take in one more stamp; return the stream's rate once it is known to be another than planned, else None.

        Lost frames do not matter: a step over one is twice the usual one. A stream that begins again is judged anew.
        """
        if self._judged or stamp_s is None:
            return None
        if self._stamps_s and stamp_s <= self._stamps_s[-1]:
            self._stamps_s.clear()
        self._stamps_s.append(stamp_s)
        span_s = stamp_s - self._stamps_s[0]
        if len(self._stamps_s) <= LEAST_STEPS or span_s < LEAST_S:
            return None
        self._judged = True
        steps_s = [later - before for before, later in pairwise(self._stamps_s)]
        usual_s = median(steps_s)
        counts = [max(round(step_s / usual_s), 1) for step_s in steps_s]
        unlike = sum(
            abs(step_s - count * usual_s) > ALIKE * usual_s for step_s, count in zip(steps_s, counts, strict=True)
        )
        shown_hz = sum(counts) / span_s
        steady = unlike <= MOST_UNLIKE * len(steps_s) and len(steps_s) >= MOST_LOST * sum(counts)
        return shown_hz if steady and abs(shown_hz / self.planned_hz - 1) > OFF else None
