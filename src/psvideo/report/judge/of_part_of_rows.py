"""Judgements on motion below 360 degrees, where every flash is seen by a part of the rows only."""

from dataclasses import replace

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.report.judge.of_rows import is_blind, opened
from psvideo.report.judgement import Judgement

STAND_STILL = "Shoot at 360 degrees, or let the subject stand still."
MOST_LENT_PX = 4.0
"""A painted bust that went 8 px from round to round under four lights at 180 degrees lost 84 % of its normals. Where
plates are not aligned, so many pixels from flash to flash are what spoils a take."""
MOTION_FIRST = "See the line on motion first: at 360 degrees plates of what moves are brought together."


def first_seen_whole(motion: Judgement, plan: Plan, timing: Timing) -> str:
    """Return what to mend before validity is looked at where things moved that flashes showed in part; else nothing."""
    moved = motion.grade in ("doubtful", "bad")
    return MOTION_FIRST if moved and plan.mode != "synced" and is_blind(timing) else ""


def round_s(plan: Plan, timing: Timing) -> float:
    """Return the time from one flash of a slot to the next, on the camera's clock, in the mean."""
    return plan.cycle_s * (1 + timing.clock_offset_ppm * 1e-6) / len(plan.dark_rounds)


def _in_part(timing: Timing) -> str:
    return f"{opened(timing)}, so that every flash was seen whole by a part of the rows"


def unknown_in_part(timing: Timing) -> Judgement:
    """Say that nothing is known of motion where plates in turn share hardly a row."""
    return Judgement(
        subject="motion",
        grade="unknown",
        found=f"Whether anything moves is not known: {_in_part(timing)}, and plates of one light in turn share too few "
        "of them. What stands still loses nothing by it; most of what moves would be lost or come out wrong.",
        advice=STAND_STILL,
    )


def lent(moves: str, timing: Timing, *, lent_px: float, grave: bool) -> Judgement:
    """Judge motion that was seen; ``lent_px`` is how far things go until another round lends its rows."""
    return Judgement(
        subject="motion",
        grade="bad" if grave else "doubtful",
        found=f"{moves} from flash to flash and {lent_px:.0f} px from round to round, and {_in_part(timing)}: the "
        "others come from other rounds, where what moves is elsewhere. So plates cannot be brought together, and "
        f"{'most' if lent_px > MOST_LENT_PX else 'some'} of what moves is lost or comes out wrong.",
        advice=STAND_STILL,
    )


def seen_in_part(found: Judgement, timing: Timing) -> Judgement:
    """Return a judgement on what changes too fast to be followed, and say what the shutter makes of it."""
    return replace(
        found,
        found=f"{found.found} Besides, {_in_part(timing)}: where things move, most is lost or comes out wrong.",
        advice=f"{STAND_STILL} {found.advice}",
    )
