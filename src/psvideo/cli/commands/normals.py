"""psvideo normals: normal maps and albedo for every round of flashes."""

from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.commands.sync import describe_timing
from psvideo.cli.console import Voice, print_report, print_takes
from psvideo.cli.options.clip_and_run import (
    ClipPaths,
    ClipWords,
    Force,
    PieceOption,
    Resume,
    RigPath,
    Sharing,
    StartNumber,
    TimingPath,
)
from psvideo.cli.options.delivery import BeautyWords, DeliveryWords
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import AlignOption, Denoise, InstantWords, SolvingWords
from psvideo.model.units import counted


@spread
def normals(
    context: typer.Context,
    clips: ClipPaths,
    *,
    rig: RigPath = None,
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    words: ClipWords,
    timing: TimingPath = None,
    solving: SolvingWords,
    align: AlignOption = "auto",
    instants: InstantWords,
    denoise: Denoise = 1,
    delivery: DeliveryWords,
    beauty: BeautyWords,
    start_number: StartNumber = 1001,
    force: Force = False,
    resume: Resume = False,
    piece: PieceOption = None,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Write normals, albedo and validity for every round of flashes; does sync and split by itself."""
    from psvideo.report.run_report import report_record
    from psvideo.runs.many_takes.normals_of_takes import normals_of_takes
    from psvideo.runs.normals import normals as solve

    options: dict[str, Any] = dict(
        rig=rig,
        timing=timing,
        align=align,
        denoise=denoise,
        start_number=start_number,
        **vars(words),
        **vars(solving),
        **instants.parameters(),
        **delivery.parameters(),
        **beauty.parameters(),
    )
    common: dict[str, Any] = {"force": force, "resume": resume, "watch": voice.track, "caller": voice.caller(context)}
    if len(clips) > 1 or sharing.asked:
        results = normals_of_takes(clips, out=out, **vars(sharing), piece=piece, **common, **options)
        print_takes(voice, results)
        return
    report = solve(clips[0], out=out, piece=piece, **common, **options)
    voice.result(report_record(report))
    if piece is not None:
        voice.say(f"{out}: piece {piece} is solved, {counted(len(report.instants), 'instant')}; --resume ends the run.")
        return
    voice.say(describe_timing(report.timing))
    print_report(voice, report)
    voice.say(f"{out}: {counted(len(report.instants), 'instant')} written; see {out / 'report.html'}.")
