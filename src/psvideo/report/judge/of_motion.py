"""Judgements on motion: how far things move from flash to flash, or whether photographs are aligned."""

from dataclasses import replace

import numpy as np

from psvideo.model.cost.motion_cost import cost_words
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.report.judge.of_ambient import NOTICED
from psvideo.report.judge.of_part_of_rows import (
    MOST_APART_PX,
    lent,
    rarer,
    round_s,
    seen_in_part,
    unknown_in_part,
)
from psvideo.report.judge.of_rows import is_blind
from psvideo.report.judge.of_validity import HARDLY_VALID
from psvideo.report.judge.of_what_moves import what_moves
from psvideo.report.judgement import Judgement
from psvideo.report.observe.alignment.astray import LEAST_SHOWN_PX, Astray
from psvideo.report.observe.observed import Observed

FAST_PX, LOST_PX, LOST_ALIGNED_PX = 1.0, 4.0, 16.0
"""Pixels from flash to flash: 1 costs about 1 degree, 4 cost 12 without alignment; with it the last costs half of the
normals of what moves."""
FEW_MOVE, MUCH_CHANGES = 0.02, 0.1
"""Shares of the picture: fewer that move fast spoil no take; more that change and cannot be followed do."""
ALL = 0.995
"""A larger share is all of the picture that can be seen to move."""
OFTEN = 0.9
"""Motion is judged by what is reached in a tenth of the rounds."""
LEAST_FOLLOWED = 0.5
"""In a smaller share of the rounds a speed says nothing of the take."""
NOTABLE = 0.5
"""A turn, a change of scale or a shift that makes this share of how far pictures lie apart is told."""


def motion(
    plan: Plan,
    timing: Timing,
    observed: Observed,
    *,
    aligned: bool = False,
    opened: bool = False,
    foretold: bool = False,
) -> Judgement:
    """Judge how far the fastest parts move from flash to flash, and within one; ``opened``: under an open shutter.
    ``foretold``: plates are only looked at, and a run brings them together."""
    shares = [one.moving_share for one in observed.facts if one.moving_share is not None]
    speeds = [one.speed_px_s for one in observed.facts if one.speed_px_s is not None]
    blind = plan.mode != "synced" and is_blind(timing)
    if not shares:
        return unknown_in_part(timing) if blind else _places(observed)
    share = float(np.quantile(shares, OFTEN))
    if len(speeds) < LEAST_FOLLOWED * len(shares):
        found = _not_followed(share, aligned=aligned, opened=opened)
        return seen_in_part(found, timing) if blind else found
    flash_s = _flash_s(plan, timing)
    speed, most_px = float(np.quantile(speeds, OFTEN)), max(speeds) * flash_s
    step_px = speed * flash_s
    if blind and (lent_px := speed * round_s(plan, timing)) > FAST_PX:
        far = step_px * rarer(timing) > MOST_APART_PX and not aligned
        grave = share > FEW_MOVE and (far or (aligned and _hardly_any_left(observed)))
        moves = f"{_what_moves(share)} moves, by up to {step_px:.1f} px"
        found = lent(moves, timing, lent_px=lent_px, grave=grave, aligned=aligned)
        return replace(found, found=found.found + _unfrozen(plan, timing, observed, speed))
    if step_px <= FAST_PX:
        return Judgement(subject="motion", grade="good", found=_slow(step_px, most_px))
    longest_s = max(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    blur_px = step_px if plan.mode == "synced" else speed * longest_s
    grave = step_px > (LOST_ALIGNED_PX if foretold else LOST_PX) and share > FEW_MOVE and not aligned
    return Judgement(
        subject="motion",
        grade="bad" if grave else "doubtful",
        found=f"{_what_moves(share)} moves, by up to {step_px:.1f} px from flash to flash "
        f"({blur_px:.1f} px of blur within one){_cost(step_px, observed, aligned=aligned)}."
        + _unfrozen(plan, timing, observed, speed),
        advice="Move slower, raise the frame rate or flash fewer lights"
        + (", or leave `align` at auto, which brings the plates together." if not aligned else "."),
    )


def apart_in_round_px(plan: Plan, timing: Timing, observed: Observed) -> float:
    """Return how far the fastest parts go from the first flash of a round to the last, in nine of ten rounds; 0 where
    that is not known."""
    speeds = [one.speed_px_s for one in observed.facts if one.speed_px_s is not None]
    return float(np.quantile(speeds, OFTEN)) * _flash_s(plan, timing) * (len(plan.lights) - 1) if speeds else 0.0


def _hardly_any_left(observed: Observed) -> bool:
    """Return whether hardly any normal of what moves is trusted in a usual result."""
    shares = [one.moving_valid_share for one in observed.facts if one.moving_valid_share is not None]
    return bool(shares) and float(np.median(shares)) < HARDLY_VALID


def _flash_s(plan: Plan, timing: Timing) -> float:
    """Return the time from flash to flash."""
    return timing.frame_period_s if plan.mode == "synced" else plan.cycle_s / len(plan.cycle_slots)


def _what_moves(share: float) -> str:
    """Say how much moves. Where a picture shifts as a whole, that is known of what is lit: what is dark is alike
    wherever it goes, and a small subject before it would be called 100 % of the picture."""
    return "All that is lit" if share > ALL else f"{100 * share:.0f} % of the picture"


def _cost(step_px: float, observed: Observed, *, aligned: bool) -> str:
    """Say what so much motion usually costs, where the take does not show it itself: then that has its own line."""
    if aligned and any(what_moves(observed.facts, aligned=True)):
        return ""
    return f": {cost_words(step_px)}"


def _not_followed(share: float, *, aligned: bool, opened: bool) -> Judgement:
    return Judgement(
        subject="motion",
        grade="bad" if share > MUCH_CHANGES and not aligned else "doubtful",
        found=f"{100 * share:.0f} % of the picture changes from round to round faster than can be followed, or "
        "repeats itself meanwhile"
        + ("; where the plates of a round do not fit together, nothing is trusted." if aligned else ".")
        + (" The open shutter shows the single flashes there, and no blur between them." if opened else ""),
        advice="Where things move: move slower, raise the frame rate, or flash fewer lights. Where nothing does, light "
        "flickers, or the movie's coding changes the pictures: record at a higher bit rate.",
    )


def _slow(step_px: float, most_px: float) -> str:
    """Say how far things move where that is little: in nine of ten rounds, and the most in any."""
    if most_px < 0.01:
        return "Nothing moves."
    if most_px <= FAST_PX:
        return f"At most {most_px:.2f} px of motion from flash to flash."
    return (
        f"In nine of ten rounds at most {step_px:.2f} px of motion from flash to flash, in the others up to "
        f"{most_px:.1f} px."
    )


def _places(observed: Observed) -> Judgement:
    """Judge whether photographs of a still scene are aligned, where that can be told."""
    found = observed.closely.astray[0] if observed.closely.astray else None
    if found is not None and found.shows:
        return Judgement(
            subject="motion",
            grade="doubtful",
            found=f"The camera or the subject moved between the pictures: {_apart(found)}, that of {found.light!r} "
            f"{found.most_px:.1f} px off. Edges and fine detail of the normals suffer.",
            advice="Take them again from a tripod without touching the camera, or align the pictures first.",
        )
    if found is None or found.within_px > LEAST_SHOWN_PX:
        return Judgement(
            subject="motion", grade="unknown", found="Motion is not known: no two whole plates of one light in turn."
        )
    if not found.fits:
        return Judgement(
            subject="motion",
            grade="unknown",
            found="Whether the pictures are aligned is not known: their fine detail does not fit together, that of "
            f"{found.light_that_fits_least!r} least. This happens where there is little but noise, where surfaces "
            "shine, and where pictures lie far apart or under other lights than is said.",
        )
    return Judgement(
        subject="motion", grade="good", found=f"The pictures are aligned to within {max(found.within_px, 0.1):.1f} px."
    )


def _apart(found: Astray) -> str:
    """Say by how much pictures lie apart, and what makes it where it is more than a shift."""
    more = " or more" if found.at_least else ""
    about = f"they lie about {found.typical_px:.1f} px{more} apart"
    ways = [
        (found.turned_px, f"turned by {found.turn_deg:.2f} degrees"),
        (found.zoomed_px, f"{100 * found.zoom:.2f} % larger or smaller"),
        (found.shift_px, f"shifted by {found.shift_px:.1f} px"),
    ]
    told = [words for size_px, words in ways if size_px > NOTABLE * found.typical_px]
    if told == [ways[-1][1]] or not told:
        return about
    listed = f"{', '.join(told[:-1])} and {told[-1]}" if len(told) > 1 else told[0]
    return f"{about}, {listed}"


def _unfrozen(plan: Plan, timing: Timing, observed: Observed, speed_px_s: float) -> str:
    """Say by how much ambient light, which flashes do not freeze, shows motion blurred and leaning, where it counts."""
    shares = [one.ambient for one in observed.facts if one.ambient is not None]
    if plan.mode == "synced" or not shares or float(np.median(shares)) < NOTICED:
        return ""
    blur_px, lean_px = speed_px_s * timing.exposure_s, speed_px_s * abs(timing.row_time_s) * plan.camera.height_px
    return (
        f" Flashes do not freeze the ambient light, {100 * float(np.median(shares)):.0f} % of the signal: in it what "
        f"moves blurs by up to {blur_px:.0f} px and leans by {lean_px:.0f} px from the first row to the last."
    )
