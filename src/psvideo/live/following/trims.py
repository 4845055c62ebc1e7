"""What a strobe was told to do to its own period while it was followed: bends of its clock that are foreseen."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field, replace

import numpy as np

from psvideo.live.following.phase_filter import PhaseFilter
from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.beat import FoundClock

LATENCY_S = 0.02
"""A trim's moment is known no better than this on the camera's clock: frames take their time to come, and a trim counts
from a board's next step or the one after it."""
SETTLED = 4
"""Looks at a time without trims until it stands still: each leaves a 100th of what the one before did."""
TAIL_S = 1.0
"""How far behind the last trim its knot stands, by which the clock's slope is known there."""


@dataclass(kw_only=True)
class Trims:
    """Trims by time: from ``at_s[k]`` on flashes come later by ``ppm[k]`` of the time that passes, until the next.

    Two clocks are meant. The camera's, by which a trim is given and a flash is seen; and the *untrimmed* one, by which
    the strobe would flash without any trim, and by which the times here, and a clock's bends, are. After 100 s of
    -1000 ppm a flash that is seen at 100.0 s is the one of 100.1 s untrimmed. Ten trims a second come for hours: what
    is asked of them costs the same after any number.
    """

    at_s: list[float] = field(default_factory=list)
    ppm: list[float] = field(default_factory=list)
    _late_s: list[float] = field(default_factory=list)

    @property
    def now_ppm(self) -> float:
        """The trim that counts last."""
        return self.ppm[-1] if self.ppm else 0.0

    def add(self, at_s: float, ppm: float) -> None:
        """Note a trim from a time of the camera on, which is not before the last."""
        knot_s = max([self.untrimmed_s(at_s), *self.at_s[-1:]])
        self._late_s.append(self._late_at_s(knot_s))
        self.at_s.append(knot_s)
        self.ppm.append(ppm)

    def untrimmed_s(self, at_s: float) -> float:
        """Return at which time a flash that comes at ``at_s`` would have come without any trim."""
        untrimmed_s = at_s
        for _ in range(SETTLED):
            untrimmed_s = at_s - self._late_at_s(untrimmed_s)
        return untrimmed_s

    def late_s(self, time_s: Doubles) -> Doubles:
        """Return by how much flashes come later than without any trim, at untrimmed times, same shape."""
        return np.array([self._late_at_s(one_s) for one_s in time_s.ravel().tolist()]).reshape(time_s.shape)

    def _late_at_s(self, time_s: float) -> float:
        last = bisect_right(self.at_s, time_s) - 1
        return 0.0 if last < 0 else self._late_s[last] + 1e-6 * self.ppm[last] * (time_s - self.at_s[last])

    def doubt_s(self, since_s: float) -> float:
        """Return by how much flashes may come otherwise than foreseen for the moments of trims since an untrimmed time:
        all may be wrong alike."""
        first = bisect_left(self.at_s, since_s)
        before = [0.0, *self.ppm][first]
        changes_ppm = np.diff([before, *self.ppm[first:]])
        return 1e-6 * float(np.abs(changes_ppm).sum()) * LATENCY_S

    def bent(self, clock: FoundClock, *, since_s: float) -> FoundClock:
        """Return a clock with the bends of all trims; those of trims that ended before a time of the camera are one
        slope."""
        if not self.at_s:
            return clock
        first = bisect_left(self.at_s, self.untrimmed_s(since_s))
        recent = sorted({*self.at_s[max(first - 2, 0) :]})
        knots = np.array([recent[0] - TAIL_S, *recent, recent[-1] + TAIL_S])
        return replace(clock, knot_s=tuple(knots.tolist()), bend_s=tuple(self.late_s(knots).tolist()))


def trimmed(phase: PhaseFilter, trims: Trims, at_s: float, ppm: float, *, since_s: float) -> PhaseFilter:
    """Note a trim and return the filter with it, less sure by what its moment may be wrong.

    Of a strobe that is held no drift is estimated: where its dark row stands between two frames these show hardly
    anything, and moments that were a little wrong would be taken for a drift that carries the clock away.
    """
    doubt_s = 1e-6 * (ppm - trims.now_ppm) * LATENCY_S
    trims.add(at_s, ppm)
    return replace(phase.less_sure(doubt_s).without_drift(), clock=trims.bent(phase.clock, since_s=since_s))
