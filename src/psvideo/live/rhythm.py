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

    @property
    def leaves_out_none(self) -> bool:
        """Whether rounds come so seldom that each is shown."""
        return self.round_s * MOST_RATE >= 1

    def next_begins_s(self, now_s: float) -> float:
        """Return when the next result is to be begun: with the first round that is whole when there is room for it, or
        at once where that would be too late."""
        first_s = max(now_s, self.free_s)
        if self.came_s is None or self.leaves_out_none:  # each is begun with its last frame
            return first_s
        known_s = self.came_s + self.frame_s  # of how far into a frame its rounds end is known
        whole_s = _first_round_after(known_s, first_s, self.round_s)
        return whole_s if whole_s <= self.wanted_s else first_s

    def idle_until_s(self, now_s: float) -> float:
        """Return until when nothing is to be done for a result: the next one begins then, or its round is whole."""
        if self.came_s is None or not self.leaves_out_none:
            return self.next_begins_s(now_s)
        return _first_round_after(self.came_s, now_s, self.round_s)

    def after_result(self, *, began_s: float, came_s: float) -> "Rhythm":
        """Return the rhythm after a result that was begun at ``began_s`` and whose last frame came at ``came_s``."""
        return replace(
            self,
            came_s=came_s,
            free_s=max(self.free_s, began_s - self.round_s) + 1 / MOST_RATE,
            wanted_s=min(max(self.wanted_s, began_s), began_s + self.round_s) + 1 / WANTED_RATE,
        )


def _first_round_after(one_s: float, now_s: float, round_s: float) -> float:
    """Return when the first round after the one that was whole at ``one_s`` is whole, and not before ``now_s``."""
    return one_s + max(ceil((now_s - one_s) / round_s), 1) * round_s
