"""How well the strobe explains the latest frames: whether it is still seen in them."""

from dataclasses import dataclass, replace

from psvideo.live.following.foretold import Learnt
from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.coarse.seed import GOOD_SEED, gain_of
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import explained
from psvideo.sync.verdict.believed import MIN_EXPLAINED, MIN_GAIN

LATEST = 24
"""Frames by which it is judged whether the strobe is still seen."""
LEFT, LEFT_AFTER_CHANGE, SLOWLY = 0.6, 0.85, 8
"""Where the strobe explains less than this share of what it usually does (a mean over this many corrections), it is as
likely to be another one; the more so after a change, as a strobe that was started again is one."""


@dataclass(frozen=True, kw_only=True)
class SeenShare:
    """Which ``share`` of what the latest frames do flashes add to the explanation, ``usual`` in the mean.

    ``whole`` is the share that is explained at all.
    """

    share: float = 1.0
    whole: float = 1.0
    usual: float = GOOD_SEED

    def of_latest(self, rows: Profiles, rest: Doubles, learnt: Learnt | None) -> "SeenShare":
        """Return the shares of the last ``LATEST`` frames; ``rest`` (frame, row) is what flashes leave of the rows.

        Frames that show nothing, by brightnesses learnt before, are not explained by flashes: anything explains them.
        """
        latest, left = rows.take(slice(len(rows.value) - LATEST, len(rows.value))), rest[-LATEST:]
        nothing = learnt is not None and learnt.show_nothing(latest)
        return replace(self, share=0.0 if nothing else gain_of(latest, left), whole=explained(latest, left))

    def is_good(self, *, after_change: bool) -> bool:
        """Return whether these frames show the strobe nearly as well as those before did."""
        least = (LEFT_AFTER_CHANGE if after_change else LEFT) * self.usual
        return self.share > max(MIN_GAIN, least) and self.whole > MIN_EXPLAINED

    def as_usual(self) -> "SeenShare":
        """Return the shares with the present one counted in what is usual."""
        return replace(self, usual=self.usual + (self.share - self.usual) / SLOWLY)
