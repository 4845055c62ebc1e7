"""What can be said of a plan alone: its lights, its marker, its dark time, what a clip of some length holds of it."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from psvideo.clip.transfer import find_curve
from psvideo.errors import PsvideoError
from psvideo.formats.rig_toml import read_rig
from psvideo.inspect.findings import Finding, fault, ok, warn
from psvideo.model.marker import has_marker
from psvideo.model.plan import Plan
from psvideo.model.units import counted

ROUNDING = 1e-4


def plan_findings(plan: Plan) -> Iterator[Finding]:
    """Check what a plan promises against itself."""
    camera = plan.camera
    yield ok(
        f"{camera.name}: {camera.width_px} x {camera.height_px} at {float(camera.fps):.6g} fps, {_shutter(plan)}, "
        f"transfer {find_curve(camera.encoding.transfer).name}"
    )
    yield ok(f"{plan.mode}, {counted(len(plan.flashes), 'flash')} a round, lights {', '.join(plan.lights)}")
    if plan.mode == "synced":
        return
    if plan.mode == "rolling" and plan.dark_s < camera.exposure_s * (1 - ROUNDING):
        yield warn(
            f"the dark time, {plan.dark_s * 1e3:.4g} ms, is shorter than the exposure, "
            f"{camera.exposure_s * 1e3:.4g} ms: rows near the dark row hold two flashes"
        )
    if has_marker(plan):
        yield ok("its cycle shows which flash is which (a dark slot or a flash of another length)")
    elif len(plan.lights) > 1:
        yield warn("all its flashes are alike, so their names are a guess: give `first_light`")


def length_finding(plan: Plan, numbers: tuple[int, ...]) -> Finding:
    """Say what frames of these numbers hold: flashes and whole rounds."""
    span = numbers[-1] - numbers[0] + 1
    if plan.mode == "synced":
        return _synced_length(len(plan.flashes), numbers)
    seconds = span * plan.camera.frame_period_s
    per_cycle = len(plan.cycle_slots)
    flashes = int(seconds / plan.cycle_s * per_cycle)
    rounds = int(seconds / plan.cycle_s * len(plan.dark_rounds))
    whole = counted(rounds, "whole round")
    text = f"{seconds:.4g} s at {float(plan.camera.fps):.6g} fps: about {counted(flashes, 'flash')}, {whole}"
    if rounds < 1:
        return fault(f"{text}, which is too short: a round lasts {plan.cycle_s / len(plan.dark_rounds):.4g} s")
    return ok(text)


def _synced_length(per_round: int, numbers: Sequence[int]) -> Finding:
    frames, span = len(numbers), numbers[-1] - numbers[0] + 1
    held = Counter((number - numbers[0]) // per_round for number in numbers)
    whole = sum(count == per_round for count in held.values())
    text = f"{frames} frames, {per_round} flashes a round: {counted(whole, 'whole round')}"
    if frames < per_round:
        return fault(f"{text}; a synced clip has one frame per flash, so {per_round - frames} are missing")
    if frames % per_round and frames == span:
        return warn(f"{text}, and {counted(frames % per_round, 'frame')} of a round that is cut")
    return ok(text)


def rig_findings(rig_path: Path, plan: Plan) -> Iterator[Finding]:
    """Check that a rig has the plan's lights."""
    try:
        rig = read_rig(rig_path, plan_lights=plan.lights)
        rig.select(plan.lights)
    except PsvideoError as error:
        yield fault(error if str(rig_path) in str(error) else f"{rig_path}: {error}")
        return
    others = [name for name in rig.names if name not in plan.lights]
    yield ok(f"{rig_path.name} has the plan's {counted(len(plan.lights), 'light')}")
    if others:
        yield warn(f"{rig_path.name} has lights that the plan does not flash: {', '.join(others)}")


def _shutter(plan: Plan) -> str:
    camera = plan.camera
    if plan.mode == "synced":
        return "one flash per frame"
    readout = "unknown" if camera.readout_s is None else f"{camera.readout_s * 1e3:.4g} ms"
    return f"shutter {camera.shutter_deg:.4g}°, readout {readout}"
