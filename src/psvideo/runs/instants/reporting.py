"""Writes the report of a run beside its results, from what was observed while it went on."""

import json
import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version as version_of
from pathlib import Path

from psvideo import __version__
from psvideo.clip import Clip, Masks, Take
from psvideo.export.sequences.tags import sha256_of
from psvideo.formats.whole_files import write_text
from psvideo.model.arrays import Pixels
from psvideo.model.rig import Light, Rig
from psvideo.model.timing import Timing
from psvideo.plates.several_lights.unmixed import slot_names
from psvideo.report.html import report_page
from psvideo.report.judge.every_line import judgements
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.report.observe.rig_and_curve.yuille1997 import Lens
from psvideo.report.observe.watched_motion import WatchedMotion
from psvideo.report.run_report import LightFacts, RunReport, report_record
from psvideo.runs.steps.levels import levels_of
from psvideo.runs.steps.lighting import Lighting
from psvideo.runs.steps.output import Output
from psvideo.runs.steps.saturation import saturation_of

LIBRARIES = ("numpy", "opencv-contrib-python-headless", "numba", "OpenEXR")


@dataclass(frozen=True, kw_only=True)
class Solved:
    """What a normals run adds to a report: what it was solved with, by which solver, and what its validity means.

    ``depth``: what its depth is measured in; empty where there is none.
    """

    lighting: Lighting
    solver: str
    trust: str
    depth: str = ""
    warnings: tuple[str, ...] = ()
    aligned: bool = False
    opened: bool = False


def observing(take: Take, rig: Rig | None = None, masks: Masks | None = None) -> Observed:
    """Return what gathers the facts of a take's rounds; with a rig, it is compared with the plates.

    Near lights are so only on the rig's plane: where depth is known instead, there may be none.
    """
    clip = take.clip
    points = None
    near = rig is not None and any(light.position_m is not None for light in rig.lights)
    size = {"height_px": clip.height_px, "width_px": clip.width_px}
    if rig is not None and not (near and None in (rig.focal_px, rig.principal_px, rig.plane)):
        points = rig_points(clip.shown_plan, rig, channels=clip.channels, **size)
        if take.unmixing is not None:  # whose lamps are of strength 1 by themselves, whatever was measured
            points = replace(points, strengths_all_one=False)
    watched = "" if take.unmixing is None else slot_names(clip.plan)[0]
    return Observed(
        lights=clip.plan.lights,
        motion=WatchedMotion(watched=watched),
        masks=masks,
        points=points,
        lens=Lens.of(rig, **size),
        stills=clip.plan.mode == "synced",
        turn=clip.turn,
    )


def run_report(
    take: Take, timing: Timing, observed: Observed, output: Output, *, solved: Solved | None = None
) -> RunReport:
    """Return the report of a run over a take."""
    clip = take.clip
    known = None if solved is None else solved.lighting.rig
    by_name = {} if known is None else {light.name: light for light in known.lights}
    lights = tuple(
        LightFacts(
            name=name,
            levels=observed.levels(name),
            where=_where(by_name.get(name)),
            error_deg=by_name[name].error_deg if name in by_name else None,
        )
        for name in clip.plan.lights
    )
    judged = judgements(
        clip.plan,
        timing,
        observed,
        curve_doubt=clip.curve_doubt,
        saturation=saturation_of(take),
        levels=levels_of(take),
        aligned=solved is not None and solved.aligned,
        opened=solved is not None and solved.opened,
    )
    warned = (one for one in clip.warnings if one != clip.curve_doubt)  # which is judged
    warnings = (*warned, *(() if solved is None else solved.warnings))
    spell = output.caller.spell
    return RunReport(
        clip=clip.name,
        version=__version__,
        kind="split" if solved is None else "normals",
        timing=timing,
        lights=lights,
        instants=tuple(observed.facts),
        judgements=tuple(one.spelled(spell) for one in judged),
        condition=None if solved is None else solved.lighting.condition,
        solver="" if solved is None else solved.solver,
        trust="" if solved is None else spell(solved.trust),
        warnings=tuple(map(spell, warnings)),
        shot={name: spell(words) for name, words in _shot(clip, take.numbers).items()},
        settings=_settings(take, output, solved),
        thumbnails=observed.thumbnails,
    )


def write_report(folder: Path, report: RunReport, pictures: Sequence[tuple[str, Pixels]]) -> None:
    """Write report.json and report.html into a folder of results."""
    write_text(folder / "report.json", json.dumps(report_record(report), indent=1) + "\n")
    write_text(folder / "report.html", report_page(report, pictures))


def _where(light: Light | None) -> str:
    if light is None:
        return "not known: no rig"
    place = light.direction if light.direction is not None else light.position_m
    numbers = ", ".join(f"{value:.3f}" for value in place or ())
    return f"direction ({numbers})" if light.direction is not None else f"position ({numbers}) m"


def _shot(clip: Clip, numbers: Sequence[int]) -> dict[str, str]:
    plan = clip.plan
    synced = plan.mode == "synced"
    flashes = " · ".join(
        (" + ".join(flash.lit) or "dark") + ("" if synced else f" {flash.duration_s * 1e3:.4g} ms")
        for flash in plan.flashes
    )
    remarks = dict.fromkeys((clip.curve_doubt, *clip.warnings, *clip.notes))
    return {
        "Clip": str(clip.path.resolve()),
        "Frames": f"{len(numbers)} of {len(clip.numbers)}, numbered {numbers[0]} to {numbers[-1]}",
        "Pictures": f"{clip.width_px} x {clip.height_px} pixels, {clip.kind}, "
        + (f"{clip.header.bits} bits" if clip.header.bits else "floating point")
        + (f", mosaic {clip.cfa}" if clip.cfa else ""),
        **(_taken_one_by_one(clip, flashes) if clip.stills else _filmed(clip, numbers, flashes)),
        "Remarks": "; ".join(one.rstrip(".") for one in remarks if one) or "none",
    }


def _taken_one_by_one(clip: Clip, lights: str) -> dict[str, str]:
    """Return what is known of photographs, which no plan timed."""
    return {"Camera": f"{clip.plan.camera.name}, transfer {clip.encoding.transfer}", "Lights": lights}


def _filmed(clip: Clip, numbers: Sequence[int], flashes: str) -> dict[str, str]:
    """Return rate, shutter and strobe of footage, in the plan's words."""
    plan, camera = clip.plan, clip.plan.camera
    synced = plan.mode == "synced"
    readout = "not known" if camera.readout_s is None else f"{camera.readout_s * 1e3:.4g} ms"
    shutter_deg = 360 * camera.exposure_s / camera.frame_period_s
    return {
        "Camera": f"{float(camera.fps):.6g} frames a second, shutter {shutter_deg:.4g} degrees, readout {readout}, "
        f"transfer {clip.encoding.transfer}",
        "Lasts": f"{(numbers[-1] - numbers[0] + 1) * camera.frame_period_s:.3f} s"
        + (f", from {clip.time_code}" if clip.time_code else ""),
        "Strobe": f"synced, one flash a frame: {flashes}"
        if synced
        else f"{plan.mode}; {flashes}; {plan.dark_s * 1e3:.4g} ms dark between them",
        "Rounds a second": f"{len(plan.dark_rounds) / plan.cycle_s:.4g}"
        if plan.mode != "synced"
        else f"{float(camera.fps) / len(plan.flashes):.4g}",
    }


def _settings(take: Take, output: Output, solved: Solved | None) -> dict[str, str]:
    facts = {"Command": output.caller.command or "called from Python", "Plan, SHA-256": sha256_of(take.clip.plan_path)}
    if solved is not None:
        facts["Rig, SHA-256"] = sha256_of(solved.lighting.rig_path)
        facts["Mask, SHA-256"] = solved.lighting.mask_sha256 or "no mask"
        facts["Solver"] = solved.solver
        facts["What valid means"] = output.caller.spell(solved.trust)
        if solved.depth:
            facts["What depth means"] = output.caller.spell(solved.depth)
    libraries = ", ".join(f"{name} {version_of(name)}" for name in LIBRARIES)
    facts["Made with"] = f"psvideo {__version__}, Python {platform.python_version()}, {libraries}"
    facts["Run in"] = str(Path.cwd())
    return facts
