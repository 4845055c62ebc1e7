"""Cautions on time: rows that mix two flashes, see none, or need three frames, and what moves meanwhile."""

import math
from collections.abc import Iterator

from psvideo.capture.caution import Caution, note, warning
from psvideo.model.cost.in_step import (
    IN_STEP,
    dark_s_out_of_step,
    frames_in_step,
    never_shown,
    stays_in_step,
    usual_take_s,
)
from psvideo.model.cost.motion_cost import LEAST_PX, cost_words, motion_cost
from psvideo.model.cost.shoot_figures import LEAST_MISSING, ShootFigures, SlotFigures
from psvideo.model.plan import Plan
from psvideo.model.units import no_less, no_more, show_ppm, show_seconds

MOST_LOST = 0.2
"""Where motion costs more of the normals than this share, people should know before they shoot."""
TENTHS_PX = 10
"""Shorter ways are said in tenths of a pixel."""


def about_the_margin(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    """Warn of two flashes that mix near the dark row, where the clocks may run too far apart for the dark time."""
    margin = figures.margin_ppm
    if margin is None or margin >= plan.clock_range_ppm * (1 - 1e-6):
        return
    needed_s = plan.camera.exposure_s / (1 - plan.clock_range_ppm * 1e-6)
    over_s = plan.camera.exposure_s - plan.dark_s * (1 - plan.clock_range_ppm * 1e-6)
    rows = f" ({over_s / abs(plan.camera.row_time_s):.2g} rows of each frame)" if plan.camera.readout_s else ""
    yield warning(
        "margin",
        f"The dark time leaves a margin of {show_ppm(margin)}, and the clocks may be "
        f"{show_ppm(plan.clock_range_ppm)} apart: then two flashes mix near the dark row{rows}. Leave `dark_s` out, or "
        f"give at least {no_less(needed_s * 1e3, figures=6):.6g}ms.",
    )


def about_blind_time(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    """Warn of rows that a shutter below 360 degrees keeps from seeing a flash, or all flashes of a light."""
    never = never_shown(plan)
    if never > IN_STEP:
        yield warning("in-step", in_step_words(plan, never))
    elif figures.missing_row_share >= LEAST_MISSING:
        yield warning(
            "blind",
            f"At a shutter of {plan.camera.shutter_deg:.4g} degrees {figures.missing_row_share:.0%} of the rows of "
            "each plate never see its flash. Where the subject stands still they come from the rounds before and "
            "after; what moves in them is lost. Set the shutter to 360 degrees.",
        )


def in_step_words(plan: Plan, never: float) -> str:
    """Say that rows never see a light since the strobe keeps step with the frames, and what avoids it."""
    other_s = dark_s_out_of_step(plan)
    longer = "" if other_s is None else f", or `dark_s` to {show_seconds(other_s)}"
    if plan.mode == "half-rate":
        longer = ", or `mode` to rolling"
    take = ", however long the take" if stays_in_step(plan, never) else f" in a take of {usual_take_s(plan):.3g} s"
    return (
        f"The strobe keeps step with the frames: every {frames_in_step(plan)} frames its flashes meet the same rows, "
        f"and at a shutter of {plan.camera.shutter_deg:.4g} degrees {never:.0%} of the rows never see a light"
        f"{take}. Set the shutter to 360 degrees{longer}."
    )


def about_three_frames(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    """Note flashes that reach into three frames, and how to avoid them."""
    wide = [slot for slot in figures.slots if not slot.is_dark and slot.frames_max == 3]
    if not wide or plan.mode != "rolling":
        return
    most = max(slot.most_frames_share or 0.0 for slot in wide)
    yield note(
        "three-frames",
        f"Up to {most:.0%} of the flashes reach into three frames; they are put together all the same. "
        f"{_free_of_three(plan)}{_equation_11(plan, wide)}".rstrip(),
    )


def about_motion(figures: ShootFigures) -> Iterator[Caution]:
    """Warn of motion between flashes, by what it costs of the normals."""
    step_px = figures.motion_per_flash_px
    if step_px is None or step_px < LEAST_PX:
        return
    grave, shown_px = motion_cost(step_px).lost > MOST_LOST, round(step_px, 1 if step_px < TENTHS_PX else None)
    yield (warning if grave else note)(
        "motion",
        f"What moves goes {shown_px:g} px from flash to flash: {cost_words(step_px)}. Move slower, raise the frame "
        "rate, flash fewer lights, or show the subject smaller.",
    )


def _free_of_three(plan: Plan) -> str:
    camera = plan.camera
    free_s = camera.frame_period_s - abs(camera.readout_s or 0.0) + abs(camera.row_time_s)
    if abs(camera.exposure_s - camera.frame_period_s) > 1e-6 * camera.frame_period_s or free_s < 20e-6:
        return ""
    return f"Flashes of up to {show_seconds(no_more(free_s))} never do. "


def _equation_11(plan: Plan, wide: list[SlotFigures]) -> str:
    """Say which equal flashes lie in two frames each; flashes that must differ, as beside a long marker, have none."""
    if len({plan.flashes[slot].duration_s for slot in plan.lit_slots}) > 1:
        return ""
    exposure_s = plan.camera.exposure_s
    count = exposure_s / wide[0].duration_s
    below, above = exposure_s / math.ceil(count + 1e-9), exposure_s / max(math.floor(count + 1e-9), 2)
    choices = " or ".join(dict.fromkeys((show_seconds(above), show_seconds(below))))
    all_of_them = "every flash" if all(flash.lit for flash in plan.flashes) else "every flash and dark slot"
    return (
        f"Eq. 11 avoids it with flashes that divide the exposure, here {choices} for {all_of_them}, but only if a "
        "trigger starts the first one with a frame and one clock drives both."
    )


def about_synced_rows(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    """Warn of triggered flashes that are longer than all rows are open together."""
    if plan.mode != "synced":
        return
    open_s = plan.camera.exposure_s - abs(plan.camera.readout_s or 0.0)
    longest_s = max((slot.duration_s for slot in figures.slots if not slot.is_dark), default=0.0)
    if longest_s > open_s * (1 + 1e-9):
        yield warning(
            "synced",
            f"All rows are open together for only {show_seconds(max(open_s, 0.0))} of each frame, so a triggered "
            "flash of "
            f'{show_seconds(longest_s)} is cut in some rows. Use `mode="rolling"`, a slower frame rate or a global '
            "shutter.",
        )
