"""psvideo split: one clean sequence per light."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, command_line, counted, tell_kept, tell_report
from psvideo.cli.delivery_options import CodecName, CodecOption, PlatesPreviewOption, Weights, WithAmbient
from psvideo.cli.options import (
    ClipPath,
    FirstLight,
    Force,
    Frames,
    Json,
    OrderRig,
    PlanPath,
    Quiet,
    Resume,
    StartNumber,
    TimingPath,
    Verbose,
)
from psvideo.cli.sync import describe_timing
from psvideo.errors import UsageError


class Method(StrEnum):
    """How plates are rebuilt."""

    weights = "weights"
    hudon2015 = "hudon2015"


def split(
    context: typer.Context,
    clip: ClipPath,
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder of plates to write.")],
    plan: PlanPath = None,
    timing: TimingPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    rig: OrderRig = None,
    method: Annotated[
        Method, typer.Option(help="By the rows' weights, or Algorithm 1 of Hudon et al. 2015, to compare with.")
    ] = Method.weights,
    flashes: Annotated[bool, typer.Option("--flashes", help="Write every flash by itself besides.")] = False,
    beauty: Annotated[bool, typer.Option("--beauty", help="Write the sum of all lights besides.")] = False,
    with_ambient: WithAmbient = False,
    weight: Weights = None,
    preview: PlatesPreviewOption = None,
    preview_codec: CodecOption = CodecName.vp9,
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Rebuild one plate per flash and write one EXR sequence per light, ambient light taken off."""
    from psvideo.cli.opening import open_and_tell
    from psvideo.clip import decoded_once
    from psvideo.export.results import Preview
    from psvideo.formats.rig_toml import read_rig
    from psvideo.formats.timing_json import timing_record
    from psvideo.plates.beauty import parse_mix
    from psvideo.runs import Besides, Output, split_run, timing_of

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    output = Output(folder=out, force=force, resume=resume, start_number=start_number, command=command_line(context))
    output.check()
    previews: tuple[Preview, ...] = tuple(dict.fromkeys(name.value for name in preview or ()))
    mix = parse_mix(weight or (), with_ambient=with_ambient)
    summed = beauty or "beauty" in previews
    if mix.weights and not summed:
        raise UsageError("--with-ambient and --weight: belong to the beauty plate. Add --beauty, or leave them out.")
    besides = Besides(flashes=flashes, mix=mix if summed else None, previews=previews, codec=preview_codec.value)
    take = open_and_tell(clip, voice, plan=plan, frames=frames)
    besides.check(take.plan)
    known = None if rig is None else read_rig(rig, plan_lights=take.plan.lights)
    with decoded_once(take, output=out) as take:
        found = timing_of(take, timing, first_light=first_light, rig=known, watch=voice.track)
        done = split_run(take, found, output, method=method.value, besides=besides, known=known, watch=voice.track)
        tell_kept(voice, take.kept)
    written = done.timing
    voice.result(timing_record(written))
    voice.say(describe_timing(written))
    for note in found.notes:
        voice.warn(note)
    tell_report(voice, done.report)
    plates = sum(flash.plate is not None for flash in written.flashes)
    voice.say(f"{out}: {counted(plates, 'plate')} written; see {out / 'report.html'}.")
