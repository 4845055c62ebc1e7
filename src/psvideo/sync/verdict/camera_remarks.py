"""What a picture shows of the shutter, the readout and the LEDs where the plan is silent or differs, in words."""

from collections.abc import Iterator

from psvideo.model.camera import Camera
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.fit import ClipFit

CHANGED, GROSS = 1e-3, 0.08
"""Shares by which an exposure or a readout must be off to be worth a word, and to make the plan's value a mistake."""
SURE = 5.0
"""Standard errors by which it must also be off to be called a mistake."""
READOUT_FOUND = "The readout was found to take"
"""What begins the remark on a readout that no plan says, which is all that a measurement of it is for."""


def remarks_on_camera(plan: Plan, found: ClipFit) -> Iterator[str]:
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
