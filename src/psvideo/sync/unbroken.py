"""Parts of a clip whose strobes are one after all: where the whole clip was found, it says the same of every part."""

from collections.abc import Sequence

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import FoundClock, train_between
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.restarts import APART
from psvideo.sync.rowfit.strobed import lost_somewhere

PLACES = 7
"""Places in each part, its first and last frames among them, at which flashes are compared: a clock that bends to meet
a strobe that started again does so beside the break."""

FEW = 3
"""More frames that are missing in one place stand for a strobe that started again: with enough of them, most can."""


def unbroken(plan: Plan, whole: ClipFit, parts: Sequence[tuple[slice, ClipFit]]) -> bool:
    """Return whether the strobe of a whole clip, with the frames that it finds missing, is that of each of its parts.

    All of a part's flashes then fire at the whole's times, and each part keeps the same place in its cycle. A subject
    that moves may hide the strobe for a while, so that a clip seems to fall into parts. One part alone, or frames that
    show no strobe, are one that began or stopped.
    """
    if len(parts) < 2 or whole.strayed > FEW * whole.steps or lost_somewhere(plan, whole):
        return False
    late_s, turned_s = np.concatenate([_apart_s(plan, whole, cut, found) for cut, found in parts]).T
    cycle_s = plan.cycle_s * whole.fit.beat.clock.rate
    moved_s = np.abs((turned_s - turned_s[0] + 0.5 * cycle_s) % cycle_s - 0.5 * cycle_s)
    return bool(max(np.abs(late_s).max(), moved_s.max()) < APART * plan.shortest_flash_s)


def _apart_s(plan: Plan, whole: ClipFit, cut: slice, found: ClipFit) -> Doubles:
    """Return by how much the whole clip's flashes come later than a part's, each against the nearest one, and by how
    much its cycles begin later, shape (place, 2)."""
    at = np.unique(np.linspace(0, cut.stop - cut.start - 1, PLACES).astype(int))
    own, others = found.track.index[at], whole.track.index[cut][at]
    apart = []
    for own_s, others_s in zip(own * whole.rows.period_s, others * whole.rows.period_s, strict=True):
        flash_s, begin_s = _since(plan, found.fit.beat.clock, float(own_s))
        other_s, other_begin_s = _since(plan, whole.fit.beat.clock, float(others_s))
        late_s = other_s[:, None] - flash_s[None, :]
        apart.append((late_s.flat[int(np.abs(late_s).argmin())], other_begin_s - begin_s))
    return np.array(apart)


def _since(plan: Plan, clock: FoundClock, at_s: float) -> tuple[Doubles, float]:
    """Return when the flashes within a cycle of a time start, counted from it, and when the cycle nearest to it."""
    start_s = train_between(plan, clock, at_s, at_s).start_s - at_s
    begin_s = start_s[:: len(plan.cycle_slots)]
    near = np.abs(start_s) < 0.5 * plan.cycle_s
    return start_s[near], float(begin_s[np.abs(begin_s).argmin()])
