"""Times that the picture leaves open: how far all flashes could move before any row would look otherwise.

A flash that lies wholly inside the exposure of every row that saw it shows no edge, so that its time can be read only
to within the exposure. The fit's curvature is nil there and its standard error means nothing; what is known is an
interval.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit

WORSE = 30.0
"""By how much the weighted sum of squares may grow: noise feigns as much at the best of all edges of a plateau."""
PROBE = 6.0
"""Standard errors from the fit at which the picture must differ if it shows the time."""
FIRST_STEP, LONGEST_STEP = 1e-3, 0.5
"""Of the shortest flash: the first step outwards, and the longest, which leaps over no edge."""
BISECTIONS = 7
FLAT = 0.1
"""Share of that growth by which a plateau may be uneven; half-way up a valley's sides it would be a quarter."""

Move = Callable[[float], Beat]


def centred(plan: Plan, rows: Profiles, fit: Fit) -> tuple[Fit, float]:
    """Return the fit in the middle of what the picture leaves open, and half of that in seconds; 0 for none.

    Where the picture decides a time less closely than the fit claims, as in very short clips, its error grows to that.
    """
    shortest_s = plan.shortest_flash_s
    least_s = max(fit.shift_error_s, FIRST_STEP * shortest_s)
    limit = fit.loss + WORSE
    if all(_left(plan, rows, fit, _shifted(rows, fit.beat, s * PROBE * least_s, 0.0)) > limit for s in (-1.0, 1.0)):
        return fit, 0.0
    low_s, high_s = _open(plan, rows, fit, lambda s: _shifted(rows, fit.beat, s, 0.0), limit)
    half_s = 0.5 * (low_s + high_s)
    if not _flat(plan, rows, fit, 0.5 * (high_s - low_s), 0.5 * half_s):
        return replace(fit, shift_error_s=max(fit.shift_error_s, half_s / np.sqrt(WORSE))), 0.0
    most_s = plan.clock_range_ppm * 1e-6 * _half_s(rows)
    slack_s = 0.0
    for _ in range(2):
        turns_s = _open(plan, rows, fit, lambda s, beat=fit.beat: _shifted(rows, beat, 0.0, s), limit)  # type: ignore[misc]
        low_s, high_s = (min(turn_s, most_s) for turn_s in turns_s)
        turn_s = 0.5 * (low_s + high_s)
        fit = replace(fit, beat=_shifted(rows, fit.beat, 0.0, 0.5 * (high_s - low_s)))
        low_s, high_s = _open(plan, rows, fit, lambda s, beat=fit.beat: _shifted(rows, beat, s, 0.0), limit)  # type: ignore[misc]
        fit = replace(fit, beat=_shifted(rows, fit.beat, 0.5 * (high_s - low_s), 0.0))
        slack_s = float(np.hypot(0.5 * (low_s + high_s), turn_s))
    errors_s = {name: float(np.hypot(error_s, slack_s * _share(rows, name))) for name, error_s in fit.errors_s.items()}
    return replace(fit, rest=unexplained(plan, rows, fit.beat, fit.weight), errors_s=errors_s), slack_s


def _share(rows: Profiles, name: str) -> float:
    """Return how much of the flashes' slack a time has as well: a row time has it over all rows together."""
    return 1.0 / (float(rows.place.max()) + 1.0) if name == "row_time_s" else 1.0


def _flat(plan: Plan, rows: Profiles, fit: Fit, middle_s: float, reach_s: float) -> bool:
    """Return whether moves about the middle make no difference; a valley's sides would rise by a quarter of its rim."""
    squares = [_left(plan, rows, fit, _shifted(rows, fit.beat, middle_s + s, 0.0)) for s in (-reach_s, 0.0, reach_s)]
    return max(squares) - min(squares) < FLAT * WORSE


def _left(plan: Plan, rows: Profiles, fit: Fit, beat: Beat) -> float:
    return float((fit.weight * unexplained(plan, rows, beat, fit.weight) ** 2).sum())


def _open(plan: Plan, rows: Profiles, fit: Fit, move: Move, limit: float) -> tuple[float, float]:
    """Return how far the clock may be moved down and up before the fit leaves more than ``limit``."""
    shortest_s = plan.shortest_flash_s

    def reach(sign: float) -> float:
        inside_s, outside_s = 0.0, FIRST_STEP * shortest_s
        while outside_s < 0.5 * plan.cycle_s and _left(plan, rows, fit, move(sign * outside_s)) <= limit:
            inside_s, outside_s = outside_s, outside_s + min(outside_s, LONGEST_STEP * shortest_s)
        for _ in range(BISECTIONS if inside_s > 0 else 0):
            middle_s = 0.5 * (inside_s + outside_s)
            fits = _left(plan, rows, fit, move(sign * middle_s)) <= limit
            inside_s, outside_s = (middle_s, outside_s) if fits else (inside_s, middle_s)
        return inside_s

    return reach(-1.0), reach(1.0)


def _shifted(rows: Profiles, beat: Beat, shift_s: float, turn_s: float) -> Beat:
    """Return the beat with all flashes later by ``shift_s``, and by ``turn_s`` more at the clip's end than amid it."""
    clock = beat.clock.shifted(shift_s, 1e6 * turn_s / _half_s(rows), pivot_s=float(rows.frame_start_s.mean()))
    return replace(beat, clock=clock)


def _half_s(rows: Profiles) -> float:
    start_s = rows.frame_start_s
    return max(float(start_s[-1] - start_s[0]) / 2, rows.period_s)
