"""What to think about before a shoot: pure functions from a plan and its figures to cautions, each a paragraph."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from psvideo.capture.request import Limits, ShootRequest
from psvideo.model.in_step import IN_STEP, dark_s_out_of_step, frames_in_step, never_shown
from psvideo.model.marker import has_marker
from psvideo.model.motion_cost import LEAST_PX, cost_words, motion_cost
from psvideo.model.plan import Plan
from psvideo.model.shoot_figures import SEIZURE_HZ, LightFigures, ShootFigures, SlotFigures
from psvideo.model.units import NTSC, show_rate, show_seconds

LEAST_LIGHTS = 3
MOST_STOPS = 6.0
"""A flash of a 64th of the exposure needs 64 times the light of a lamp that would do if it were left on."""

MOST_LOST = 0.2
TENTHS_PX = 10
"""Shorter ways are said in tenths of a pixel."""
"""Where motion costs more of the normals than this share, people should know before they shoot."""


@dataclass(frozen=True, kw_only=True)
class Caution:
    """One thing to know: ``warning`` where people, footage or lights suffer, ``note`` where it is good to know."""

    kind: str
    level: Literal["warning", "note"]
    text: str


def request_cautions(request: ShootRequest) -> tuple[Caution, ...]:
    """Return what is to be said about the camera's figures."""
    return (*_about_the_readout(request), *_about_the_rate(request))


def shoot_cautions(plan: Plan, figures: ShootFigures, *, limits: Limits | None = None) -> tuple[Caution, ...]:
    """Return what is to be said about the plan itself, whoever wrote it."""
    return (
        *_about_the_lights(plan),
        *_about_the_light_of_a_flash(figures),
        *_about_the_marker(plan),
        *_about_seizures(figures),
        *_about_the_margin(plan, figures),
        *_about_blind_time(plan, figures),
        *_about_three_frames(plan, figures),
        *_about_motion(figures),
        *_about_the_leds(figures, limits or Limits()),
        *_about_synced_rows(plan, figures),
    )


def _warning(kind: str, text: str) -> Caution:
    return Caution(kind=kind, level="warning", text=text)


def _note(kind: str, text: str) -> Caution:
    return Caution(kind=kind, level="note", text=text)


def _about_the_readout(request: ShootRequest) -> Iterator[Caution]:
    preset = request.preset
    if request.camera.readout_s is None:
        yield _note("readout", "The readout time is unknown: what hangs on it is left out until it is measured.")
    if preset is not None and preset.sure in ("single", "assumed"):
        yield _warning(
            "readout",
            f"The readout of {show_seconds(abs(preset.readout_s))} for the {preset.name} rests on little "
            f"({preset.source}). "
            "Measure yours (calibration/README.md) and give it as `readout_s`.",
        )


def _about_the_rate(request: ShootRequest) -> Iterator[Caution]:
    fps, asked = request.camera.fps, request.asked_fps
    if request.mode == "synced":
        return
    if asked is not None and asked != fps:
        yield _note(
            "fps",
            f"{asked} fps is what this mode is called; the plan says {show_rate(fps)}, which it records. If yours "
            "truly "
            f"records {asked}, give `size_px` and `readout_s` with `fps`.",
        )
    elif fps.denominator == 1 and fps % 6 == 0 and fps >= 24:
        exact: Fraction = fps * NTSC
        yield _note(
            "fps",
            f"Many cameras that say {fps} fps record {float(exact):.5g}, 999 ppm slower, which is more than a crystal "
            f"clock is off. If yours does, write `fps` {exact}.",
        )


def _about_the_lights(plan: Plan) -> Iterator[Caution]:
    names = plan.lights
    if len(names) < LEAST_LIGHTS:
        yield _warning(
            "lights",
            f"Normals need three lights that do not lie in one plane with the subject, and the plan has {len(names)} "
            f"({', '.join(names) or 'none'}): plates and relit views come, normals do not. Add lights.",
        )


def _about_the_light_of_a_flash(figures: ShootFigures) -> Iterator[Caution]:
    dim = [slot for slot in figures.slots if not slot.is_dark and (slot.stops or 0.0) > MOST_STOPS]
    if dim:
        worst = max(dim, key=lambda slot: slot.stops or 0.0)
        enough_s = worst.duration_s * 2 ** ((worst.stops or 0.0) - MOST_STOPS)
        yield _warning(
            "dim",
            f"A flash of {show_seconds(worst.duration_s)} gives {worst.light_share:.2%} of the light of the same lamp "
            f"left on, {worst.stops:.1f} stops less: noise will show in the normals unless the lamps are "
            f"made for it. Flash for {show_seconds(enough_s)} and more, bring the lamps closer, or film slower.",
        )


def _about_the_marker(plan: Plan) -> Iterator[Caution]:
    if plan.mode != "synced" and not has_marker(plan):
        yield _warning(
            "marker",
            "Without a marker nothing in the footage shows which light is which: note the light of the first flash for "
            "`first_light`, or leave `marker` dark.",
        )
    if not any(flash.is_dark for flash in plan.flashes):
        yield _note(
            "ambient",
            "Without a dark slot ambient light is taken off only where the subject stands still, and none in synced "
            "clips: keep the room dark.",
        )


def _about_seizures(figures: ShootFigures) -> Iterator[Caution]:
    low, high = SEIZURE_HZ
    care = "Warn everybody on the set, let no photosensitive person stay, and keep eyes off the lights."
    if low <= figures.flash_rate_hz <= high:
        yield _warning(
            "flicker",
            f"The whole scene flickers at {figures.flash_rate_hz:.1f} Hz, between {low:g} and {high:g} Hz. {care} A "
            "frame "
            f"rate of over {high:g} fps helps.",
        )
    slow = [light for light in figures.lights if low <= light.rate_hz <= high]
    if slow:
        names = "Each light" if len(slow) == len(figures.lights) else ", ".join(light.name for light in slow)
        rates = sorted({f"{light.rate_hz:.1f}" for light in slow})
        yield _warning(
            "flicker",
            f"{names} by itself flashes at {' to '.join(rates[:: max(len(rates) - 1, 1)])} Hz, between {low:g} and "
            f"{high:g} Hz: "
            f"a person who sees one light more than the others sees that, though the scene as a whole is lit "
            f"{figures.flash_rate_hz:.1f} times a second. {care}",
        )
    if low <= figures.dark_slot_rate_hz <= high:
        yield _warning(
            "flicker",
            f"Dark slots come {figures.dark_slot_rate_hz:.1f} times a second, a flicker of the whole scene between "
            f"{low:g} and "
            f"{high:g} Hz. {care} A larger `dark_every` makes them rarer; two a second are enough.",
        )


def _about_the_margin(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    margin = figures.margin_ppm
    if margin is None or margin >= plan.clock_range_ppm * (1 - 1e-6):
        return
    needed_s = plan.camera.exposure_s / (1 - plan.clock_range_ppm * 1e-6)
    over_s = plan.camera.exposure_s - plan.dark_s * (1 - plan.clock_range_ppm * 1e-6)
    rows = f" ({over_s / abs(plan.camera.row_time_s):.2g} rows of each frame)" if plan.camera.readout_s else ""
    yield _warning(
        "margin",
        f"The dark time leaves a margin of {margin:.4g} ppm, and the clocks may be {plan.clock_range_ppm:g} ppm "
        "apart: then two "
        f"flashes mix near the dark row{rows}. Leave `dark_s` out, or give at least {needed_s * 1e3:.6g}ms.",
    )


def _about_blind_time(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    never = never_shown(plan)
    if never > IN_STEP:
        yield _warning("in-step", in_step_words(plan, never))
    elif figures.missing_row_share > 0:
        yield _warning(
            "blind",
            f"At a shutter of {plan.camera.shutter_deg:.4g} degrees {figures.missing_row_share:.0%} of the rows of "
            "each plate never see its flash. Where the subject stands still they come from the rounds before and "
            "after; what moves in them is lost. Set the shutter to 360 degrees.",
        )


def in_step_words(plan: Plan, never: float) -> str:
    """Say that rows never see a light since the strobe keeps step with the frames, and which dark time mends it."""
    other_s = dark_s_out_of_step(plan)
    longer = "" if other_s is None else f", or `dark_s` to {show_seconds(other_s)}"
    return (
        f"The strobe keeps step with the frames: every {frames_in_step(plan)} frames its flashes meet the same rows, "
        f"and at a shutter of {plan.camera.shutter_deg:.4g} degrees {never:.0%} of the rows never see a light, however "
        f"long the take. Set the shutter to 360 degrees{longer}."
    )


def _about_three_frames(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    wide = [slot for slot in figures.slots if not slot.is_dark and slot.frames_max == 3]
    if not wide or plan.mode != "rolling":
        return
    most = max(slot.most_frames_share or 0.0 for slot in wide)
    yield _note(
        "three-frames",
        f"Up to {most:.0%} of the flashes reach into three frames; they are put together all the same. "
        f"{_free_of_three(plan)}{_equation_11(plan, wide)}",
    )


def _about_motion(figures: ShootFigures) -> Iterator[Caution]:
    step_px = figures.motion_per_flash_px
    if step_px is None or step_px < LEAST_PX:
        return
    grave, shown_px = motion_cost(step_px).lost > MOST_LOST, round(step_px, 1 if step_px < TENTHS_PX else None)
    yield (_warning if grave else _note)(
        "motion",
        f"What moves goes {shown_px:g} px from flash to flash: {cost_words(step_px)}. Move slower, raise the frame "
        "rate, flash fewer lights, or show the subject smaller.",
    )


def _free_of_three(plan: Plan) -> str:
    camera = plan.camera
    free_s = camera.frame_period_s - abs(camera.readout_s or 0.0) + abs(camera.row_time_s)
    if abs(camera.exposure_s - camera.frame_period_s) > 1e-6 * camera.frame_period_s or free_s < 20e-6:
        return ""
    return f"Flashes of up to {show_seconds(free_s)} never do. "


def _equation_11(plan: Plan, wide: list[SlotFigures]) -> str:
    exposure_s = plan.camera.exposure_s
    count = exposure_s / wide[0].duration_s
    below, above = exposure_s / math.ceil(count + 1e-9), exposure_s / max(math.floor(count + 1e-9), 2)
    choices = " or ".join(dict.fromkeys((show_seconds(above), show_seconds(below))))
    return (
        f"Eq. 11 avoids it with flashes that divide the exposure, here {choices} for every flash and dark slot, but "
        "only if "
        "a trigger starts the first one with a frame and one clock drives both."
    )


def _about_the_leds(figures: ShootFigures, limits: Limits) -> Iterator[Caution]:
    too_long: dict[float, list[str]] = {}
    too_often: dict[float, list[LightFigures]] = {}
    for light in figures.lights:
        if limits.max_pulse_s is not None and light.longest_pulse_s > limits.max_pulse_s * (1 + 1e-9):
            too_long.setdefault(light.longest_pulse_s, []).append(light.name)
        if limits.max_duty is not None and light.duty > limits.max_duty * (1 + 1e-9):
            too_often.setdefault(light.duty, []).append(light)
    for pulse_s, names in too_long.items():
        limit = show_seconds(limits.max_pulse_s or 0.0)
        text = f"{_and(names)}: flashes of {show_seconds(pulse_s)}, over the limit of {limit}. Give at most that."
        yield _warning("pulse", text)
    for duty, lights in too_often.items():
        limit_share = limits.max_duty or 1.0
        fits_s = _flash_for_duty_s(figures, lights[0], limit_share)
        yield _warning(
            "duty",
            f"{_and([light.name for light in lights])}: on for {duty:.2%} of the time, over the limit of "
            f"{limit_share:.2%}. "
            f"Flashes of {show_seconds(fits_s)} for every light would fit; more lights in the round help too.",
        )


def _flash_for_duty_s(figures: ShootFigures, light: LightFigures, duty: float) -> float:
    """Return the flash at which the light's duty is met if all lights take it and the dark times stay."""
    dark_s = (1 - sum(other.duty for other in figures.lights)) / light.rate_hz
    return duty * dark_s / (1 - duty * figures.flash_rate_hz / light.rate_hz)


def _and(names: Sequence[str]) -> str:
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0]


def _about_synced_rows(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    if plan.mode != "synced":
        return
    open_s = plan.camera.exposure_s - abs(plan.camera.readout_s or 0.0)
    longest_s = max(slot.duration_s for slot in figures.slots)
    if longest_s > open_s * (1 + 1e-9):
        yield _warning(
            "synced",
            f"All rows are open together for only {show_seconds(max(open_s, 0.0))} of each frame, so a triggered "
            "flash of "
            f'{show_seconds(longest_s)} is cut in some rows. Use `mode="rolling"`, a slower frame rate or a global '
            "shutter.",
        )
