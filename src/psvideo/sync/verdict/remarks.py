"""What people should know of a clip whose strobe was found: what to distrust, and what to put right in its plan."""

from psvideo.model.cost.rows_of_flashes import mixed_share
from psvideo.model.half_flash import HalfFlash
from psvideo.model.plan import Plan
from psvideo.model.swing import Swing
from psvideo.model.units import NTSC, show_seconds
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.verdict.camera_remarks import remarks_on_camera

OF_MISNAMED_PPM = (1e6 * (float(NTSC) - 1.0), 1e6 * (1.0 / float(NTSC) - 1.0))
"""Clock offsets that a frame rate misnamed by 1.001 leaves: -999 ppm for a plan of 120 and footage of 119.88, +1000 ppm
the other way round."""
NEAR_PPM = 150.0
MIXED_ROWS = 0.02
"""Share of the rows that may hold two flashes before it is worth a word."""
UNSURE = 0.05
"""Share of a flash from which on a standard error is worth a word."""
MUCH = 0.5
"""Share of the times' error from which on its source is worth a word."""
SOFT_ROWS = 0.1
"""Edges that are softer than sharp ones by less than this, as a time and in rows, are not worth a word, and in the
times' error all the same: black that is cut off, so that noise lifts it, makes sharp ones 0.03 to 0.08 row soft."""


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
        *(remarks_on_camera(plan, found) if half is None else ()),
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


def _soft(found: ClipFit) -> str:
    if found.soft_s <= SOFT_ROWS * abs(found.fit.beat.row_time_s):
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
