"""Judgements on motion below 360 degrees, where every flash is seen by a part of the rows only."""

from dataclasses import replace

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.report.judge.of_rows import is_blind, opened
from psvideo.report.judgement import Judgement

STAND_STILL = "Shoot at 360 degrees, or let the subject stand still."
BRING = "Shoot at 360 degrees, move slower, or leave `align` at auto, which moves these rows to where things are."
MOST_APART_PX = 4.0
"""Pixels from flash to flash, times how many more rounds pass until every row has seen a light: what moves farther is
followed no better than at 360 degrees, where so many from flash to flash are too many."""
MOTION_FIRST = "See the line on motion first: at 360 degrees more of what moves is kept."


def first_seen_whole(motion: Judgement, plan: Plan, timing: Timing) -> str:
    """Return what to mend before validity is looked at where things moved that flashes showed in part; else nothing."""
    moved = motion.grade in ("doubtful", "bad")
    return MOTION_FIRST if moved and plan.mode != "synced" and is_blind(timing) else ""


def round_s(plan: Plan, timing: Timing) -> float:
    """Return the time from one flash of a slot to the next, on the camera's clock, in the mean."""
    return plan.cycle_s * (1 + timing.clock_offset_ppm * 1e-6) / len(plan.dark_rounds)


def _in_part(timing: Timing) -> str:
    return f"{opened(timing)}, so that every flash was seen whole by a part of the rows"


def rarer(timing: Timing) -> float:
    """Return how many times more rarely a row sees a light than at 360 degrees."""
    return timing.frame_period_s / timing.exposure_s


def unknown_in_part(timing: Timing) -> Judgement:
    """Say that nothing is known of motion where plates in turn share hardly a row."""
    return Judgement(
        subject="motion",
        grade="unknown",
        found=f"Whether anything moves is not known: {_in_part(timing)}, and plates of one light in turn share too few "
        "of them. What stands still loses nothing by it; of what moves more is lost than at 360 degrees.",
        advice=STAND_STILL,
    )


def lent(moves: str, timing: Timing, *, lent_px: float, grave: bool, aligned: bool) -> Judgement:
    """Judge motion that was seen; ``lent_px`` is how far things go until another round lends its rows, and ``aligned``
    says whether these are moved."""
    fate = (
        "and are moved along with it: what is hidden there, or turns far meanwhile, is lost or comes out wrong."
        if aligned
        else "where what moves is elsewhere: left as they are, some of it is lost or comes out wrong."
    )
    return Judgement(
        subject="motion",
        grade="bad" if grave else "doubtful",
        found=f"{moves} from flash to flash and {lent_px:.0f} px from round to round, and {_in_part(timing)}: the "
        f"others come from other rounds, {fate}",
        advice=STAND_STILL if aligned else BRING,
    )


def seen_in_part(found: Judgement, timing: Timing) -> Judgement:
    """Return a judgement on what changes too fast to be followed, and say what the shutter makes of it."""
    return replace(
        found,
        found=f"{found.found} Besides, {_in_part(timing)}: where things move, more is lost than at 360 degrees.",
        advice=f"{STAND_STILL} {found.advice}",
    )
