"""Judgements on time: the flashes' moments, the lights' order, rows that nobody saw, and motion."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.cost.in_step import IN_STEP, dark_s_out_of_step, frames_in_step, never_shown
from psvideo.model.cost.motion_cost import cost_words
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.model.units import counted, listed
from psvideo.report.judge.of_ambient import NOTICED
from psvideo.report.judgement import Judgement
from psvideo.report.observe.astray import LEAST_SHOWN_PX
from psvideo.report.observe.observed import Observed

SURE_ROWS, LOST_ROWS = 0.3, 2.0
MIXED, LOST_MIXED = 0.02, 0.2
BLIND = 0.97
MOST_UNSEEN, LOST_UNSEEN = 0.02, 0.3
FAST_PX, LOST_PX = 1.0, 4.0
"""Pixels from flash to flash: 1 costs about 1 degree, 4 cost 5 to 9."""
FEW_MOVE, MUCH_CHANGES = 0.02, 0.1
OFTEN = 0.9
"""Motion is judged by what is reached in a tenth of the rounds."""
LEAST_FOLLOWED = 0.5
NAMED = 3


def timing_and_order(timing: Timing, mode: str) -> Iterator[Judgement]:
    """Judge how certain the flashes' times and names are."""
    rows = timing.phase_error_rows
    if mode == "synced":
        yield Judgement(
            subject="timing", grade="good", found="One flash a frame, as the plan says: no time had to be found."
        )
    elif rows <= SURE_ROWS:
        yield Judgement(
            subject="timing",
            grade="good",
            found=f"Phase locked. {timing.how_sure} The clocks differ by {timing.clock_offset_ppm:+.1f} ppm.",
        )
    else:
        yield Judgement(
            subject="timing",
            grade="bad" if rows > LOST_ROWS else "doubtful",
            found=f"Flash times are known to {rows:.2f} row only: plates may be torn near the dark row.",
            advice="Check that plan.toml is what the strobe played, and its transfer how the files code light: a wrong "
            "curve looks like another exposure. Fix the exposure, and switch stabilisation off.",
        )
    if timing.order == "guess":
        yield Judgement(
            subject="order",
            grade="doubtful",
            found="Which light is which is a guess, so normals may be wrong everywhere."
            + (f" {timing.order_note}" if timing.order_note else ""),
            advice="Shoot with a dark slot as marker, or name the first light with `first_light`.",
        )
    else:
        yield Judgement(subject="order", grade="good", found=ORDER[timing.order])


ORDER = {
    "marker": "Which light is which is known from the cycle's marker.",
    "rig": "Which light is which is known from the rig's directions.",
    "given": "Which light is which was given.",
}


def coverage(plan: Plan, timing: Timing, observed: Observed, *, take_s: float | None = None) -> Iterator[Judgement]:
    """Judge which rows were seen by nobody, or under two flashes, and why. ``take_s`` is how long the take lasts of
    which only a part was looked at: the rest shows more rows below 360 degrees, and tells the ambient light of rows
    where there is no dark slot."""
    unseen = max((one.unseen_share for one in observed.facts), default=0.0)
    borrowed = max((one.borrowed_share for one in observed.facts), default=0.0)
    if take_s is not None and unseen > MOST_UNSEEN and _is_blind(timing) and not in_step(plan, timing):
        never = never_shown(_as_found(plan, timing), lasts_s=take_s, clock_offset_ppm=timing.clock_offset_ppm)
        unseen, borrowed = min(unseen, never), min(borrowed + unseen, 1.0)
    without_dark = not (plan.mode == "synced" or _is_blind(timing) or any(flash.is_dark for flash in plan.flashes))
    if take_s is not None and without_dark:
        unseen = 0.0  # more frames tell the ambient light of more rows
    said = [] if plan.mode == "synced" else [*_mixed(plan, timing), *_blind(plan, timing, unseen, borrowed)]
    said += _dropped(timing, observed)
    if unseen > MOST_UNSEEN and not said and without_dark:
        said.append(
            Judgement(
                subject="rows",
                grade="bad" if unseen > LOST_UNSEEN else "doubtful",
                found=f"In up to {100 * unseen:.0f} % of a round's rows ambient light is not known: without a dark "
                "slot it is found from rows that saw a part of a flash, and these saw whole flashes only.",
                advice="Film longer, or add a dark slot to the plan.",
            )
        )
    elif unseen > MOST_UNSEEN and not said:
        said.append(
            Judgement(
                subject="rows",
                grade="bad" if unseen > LOST_UNSEEN else "doubtful",
                found=f"Up to {100 * unseen:.0f} % of a round's rows were seen by no frame.",
                advice="Use all frames (no steps in `frames`), and shoot at 360 degrees.",
            )
        )
    yield from said
    if not said:
        yield Judgement(subject="rows", grade="good", found="Every row of every round was seen; no frame is missing.")


def _mixed(plan: Plan, timing: Timing) -> Iterator[Judgement]:
    dark_s = plan.dark_s * (1 + timing.clock_offset_ppm * 1e-6)
    share = (timing.exposure_s - dark_s) / timing.frame_period_s
    if share > MIXED:
        yield Judgement(
            subject="rows",
            grade="bad" if share > LOST_MIXED else "doubtful",
            found=f"The dark time of {dark_s * 1e3:.4g} ms is shorter than the exposure of "
            f"{timing.exposure_s * 1e3:.4g} ms: about {100 * min(share, 1):.0f} % of the rows hold two flashes, and "
            "plates are cut there.",
            advice=f"Lengthen the dark time to at least {timing.exposure_s * 1e3:.4g} ms: make the plan again with "
            "psvideo capture-plan.",
        )


def _is_blind(timing: Timing) -> bool:
    return timing.exposure_s / timing.frame_period_s < BLIND


def _as_found(plan: Plan, timing: Timing) -> Plan:
    return replace(plan, camera=replace(plan.camera, exposure_s=timing.exposure_s))


def in_step(plan: Plan, timing: Timing) -> bool:
    """Tell whether flashes meet the same rows again and again, so that some rows never see some lights."""
    found = _as_found(plan, timing)
    return _is_blind(timing) and never_shown(found, clock_offset_ppm=timing.clock_offset_ppm) > IN_STEP


def _blind(plan: Plan, timing: Timing, unseen: float, borrowed: float) -> Iterator[Judgement]:
    if not _is_blind(timing):
        return
    opened = f"the shutter is open for {360 * timing.exposure_s / timing.frame_period_s:.0f} degrees only"
    if unseen > MOST_UNSEEN and in_step(plan, timing):
        other_s = dark_s_out_of_step(_as_found(plan, timing))
        yield Judgement(
            subject="rows",
            grade="bad" if unseen > LOST_UNSEEN else "doubtful",
            found=f"Up to {100 * unseen:.0f} % of a round's rows see a light in no round: {opened}, and the strobe "
            f"keeps step with the frames, so that every {frames_in_step(plan)} frames its flashes meet the same rows.",
            advice="Shoot at 360 degrees"
            + ("." if other_s is None else f", or with a dark time (dark_s) of {other_s * 1e3:.4g} ms."),
        )
    elif borrowed > MOST_UNSEEN and unseen <= LOST_UNSEEN:
        yield Judgement(
            subject="rows",
            grade="doubtful",
            found=f"{opened.capitalize()}: up to {100 * borrowed:.0f} % of a round's rows come from other rounds. What "
            "stands still loses nothing by it, what moves in them is left out.",
            advice="Shoot at 360 degrees.",
        )
    elif unseen > MOST_UNSEEN:
        yield Judgement(
            subject="rows",
            grade="bad" if unseen > LOST_UNSEEN else "doubtful",
            found=f"Up to {100 * unseen:.0f} % of a round's rows were seen by no frame: {opened}.",
            advice="Shoot at 360 degrees.",
        )


def _dropped(timing: Timing, observed: Observed) -> Iterator[Judgement]:
    holes, again = timing.dropped_frames, timing.repeated_frames
    missing = sum(hole.count for hole in holes)
    spoilt = [one.number for one in observed.facts if one.unseen_share > 0]
    if missing:
        where = listed([f"{hole.count} after number {hole.after}" for hole in holes], NAMED, things="places")
        grave = len(spoilt) > 0.1 * max(len(observed.facts), 1) and len(spoilt) > 1
        yield Judgement(
            subject="frames",
            grade="doubtful",
            found=f"{counted(missing, 'frame')} {'is' if missing == 1 else 'are'} missing ({where}); the rows "
            "there are not valid"
            + (f", which spoils {len(spoilt)} of {len(observed.facts)} rounds." if grave else "."),
            advice="Use a faster card or a lower data rate, and copy the take again before shooting it again.",
        )
    if again:
        yield Judgement(
            subject="frames",
            grade="doubtful",
            found=f"{counted(len(again), 'frame')} {'repeats' if len(again) == 1 else 'repeat'} the one before (first: "
            f"number {again[0]}).",
            advice="Export the take without frame-rate conversion.",
        )


def motion(plan: Plan, timing: Timing, observed: Observed, *, aligned: bool = False, opened: bool = False) -> Judgement:
    """Judge how far the fastest parts move from flash to flash, and within one; ``opened``: under an open shutter."""
    shares = [one.moving_share for one in observed.facts if one.moving_share is not None]
    speeds = [one.speed_px_s for one in observed.facts if one.speed_px_s is not None]
    if not shares:
        return _places(observed)
    share = float(np.quantile(shares, OFTEN))
    if len(speeds) < LEAST_FOLLOWED * len(shares):
        return Judgement(
            subject="motion",
            grade="bad" if share > MUCH_CHANGES and not aligned else "doubtful",
            found=f"{100 * share:.0f} % of the picture changes from round to round faster than can be followed, or "
            "repeats itself meanwhile"
            + ("; where the plates of a round do not fit together, nothing is trusted." if aligned else ".")
            + (" The open shutter shows the single flashes there, and no blur between them." if opened else ""),
            advice="Move slower, raise the frame rate, or flash fewer lights; if nothing moved, light flickers, or the "
            "movie's coding changes the pictures.",
        )
    speed = float(np.quantile(speeds, OFTEN))
    flash_s = timing.frame_period_s if plan.mode == "synced" else plan.cycle_s / len(plan.cycle_slots)
    step_px = speed * flash_s
    blur_px = speed * max(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    if plan.mode == "synced":
        blur_px = step_px
    if step_px <= FAST_PX:
        still = "Nothing moves." if step_px < 0.01 else f"At most {step_px:.2f} px of motion from flash to flash."
        return Judgement(subject="motion", grade="good", found=still)
    grave = step_px > LOST_PX and share > FEW_MOVE and not aligned
    return Judgement(
        subject="motion",
        grade="bad" if grave else "doubtful",
        found=f"{100 * share:.0f} % of the picture moves, by up to {step_px:.1f} px from flash to flash "
        f"({blur_px:.1f} px of blur within one): {cost_words(step_px)}." + _unfrozen(plan, timing, observed, speed),
        advice="Move slower, raise the frame rate or flash fewer lights"
        + (", or leave `align` at auto, which brings the plates together." if not aligned else "."),
    )


def _places(observed: Observed) -> Judgement:
    """Judge whether photographs of a still scene are aligned, where that can be told."""
    found = observed.astray[0] if observed.astray else None
    if found is None or (not found.shows and found.within_px > LEAST_SHOWN_PX):
        return Judgement(
            subject="motion", grade="unknown", found="Motion is not known: no two whole plates of one light in turn."
        )
    if not found.shows:
        return Judgement(
            subject="motion",
            grade="good",
            found=f"The pictures are aligned to within {max(found.within_px, 0.1):.1f} px.",
        )
    more = " or more" if found.typical_px > FAST_PX else ""
    return Judgement(
        subject="motion",
        grade="doubtful",
        found=f"The camera or the subject moved between the pictures: they lie about {found.typical_px:.1f} px{more} "
        f"apart, that of {found.light!r} {found.most_px:.1f} px off. Edges and fine detail of the normals suffer.",
        advice="Take them again from a tripod without touching the camera, or align the pictures first.",
    )


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
