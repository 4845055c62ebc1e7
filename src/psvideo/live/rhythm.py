"""When the next result is begun: as soon as a round is whole, where that keeps up the rate that looks like motion.

Rounds come in their own time. A result that is begun at any other moment shows a round that is older by as much as a
round lasts; so rounds are left out as a whole where there are more of them than anybody sees, and never by halves.
"""

from dataclasses import dataclass, replace
from math import ceil

from psvideo.live.showing.quality import LEAST_RATE, MOST_RATE

WANTED_RATE = (LEAST_RATE + MOST_RATE) / 2
"""Results a second that waiting for rounds must leave: what a machine lacks now and then shall not go below the least.
"""


@dataclass(frozen=True, kw_only=True)
class Rhythm:
    """``round_s``: how long a round lasts, ``frame_s`` a frame. ``came_s``: when the last frame came that the latest
    result shows, on this machine's clock, None before there is one. ``free_s``: from when on a further result takes no
    more than ``MOST_RATE``, and ``wanted_s``: when it must be begun for ``WANTED_RATE``, both in the long run."""

    round_s: float
    frame_s: float
    came_s: float | None = None
    free_s: float = float("-inf")
    wanted_s: float = float("-inf")

    def due_s(self, now_s: float) -> float:
        """Return when the next result is to be begun: with the first round that is whole when there is room for it, or
        at once where that would be too late."""
        first_s = max(now_s, self.free_s)
        if self.came_s is None or self.round_s * MOST_RATE >= 1:  # none is left out: each is begun with its last frame
            return first_s
        surely_s = self.came_s + self.frame_s  # of how far into a frame its rounds end is known
        whole_s = surely_s + max(ceil((first_s - surely_s) / self.round_s), 1) * self.round_s
        return whole_s if whole_s <= self.wanted_s else first_s

    def idle_until_s(self, now_s: float) -> float:
        """Return until when nothing is to be done for a result: the next one is due then, or its round is whole."""
        if self.came_s is None or self.round_s * MOST_RATE < 1:
            return self.due_s(now_s)
        return self.came_s + max(ceil((now_s - self.came_s) / self.round_s), 1) * self.round_s

    def after(self, *, began_s: float, came_s: float) -> "Rhythm":
        """Return the rhythm after a result that was begun at ``began_s`` and whose last frame came at ``came_s``."""
        return replace(
            self,
            came_s=came_s,
            free_s=max(self.free_s, began_s - self.round_s) + 1 / MOST_RATE,
            wanted_s=min(max(self.wanted_s, began_s), began_s + self.round_s) + 1 / WANTED_RATE,
        )
