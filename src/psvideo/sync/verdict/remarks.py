"""What people should know of a clip whose strobe was found: what to distrust, and what to put right in its plan."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from psvideo.model.camera import Camera
from psvideo.model.cost.in_step import IN_STEP, never_shown
from psvideo.model.cost.shoot_figures import mixed_share
from psvideo.model.half_flash import HalfFlash
from psvideo.model.plan import Plan
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.swing import Swing
from psvideo.model.units import NTSC, show_seconds
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import brightnesses

OF_MISNAMED_PPM = (1e6 * (float(NTSC) - 1.0), 1e6 * (1.0 / float(NTSC) - 1.0))
"""Clock offsets that a frame rate misnamed by 1.001 leaves: -999 ppm for a plan of 120 and footage of 119.88, +1000 ppm
the other way round."""
NEAR_PPM = 150.0
CHANGED, GROSS = 1e-3, 0.08
"""Shares by which an exposure or a readout must be off to be worth a word, and to make the plan's value a mistake."""
SURE = 5.0
"""Standard errors by which it must also be off to be called a mistake."""
MIXED_ROWS = 0.02
"""Share of the rows that may hold two flashes before it is worth a word."""
UNFIRED = 0.01
"""Share of the brightest light's level below which a light is said not to have fired."""
ALIKE = 0.01
"""Share of their level by which lights that flash one at a time differ at least, in some rows."""
UNSURE = 0.05
"""Share of a flash from which on a standard error is worth a word."""
MUCH = 0.5
"""Share of the times' error from which on its source is worth a word."""
READOUT_FOUND = "The readout was found to take"
"""What begins the remark on a readout that no plan says, which is all that a measurement of it is for."""


def remarks(
    plan: Plan, found: ClipFit, *, swing: Swing | None, half: HalfFlash | None = None
) -> tuple[str, ...]:  # fmt: skip
    """Return sentences on what to distrust or to put right. ``plan`` is the one that was given, as it was given;
    ``swing`` is how its light grows and shrinks, ``half`` how bright half of a flash looks where that shows another
    curve, which also looks like slow LEDs or another exposure."""
    beat = found.fit.beat
    said = [
        _clock(plan, found),
        _mixed(plan, beat),
        *(_camera(plan, found) if half is None else ()),
        "" if half is None else half.sentence,
        "" if swing is None else swing.sentence,
        _soft(found)
        if swing is None and half is None
        else "",  # light that changes between two frames bends edges as well
        _unsteady(found),
        _sureness(plan, found),
    ]
    return tuple(sentence for sentence in said if sentence)


def _clock(plan: Plan, found: ClipFit) -> str:
    ppm = found.fit.beat.clock.mean_offset_ppm()
    start_s = found.rows.frame_start_s
    error_ppm = 2e6 * found.fit.shift_error_s / float(start_s[-1] - start_s[0])
    near = min(OF_MISNAMED_PPM, key=lambda misnamed: abs(ppm - misnamed))
    tolerance = plan.clock_range_ppm
    if abs(ppm - near) + error_ppm < NEAR_PPM and (tolerance < abs(near) or plan.clock_tolerance_ppm is None):
        rate = plan.camera.fps
        other = float(rate) / 1.001 if near < 0 else float(rate) * 1.001
        return (
            f"The strobe's clock seems off by {ppm:+.0f} ppm, which is what a frame rate misnamed by 1.001 looks like: "
            f"the plan says {float(rate):.6g} frames a second, and the camera may well have run at {other:.6g}."
        )
    if abs(ppm) > tolerance + 1.0 + 3 * error_ppm:
        return f"The strobe's clock is off by {ppm:+.0f} ppm, which is more than the {tolerance:.0f} ppm of the plan."
    return ""


def _unsteady(found: ClipFit) -> str:
    if found.unsteady_s == 0.0 or found.unsteady_s < MUCH * found.fit.shift_error_s:
        return ""
    return (
        "Some flashes in a row come early or late against all the others, as where the strobe's clock jumped or frames "
        f"are missing: that makes much of the times' error of {show_seconds(found.fit.shift_error_s)}."
    )


def _mixed(plan: Plan, beat: Beat) -> str:
    share = mixed_share(plan, exposure_s=beat.exposure_s, dark_s=plan.dark_s * beat.clock.rate)
    if share < MIXED_ROWS:
        return ""
    return (
        f"The dark time of {plan.dark_s * 1e3:.4g} ms is shorter than the exposure of {beat.exposure_s * 1e3:.4g} ms: "
        f"about {100 * share:.0f} % of the rows of every frame hold two flashes, which cannot be "
        "separated. Lengthen the dark time or shorten the exposure."
    )


def _camera(plan: Plan, found: ClipFit) -> Iterator[str]:
    """Say what the picture shows of the shutter and the LEDs where the plan is silent or differs."""
    beat, camera, errors_s = found.fit.beat, plan.camera, found.fit.errors_s
    parts = []
    exposure = f"{_ms(beat.exposure_s, errors_s.get('exposure_s'))} ({_degrees(camera, beat.exposure_s)} degrees)"
    off = abs(beat.exposure_s / camera.exposure_s - 1)
    if off > GROSS and abs(beat.exposure_s - camera.exposure_s) > SURE * errors_s.get("exposure_s", 0.0):
        yield (
            f"The plan's shutter is wrong: the exposure is {exposure}, and the plan says {_ms(camera.exposure_s)} "
            f"({_degrees(camera, camera.exposure_s)} degrees). Put exposure_s = {beat.exposure_s:.6g} into plan.toml."
        )
    elif off > CHANGED:
        parts.append(f"the exposure is {exposure} (plan: {camera.exposure_s * 1e3:.5g} ms)")
    readout_s = beat.row_time_s * camera.height_px * (-1 if beat.upward else 1)
    error_s = errors_s.get("row_time_s", 0.0) * camera.height_px
    if abs(readout_s) < 3 * error_s:
        readout_s = 0.0
    if camera.readout_s is None and found.slack_s > 0:
        yield "The readout cannot be measured from this clip: no row opens or closes during a flash."
    elif camera.readout_s is None:
        yield f"{READOUT_FOUND} {_ms(abs(readout_s), error_s)}, {_direction(readout_s)}."
    elif abs(readout_s - camera.readout_s) > GROSS * max(abs(camera.readout_s), abs(readout_s)):
        yield _wrong_readout(camera.readout_s, readout_s, error_s)
    elif camera.readout_s and abs(readout_s / camera.readout_s - 1) > CHANGED:
        parts.append(f"the readout takes {_ms(abs(readout_s), error_s)} (plan: {abs(camera.readout_s) * 1e3:.5g} ms)")
    if beat.fall_s > plan.fall_s + 1e-6 or beat.rise_s > plan.rise_s + 1e-6:
        parts.append(f"the LEDs rise in {beat.rise_s * 1e6:.1f} us and fall in {beat.fall_s * 1e6:.1f} us")
    if parts:
        yield f"The picture differs from the plan: {'; '.join(parts)}."


def _wrong_readout(planned_s: float, readout_s: float, error_s: float) -> str:
    found = f"it takes {_ms(abs(readout_s), error_s)}, {_direction(readout_s)}"
    if planned_s * readout_s < 0:
        return (
            f"The plan's readout runs the wrong way: {found}, and the plan says {_direction(planned_s)}. Put readout_s "
            f"= {readout_s:.6g} into plan.toml. Or the picture was turned by 180 degrees, or mirrored top to bottom, "
            "after it was taken: then turn the rig's lights as well. Normals of lights that were not turned look wrong "
            "only where the subject stands free."
        )
    if planned_s == 0:
        fault = f"The plan's camera has a global shutter, but the picture shows a rolling readout: {found}"
    else:
        fault = f"The plan's readout is wrong: {found}, and the plan says {_ms(abs(planned_s))}"
    return f"{fault}. Put readout_s = {readout_s:.6g} into plan.toml."


def _ms(time_s: float, error_s: float | None = None) -> str:
    if not error_s:
        return f"{time_s * 1e3:.5g} ms"
    return f"{time_s * 1e3:.5g} ms +- {f'{error_s * 1e3:.1g} ms' if error_s > 1e-6 else f'{error_s * 1e6:.1g} us'}"


def _degrees(camera: Camera, exposure_s: float) -> str:
    return f"{360.0 * exposure_s / camera.frame_period_s:.4g}"


def _direction(readout_s: float) -> str:
    if readout_s == 0:
        return "all rows at once"
    return f"{'bottom' if readout_s < 0 else 'top'} row first"


def _soft(found: ClipFit) -> str:
    if found.soft_s == 0.0:
        return ""
    return (
        f"The flashes' edges in the picture are soft, as when compression or scaling blurs rows, which moves no flash. "
        f"If the LEDs themselves take {found.soft_s * 1e6:.0f} us to rise and to fall, all flashes start earlier by as "
        "much: then give rise_s and fall_s in the plan."
    )


def _sureness(plan: Plan, found: ClipFit) -> str:
    error_s = found.fit.shift_error_s
    shortest_s = plan.shortest_flash_s
    if found.slack_s > 0:
        return (
            f"The flashes' times are known to +- {found.slack_s * 1e3:.3g} ms only: no row opens or closes during a "
            "flash, so that the picture looks the same wherever in the exposure they fired. The plates do not suffer."
        )
    if error_s > UNSURE * shortest_s:
        return (
            f"The flashes' times are known to +- {show_seconds(error_s, figures=2)} only, and flashes last "
            f"{show_seconds(shortest_s, figures=3)}: the clip is too short or too noisy, or its subject moves too "
            "much, to measure them better."
        )
    return ""


def _missed_share(plan: Plan, found: ClipFit, beat: Beat) -> float:
    """Return the share of the rows that see a light in no round of the clip, in the mean over lights: 0 where the
    shutter is open all the time, or flashes come at other places in the frame from round to round."""
    start_s = found.rows.frame_start_s
    as_found = replace(plan, camera=replace(plan.camera, exposure_s=beat.exposure_s))
    lasts_s = float(start_s[-1] - start_s[0]) + found.rows.period_s
    return never_shown(as_found, lasts_s=lasts_s, clock_offset_ppm=beat.clock.mean_offset_ppm())


def remarks_on_lights(plan: Plan, found: ClipFit, beat: Beat, *, named: bool) -> tuple[str, ...]:
    """Return sentences on lights that seem not to have fired, or all at once.

    ``beat`` is the fit's, its cycle turned to where the lights' names are; ``named``: these are not a guess.
    """
    lit = plan.lit_slots
    drive_s = np.array([sum(plan.flashes[slot].lights.values()) * plan.flashes[slot].duration_s for slot in lit])
    rows = found.rows.one_window()
    light = brightnesses(plan, rows, beat, rows.unclipped)[:, 1 : len(lit) + 1] / drive_s
    level = light.mean(axis=0)
    if level.min() < -UNFIRED * level.max():
        return ()  # no flash takes light away: the names are wrong, and not the lights
    off = [slot for slot, one in zip(lit, level, strict=True) if one < UNFIRED * level.max()]
    if off:
        dark = ", ".join(dict.fromkeys("+".join(plan.flashes[slot].lit) for slot in off))
        unless = "" if named else " If the order guessed here is not the true one, it is another light."
        told = f"{dark}: no light is seen from there, less than {100 * UNFIRED:.0f} % of the brightest."
        missed = _missed_share(plan, found, beat)
        if missed > IN_STEP:
            return (
                f"{told} These lights may fire unseen: the strobe keeps step with the frames, and the closed shutter "
                f"misses {100 * missed:.0f} % of the rows' flashes in every round of this clip. Then times are known "
                f"less well than is said. Plan another dark time (`dark_s`), or open the shutter longer.{unless}",
            )
        return (f"{told} Check that it fires, and that it reaches what the camera sees.{unless}",)
    if len({frozenset(plan.flashes[slot].lit) for slot in lit}) < LEAST_LIGHTS:
        return ()
    if any(len(plan.flashes[slot].lit) > 1 for slot in lit):
        return ()  # flashes of several colours that are exchanged are alike on what is grey
    size = float(np.sqrt((light**2).mean()))
    apart = [float(np.sqrt(((light[:, a] - light[:, b]) ** 2).mean())) for a, b in combinations(range(len(lit)), 2)]
    if max(apart) > ALIKE * size:
        return ()
    return (
        f"All lights give the same picture to within {100 * max(apart) / size:.1g} %: they seem to flash together, "
        "not one after the other. Check the wiring and that each light listens to its own line.",
    )
