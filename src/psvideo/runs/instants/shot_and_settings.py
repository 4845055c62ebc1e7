"""What a report says of the shot and of the run's settings, in words."""

import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version as version_of
from pathlib import Path

from psvideo import __version__
from psvideo.clip import Clip, Take
from psvideo.export.sequences.tags import sha256_of
from psvideo.model.rig import Light
from psvideo.runs.steps.lighting import Lighting
from psvideo.runs.steps.output import Output

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


def shot_words(clip: Clip, numbers: Sequence[int]) -> dict[str, str]:
    """Return what is known of the clip, by what the report calls it."""
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
        "Remarks": sentences([one for one in remarks if one]) or "none",
    }


def sentences(remarks: Sequence[str]) -> str:
    """Return remarks as sentences: each ends once, and one that begins small follows the one before it."""
    ended = [one.rstrip(". ") for one in remarks]
    marks = ["; " if other[0].islower() else ". " for other in ended[1:]]
    return "".join(one + mark for one, mark in zip(ended, [*marks, "."], strict=False))


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


def settings_words(take: Take, output: Output, solved: Solved | None) -> dict[str, str]:
    """Return what the run was given and made with; ``solved``: where it solved normals."""
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


def where_words(light: Light | None) -> str:
    """Return where a light is, in the rig's numbers."""
    if light is None:
        return "not known: no rig"
    place = light.direction if light.direction is not None else light.position_m
    numbers = ", ".join(f"{value:.3f}" for value in place or ())
    return f"direction ({numbers})" if light.direction is not None else f"position ({numbers}) m"
