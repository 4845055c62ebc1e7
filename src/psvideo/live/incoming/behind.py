"""Do frames wait to be fetched? By how much later they come than those of the last seconds did."""

from collections import deque
from dataclasses import dataclass, field

REMEMBERED = 10
"""Seconds whose quickest frames are the measure: long beside a hiccup, short beside the drift of two clocks."""
STALL_S = 0.5
"""After a pause as long as this the source itself stood still, and its frames are measured by themselves again."""


@dataclass(kw_only=True)
class Behind:
    """Compares when frames come with their places in time; ``period_s`` is from one to the next."""

    period_s: float
    _quickest_s: deque[float] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    _now_s: float = float("inf")
    _came_s: float = float("inf")

    def take(self, index: int, came_s: float) -> None:
        """Note that the frame at a place in time came at a time of this machine's clock."""
        if came_s - self._came_s > STALL_S:
            self._quickest_s.clear()
            self._now_s = float("inf")
        self._came_s = came_s
        self._now_s = min(self._now_s, came_s - index * self.period_s)

    def second_s(self) -> float:
        """Return by how much later the quickest frame since the last call came than that of the last seconds."""
        now_s, self._now_s = self._now_s, float("inf")
        if now_s == float("inf"):
            return 0.0
        self._quickest_s.append(now_s)
        return now_s - min(self._quickest_s)
