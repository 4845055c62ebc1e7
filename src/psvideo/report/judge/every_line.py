"""All judgements of a take, line by line: what check says on the set, and the report after a run."""

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.report.judge.of_accuracy import accuracy, distance
from psvideo.report.judge.of_ambient import ambient
from psvideo.report.judge.of_exposure import ceiling_of, exposure
from psvideo.report.judge.of_lamps import lamps
from psvideo.report.judge.of_motion import apart_in_round_px, motion
from psvideo.report.judge.of_part_of_rows import first_seen_whole
from psvideo.report.judge.of_rig import rig
from psvideo.report.judge.of_rows import coverage, in_step
from psvideo.report.judge.of_steadiness import focus, steadiness
from psvideo.report.judge.of_timing import read_otherwise, timing_and_order
from psvideo.report.judge.of_validity import first_of_all, validity
from psvideo.report.judge.of_what_moves import what_moves
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed


def judgements(
    plan: Plan,
    timing: Timing,
    observed: Observed,
    *,
    aligned: bool = False,
    opened: bool = False,
    foretold: bool = False,
    take_s: float | None = None,
    curve_doubt: str = "",
    saturation: Judgement | None = None,
    levels: Judgement | None = None,
) -> tuple[Judgement, ...]:
    """Return one line per thing that decides whether a take can be used; ``take_s`` is how long a take lasts of which
    only a part was looked at, ``curve_doubt`` what pictures say against the curve by which they were read,
    ``saturation`` that the sensor saturates where the plan does not say: nothing else is known of exposure then;
    ``levels`` that files hold too few levels. ``foretold``: what moves is only looked at, and a run aligns it."""
    on_time = tuple(timing_and_order(timing, plan.mode))
    if not observed.facts:
        return on_time
    exposed = (saturation,) if saturation else tuple(exposure(observed, under=ceiling_of(plan.camera.encoding)))
    fired = tuple(
        lamps(
            observed,
            timed=all(one.grade == "good" for one in on_time),
            missed=in_step(plan, timing),
            guessed=timing.order == "guess",
            swing=timing.swing,
        )
    )
    apart_px = 0.0 if aligned else apart_in_round_px(plan, timing, observed)
    lit = tuple(rig(observed, guessed=timing.order == "guess", curve_doubt=curve_doubt, apart_px=apart_px))
    moving = motion(plan, timing, observed, aligned=aligned, opened=opened, foretold=foretold)
    first = first_of_all((*exposed, *fired, *lit), curve_doubted=bool(curve_doubt or timing.half))
    first = first or first_seen_whole(moving, plan, timing)
    return (
        *on_time,
        *([read_otherwise(timing.half)] if timing.half else []),
        *coverage(plan, timing, observed, take_s=take_s),
        *exposed,
        *([levels] if levels else []),
        *fired,
        ambient(observed),
        moving,
        focus(observed),
        *lit,
        *accuracy(observed),
        *distance(observed),
        *validity(observed, first=first),
        *what_moves(observed.facts, aligned=aligned),
        *steadiness(observed.facts),
    )
