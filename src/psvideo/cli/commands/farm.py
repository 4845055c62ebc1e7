"""psvideo farm: a run as a job for a render farm."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import ClipPath, Force, Json, PlanPath, Quiet, RigPath
from psvideo.model.units import counted


def farm(
    clip: ClipPath,
    rig: RigPath,
    options: Annotated[
        list[str] | None, typer.Argument(metavar="-- OPTIONS", help="After --: other options of psvideo normals.")
    ] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="The folder of the job to write.")] = None,
    results: Annotated[
        Path | None, typer.Option("--results", help="Where to write results; left out: results/ in the job's folder.")
    ] = None,
    plan: PlanPath = None,
    pieces: Annotated[
        int | None,
        typer.Option("--pieces", min=1, help="How many pieces to cut the run into; left out: by the clip's length."),
    ] = None,
    commands: Annotated[bool, typer.Option("--commands", help="Print shell commands instead, one a line.")] = False,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a run as a job for a render farm: an Open Job Description, or a list of shell commands."""
    from psvideo.runs.farm import farm as write_job

    voice = Voice(json=json, quiet=quiet)
    words = options or []
    lines = write_job(clip, rig=rig, out=out, results=results, plan=plan, pieces=pieces, words=words, force=force)
    voice.result({"commands": lines})
    if commands:
        for line in lines:
            voice.say(line)
    elif out is not None:
        cut = counted(len(lines) - 2, "piece")
        voice.say(f"{out}: a job of {cut}. See {out / 'README.txt'} for how to run it.")
