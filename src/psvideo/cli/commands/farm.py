"""psvideo farm: a run as a job for a render farm."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.main import get_command

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import ClipPath, Force, Json, PlanPath, Quiet, RigPath
from psvideo.errors import UsageError
from psvideo.model.units import counted

OF_THE_FARM = {
    **dict.fromkeys(("out", "rig", "plan"), "farm has it itself; give it before --"),
    **dict.fromkeys(("piece", "resume"), "farm gives it to every piece; leave it out"),
    **dict.fromkeys(("workers", "scheduler"), "the farm shares the work; leave it out"),
}
"""Options of normals that a job has no use for, and what to do instead."""


def farm(
    clip: ClipPath,
    options: Annotated[
        list[str] | None, typer.Argument(metavar="-- OPTIONS", help="After --: other options of psvideo normals.")
    ] = None,
    rig: RigPath = None,
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
    words = _checked(options or [])
    lines = write_job(clip, rig=rig, out=out, results=results, plan=plan, pieces=pieces, words=words, force=force)
    voice.result({"commands": lines})
    if commands or out is None:
        for line in lines:
            voice.say(line)
    else:
        cut = counted(len(lines) - 2, "piece")
        voice.say(f"{out}: a job of {cut}. See {out / 'README.txt'} for how to run it.")


def _checked(words: Sequence[str]) -> list[str]:
    """Return other options of ``normals``, with whole paths: machines of a farm work in folders of their own.

    Raises as ``psvideo normals`` would where options cannot be parsed, and UsageError where a job cannot have them:
    here, not on the farm.
    """
    from psvideo.cli.app import application

    group: Any = get_command(application(["normals"]))
    context = group.commands["normals"].make_context("psvideo normals", ["clip", "--rig", "rig", "-o", "out", *words])
    if len(context.params["clips"]) > 1:
        raise UsageError(
            f"{context.params['clips'][1]}: farm takes one clip, and other options of normals after --. Write a job "
            "for each clip."
        )
    for name, why in OF_THE_FARM.items():
        given = [word for word in words if _names(word, _spellings(context, name))]
        if given:
            raise UsageError(f"{given[0]} after --: {why}.")
    return _with_whole_paths(words, context)


def _names(word: str, spellings: Sequence[str]) -> bool:
    """Return whether a word names an option: alone, before ``=``, or, of one letter, before its value."""
    return word.split("=")[0] in spellings or any(len(one) == 2 and word.startswith(one) for one in spellings)


def _with_whole_paths(words: Sequence[str], context: Any) -> list[str]:
    given = {name for name, value in context.params.items() if isinstance(value, Path)}
    of_paths = {one for param in context.command.params if param.name in given for one in param.opts}
    whole: list[str] = []
    for before, word in pairwise(["", *words]):
        option, equals, path = word.partition("=")
        if before in of_paths:
            whole.append(str(Path(word).resolve()))
        elif equals and option in of_paths:
            whole.append(f"{option}={Path(path).resolve()}")
        else:
            whole.append(word)
    return whole


def _spellings(context: Any, name: str) -> tuple[str, ...]:
    return next((tuple(param.opts) for param in context.command.params if param.name == name), ())
