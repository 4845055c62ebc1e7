"""What people should know of a fit: why there is none, and what to distrust where there is one."""

from dataclasses import replace

import numpy as np

from psvideo.camera import FloatArray
from psvideo.plan import Plan
from psvideo.rowfit.beat import Beat
from psvideo.rowfit.fit import Found, first_guess, gain_of
from psvideo.rowfit.profiles import Profiles, brightnesses, predictions, unexplained
from psvideo.rowfit.search import search

MIN_EXPLAINED, MIN_GAIN = 0.5, 0.3
"""A fit that explains less of the rows' changes, or takes less of the robust loss away, has not found a strobe."""
MOST_STEPS, MOST_STEPS_SHARE = 3, 0.04
"""Frames before which others may be missing (or a share of all frames) until only an excellent fit is believed."""
MISNAMED_PPM = (-1000.0, 999.0)
"""Clock offsets that a frame rate misnamed by 1.001 leaves: 120 for 119.88, and 119.88 for 120."""
NEAR_PPM = 150.0
STEADY = 0.02
"""Rows that change by less than this share of their light from frame to frame saw no strobe."""
GAIN_RANGE, GAIN_EXPLAINS = 0.06, 0.6
"""Exposure is called automatic where frames' gains differ by so much and explain such a share of what is left."""
WRONG_PERIOD_GAIN = 0.35
PERIOD_FRAMES, PERIOD_ROWS = 14, 8
MIXED_ROWS = 0.02
"""Share of the rows that may hold two flashes before it is worth a word."""


def convincing(found: Found) -> bool:
    """Tell whether a fit has found a strobe, and not merely the least bad place for one."""
    share = gain_of(found.rows, found.fit.rest)
    often = found.steps > max(MOST_STEPS, MOST_STEPS_SHARE * len(found.rows.value))
    return (
        found.fit.explained > MIN_EXPLAINED
        and share > MIN_GAIN
        and (not often or min(share, found.fit.explained) > 0.9)
    )


def notes(plan: Plan, found: Found) -> tuple[str, ...]:
    """Return sentences on what to distrust, or to put right, although the strobe was found."""
    beat = found.fit.beat
    said = [_clock(plan, beat), _mixed(plan, beat), _shutter(plan, found), _exposure(plan, found), _soft(found)]
    return tuple(sentence for sentence in said if sentence)


def _clock(plan: Plan, beat: Beat) -> str:
    ppm = beat.clock.mean_offset_ppm()
    near = min(MISNAMED_PPM, key=lambda misnamed: abs(ppm - misnamed))
    tolerance = plan.clock_range_ppm
    if abs(ppm - near) < NEAR_PPM and (tolerance < abs(near) or plan.clock_tolerance_ppm is None):
        rate = plan.camera.fps
        other = float(rate) / 1.001 if near < 0 else float(rate) * 1.001
        return (
            f"The strobe's clock seems off by {ppm:+.0f} ppm, which is what a frame rate misnamed by 1.001 looks like: "
            f"the plan says {float(rate):.6g} frames a second, and the camera may well have run at {other:.6g}."
        )
    if abs(ppm) > tolerance + 1.0:
        return f"The strobe's clock is off by {ppm:+.0f} ppm, which is more than the {tolerance:.0f} ppm of the plan."
    return ""


def _mixed(plan: Plan, beat: Beat) -> str:
    short_s = beat.exposure_s - plan.dark_s * beat.clock.rate
    span_s = plan.camera.frame_period_s
    if short_s < MIXED_ROWS * span_s:
        return ""
    return (
        f"The dark time of {plan.dark_s * 1e3:.4g} ms is shorter than the exposure of {beat.exposure_s * 1e3:.4g} ms: "
        f"about {100 * min(short_s / span_s, 1):.0f} % of the rows of every frame hold two flashes, which cannot be "
        "taken apart. Lengthen the dark time or shorten the exposure."
    )


def _shutter(plan: Plan, found: Found) -> str:
    beat, camera = found.fit.beat, plan.camera
    parts = []
    if abs(beat.exposure_s / camera.exposure_s - 1) > 1e-3:
        parts.append(f"the exposure is {beat.exposure_s * 1e3:.5g} ms (plan: {camera.exposure_s * 1e3:.5g})")
    if camera.readout_s:
        readout_s = beat.row_time_s * camera.height_px
        if abs(readout_s / abs(camera.readout_s) - 1) > 1e-3:
            parts.append(f"the readout takes {readout_s * 1e3:.5g} ms (plan: {abs(camera.readout_s) * 1e3:.5g})")
    if beat.fall_s > plan.fall_s + 1e-6 or beat.rise_s > plan.rise_s + 1e-6:
        parts.append(f"the LEDs rise in {beat.rise_s * 1e6:.1f} us and fall in {beat.fall_s * 1e6:.1f} us")
    if camera.readout_s is None:
        height, error_s = camera.height_px, found.fit.errors_s.get("row_time_s", 0.0)
        direction = "bottom" if beat.upward else "top"
        return (
            f"The readout was found to take {beat.row_time_s * height * 1e3:.5g} ms, give or take "
            f"{error_s * height * 1e3:.1g} ms, {direction} row first."
        )
    return f"The picture tells otherwise than the plan: {'; '.join(parts)}." if parts else ""


def _exposure(plan: Plan, found: Found) -> str:
    gain, share = frame_gains(plan, found)
    low, high = np.percentile(gain, [2, 98])
    if high / max(low, 1e-9) - 1 < GAIN_RANGE or share < GAIN_EXPLAINS:
        return ""
    return (
        f"Whole frames grow brighter and darker by {100 * (high / low - 1):.0f} %: the camera seems to have set its "
        "exposure or gain by itself. Plates of different moments cannot be compared; film with everything fixed."
    )


def _soft(found: Found) -> str:
    if found.soft_s == 0.0:
        return ""
    return (
        f"The flashes' edges in the picture are soft, as when compression or scaling blurs rows, which moves no flash. "
        f"If the LEDs themselves take {found.soft_s * 1e6:.0f} us to rise and to fall, all flashes start earlier by as "
        "much: then give rise_s and fall_s in the plan."
    )


def frame_gains(plan: Plan, found: Found) -> tuple[FloatArray, float]:
    """Return every frame's gain (frame,) against the whole clip's brightnesses, and what gains explain of the rest."""
    rows = replace(found.rows, doubt=None)
    beat = replace(found.fit.beat, beat_hz=())
    expected = predictions(plan, rows, beat, brightnesses(plan, rows.one_window(), beat))
    trust = found.fit.weight / found.fit.weight.max(axis=0)
    width = min(9, len(rows.value))
    around = [
        np.convolve(np.pad(sums, width // 2, mode="edge"), np.ones(width), mode="valid")[: len(sums)]
        for sums in ((trust * expected * rows.value).sum(axis=1), (trust * expected**2).sum(axis=1))
    ]
    smooth: FloatArray = around[0] / np.maximum(around[1], 1e-30)
    before = float((trust * (rows.value - expected) ** 2).sum())
    after = float((trust * (rows.value - smooth[:, None] * expected) ** 2).sum())
    return smooth, 1 - after / max(before, 1e-30)


def why_not(plan: Plan, rows: Profiles) -> str:
    """Return what the picture looks like where no strobe like the plan's was found in it."""
    change = np.abs(np.diff(rows.value, axis=0))
    level = float(np.abs(rows.value).mean())
    if float(change.mean()) < STEADY * level:
        return (
            "The rows hardly change from frame to frame, as without any strobe, or with one so fast that every row "
            "sees the same light."
        )
    whole = rows.value.mean(axis=1)
    alone = float(((rows.value - whole[:, None]) - (rows.value - whole[:, None]).mean(axis=0)).std())
    if alone < 0.15 * float((whole - whole.mean()).std()) and plan.camera.readout_s != 0:
        return "All rows change together, as under flicker or automatic exposure, and not as under flashes."
    period_s, gain = other_period(plan, rows)
    if gain < WRONG_PERIOD_GAIN:
        return ""
    planned_s = plan.dark_s + plan.flashes[plan.lit_slots[0]].duration_s
    words = (
        f"The picture looks like a strobe that flashes every {period_s * 1e3:.4g} ms, and not every "
        f"{planned_s * 1e3:.4g} ms as planned"
    )
    short = period_s < plan.camera.exposure_s
    return words + (", which is shorter than the exposure, so that rows hold two flashes mixed." if short else ".")


def other_period(plan: Plan, rows: Profiles) -> tuple[float, float]:
    """Return the time from flash to flash that explains the picture best, and how much of the loss it takes away."""
    part = rows.take(slice(0, min(PERIOD_FRAMES, len(rows.value)))).binned(PERIOD_ROWS).one_window()
    longest_s = max(flash.duration_s for flash in plan.flashes)
    step_s = longest_s / len(part.value)
    best = (np.inf, 0.0)
    for period_s in np.arange(longest_s + 0.25 * rows.period_s, 2.5 * rows.period_s, step_s):
        tried = replace(plan, dark_s=float(period_s) - longest_s)
        place = search(tried, part, range_ppm=0.0, start=first_guess(plan), readout_known=True)[0]
        best = min(best, (place.loss, float(period_s)))
    tried = replace(plan, dark_s=best[1] - longest_s)
    place = search(tried, part, range_ppm=0.0, start=first_guess(plan), readout_known=True)[0]
    return best[1], gain_of(part, unexplained(tried, part, place.beat))
