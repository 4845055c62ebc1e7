"""What can be said of a single file: a plan, a rig, a timing, or an image with its attributes."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from psvideo.clip.decode import exr
from psvideo.clip.decode.decoders import decode
from psvideo.clip.folder import KINDS
from psvideo.clip.reading import looks
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.contract import read_text
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_folder import RIG_FILE
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import read_timing
from psvideo.inspect.about_output import describe_output, output_around
from psvideo.inspect.about_plan import plan_findings, rig_findings
from psvideo.inspect.findings import Description, Fact, Finding, fault, ok, warn
from psvideo.model.units import MISNAMED_PPM, counted
from psvideo.strobe.as_played import as_played
from psvideo.strobe.runlog import read_log

NEAR_PPM = 100.0
"""A clock that is off by what a misnamed rate makes, to this much, speaks of one: cameras' clocks are better."""
OF_A_FOLDER = ("psvideo-delivery", "psvideo-report")
"""What stands for the folder in which it lies."""
LIGHT_LISTS = (".lp", ".txt")


def describe_file(path: Path) -> Description:
    """Describe one file by its name's ending and, for TOML and JSON, its schema."""
    suffix = path.suffix.lower()
    if suffix in KINDS:
        return _describe_image(path, KINDS[suffix])
    if suffix in LIGHT_LISTS and output_around(path.absolute()) is None:
        return _described(path, "rig", _rig)
    schema = _schema(path)
    readers = {
        "psvideo-plan": ("plan", _plan),
        "psvideo-rig": ("rig", _rig),
        "psvideo-timing": ("timing", _timing),
        "psvideo-strobe": ("strobe log", _strobe_log),
    }
    if schema in OF_A_FOLDER:
        return describe_output(path.parent)
    if schema not in readers and (around := output_around(path.absolute())) is not None:
        return describe_output(around)
    if schema not in readers:
        kinds = ", ".join(readers)
        raise PsvideoError(
            f"{path}: is nothing of which psvideo can say more. Name a clip folder, a movie, an image, an output "
            f"folder, or a file whose schema is one of {kinds}."
        )
    return _described(path, *readers[schema])


def _described(path: Path, kind: str, read: Callable[[Path], tuple[dict[str, Fact], list[Finding]]]) -> Description:
    try:
        facts, findings = read(path)
    except PsvideoError as error:
        return Description(path=path, kind=kind, findings=(fault(error),))
    return Description(path=path, kind=kind, facts=facts, findings=tuple(findings))


def _schema(path: Path) -> str | None:
    """Return the kind of file that TOML or JSON says it is; what cannot be parsed is judged by its name."""
    if path.suffix not in (".toml", ".json"):
        return None
    try:
        text = read_text(path)
        data: Any = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
        return str(data["schema"]).partition("/")[0]
    except (ValueError, RecursionError, KeyError, TypeError):
        return f"psvideo-{path.stem}"


def _plan(path: Path) -> tuple[dict[str, Fact], list[Finding]]:
    plan = read_plan(path)
    rig = path.with_name(RIG_FILE)
    findings = [*plan_findings(plan), *(rig_findings(rig, plan) if rig.is_file() else ())]
    facts: dict[str, Fact] = {
        "mode": plan.mode,
        "lights": list(plan.lights),
        "fps": float(plan.camera.fps),
        "flashes_per_round": len(plan.flashes),
        "cycle_s": plan.cycle_s,
    }
    return facts, findings


def _rig(path: Path) -> tuple[dict[str, Fact], list[Finding]]:
    rig = read_rig(path)
    near = [light.name for light in rig.lights if light.direction is None]
    findings = [ok(f"{len(rig.lights)} lights: {', '.join(rig.names)}")]
    if near:
        some = f"{len(near)} of them near, with positions; the others distant, with directions"
        findings.append(ok(some if len(near) < len(rig.lights) else "near, with positions"))
    if len(rig.lights) < 3:
        findings.append(warn("normals need three lights or more"))
    plan = path.with_name(PLAN_FILE)
    if plan.is_file():
        findings += rig_findings(path, read_plan(plan))
    return {"lights": list(rig.names), "near_lights": near}, findings


def _timing(path: Path) -> tuple[dict[str, Fact], list[Finding]]:
    timing = read_timing(path)
    complete = sum(flash.complete for flash in timing.flashes)
    findings = [ok(f"clip {timing.clip}: {len(timing.flashes)} flashes, {complete} of them complete")]
    findings.append(
        warn("the order of the lights is a guess: give `first_light`")
        if timing.order == "guess"
        else ok(f"the order of the lights was {'' if timing.order == 'given' else 'found by '}{timing.order}")
    )
    offset = f"the strobe's clock is {timing.clock_offset_ppm:+.4g} ppm off the camera's"
    misnamed = abs(abs(timing.clock_offset_ppm) - MISNAMED_PPM) < NEAR_PPM
    findings.append(warn(f"{offset}: the frame rate is likely misnamed by 1000/1001") if misnamed else ok(offset))
    dropped = sum(hole.count for hole in timing.dropped_frames)
    if dropped:
        findings.append(
            warn(f"{counted(dropped, 'frame')} dropped, after {', '.join(str(h.after) for h in timing.dropped_frames)}")
        )
    facts: dict[str, Fact] = {
        "clip": timing.clip,
        "flashes": len(timing.flashes),
        "complete": complete,
        "order": timing.order,
        "clock_offset_ppm": timing.clock_offset_ppm,
        "phase_error_rows": timing.phase_error_rows,
    }
    return facts, findings


def _strobe_log(path: Path) -> tuple[dict[str, Fact], list[Finding]]:
    log = read_log(path)
    findings = [ok(f"{log.cycles} cycles played from {log.started_utc} on, by {log.board} {log.unit} ({log.firmware})")]
    if log.fault is not None:
        findings.append(warn(f"the run broke off: {log.fault}"))
    if log.clock is not None:
        findings.append(ok(f"the board's clock: {log.clock.offset_ppm:+.0f} ± {log.clock.error_ppm:.0f} ppm"))
    plan = path.with_name(PLAN_FILE)
    if plan.is_file():
        played = as_played(read_plan(plan), plan)
        findings.append(warn(played.warning) if played.warning else ok("it is the log of the plan.toml beside it"))
    facts: dict[str, Fact] = {
        "board": log.board,
        "unit": log.unit,
        "plan_sha256": log.plan_sha256,
        "cycles": log.cycles,
        "ended": log.ended,
        "started_utc": log.started_utc,
    }
    return facts, findings


def _describe_image(path: Path, kind: str) -> Description:
    """Describe an image; an EXR may hold any channels, and its attributes say where it comes from."""
    try:
        if kind == "exr":
            return _describe_exr(path)
        header = decode(kind, path).header
    except PsvideoError as error:
        return Description(path=path, kind=f"{kind} image", findings=(fault(error),))
    facts: dict[str, Fact] = {
        "width_px": header.width_px,
        "height_px": header.height_px,
        "channels": header.channels,
        "bits": header.bits,
        "cfa": header.cfa,
        "time_code": header.time_code,
    }
    findings = [ok(looks(header)), *(warn(text) for text in header.warnings), *(ok(text) for text in header.notes)]
    return Description(path=path, kind=f"{kind} image", facts=facts, findings=tuple(findings))


def _describe_exr(path: Path) -> Description:
    channels, facts = exr.contents(path, header_only=False)
    size = ok(f"{facts['width_px']} x {facts['height_px']} pixels, channels {', '.join(channels)}")
    shown = [ok(f"{name} = {value}") for name, value in facts.items() if name not in ("width_px", "height_px")]
    return Description(path=path, kind="exr image", facts={"channels": channels, **facts}, findings=(size, *shown))
