"""psvideo split: one clean sequence per light."""

from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.commands.sync import describe_timing
from psvideo.cli.console import Voice, plain, print_report, print_takes
from psvideo.cli.options.clip_and_run import (
    ClipPaths,
    ClipWords,
    Force,
    OrderRig,
    Resume,
    Sharing,
    StartNumber,
    TimingPath,
)
from psvideo.cli.options.delivery import BeautyWords, CodecOption, CompressionOption, PlatesPreviewOption
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import InstantWords
from psvideo.model.choices import USUAL_COMPRESSION, SplitMethod
from psvideo.model.units import counted


@spread
def split(
    context: typer.Context,
    clips: ClipPaths,
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder of plates to write.")],
    *,
    words: ClipWords,
    timing: TimingPath = None,
    rig: OrderRig = None,
    method: Annotated[
        SplitMethod, typer.Option(help="weights, or Algorithm 1 of Hudon et al. 2015, to compare with.")
    ] = "weights",
    flashes: Annotated[bool, typer.Option("--flashes", help="Also write a plate of every single flash.")] = False,
    beauty: Annotated[bool, typer.Option("--beauty", help="Also write the sum of all lights.")] = False,
    mix: BeautyWords,
    instants: InstantWords,
    preview: PlatesPreviewOption = None,
    preview_codec: CodecOption = "both",
    compression: CompressionOption = USUAL_COMPRESSION,
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Rebuild one plate per flash and write one EXR sequence per light, ambient light taken off."""
    from psvideo.formats.timing_json import timing_record
    from psvideo.runs.many_takes.split_of_takes import split_of_takes
    from psvideo.runs.split import split as rebuild

    options: dict[str, Any] = dict(
        timing=timing,
        rig=rig,
        method=method,
        flashes=flashes,
        beauty=beauty,
        preview=plain(preview),
        preview_codec=preview_codec,
        compression=compression,
        start_number=start_number,
        **vars(words),
        **mix.parameters(),
        **instants.parameters(),
    )
    common: dict[str, Any] = {"force": force, "resume": resume, "watch": voice.track, "caller": voice.caller(context)}
    if len(clips) > 1 or sharing.asked:
        print_takes(voice, split_of_takes(clips, out=out, **vars(sharing), **common, **options))
        return
    report = rebuild(clips[0], out=out, **common, **options)
    voice.result(timing_record(report.timing))
    voice.say(describe_timing(report.timing))
    print_report(voice, report)
    made = "plates" if instants.fps == "round" else counted(len(report.instants), "instant")
    voice.say(f"{out}: {made} of {counted(len(report.lights), 'light')} written; see {out / 'report.html'}.")
