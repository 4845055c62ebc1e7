"""What is checked and said of a delivery before anything is written: whether this take can give what was asked for."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.clip import Take
from psvideo.errors import UsageError
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import Space
from psvideo.model.plan import Plan
from psvideo.model.quantities import QUANTITIES, Aov
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.model.units import counted, show_rate
from psvideo.plates.align.comb import Comb, Schedule
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import scheduled
from psvideo.plates.sequence import round_numbers
from psvideo.plates.used_flashes import used_of
from psvideo.runs.steps.caller import Caller
from psvideo.runs.steps.lighting import Lighting
from psvideo.runs.steps.output import Output
from psvideo.solve.normals.solving import ROBUST_FROM_LIGHTS
from psvideo.solve.passes.asked_passes import FEWEST_FOR_SPECULAR, AskedPasses

LENS_TOLERANCE = 0.01
"""Share by which two focal lengths may differ before a warning: calibrations of one lens differ by less."""


def check_delivery(delivery: Delivery, take: Take, timing: Timing, start_number: int) -> None:
    """Raise UsageError or PsvideoError where a delivery asks for what this take does not have."""
    delivery.mix.check(take.plan)
    check_camera(delivery.space, take, timing, start_number)


def metric_delivery(delivery: Delivery, aov: Sequence[Aov], lighting: Lighting, caller: Caller) -> Delivery:
    """Return a program's delivery without positions that its preset adds, where depth has no metres; say why.

    Raises UsageError where ``aov`` asks for such positions for a program, whose camera and lights count in metres.
    """
    if delivery.program is None or lighting.metric or "position" not in delivery.aovs:
        return delivery
    lacking = "[camera] focal_px" if lighting.rig.focal_px is None else "a [surface] plane, or `depth`"
    why = (
        f"`preset={delivery.program!r}` has no positions: without {lacking} in the rig depth is relative, and points "
        "would not lie where the program's camera and lights are."
    )
    if "position" in aov:
        raise UsageError(f"{why} Give the rig lens and plane, or leave `preset` or `aov=['position']` out.")
    caller.say(why)
    kept = tuple(name for name in delivery.aovs if name in aov or QUANTITIES[name].of != "depth")
    return replace(delivery, aovs=kept)


def say_instants(take: Take, timing: Timing, aligning: Aligning | None, output: Output) -> Schedule | None:
    """Say which instants are delivered at a steady rate, and which are not; return them, None where rounds decide.

    Raises UsageError where a rate has no instant near a whole round, though there are rounds.
    """
    due = None if aligning is None else scheduled(take, timing, aligning, start_number=output.start_number)
    if due is not None and aligning is not None and isinstance(aligning.rate, Comb):
        if due.rounds and not due.numbers:
            raise UsageError(
                f"`fps` {aligning.rate.fps}: no instant at this rate, the first at {aligning.rate.first_s:.4g} s, is "
                f"near one of the clip's {counted(due.rounds, 'whole round')}. Give a higher rate."
            )
        output.caller.say(_instants_said(aligning.rate, due, output.start_number))
    return due


def _instants_said(comb: Comb, due: Schedule, start_number: int) -> str:
    numbers = due.numbers
    shown = "No result is delivered"
    if numbers:
        verb = "is" if len(numbers) == 1 else "are"
        which = f"number {numbers[0]}" if len(numbers) == 1 else f"numbered {numbers[0]} to {numbers[-1]}"
        shown = f"{counted(len(numbers), 'result')} {verb} delivered, {which}"
    before, within, after = due.left_out
    lacking = [
        f"{count} {where}"
        for count, where in ((before, "at the start"), (within, "in holes"), (after, "at the end"))
        if count
    ]
    clock = "the camera's clock" if comb.clock is None else "the clock of the cameras' reference"
    rest = f" Left out, as no whole round is near: {', '.join(lacking)}." if lacking else " None is left out."
    return (
        f"Instants at {show_rate(comb.fps)}: number {start_number} + k shows {comb.first_s:.7g} s + k / ({comb.fps}) "
        f"on {clock}. {shown}.{rest}"
    )


def check_camera(space: Space, take: Take, timing: Timing, start_number: int) -> None:
    """Raise PsvideoError where a moving camera is not known at the clip's first or last round."""
    if space.moving is None:
        return
    times_s: dict[int, list[float]] = defaultdict(list)
    numbers = round_numbers(timing.flashes, start=start_number)
    for flash, number in zip(used_of(take, timing).flashes, numbers, strict=True):
        if flash.complete and not flash.is_dark:
            times_s[number].append(flash.start_s + flash.duration_s / 2)
    whole = [number for number, times in times_s.items() if len(times) == len(take.plan.lit_slots)]
    for number in (min(whole), max(whole)) if whole else ():
        space.at(float(np.mean(times_s[number])), number, take.clip.filmed_plan.camera.fps)


def world_doubts(delivery: Delivery, rig: Rig, width_px: int, *, metric: bool) -> tuple[str, ...]:
    """Return in whole sentences why points in the world do not lie where the scene is: no scale, or another lens."""
    space = delivery.space
    if space.name != "world" or not delivery.needs_depth:
        return ()
    said = []
    lens_px = None if space.lens is None else space.lens * width_px
    if not metric:
        known = "" if lens_px is None else f" (the USD camera's would be {lens_px:.6g})"
        said.append(
            "Positions and meshes in world space need depth in metres, and here it is relative: they do not lie where "
            f"the scene is. Give the rig [camera] focal_px{known} and a [surface] plane."
        )
    if lens_px and rig.focal_px and abs(rig.focal_px[0] / lens_px - 1) > LENS_TOLERANCE:
        said.append(
            f"The rig's focal length is {rig.focal_px[0]:.6g} pixels and the USD camera's {lens_px:.6g}: positions do "
            "not lie under their pixels when they are seen through that camera. Give both the same lens and crop."
        )
    return tuple(said)


def pass_doubts(asked: AskedPasses, plan: Plan) -> tuple[str, ...]:
    """Return in whole sentences why a pass that was asked for does not show what its name says."""
    said = []
    if asked.specular and len(plan.lights) < FEWEST_FOR_SPECULAR:
        said.append(
            f"`aov` specular is empty: three lights explain any three brightnesses as diffuse. From "
            f"{FEWEST_FOR_SPECULAR} lights on, better {ROBUST_FROM_LIGHTS}, something is left over."
        )
    if asked.alpha and all(not flash.is_dark for flash in plan.flashes):
        said.append(
            "`aov` alpha is 1 wherever ambient light falls too: without a dark slot it cannot be told from the lights' "
            "own. Keep a dark slot in the plan (of stills: a picture named dark), or darken the room."
        )
    return tuple(said)
